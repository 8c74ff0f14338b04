// From the contact's force to what the hand is given.
#pragma once

namespace palpate {

struct ToolState;

/// Sets tool.wrench from tool.contact_wrench and the local model of it. What the device's own motion explains
/// (the local stiffness times how far it moved) goes through at once; what else changes, contact that slips
/// from one piece of surface to another, is handed over by at most `hand_over` of the force a tick, and in
/// `fade_ticks` where contact was lost: no kick. Then the tool's largest force is kept to. Sets status bits.
void give_force(ToolState& tool) noexcept;

}  // namespace palpate
