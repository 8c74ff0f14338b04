#include "runtime/igtl/watched_picture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are in memory as they are sent");

enum Kind : std::uint32_t { scene_kind = 1, patch_kind = 2, frame_kind = 3 };

[[noreturn]] void refuse() {
  throw std::out_of_range("it is not as the protocol has it");
}

/// Numbers in blocks by Rice's code.
class BlockReader {
 public:
  explicit BlockReader(std::string_view bytes) : bytes_(bytes) {}

  [[nodiscard]] std::int64_t next() {
    if (at_ == block_.size()) read_block();
    const auto number = static_cast<std::int64_t>(block_[at_++]);
    return number % 2 == 0 ? number / 2 : -(number + 1) / 2;
  }
  void end_channel() { at_ = block_.size(); }

 private:
  static constexpr unsigned parameter_bits = 5, run_bits = 12, run_of_zeros = 31;

  void read_block() {
    at_ = 0;
    block_.fill(0);
    if (zeros_ > 0) {
      --zeros_;
      return;
    }
    const std::uint32_t parameter = take(parameter_bits);
    if (parameter == run_of_zeros) {
      zeros_ = take(run_bits);  // beside this one
      return;
    }
    for (std::uint64_t& number : block_) {
      while (take(1) == 1) ++number;
      number = (number << parameter) + take(parameter);
    }
  }
  /// The next bits, at most 31, the lowest first.
  std::uint32_t take(unsigned count) {
    for (; waiting_ < count; waiting_ += 8, bytes_.remove_prefix(1)) {
      if (bytes_.empty()) refuse();
      bits_ |= std::uint64_t{static_cast<unsigned char>(bytes_.front())} << waiting_;
    }
    const auto taken = static_cast<std::uint32_t>(bits_ & ((std::uint64_t{1} << count) - 1));
    bits_ >>= count;
    waiting_ -= count;
    return taken;
  }

  std::string_view bytes_;
  std::uint64_t bits_ = 0;
  unsigned waiting_ = 0;  // bits
  std::array<std::uint64_t, 32> block_{};
  std::size_t at_ = block_.size();
  std::uint32_t zeros_ = 0;  // blocks
};

}  // namespace

/// Takes numbers off a message's front.
class PictureReader::Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T take() {
    T taken{};
    std::memcpy(&taken, piece(sizeof taken).data(), sizeof taken);
    return taken;
  }
  std::uint32_t number() { return take<std::uint32_t>(); }
  template <class T>
  std::vector<T> array(std::size_t count) {
    const std::string_view bytes = piece(count * sizeof(T));
    std::vector<T> taken(count);
    if (count > 0) std::memcpy(taken.data(), bytes.data(), bytes.size());
    return taken;
  }
  std::string_view piece(std::size_t size) {
    if (size > bytes_.size()) refuse();
    const std::string_view taken = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return taken;
  }
  [[nodiscard]] std::string_view rest() const { return bytes_; }

 private:
  std::string_view bytes_;
};

bool PictureReader::take(std::string_view message) {
  Reader reader(message);
  const std::uint32_t kind = reader.number();
  const auto scene = reader.number();
  if (kind == scene_kind) {
    scene_.number = scene;
    take_scene(reader);
  } else if (scene == scene_.number && kind == patch_kind) {
    take_patch(reader);
  } else if (scene == scene_.number && kind == frame_kind) {
    take_frame(reader);
    return true;
  }
  return false;
}

void PictureReader::take_scene(Reader& message) {
  message.number();  // dimension
  const std::size_t nodes = message.number(), triangles = message.number(), lines = message.number();
  scene_.nodes = message.array<std::array<float, 3>>(nodes);
  scene_.triangles = message.array<std::uint32_t>(3 * triangles);
  scene_.others = message.array<std::uint32_t>(2 * lines);
  patch_ = {};
  join_cells();
}

