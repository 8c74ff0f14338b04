#include "runtime/devices/hid/hid_board.h"

#include <algorithm>
#include <array>

#include "base/error.h"

namespace palpate {
namespace {

constexpr double position_unit = 1e-6;  // m

}  // namespace

HidBoard::HidBoard(const DeviceLimits& limits, const HidReportDescriptor& descriptor, std::string device,
                   std::uint32_t last)
    : limits_(limits), device_(std::move(device)), last_(last), velocity_(Vec3::Constant(position_unit)) {
  const std::size_t bytes = 1U + descriptor.report_bytes(HidReportType::input, 1);
  for (int axes = least_board_axes; axes <= most_board_axes; ++axes) {
    if (board_input_bytes(axes) == bytes) axes_ = axes;
  }
  if (axes_ == 0 || !descriptor.numbered ||
      1U + descriptor.report_bytes(HidReportType::output, 2) != board_force_bytes ||
      1U + descriptor.report_bytes(HidReportType::feature, 3) != board_feature_bytes) {
    throw Error(
        "its report descriptor has not the three reports of a home-made board", device_,
        "give it the descriptor of board_report_descriptor (runtime/devices/reports/palpate_board.cpp)");
  }
}

void HidBoard::start(HidDevice& device) {
  std::array<std::uint8_t, board_feature_bytes> report{3};
  const int size = device.get_feature(report);
  if (size < 0) {
    throw Error("the board does not answer to feature report 3", device_,
                "its firmware must send its limits when it is asked (devices-protocol.md, \"Boards\")");
  }
  const auto feature =
      decode_board_feature(std::span(report).first(std::min(report.size(), static_cast<std::size_t>(size))));
  if (!feature) {
    throw Error("feature report 3 of the board has another length or version, or numbers out of range",
                device_,
                "send 25 bytes: version 1, axes 3 to 6, a watchdog of 1 to 1000 ms and a force unit from 1");
  }
  if (feature->axes != axes_) {
    throw Error("feature report 3 says " + std::to_string(feature->axes) +
                    " axes, the report descriptor has " + std::to_string(axes_),
                device_, "correct the firmware");
  }
  feature_ = *feature;
  const DeviceLimits own = feature_.limits();
  limits_.max_force = std::min(limits_.max_force, own.max_force);
  limits_.max_stiffness = std::min(limits_.max_stiffness, own.max_stiffness);
  limits_.max_damping = std::min(limits_.max_damping, own.max_damping);
  limits_.workspace_radius = std::min(limits_.workspace_radius, own.workspace_radius);
}

bool HidBoard::take(std::span<const std::uint8_t> report) noexcept {
  const auto input = decode_board_input(report);
  if (!input || input->axes != axes_) return false;
  if (!heard_anything_) {
    ahead_.store(last_ + 1 - input->sequence, std::memory_order_relaxed);
  } else if (static_cast<std::int32_t>(input->sequence - input_.sequence) <= 0) {
    return false;
  }
  heard_anything_ = true;
  input_ = *input;
  return true;
}

bool HidBoard::tell(bool heard, std::int64_t now, DeviceState& state) noexcept {
  if (!heard) return false;
  state = board_state(input_);
  state.velocity = velocity_.take(state.pose.position, now);
  state.sequence = input_.sequence + ahead_.load(std::memory_order_relaxed);
  return true;
}

void HidBoard::encode(const DeviceCommand& command, const DeviceState& state,
                      OutputReports& reports) noexcept {
  reports.add(encode_board_force({state.sequence - ahead_.load(std::memory_order_relaxed),
                                  board_counts(feature_, command.wrench.force).counts}));
}

std::vector<OutputReport> HidBoard::zero() const {
  const auto report = encode_board_force({});
  return {{report.begin(), report.end()}};
}

}  // namespace palpate
