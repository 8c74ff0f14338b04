// The messages of web/PROTOCOL.md as a reader of that text would decode them.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate::test {

/// Takes numbers off a message's front.
class Bytes {
 public:
  explicit Bytes(std::string bytes) : bytes_(std::move(bytes)) {}

  template <class Number>
  Number take() {
    if (at_ + sizeof(Number) > bytes_.size()) throw std::out_of_range("the message is too short");
    Number number{};
    std::memcpy(&number, bytes_.data() + at_, sizeof number);
    at_ += sizeof number;
    return number;
  }
  template <class Number>
  std::vector<Number> array(std::size_t count) {
    at_ = (at_ + 3) / 4 * 4;
    std::vector<Number> numbers;
    for (std::size_t k = 0; k < count; ++k) numbers.push_back(take<Number>());
    return numbers;
  }
  std::uint32_t u32() { return take<std::uint32_t>(); }
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }
  [[nodiscard]] std::string rest() const { return bytes_.substr(at_); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

struct DecodedScene {
  std::uint32_t scene, dimension;
  std::vector<float> position;
  std::vector<std::uint32_t> triangle, edge;
  std::vector<std::uint8_t> held;
  std::vector<float> inner_position;  // of a body of several materials
  std::vector<std::uint32_t> inner_triangle;
  std::vector<std::uint8_t> material, inside, outside;
};

inline DecodedScene decode_scene(const std::string& message) {
  Bytes bytes(message);
  if (bytes.u32() != 1) throw std::invalid_argument("no scene");
  DecodedScene scene{};
  scene.scene = bytes.u32();
  scene.dimension = bytes.u32();
  const std::size_t S = bytes.u32();
  const std::size_t T = bytes.u32();
  const std::size_t E = bytes.u32();
  scene.position = bytes.array<float>(3 * S);
  scene.triangle = bytes.array<std::uint32_t>(3 * T);
  scene.edge = bytes.array<std::uint32_t>(2 * E);
  scene.held = bytes.array<std::uint8_t>(S);
  if (!bytes.at_end()) {
    bytes.array<std::uint8_t>(0);  // to the next multiple of 4 bytes
    const std::size_t I = bytes.u32();
    const std::size_t J = bytes.u32();
    scene.inner_position = bytes.array<float>(3 * I);
    scene.inner_triangle = bytes.array<std::uint32_t>(3 * J);
    scene.material = bytes.array<std::uint8_t>(T);
    scene.inside = bytes.array<std::uint8_t>(J);
    scene.outside = bytes.array<std::uint8_t>(J);
  }
  if (!bytes.at_end()) throw std::invalid_argument("the scene is too long");
  return scene;
}

struct DecodedPatch {
  std::uint32_t scene, patch;
  std::vector<std::uint32_t> hidden;
  std::vector<float> position;
  std::vector<std::uint32_t> triangle, outline;
  std::vector<std::uint8_t> material;  // of a body of several
};

inline DecodedPatch decode_patch(const std::string& message) {
  Bytes bytes(message);
  if (bytes.u32() != 2) throw std::invalid_argument("no patch");
  DecodedPatch patch{};
  patch.scene = bytes.u32();
  patch.patch = bytes.u32();
  const std::size_t H = bytes.u32();
  const std::size_t m = bytes.u32();
  const std::size_t t = bytes.u32();
  const std::size_t o = bytes.u32();
  patch.hidden = bytes.array<std::uint32_t>(H);
  patch.position = bytes.array<float>(3 * m);
  patch.triangle = bytes.array<std::uint32_t>(3 * t);
  patch.outline = bytes.array<std::uint32_t>(2 * o);
  if (!bytes.at_end()) patch.material = bytes.array<std::uint8_t>(t);
  if (!bytes.at_end()) throw std::invalid_argument("the patch is too long");
  return patch;
}

/// Takes numbers of some bits off a text's front, the lowest bit of each byte first.
class Bits {
 public:
  explicit Bits(std::string bytes) : bytes_(std::move(bytes)) {}

  std::int64_t take(std::size_t count) {
    std::int64_t number = 0;
    for (std::size_t k = 0; k < count; ++k, ++at_) {
      const auto byte = static_cast<unsigned char>(bytes_.at(at_ / 8));
      if ((byte >> (at_ % 8) & 1) != 0) number += std::int64_t{1} << k;
    }
    return number;
  }
  /// Of `count` numbers in blocks of 32; a run of zeros may go on in the next call.
  std::vector<std::int64_t> blocks(std::size_t count) {
    std::vector<std::int64_t> numbers;
    while (numbers.size() < count) {
      if (zeros_ == 0) {
        const auto parameter = static_cast<std::size_t>(take(5));
        if (parameter != 31) {
          for (int k = 0; k < 32; ++k) {
            std::int64_t ones = 0;
            while (take(1) == 1) ++ones;
            const std::int64_t z = (ones << parameter) + take(parameter);
            numbers.push_back(z % 2 == 0 ? z / 2 : -(z + 1) / 2);
          }
          continue;
        }
        zeros_ = take(12) + 1;
      }
      numbers.resize(numbers.size() + 32);
      --zeros_;
    }
    numbers.resize(count);
    return numbers;
  }
  /// Bits short of a byte may be left.
  [[nodiscard]] bool at_end() const { return zeros_ == 0 && (at_ + 7) / 8 == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
  std::int64_t zeros_ = 0;
};

struct DecodedFrame {
  std::uint32_t scene;
  double tick, time;
  std::uint32_t number, base;
  std::int32_t exponent_u, exponent_stress;
  std::vector<float> tool, device, force, torque;
  std::uint32_t status, contacts, patch, patch_nodes;
  float force_error;
  std::uint32_t left_out;
  float greens_error;
  std::vector<float> contact;
  std::vector<std::uint32_t> pressure_node;
  std::vector<float> pressure;
  std::vector<std::int64_t> numbers[4];  // of each channel at the scene's nodes, then at the patch's
  double unit_u, unit_stress;
  std::vector<double> u;       // [m]
  std::vector<double> stress;  // [Pa]; -1 where it is not known
};

/// What a number of the base counts for where the unit is another one.
inline std::int64_t in_unit(std::int64_t number, int from, int to) {
  if (std::abs(to - from) > 8) return 0;
  return static_cast<std::int64_t>(std::floor(std::ldexp(static_cast<double>(number), from - to) + 0.5));
}

/// `base`: the frame before, where the message names one; else it has no values at nodes.
inline DecodedFrame decode_frame(const std::string& message, std::size_t scene_nodes,
                                 const DecodedFrame* base = nullptr) {
  Bytes bytes(message);
  if (bytes.u32() != 3) throw std::invalid_argument("no frame");
  DecodedFrame frame{};
  frame.scene = bytes.u32();
  frame.tick = bytes.take<double>();
  frame.time = bytes.take<double>();
  frame.number = bytes.u32();
  frame.base = bytes.u32();
  frame.exponent_u = bytes.take<std::int32_t>();
  frame.exponent_stress = bytes.take<std::int32_t>();
  frame.unit_u = std::ldexp(1.0, frame.exponent_u);
  frame.unit_stress = std::ldexp(1.0, frame.exponent_stress);
  frame.tool = bytes.array<float>(7);
  frame.device = bytes.array<float>(7);
  frame.force = bytes.array<float>(3);
  frame.torque = bytes.array<float>(3);
  frame.status = bytes.u32();
  frame.contacts = bytes.u32();
  frame.patch = bytes.u32();
  frame.patch_nodes = bytes.u32();
  const std::size_t q = bytes.u32();
  frame.force_error = bytes.take<float>();
  frame.left_out = bytes.u32();
  frame.greens_error = bytes.take<float>();
  frame.contact = bytes.array<float>(std::size_t{10} * frame.contacts);
  frame.pressure_node = bytes.array<std::uint32_t>(q);
  frame.pressure = bytes.array<float>(q);
  if (frame.base != 0 && base == nullptr) return frame;
  if (frame.base != 0 && frame.base != base->number) throw std::invalid_argument("another base");
  Bits bits(bytes.rest());
  for (const bool of_patch : {false, true}) {
    const bool has_base = frame.base != 0 && (!of_patch || base->patch == frame.patch);
    for (std::size_t c = 0; c < 4; ++c) {
      std::int64_t change = 0;
      for (const std::int64_t further : bits.blocks(of_patch ? frame.patch_nodes : scene_nodes)) {
        change += further;
        std::int64_t known = has_base ? base->numbers[c].at(frame.numbers[c].size()) : 0;
        if (c < 3) {
          known = in_unit(known, has_base ? base->exponent_u : frame.exponent_u, frame.exponent_u);
        } else if (known != 0) {
          known = std::abs(frame.exponent_stress - base->exponent_stress) > 8
                      ? 0
                      : 1 + in_unit(known - 1, base->exponent_stress, frame.exponent_stress);
        }
        frame.numbers[c].push_back(known + change);
      }
    }
  }
  if (!bits.at_end()) throw std::invalid_argument("the frame is too long");
  for (std::size_t k = 0; k < frame.numbers[0].size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c)
      frame.u.push_back(static_cast<double>(frame.numbers[c][k]) * frame.unit_u);
    const std::int64_t stress = frame.numbers[3][k];
    frame.stress.push_back(stress == 0 ? -1.0 : static_cast<double>(stress - 1) * frame.unit_stress);
  }
  return frame;
}

struct DecodedTicks {
  std::uint32_t scene;
  double first;
  std::uint32_t stride;
  std::vector<float> force, shown, depth, late_us, compute_us, force_error;
  std::vector<std::uint32_t> status, left_out;
  std::vector<std::uint8_t> contacts;
};

inline DecodedTicks decode_ticks(const std::string& message) {
  Bytes bytes(message);
  if (bytes.u32() != 4) throw std::invalid_argument("no ticks");
  DecodedTicks ticks{};
  ticks.scene = bytes.u32();
  ticks.first = bytes.take<double>();
  const std::uint32_t n = bytes.u32();
  ticks.stride = bytes.u32();
  ticks.force = bytes.array<float>(std::size_t{3} * n);
  ticks.shown = bytes.array<float>(n);
  ticks.depth = bytes.array<float>(n);
  ticks.late_us = bytes.array<float>(n);
  ticks.compute_us = bytes.array<float>(n);
  ticks.status = bytes.array<std::uint32_t>(n);
  ticks.force_error = bytes.array<float>(n);
  ticks.left_out = bytes.array<std::uint32_t>(n);
  ticks.contacts = bytes.array<std::uint8_t>(n);
  if (!bytes.at_end()) throw std::invalid_argument("the ticks are too long");
  return ticks;
}

}  // namespace palpate::test
