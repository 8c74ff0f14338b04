#include "runtime/viewer/wire_values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "runtime/scene/seen_values.h"

namespace palpate {
namespace {

constexpr double least_displacement = 5000.0;  // least size of the largest one in units; below twice that
constexpr double least_stress = 4096.0;
constexpr int most_shift = 8;  // beyond it a base is no help, and its numbers would overflow

constexpr std::size_t block = 32;  // numbers with a common Rice parameter
constexpr unsigned parameter_bits = 5;
constexpr std::uint32_t run_of_zeros = 31;  // in place of a parameter: no number has as many bits
constexpr unsigned run_bits = 12;
constexpr std::size_t longest_run = 1U << run_bits;  // blocks

/// Returns the exponent for which `largest` is at least `least` units and less than twice that.
std::int32_t exponent_for(double largest, double least) {
  return largest > 0.0 ? std::ilogb(largest / least) : 0;
}

/// Writes bits, from the lowest of each byte up.
class BitWriter {
 public:
  /// Appends the lowest `bits` of `number`, at most 32; its other bits are 0.
  void add(std::uint32_t number, unsigned bits) {
    waiting_ |= std::uint64_t{number} << count_;
    count_ += bits;
    if (count_ < 32) return;
    for (unsigned k = 0; k < 4; ++k) bytes_ += static_cast<char>(waiting_ >> 8 * k & 0xFFU);
    waiting_ >>= 32U;
    count_ -= 32;
  }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  [[nodiscard]] std::string take() {
    for (; count_ > 0; count_ -= std::min(count_, 8U)) {
      bytes_ += static_cast<char>(waiting_ & 0xFFU);
      waiting_ >>= 8U;
    }
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  std::uint64_t waiting_ = 0;
  unsigned count_ = 0;
};

/// Writes blocks of numbers in Rice code, each with the best parameter; several blocks of zeros become one
/// run.
class BlockWriter {
 public:
  explicit BlockWriter(std::size_t numbers) { bits_.reserve(numbers); }

  void add(std::int32_t number) {
    const auto doubled = static_cast<std::uint32_t>(number) << 1U;
    block_[count_] = number < 0 ? ~doubled : doubled;
    if (++count_ == block) end_block();
  }
  /// Fills the last block with zeros.
  void end_channel() {
    if (count_ == 0) return;
    std::fill(block_.begin() + static_cast<std::ptrdiff_t>(count_), block_.end(), 0U);
    end_block();
  }
  [[nodiscard]] std::string take() {
    end_run();
    return bits_.take();
  }

 private:
  void end_block() {
    count_ = 0;
    std::uint64_t sum = 0;
    for (const std::uint32_t number : block_) sum += number;
    if (sum == 0) {
      if (++zeros_ == longest_run) end_run();
      return;
    }
    end_run();
    const unsigned parameter = best_parameter(sum);
    bits_.add(parameter, parameter_bits);
    for (const std::uint32_t number : block_) add_number(number, parameter);
  }
  /// Tries the parameters around the bit width of the mean.
  [[nodiscard]] unsigned best_parameter(std::uint64_t sum) const {
    const auto middle = static_cast<unsigned>(std::bit_width(sum / block));
    unsigned best = 0;
    std::size_t least = std::numeric_limits<std::size_t>::max();
    for (unsigned parameter = middle > 2 ? middle - 2 : 0; parameter <= middle; ++parameter) {
      std::size_t bits = block * parameter;
      for (const std::uint32_t number : block_) bits += number >> parameter;
      if (bits >= least) continue;
      least = bits;
      best = parameter;
    }
    return best;
  }
  /// Appends the quotient by 2^parameter in ones, a zero, and the remainder.
  void add_number(std::uint32_t number, unsigned parameter) {
    constexpr unsigned most_ones = 31;
    std::uint32_t ones = number >> parameter;
    for (; ones > most_ones; ones -= most_ones) bits_.add((1U << most_ones) - 1, most_ones);
    bits_.add((1U << ones) - 1, ones + 1);
    bits_.add(number & ((1U << parameter) - 1), parameter);
  }
  void end_run() {
    if (zeros_ == 0) return;
    bits_.add(run_of_zeros, parameter_bits);
    bits_.add(static_cast<std::uint32_t>(zeros_ - 1), run_bits);
    zeros_ = 0;
  }

