#include "tests/bench/tick_stages.h"

#include <chrono>

#include "runtime/core/tick/assemble_contact.h"
#include "runtime/core/tick/contact_detection.h"
#include "runtime/core/tick/contact_solution.h"
#include "runtime/core/tick/linearise.h"

namespace palpate::test {
namespace {

template <class F>
double seconds(F&& f) {
  const auto begin = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

TickStages time_stages(const Body& body, State& state, const ToolPose& pose) {
  Scratch& scratch = state.scratch;
  ToolState& tool = state.tools.front();
  tool.margin = 0.1 * body.mean_surface_edge() + (pose.position - tool.device.position).norm();
  tool.device = pose;
  state.surface.near.begin_tick();
  scratch.last.remember(state.contacts());

  TickStages stages;
  stages.find = seconds([&] { find_contacts(body, state, scratch, Pass::first); });
  stages.assemble = seconds([&] { assemble_contact(body, state, scratch, Pass::first); });
  stages.solve = seconds([&] { scratch.solver.solve(scratch.problem); });
  stages.displace = seconds([&] { apply_forces(state, scratch); });
  stages.linearise = seconds([&] { linearise(body, state, scratch); });
  return stages;
}

}  // namespace palpate::test
