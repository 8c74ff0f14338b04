// Force on the hand from the contact force.
#pragma once

#include "runtime/core/tick/state.h"

namespace palpate {

/// Sets tool.wrench and its local model from tool.contact_wrench. The wrench moves straight towards that of
/// the contact. Per tick it changes by at most the part explained by the device's own motion (translation and
/// rotation, to first order) plus a fraction `hand_over` of the force per millisecond; for the torque, this
/// fraction times the longest lever of the tool. Contact that slips from one part of the surface to another
/// is thus handed over without a kick; after a loss of contact the force fades in 20 ms. Finally the tool's
/// largest force is applied. `tick`: time between ticks [s]. Sets status bits.
void give_force(ToolState& tool, double tick) noexcept;

}  // namespace palpate