  BitWriter bits_;
  std::array<std::uint32_t, block> block_{};
  std::size_t count_ = 0;
  std::size_t zeros_ = 0;  // pending blocks
};

/// Converts a number of the base to a unit that is 2^shift times as large.
std::int32_t in_other_unit(std::int32_t number, int shift) {
  if (shift <= 0) return number * (1 << -shift);
  return (number + (1 << (shift - 1))) >> shift;
}

/// `is_stress`: 0 means unknown, and known values start at 1.
void add_channel(BlockWriter& writer, const std::vector<std::int32_t>& values,
                 const std::vector<std::int32_t>* base, int shift, bool is_stress, std::size_t first,
                 std::size_t end) {
  std::int32_t last = 0;
  for (std::size_t k = first; k < end; ++k) {
    std::int32_t known = 0;
    if (base != nullptr) {
      known = (*base)[k];
      if (shift != 0)
        known =
            is_stress ? (known == 0 ? 0 : 1 + in_other_unit(known - 1, shift)) : in_other_unit(known, shift);
    }
    const std::int32_t change = values[k] - known;
    writer.add(change - last);
    last = change;
  }
  writer.end_channel();
}

}  // namespace

WireValues wire_values(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch,
                       std::uint32_t number) {
  const SeenValues seen(picture, scene, patch);
  WireValues values;
  values.number = number;
  values.patch = patch == nullptr ? 0 : patch->number;
  values.scene_nodes = seen.scene_nodes();
  const std::size_t nodes = seen.scene_nodes() + seen.patch_nodes();
  float largest_u = 0.0F;
  float largest_stress = 0.0F;
  for (std::size_t k = 0; k < nodes; ++k) {
    for (const float u : std::span(seen.displacement(k), 3)) {
      if (std::isfinite(u)) largest_u = std::max(largest_u, std::abs(u));
    }
    if (const float stress = seen.von_mises(k); std::isfinite(stress))
      largest_stress = std::max(largest_stress, stress);
  }
  values.exponent_u = exponent_for(largest_u, least_displacement);
  values.exponent_stress = exponent_for(largest_stress, least_stress);
  const double units_of_u = std::ldexp(1.0, -values.exponent_u);
  const double units_of_stress = std::ldexp(1.0, -values.exponent_stress);
  const auto rounded = [](float value, double units) {
    return static_cast<std::int32_t>(std::rint(static_cast<double>(value) * units));
  };
  for (std::vector<std::int32_t>& channel : values.channel) channel.resize(nodes);
  for (std::size_t k = 0; k < nodes; ++k) {
    const std::size_t node = k < values.scene_nodes ? static_cast<std::size_t>(scene.order[k]) : k;
    const float* u = seen.displacement(node);
    for (std::size_t axis = 0; axis < 3; ++axis)
      values.channel[axis][k] = std::isfinite(u[axis]) ? rounded(u[axis], units_of_u) : 0;
    const float stress = seen.von_mises(node);
    values.channel[3][k] = std::isfinite(stress) ? 1 + rounded(std::max(0.0F, stress), units_of_stress) : 0;
  }
  return values;
}

std::string encode_values(const WireValues& values, const WireValues* base) {
  const std::size_t nodes = values.channel[0].size();
  BlockWriter writer(2 * nodes);
  const std::pair<std::size_t, std::size_t> parts[] = {{0, values.scene_nodes}, {values.scene_nodes, nodes}};
  for (const auto& [first, end] : parts) {
    const bool has_base = base != nullptr && (first == 0 || base->patch == values.patch);
    for (std::size_t c = 0; c < 4; ++c) {
      const bool is_stress = c == 3;
      int shift = 0;
      if (has_base) {
        shift =
            is_stress ? values.exponent_stress - base->exponent_stress : values.exponent_u - base->exponent_u;
      }
      add_channel(writer, values.channel[c],
                  has_base && std::abs(shift) <= most_shift ? &base->channel[c] : nullptr, shift, is_stress,
                  first, end);
    }
  }
  return writer.take();
}

}  // namespace palpate
