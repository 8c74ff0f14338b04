#include "tests/bench/tick_stages.h"

#include <chrono>

#include "runtime/tick/assemble_contact.h"
#include "runtime/tick/contact_detection.h"
#include "runtime/tick/contact_solution.h"
#include "runtime/tick/local_model.h"

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
  ToolState& tool = state.tools.front();
  tool.margin = 0.1 * body.mean_surface_edge() + (pose.position - tool.device.position).norm();
  tool.device = pose;
  state.near.begin_tick();
  remember_contacts(state);

  TickStages stages;
  stages.find = seconds([&] { find_contacts(body, state); });
  stages.assemble = seconds([&] { assemble_contact(body, state); });
  stages.solve = seconds([&] { solve_problem(state); });
  stages.displace = seconds([&] { apply_forces(state); });
  stages.linearise = seconds([&] { linearise(state); });
  return stages;
}

}  // namespace palpate::test
