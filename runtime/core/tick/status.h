// Status bits of a tick.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

namespace palpate {

/// Limitations of a tick; no bit is set when all is well. Bits 5 and 14 are free. The
/// reference shows these comments.
enum class StepStatus : std::uint32_t {
  ok = 0,
  nothing_in_reach = 1U << 0,   ///< grab is pressed, the tool touches nothing and no surface is within reach
  capacity_full = 1U << 1,      ///< the capacity for nodes or contacts is exceeded: the deepest are kept
  unsettled = 1U << 2,          ///< contact forces still change although nothing has moved for long
  pose_not_finite = 1U << 3,    ///< the pose was ignored: the last valid one is used
  result_not_finite = 1U << 4,  ///< the force overflowed: the last valid result is used
  inside_body = 1U << 6,        ///< the tool is inside the body and touches nothing until it is out
  pose_limited = 1U << 7,       ///< the pose jumped: the tool follows at a bounded speed
  not_converged = 1U << 8,      ///< the contact forces did not reach their tolerance within the budget
  force_limited = 1U << 9,      ///< the force was limited to the tool's largest (`--max-force`)
  handing_over = 1U << 10,      ///< the force approaches that of the contact gradually, to avoid a kick
  older_patch = 1U << 11,       ///< the overlay for this place was not ready: an older one was used, or none
  late_motion = 1U << 12,    ///< the free motion of the body was not ready in time: the surface waits for it
  rigid_contact = 1U << 13,  ///< the tool presses on a rigid part: only its coupling deforms
  unbalanced = 1U << 14,  ///< the body's balance at depth was not met: see the estimated error of the force
};

constexpr StepStatus operator|(StepStatus a, StepStatus b) noexcept {
  return static_cast<StepStatus>(static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b));
}
constexpr StepStatus& operator|=(StepStatus& a, StepStatus b) noexcept {
  return a = a | b;
}
constexpr bool has(StepStatus status, StepStatus bit) noexcept {
  return (static_cast<std::uint32_t>(status) & static_cast<std::uint32_t>(bit)) != 0;
}

/// The bits and their names, for reports.
inline constexpr std::array<std::pair<StepStatus, const char*>, 14> status_names = {{
    {StepStatus::nothing_in_reach, "nothing_in_reach"},
    {StepStatus::capacity_full, "capacity_full"},
    {StepStatus::unsettled, "unsettled"},
    {StepStatus::pose_not_finite, "pose_not_finite"},
    {StepStatus::result_not_finite, "result_not_finite"},
    {StepStatus::inside_body, "inside_body"},
    {StepStatus::pose_limited, "pose_limited"},
    {StepStatus::not_converged, "not_converged"},
    {StepStatus::force_limited, "force_limited"},
    {StepStatus::handing_over, "handing_over"},
    {StepStatus::older_patch, "older_patch"},
    {StepStatus::late_motion, "late_motion"},
    {StepStatus::rigid_contact, "rigid_contact"},
    {StepStatus::unbalanced, "unbalanced"},
}};

}  // namespace palpate
