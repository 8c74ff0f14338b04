#include "runtime/core/tick/release.h"

#include <algorithm>

#include "runtime/core/tick/surface_motion.h"

namespace palpate {
namespace {

bool opens_grab(const State& state) noexcept {
  return std::any_of(state.tools.begin(), state.tools.end(),
                     [](const ToolState& tool) { return tool.held_last_tick && !tool.holding; });
}

}  // namespace

bool is_released(const ElasticBody& body, const State& state) noexcept {
  if (!body.swings()) return false;
  return std::any_of(state.tools.begin(), state.tools.end(), [](const ToolState& tool) {
    return (tool.touched_last_tick && tool.contacts == 0) || (tool.held_last_tick && !tool.holding);
  });
}

void release(const ElasticBody& body, State& state) noexcept {
  state.surface.motion.note_strain(state.surface.stored_displacement);
  if (is_released(body, state)) {
    state.surface.motion.let_go(body, state.surface.near.load(), state.surface.stored_displacement,
                                opens_grab(state));
    move_near_surface(body, state.surface);
  }
  state.surface.motion.end_tick(body, state.surface.near.load());
}

}  // namespace palpate
