#include "runtime/hand_force.h"

#include <algorithm>

#include "runtime/state.h"

namespace palpate {
namespace {

constexpr double fade_ticks = 20.0;
constexpr double memory = 0.98;  // of the force that was felt, a tick: the measure of a fade

void hand_over(ToolState& tool) noexcept {
  const Wrench last = tool.wrench;
  const Wrench& contact = tool.contact_wrench;
  tool.felt = std::max(contact.force.norm(), memory * tool.felt);
  const Vec3 explained =
      last.force - tool.local.stiffness * (tool.device.position - tool.last_device_position);
  const Vec3 rest = contact.force - explained;
  const double most = tool.contacts > 0
                          ? tool.tool.hand_over * std::max(contact.force.norm(), last.force.norm())
                          : std::max(tool.tool.hand_over, 1.0 / fade_ticks) * tool.felt;
  const double size = rest.norm();
  if (!(size > most)) {
    tool.wrench = contact;
    return;
  }
  const double share = most / size;
  tool.wrench.force = explained + share * rest;
  tool.wrench.torque = last.torque + share * (contact.torque - last.torque);
  tool.status |= StepStatus::handing_over;
}

void limit(ToolState& tool) noexcept {
  const double force = tool.wrench.force.stableNorm();
  if (!(force > tool.tool.max_force)) return;
  const double share = tool.tool.max_force / force;
  tool.wrench.force *= share;
  tool.wrench.torque *= share;
  tool.local.stiffness.setZero();
  tool.status |= StepStatus::force_limited;
}

}  // namespace

void give_force(ToolState& tool) noexcept {
  hand_over(tool);
  limit(tool);
  tool.local.force = tool.wrench.force;
}

}  // namespace palpate
