// One tick: tools in, wrenches out.
#pragma once

#include <span>

#include "runtime/body/body.h"
#include "runtime/tick/state.h"
#include "runtime/tick/status.h"
#include "runtime/touch/tool.h"

namespace palpate {

/// One tick for each tool's pose (as many as the state has tools). The tool is pushed out of the deformed
/// surface, exactly: gaps >= 0, normal forces >= 0, one of them zero, with Coulomb friction where the surface
/// has it, over the compliance of the body and of the coupling together. No heap, lock, system call or
/// exception; never a force that is not finite.
StepStatus step(const Body& body, State& state, std::span<const ToolPose> poses) noexcept;

/// One tick of a state with one tool.
StepStatus step(const Body& body, State& state, const ToolPose& pose) noexcept;

/// u = Xi E f: displacement u [n] of all stored nodes [m] by the present contact forces, relative to rest
/// (theory.md section 3), and what the body's free motion adds. What is seen is node + u0 + u. For the eye;
/// not needed by a tick.
void surface_displacement(const Body& body, const State& state, std::span<double> u) noexcept;

}  // namespace palpate
