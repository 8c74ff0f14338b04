#include "runtime/tick/release.h"

#include <algorithm>

#include "runtime/tick/state.h"
#include "runtime/tick/surface_motion.h"

namespace palpate {

bool is_released(const Body& body, const State& state) noexcept {
  if (body.model().dynamics.method == DynamicsMethod::none) return false;
  return std::any_of(state.tools.begin(), state.tools.end(), [](const ToolState& tool) {
    return (tool.touched && tool.contacts == 0) || (tool.held && !tool.holding);
  });
}

void release(const Body& body, State& state) noexcept {
  if (is_released(body, state)) {
    state.motion.let_go(body, state.near.load(), state.stored_displacement);
    move_near_surface(body, state);
  }
  state.motion.end_tick(body, state.near.load());
}

}  // namespace palpate
