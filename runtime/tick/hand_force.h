// From the contact's force to what the hand is given.
#pragma once

#include "runtime/tick/state.h"

namespace palpate {

/// Sets tool.wrench from tool.contact_wrench and the local model of it: straight towards the contact's
/// wrench, by no more a tick than the device's own motion explains (to first order, how far it moved and how
/// it turned) plus a share `hand_over` of the force a millisecond; the torque by that force at the tool's
/// longest arm. Contact that slips from one piece of surface to another is so handed over without a kick;
/// where contact is lost, the force fades in 20 ms. Then the tool's largest force is kept to. `tick` [s]:
/// time from one tick to the next. Sets status bits.
void give_force(ToolState& tool, double tick) noexcept;

}  // namespace palpate
