// Faults and phases of the safety layer.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace palpate {

/// Fault that stopped the force, until it is acknowledged. The book's reference shows these comments.
enum class Fault : std::uint8_t {
  none = 0,
  too_fast = 1,         ///< the device moved faster than the speed limit, or its position jumped
  device_silent = 2,    ///< no new report for too long
  device_frozen = 3,    ///< new reports, always the same numbers
  deadline_missed = 4,  ///< too many late ticks
  buzzing = 5,          ///< force or hand chattered until the force had faded to zero
  device_lost = 6,      ///< the device was unplugged, or cannot be read or written
  input_lost = 7,       ///< the viewer that moved the tool is gone
  stopped = 8,          ///< emergency stop
};

/// The faults and their names, for reports.
inline constexpr std::array<std::pair<Fault, const char*>, 9> fault_names = {{
    {Fault::none, "none"},
    {Fault::too_fast, "too_fast"},
    {Fault::device_silent, "device_silent"},
    {Fault::device_frozen, "device_frozen"},
    {Fault::deadline_missed, "deadline_missed"},
    {Fault::buzzing, "buzzing"},
    {Fault::device_lost, "device_lost"},
    {Fault::input_lost, "input_lost"},
    {Fault::stopped, "stopped"},
}};

/// Phase of the safety layer: force on, or the reason why it is off. The book's reference shows these
/// comments.
enum class SafetyPhase : std::uint8_t {
  waiting = 0,    ///< waits until the tool is clear of the body and the force is small
  ramping = 1,    ///< force ramps up from zero
  active = 2,     ///< force is on, within the safety bounds
  faulted = 3,    ///< no force until acknowledged
  shut_down = 4,  ///< force is off for good
};

/// The phases and their names, for reports.
inline constexpr std::array<std::pair<SafetyPhase, const char*>, 5> safety_phase_names = {{
    {SafetyPhase::waiting, "waiting"},
    {SafetyPhase::ramping, "ramping"},
    {SafetyPhase::active, "active"},
    {SafetyPhase::faulted, "faulted"},
    {SafetyPhase::shut_down, "shut_down"},
}};

}  // namespace palpate
