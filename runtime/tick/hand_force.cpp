#include "runtime/tick/hand_force.h"

#include <algorithm>
#include <cmath>

#include "runtime/solve/tick_tuning.h"
namespace palpate {
namespace {

void hand_over(ToolState& tool, double tick) noexcept {
  const double milliseconds = tick / tuning.hand.usual_tick;
  const Wrench last = tool.wrench;
  const Wrench& contact = tool.contact_wrench;
  const double size = contact.force.norm();
  tool.recent_force =
      std::max({size, last.force.norm(), std::pow(tuning.hand.memory, milliseconds) * tool.recent_force});
  const Vec3 moved = tool.device.position - tool.last_device_position - tool.surface_change;
  const double explained = (tool.local.stiffness * moved).norm();
  const double handed_over =
      milliseconds * (tool.contacts > 0
                          ? tool.tool.hand_over * std::max(size, last.force.norm())
                          : std::max(tool.tool.hand_over, 1.0 / tuning.hand.fade_time) * tool.recent_force);
  const double change = (contact.force - last.force).norm();
  if (!(change > explained + handed_over)) {
    tool.wrench = contact;
    return;
  }
  const double share = (explained + handed_over) / change;
  tool.wrench.force = last.force + share * (contact.force - last.force);
  tool.wrench.torque = last.torque + share * (contact.torque - last.torque);
  tool.status |= StepStatus::handing_over;
}

void limit(ToolState& tool) noexcept {
  const double force = tool.wrench.force.norm();
  if (!(force > tool.tool.max_force)) return;
  const double share = tool.tool.max_force / force;
  tool.wrench.force *= share;
  tool.wrench.torque *= share;
  tool.local.stiffness.setZero();
  tool.status |= StepStatus::force_limited;
}

}  // namespace

void give_force(ToolState& tool, double tick) noexcept {
  hand_over(tool, tick);
  limit(tool);
  tool.local.force = tool.wrench.force;
}

}  // namespace palpate
