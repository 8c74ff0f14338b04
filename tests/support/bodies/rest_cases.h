// Spheres that press, grab, move and turn at random on a body, and come to rest.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/core/tick/step.h"
#include "tests/bench/palpation_paths.h"

namespace palpate::test {

/// A tool and a pose for each tick.
struct RestCase {
  Tool tool;
  std::vector<ToolPose> poses;
};

/// Ticks at the end of a case in which it rests.
inline constexpr int ticks_of_rest = 400;
/// Ticks at its end in which its force is expected to be constant.
inline constexpr int ticks_looked_at = 64;

/// A sphere of 1/2 to 3 edges that is pressed up to 0.4 R into a random place of the surface, grabs or not,
/// is moved by up to R, turned by up to 0.3 rad, and rests; the same for the same number.
RestCase rest_case(const Body& body, const RestSurface& surface, std::uint64_t number, bool grab);

/// How a case ended.
struct Rest {
  double force = 0.0;                  ///< of the last tick [N]
  double change = 0.0;                 ///< the largest in the ticks that are looked at [force]
  int ticks = 0;                       ///< of rest after which it stays within 1e-9
  Index contacts = 0;                  ///< in the last tick
  bool touched = false;                ///< in the ticks that are looked at
  StepStatus status = StepStatus::ok;  ///< of all of them
};

/// Goes through a case, and calls `look` after each of its last `ticks` ticks.
template <class Look>
Rest rest_of(const Body& body, const RestCase& made, int ticks, const Look& look) {
  State state(body, {.tools = {made.tool}});
  std::vector<Vec3> forces;
  Rest rest;
  const auto is_late = [&](int last) { return std::ssize(forces) + last >= std::ssize(made.poses); };
  for (const ToolPose& pose : made.poses) {
    step(body, state, pose);
    if (is_late(ticks_looked_at)) {
      rest.status |= state.status;
      rest.touched = rest.touched || state.tools[0].contacts > 0;
    }
    if (is_late(ticks)) look(state);
    forces.push_back(state.tools[0].contact_wrench.force);
  }
  rest.force = forces.back().norm();
  rest.contacts = state.tools[0].contacts;
  for (int k = 0; k < ticks_of_rest; ++k) {
    const Vec3& force = forces[forces.size() - 1 - static_cast<std::size_t>(k)];
    const double change = (force - forces.back()).norm();
    const double share = change > 0.0 ? change / std::max(rest.force, force.norm()) : 0.0;
    if (share > 1e-9 && rest.ticks == 0) rest.ticks = ticks_of_rest - k;
    if (k < ticks_looked_at) rest.change = std::max(rest.change, share);
  }
  return rest;
}

inline Rest rest_of(const Body& body, const RestCase& made) {
  return rest_of(body, made, 0, [](const State&) {});
}

}  // namespace palpate::test
