#include "runtime/devices/reports/palpate_board.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/devices/reports/little_endian.h"
#include "runtime/safety/saturation.h"

namespace palpate {
namespace {

enum ReportId : std::uint8_t { input_id = 1, force_id = 2, feature_id = 3 };

constexpr std::int32_t farthest = 10'000'000;      // um
constexpr std::int32_t largest_angle = 6'283'186;  // urad: 2 pi
constexpr std::uint16_t longest_watchdog = 1000;   // ms
constexpr double largest_count = 32767.0;

double or_infinite(std::uint32_t value, double unit) noexcept {
  return value == 0 ? std::numeric_limits<double>::infinity() : unit * value;
}

}  // namespace

// NOLINTNEXTLINE(readability-function-size): a table
std::vector<std::uint8_t> board_report_descriptor(int axes) {
  const auto count = static_cast<std::uint8_t>(axes);
  return {
      // clang-format off
      0x06, 0x48, 0xFF,                              // usage page: vendor 0xFF48
      0x09, 0x01,                                    // usage: haptic device
      0xA1, 0x01,                                    // collection: application
      0x85, 0x01,                                    //   report id 1
      0x17, 0x00, 0x00, 0x00, 0x80,                  //   logical minimum -2^31
      0x27, 0xFF, 0xFF, 0xFF, 0x7F,                  //   logical maximum 2^31 - 1
      0x75, 0x20,                                    //   report size 32
      0x95, 0x01,                                    //   report count 1
      0x09, 0x02,                                    //   usage: sequence
      0x81, 0x02,                                    //   input: data, variable, absolute
      0x95, count,                                   //   report count: axes
      0x19, 0x10,                                    //   usage minimum: x
      0x29, static_cast<std::uint8_t>(0x0F + axes),  // usage maximum: the last axis
      0x81, 0x02,                                    //   input
      0x15, 0x00,                                    //   logical minimum 0
      0x25, 0x01,                                    //   logical maximum 1
      0x75, 0x01,                                    //   report size 1
      0x95, 0x10,                                    //   report count 16
      0x19, 0x20,                                    //   usage minimum: button 0
      0x29, 0x2F,                                    //   usage maximum: button 15
      0x81, 0x02,                                    //   input
      0x85, 0x02,                                    //   report id 2
      0x17, 0x00, 0x00, 0x00, 0x80,                  //   logical minimum -2^31
      0x27, 0xFF, 0xFF, 0xFF, 0x7F,                  //   logical maximum 2^31 - 1
      0x75, 0x20,                                    //   report size 32
      0x95, 0x01,                                    //   report count 1
      0x09, 0x03,                                    //   usage: sequence answered
      0x91, 0x02,                                    //   output
      0x16, 0x01, 0x80,                              //   logical minimum -32767
      0x26, 0xFF, 0x7F,                              //   logical maximum 32767
      0x75, 0x10,                                    //   report size 16
      0x95, 0x03,                                    //   report count 3
      0x19, 0x30,                                    //   usage minimum: force x
      0x29, 0x32,                                    //   usage maximum: force z
      0x91, 0x02,                                    //   output
      0x85, 0x03,                                    //   report id 3
      0x15, 0x00,                                    //   logical minimum 0
      0x26, 0xFF, 0x00,                              //   logical maximum 255
      0x75, 0x08,                                    //   report size 8
      0x95, 0x02,                                    //   report count 2
      0x19, 0x40,                                    //   usage minimum: version
      0x29, 0x41,                                    //   usage maximum: axes
      0xB1, 0x02,                                    //   feature
      0x27, 0xFF, 0xFF, 0x00, 0x00,                  //   logical maximum 65535
      0x75, 0x10,                                    //   report size 16
      0x95, 0x01,                                    //   report count 1
      0x09, 0x42,                                    //   usage: watchdog
      0xB1, 0x02,                                    //   feature
      0x27, 0xFF, 0xFF, 0xFF, 0x7F,                  //   logical maximum 2^31 - 1
      0x75, 0x20,                                    //   report size 32
      0x95, 0x05,                                    //   report count 5
      0x19, 0x43,                                    //   usage minimum: force unit
      0x29, 0x47,                                    //   usage maximum: workspace radius
      0xB1, 0x02,                                    //   feature
      0xC0,                                          // end of the collection
      // clang-format on
  };
}

std::optional<BoardInput> decode_board_input(std::span<const std::uint8_t> report) noexcept {
  BoardInput input;
  input.axes = 0;
  for (int axes = least_board_axes; axes <= most_board_axes; ++axes) {
    if (report.size() == board_input_bytes(axes)) input.axes = axes;
  }
  if (input.axes == 0 || report[0] != input_id) return std::nullopt;
  input.sequence = read_number<std::uint32_t>(report, 1);
  const auto axes = static_cast<std::size_t>(input.axes);
  for (std::size_t k = 0; k < axes; ++k) {
    input.values[k] = read_number<std::int32_t>(report, 5 + 4 * k);
    const std::int32_t bound = k < 3 ? farthest : largest_angle;
    if (input.values[k] < -bound || input.values[k] > bound) return std::nullopt;
  }
  input.buttons = read_number<std::uint16_t>(report, 5 + 4 * axes);
  return input;
}

DeviceState board_state(const BoardInput& input) noexcept {
  constexpr double micro = 1e-6;
  DeviceState state;
  state.sequence = input.sequence;
  state.buttons = input.buttons;
  state.pose.grab = (input.buttons & 1U) != 0;
  state.pose.position = micro * Vec3(input.values[0], input.values[1], input.values[2]);
  const Vec3 rotation = micro * Vec3(input.values[3], input.values[4], input.values[5]);
  const double angle = rotation.norm();
  if (angle > 0.0) state.pose.orientation = Eigen::AngleAxisd(angle, rotation / angle);
  return state;
}

std::array<std::uint8_t, board_force_bytes> encode_board_force(const BoardForce& force) noexcept {
  std::array<std::uint8_t, board_force_bytes> report{};
  report[0] = force_id;
  write_number(report, 1, force.sequence);
  for (std::size_t k = 0; k < 3; ++k) {
    write_number(report, 5 + 2 * k, force.counts[k]);
  }
  return report;
}

DeviceLimits BoardFeature::limits() const noexcept {
  DeviceLimits result;
  result.max_force = or_infinite(max_force, 1e-3);
  result.max_stiffness = or_infinite(max_stiffness, 1.0);
  result.max_damping = or_infinite(max_damping, 1e-3);
  result.workspace_radius = or_infinite(workspace_radius, 1e-6);
  return result;
}

std::optional<BoardFeature> decode_board_feature(std::span<const std::uint8_t> report) noexcept {
  if (report.size() != board_feature_bytes || report[0] != feature_id || report[1] != board_version) {
    return std::nullopt;
  }
  BoardFeature feature;
  feature.axes = report[2];
  feature.watchdog = read_number<std::uint16_t>(report, 3);
  feature.force_unit = read_number<std::uint32_t>(report, 5);
  feature.max_force = read_number<std::uint32_t>(report, 9);
  feature.max_stiffness = read_number<std::uint32_t>(report, 13);
  feature.max_damping = read_number<std::uint32_t>(report, 17);
  feature.workspace_radius = read_number<std::uint32_t>(report, 21);
  if (feature.axes < least_board_axes || feature.axes > most_board_axes || feature.watchdog == 0 ||
      feature.watchdog > longest_watchdog || feature.force_unit == 0) {
    return std::nullopt;
  }
  return feature;
}

std::array<std::int16_t, 3> board_counts(const BoardFeature& feature, const Vec3& force) noexcept {
  const Vec3 counts = saturate(force / (1e-6 * feature.force_unit), largest_count);
  const auto whole = [](double count) { return static_cast<std::int16_t>(std::lround(count)); };
  return {whole(counts.x()), whole(counts.y()), whole(counts.z())};
}

}  // namespace palpate
