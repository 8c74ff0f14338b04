// One tick: poses of the tools in, wrenches out.
#pragma once

#include <span>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/tick/state.h"
#include "runtime/core/tick/status.h"
#include "runtime/core/touch/tool.h"

namespace palpate {

/// Performs one tick with a pose for each tool of the state. The tool is pushed out of the deformed surface
/// exactly: gaps >= 0, normal forces >= 0, one of them zero, with Coulomb friction where the surface has it,
/// for the compliance of body and coupling together. No heap allocation, lock, system call or exception;
/// forces are always finite.
StepStatus step(const ElasticBody& body, State& state, std::span<const ToolPose> poses) noexcept;

/// Performs one tick of a state with one tool.
StepStatus step(const ElasticBody& body, State& state, const ToolPose& pose) noexcept;

/// u = Xi E f: computes the displacement u [n] of all stored nodes [m] by the present contact forces,
/// relative to rest (theory.md section 3), plus the body's free motion. The visible position is node + u0 +
/// u. For display; a tick does not need it.
void surface_displacement(const ElasticBody& body, const State& state, std::span<double> u) noexcept;

}  // namespace palpate
