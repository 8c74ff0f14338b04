#include "runtime/devices/reports/woodenhaptics_report.h"

#include <algorithm>
#include <cmath>

#include "runtime/devices/reports/little_endian.h"

namespace palpate {
namespace {

constexpr std::int16_t button_counts = 10000;
constexpr std::int16_t button_from = 5000;

enum Command : std::int16_t { show_currents = 0, set_counters = 1 };

/// Encodes the report id 0 and seven numbers.
WoodenHapticsCommand encode(const std::array<std::int16_t, 7>& numbers) noexcept {
  WoodenHapticsCommand bytes{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    write_number<std::int16_t>(bytes, 1 + 2 * i, numbers[i]);
  }
  return bytes;
}

std::int16_t milliamperes(double current) noexcept {
  constexpr double largest = 32767.0;
  if (!std::isfinite(current)) return 0;
  return static_cast<std::int16_t>(std::lround(std::clamp(1000.0 * current, -largest, largest)));
}

}  // namespace

std::optional<EncoderReport> decode_encoders(std::span<const std::uint8_t> report) noexcept {
  if (report.size() != woodenhaptics_report_bytes) return std::nullopt;
  EncoderReport result;
  for (std::size_t i = 0; i < 6; ++i) {
    result.counters[i] = read_number<std::int16_t>(report, 2 * i);
  }
  const auto info = read_number<std::int16_t>(report, 12);
  if (info != 0 && info != 1) return std::nullopt;
  result.calibrate = info == 1;
  result.button = result.counters[3] > button_from;
  if (result.button) result.counters[3] = static_cast<std::int16_t>(result.counters[3] - button_counts);
  return result;
}

WoodenHapticsCommand encode_currents(const Vec3& currents) noexcept {
  return encode({milliamperes(currents[0]), milliamperes(currents[1]), milliamperes(currents[2]),
                 show_currents, 0, 0, 0});
}

WoodenHapticsCommand encode_counters(const std::array<std::int16_t, 6>& counters) noexcept {
  return encode({counters[3], counters[4], counters[5], set_counters, counters[0], counters[1], counters[2]});
}

DeviceState arm_state(const ArmConstants& arm, const EncoderReport& report) noexcept {
  const Vec3 angles = joint_angles(arm, report.counters);
  DeviceState state;
  state.pose.position = arm_position(arm, angles);
  state.pose.orientation = arm_orientation(arm, angles, wrist_angles(arm, report.counters));
  state.pose.grab = report.button;
  state.buttons = report.button ? 1 : 0;
  return state;
}

}  // namespace palpate
