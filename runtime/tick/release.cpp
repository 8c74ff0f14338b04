#include "runtime/tick/release.h"

#include <algorithm>

#include "runtime/tick/surface_motion.h"

namespace palpate {

bool is_released(const Body& body, const State& state) noexcept {
  if (body.model().dynamics.method == DynamicsMethod::none) return false;
  return std::any_of(state.tools.begin(), state.tools.end(), [](const ToolState& tool) {
    return (tool.touched_last_tick && tool.contacts == 0) || (tool.held_last_tick && !tool.holding);
  });
}

void release(const Body& body, State& state) noexcept {
  if (is_released(body, state)) {
    state.surface.motion.let_go(body, state.surface.near.load(), state.surface.stored_displacement);
    move_near_surface(body, state.surface);
  }
  state.surface.motion.end_tick(body, state.surface.near.load());
}

}  // namespace palpate
