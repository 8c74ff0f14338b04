#include "runtime/tick/hand_force.h"

#include <algorithm>
#include <cmath>

#include "runtime/tick/state.h"

namespace palpate {
namespace {

constexpr double usual_tick = 0.001;  // s
constexpr double fade_time = 20.0;    // ms
constexpr double memory = 0.98;       // of the force that was felt, a millisecond: the measure of a fade

void hand_over(ToolState& tool, double tick) noexcept {
  const double milliseconds = tick / usual_tick;
  const Wrench last = tool.wrench;
  const Wrench& contact = tool.contact_wrench;
  const double size = contact.force.norm();
  tool.felt = std::max({size, last.force.norm(), std::pow(memory, milliseconds) * tool.felt});
  const Vec3 moved = tool.device.position - tool.last_device_position - tool.surface_change;
  const double explained = (tool.local.stiffness * moved).norm();
  const double handed_over =
      milliseconds * (tool.contacts > 0 ? tool.tool.hand_over * std::max(size, last.force.norm())
                                        : std::max(tool.tool.hand_over, 1.0 / fade_time) * tool.felt);
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
