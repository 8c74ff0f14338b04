#include "tests/bench/tick_stages.h"

#include <algorithm>
#include <chrono>

namespace palpate::test {
namespace {

template <class F>
double seconds(F&& f) {
  const auto begin = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

void load_near_field(State& state) {
  state.near.unload();
  for (Index i = 0; i < state.problem.rows; ++i) {
    const ContactRow& row = state.rows[static_cast<std::size_t>(i)];
    const double lambda = state.problem.lambda[static_cast<std::size_t>(i)];
    for (std::size_t n = 0; n < 3; ++n) {
      if (lambda != 0.0 && row.places[n] >= 0) state.near.load(row.places[n], -lambda * row.body[n]);
    }
  }
  state.near.displace();
}

}  // namespace

TickStages time_stages(const Body& body, State& state, const ToolPose& pose) {
  ToolState& tool = state.tools.front();
  tool.margin = 0.1 * body.mean_surface_edge() + (pose.position - tool.device.position).norm();
  tool.device = pose;
  state.near.begin_tick();
  std::copy_n(state.contact_points.begin(), state.contact_count, state.last_contacts.begin());
  state.last_count = state.contact_count;

  TickStages stages;
  stages.find = seconds([&] { find_contacts(body, state); });
  stages.assemble = seconds([&] { assemble_contact(body, state); });
  stages.solve = seconds([&] {
    if (state.problem.frictionless) {
      state.active_set.solve(state.problem);
    } else {
      state.cone_solver.solve(state.problem);
    }
  });
  stages.displace = seconds([&] { load_near_field(state); });
  stages.linearise = seconds([&] { linearise(state); });
  return stages;
}

}  // namespace palpate::test
