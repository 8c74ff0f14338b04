#include "runtime/core/tick/hand_force.h"

#include <algorithm>
#include <cmath>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/tool_geometry.h"

namespace palpate {
namespace {

/// Fraction of the distance between two vectors that is no longer than `most`.
double share_of_way(const Vec3& from, const Vec3& to, double most) noexcept {
  const double way = (to - from).norm();
  return way > most ? most / way : 1.0;
}

void hand_over(ToolState& tool, double tick) noexcept {
  const double milliseconds = tick / tuning.hand.usual_tick;
  const Wrench last = tool.wrench;
  const Wrench& contact = tool.contact_wrench;
  const double size = contact.force.norm();
  tool.recent_force =
      std::max({size, last.force.norm(), std::pow(tuning.hand.memory, milliseconds) * tool.recent_force});
  const double handed_over =
      milliseconds * (tool.contacts > 0
                          ? tool.tool.hand_over * std::max(size, last.force.norm())
                          : std::max(tool.tool.hand_over, 1.0 / tuning.hand.fade_time) * tool.recent_force);
  const double force = share_of_way(last.force, contact.force, tool.explained.force.norm() + handed_over);
  const double arm = std::max(extent(tool.tool), tool.tool.reach);
  const double torque = tool.contacts > 0 ? share_of_way(last.torque, contact.torque,
                                                         tool.explained.torque.norm() + arm * handed_over)
                                          : force;  // a lost force and its torque fade together
  tool.wrench = contact;
  if (force < 1.0) tool.wrench.force = last.force + force * (contact.force - last.force);
  if (torque < 1.0) tool.wrench.torque = last.torque + torque * (contact.torque - last.torque);
  if (force < 1.0 || torque < 1.0) tool.status |= StepStatus::handing_over;
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