void PictureReader::take_patch(Reader& message) {
  patch_.number = message.number();
  const std::size_t hidden = message.number(), nodes = message.number(), triangles = message.number();
  message.number();  // lines of its outline
  patch_.others = message.array<std::uint32_t>(hidden);
  patch_.nodes = message.array<std::array<float, 3>>(nodes);
  patch_.triangles = message.array<std::uint32_t>(3 * triangles);
  join_cells();
}

/// The triangles of both, or the scene's lines where there are none.
void PictureReader::join_cells() {
  const std::size_t count = scene_.nodes.size();
  std::vector<bool> is_hidden(scene_.triangles.size() / 3);
  for (const std::uint32_t triangle : patch_.others) is_hidden.at(triangle) = true;
  std::vector<std::uint32_t>& cells = picture_.cells;
  cells.clear();
  for (std::size_t k = 0; k < scene_.triangles.size(); ++k)
    if (!is_hidden[k / 3]) cells.push_back(scene_.triangles[k]);
  for (const std::uint32_t node : patch_.triangles) cells.push_back(static_cast<std::uint32_t>(count) + node);
  picture_.corners = cells.empty() ? 2 : 3;
  if (cells.empty()) cells = scene_.others;
  if (std::ranges::any_of(cells, [&](std::size_t node) { return node >= count + patch_.nodes.size(); }))
    refuse();
}

void PictureReader::take_frame(Reader& message) {
  message.take<double>();  // tick
  picture_.time = message.take<double>();
  message.number();                     // of the picture
  if (message.number() != 0) refuse();  // it follows from another one
  const auto exponents = message.take<std::array<std::int32_t, 2>>();
  picture_.tool = message.take<std::array<float, 7>>();
  message.take<std::array<float, 7>>();  // device
  picture_.force = message.take<std::array<float, 3>>();
  picture_.torque = message.take<std::array<float, 3>>();
  message.number();  // status
  const std::size_t contacts = message.number();
  const std::uint32_t patch = message.number();
  const std::size_t patch_nodes = message.number();
  const std::size_t pressures = message.number();
  message.take<std::array<std::uint32_t, 3>>();  // how good the force is
  message.array<std::array<float, 10>>(contacts);
  const auto pressed = message.array<std::uint32_t>(pressures);
  const auto pressure = message.array<float>(pressures);

  if (patch == 0 && patch_.number != 0) {
    patch_ = {};
    join_cells();
  }
  if (patch != patch_.number || patch_nodes != patch_.nodes.size()) refuse();
  take_values(exponents, message.rest());
  picture_.pressure.assign(picture_.nodes.size(), 0.0F);
  for (std::size_t k = 0; k < pressures; ++k) picture_.pressure.at(pressed[k]) = pressure[k];
}

/// x, y, z and stress of the scene's nodes, one after the other, then of the patch's.
void PictureReader::take_values(std::array<std::int32_t, 2> exponents, std::string_view bits) {
  constexpr std::size_t stress = 3;
  const float unit = std::ldexp(1.0F, exponents[0]), stress_unit = std::ldexp(1.0F, exponents[1]);
  picture_.nodes = scene_.nodes;
  picture_.nodes.insert(picture_.nodes.end(), patch_.nodes.begin(), patch_.nodes.end());
  const std::size_t scene = scene_.nodes.size(), all = picture_.nodes.size();
  std::vector<float> squares(all);
  picture_.von_mises.assign(all, std::numeric_limits<float>::quiet_NaN());
  BlockReader numbers(bits);
  for (const auto& [first, end] : {std::pair(std::size_t{0}, scene), std::pair(scene, all)}) {
    for (std::size_t channel = 0; channel <= stress; ++channel, numbers.end_channel()) {
      std::int64_t number = 0;
      for (std::size_t k = first; k < end; ++k) {
        number += numbers.next();
        if (channel < stress) {
          const float u = unit * static_cast<float>(number);
          picture_.nodes[k].at(channel) += u;
          squares[k] += u * u;
        } else if (number != 0) {
          picture_.von_mises[k] = stress_unit * static_cast<float>(number - 1);
        }
      }
    }
  }
  picture_.displacement = std::move(squares);
  for (float& size : picture_.displacement) size = std::sqrt(size);
}

}  // namespace palpate
