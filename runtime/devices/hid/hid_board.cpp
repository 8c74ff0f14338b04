// HID protocol of a home-made board.
#include <algorithm>
#include <array>
#include <atomic>

#include "base/error.h"
#include "runtime/devices/hid/make_hid_protocol.h"
#include "runtime/devices/reports/palpate_board.h"
#include "runtime/safety/velocity_estimator.h"

namespace palpate {
namespace {

constexpr double position_unit = 1e-6;  // m

/// Number of axes that a board reports, by its descriptor. Throws Error if the descriptor is not a board's.
int board_axes(const HidReportDescriptor& descriptor, const std::string& device) {
  const std::size_t bytes = 1U + descriptor.report_bytes(HidReportType::input, 1);
  int found = 0;
  for (int axes = least_board_axes; axes <= most_board_axes; ++axes) {
    if (board_input_bytes(axes) == bytes) found = axes;
  }
  if (found == 0 || !descriptor.numbered ||
      1U + descriptor.report_bytes(HidReportType::output, 2) != board_force_bytes ||
      1U + descriptor.report_bytes(HidReportType::feature, 3) != board_feature_bytes) {
    throw Error(
        "its report descriptor has not the three reports of a home-made board", device,
        "give it the descriptor of board_report_descriptor (runtime/devices/reports/palpate_board.cpp)");
  }
  return found;
}

/// The board numbers its reports. A report whose number is not ahead of the last one's is old and is dropped.
class HidBoard : public HidProtocol {
 public:
  HidBoard(const DeviceLimits& limits, const HidReportDescriptor& descriptor, std::string device,
           std::uint32_t last)
      : HidProtocol(limits),
        device_(std::move(device)),
        axes_(board_axes(descriptor, device_)),
        last_(last),
        velocity_(Vec3::Constant(position_unit)) {}

  [[nodiscard]] std::size_t input_bytes() const noexcept override { return board_input_bytes(axes_); }

  /// Reads the feature report: limits and unit of force.
  void start(HidDevice& device) override {
    std::array<std::uint8_t, board_feature_bytes> report{3};
    const int size = device.get_feature(report);
    if (size < 0) {
      throw Error("the board does not answer to feature report 3", device_,
                  "its firmware must send its limits when it is asked (devices-protocol.md, \"Boards\")");
    }
    const auto feature = decode_board_feature(
        std::span(report).first(std::min(report.size(), static_cast<std::size_t>(size))));
    if (!feature) {
      throw Error(
          "feature report 3 of the board has another length or version, or numbers out of range", device_,
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

  bool take(std::span<const std::uint8_t> report) noexcept override {
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

  bool tell(bool heard, std::int64_t now, DeviceState& state) noexcept override {
    if (!heard) return false;
    state = board_state(input_);
    state.velocity = velocity_.take(state.pose.position, now);
    state.sequence = input_.sequence + ahead_.load(std::memory_order_relaxed);
    return true;
  }

  /// Sends the force together with the board's own number of the report behind `state`.
  void encode(const DeviceCommand& command, const DeviceState& state,
              OutputReports& reports) noexcept override {
    reports.add(encode_board_force({state.sequence - ahead_.load(std::memory_order_relaxed),
                                    board_counts(feature_, command.wrench.force)}));
  }

  [[nodiscard]] std::vector<OutputReport> zero() const override {
    const auto report = encode_board_force({});
    return {{report.begin(), report.end()}};
  }

 private:
  std::string device_;
  int axes_;
  BoardFeature feature_;
  std::uint32_t last_;
  BoardInput input_;
  bool heard_anything_ = false;
  /// Sequence number of the state minus the board's, which restarts when it is plugged in again. Set by the
  /// first report.
  std::atomic<std::uint32_t> ahead_ = 0;
  VelocityEstimator velocity_;
};

}  // namespace

std::unique_ptr<HidProtocol> make_hid_board(const DeviceLimits& limits, const HidReportDescriptor& descriptor,
                                            const std::string& device, std::uint32_t last) {
  return std::make_unique<HidBoard>(limits, descriptor, device, last);
}

}  // namespace palpate
