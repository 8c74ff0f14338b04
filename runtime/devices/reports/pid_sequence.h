// Start sequence of a force-feedback joystick, as a state machine without the connection.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "runtime/devices/reports/pid_reports.h"

namespace palpate {

/// Next action on the device.
struct PidRequest {
  enum class Kind {
    output,       ///< hid_write the report
    set_feature,  ///< hid_send_feature_report it
    get_feature,  ///< hid_get_feature_report with its id and length
    none,         ///< nothing: forces may be sent, or the sequence has ended
  };
  Kind kind = Kind::none;
  PidReport report;
};

/// Device reset, actuators on, then for each axis: Create New Effect, Block Load until it succeeds, Set
/// Effect, Set Constant Force of 0, Effect Operation start. After that only Set Constant Force, one report
/// per axis and tick.
///
///     while (next().kind != none) { do it; done(); or received(report); or refused(); }
class PidSequence {
 public:
  /// Keeps a reference to the layout.
  PidSequence(const PidLayout& layout, const PidConstants& constants) noexcept
      : layout_(layout), constants_(constants) {}

  [[nodiscard]] PidRequest next() const noexcept;

  /// Reports that the output or feature report was sent.
  void done() noexcept;
  /// Passes on the device's answer to get_feature.
  void received(std::span<const std::uint8_t> report) noexcept;
  /// Reports that the device did not accept or answer the request.
  void refused() noexcept;

  /// True while the effects play: force() may be sent.
  [[nodiscard]] bool running() const noexcept { return step_ == Step::running; }
  /// Reason why the sequence has failed for good; null while it has not.
  [[nodiscard]] const char* failure() const noexcept { return failure_; }

  /// Encodes Set Constant Force for x and y; only while running.
  [[nodiscard]] std::array<PidReport, pid_axes> force(const PidForce& wish) const noexcept;

  /// Stops both effects and resets the device from here on. May be called at any step.
  void stop() noexcept;

 private:
  enum class Step {
    reset,
    enable,
    create,
    load,
    set_effect,
    set_constant,
    start,
    running,
    stop,
    last_reset,
    over
  };

  void fail(const char* why) noexcept;

  const PidLayout& layout_;
  PidConstants constants_;
  Step step_ = Step::reset;
  std::size_t axis_ = 0;
  int tries_ = 0;
  std::array<std::uint32_t, pid_axes> blocks_{};  // 0: none yet
  const char* failure_ = nullptr;
};

}  // namespace palpate
