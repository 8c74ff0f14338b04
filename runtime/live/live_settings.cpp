#include "runtime/live/live_settings.h"

#include <fmt/format.h>

#include <cmath>

#include "base/error.h"
#include "runtime/live/live_stepper.h"

namespace palpate {
namespace {

constexpr double most_gravity = 1000.0;  // [m/s^2]

/// Returns the corners of a box, which in the plane is unbounded along z.
AxisBox whole(AxisBox box, int dimension, const char* option) {
  if (dimension == 2) {
    box.low.z() = -1.0;
    box.high.z() = 1.0;
  }
  if (!((box.high - box.low).minCoeff() > 0.0)) {
    throw Error("the box has no size", option,
                "give its lowest corner, then its highest, e.g. 0,0,0,0.2,0.2,0.1");
  }
  return box;
}

}  // namespace

LiveOptions live_options(const LiveSettings& settings) {
  if (!(settings.gravity.norm() <= most_gravity)) {
    throw Error(fmt::format("the body would fall by {:.3g} m/s^2", settings.gravity.norm()), "--gravity",
                fmt::format("give at most {} m/s^2; the earth has 9.81", most_gravity));
  }
  LiveOptions options{.law = settings.solver.value(),
                      .damping = {.mass = settings.mass_damping, .stiffness = settings.stiffness_damping},
                      .gravity = settings.gravity};
  if (std::isfinite(settings.yield))
    options.plasticity = {.yield = settings.yield, .creep = settings.creep, .maximum = settings.most_plastic};
  return options;
}

StepperOptions stepper_options(const LiveSettings& settings, int dimension) {
  StepperOptions options{
      .time_step = settings.step,
      .scheme = {
          .integrator = settings.integrator, .solver = {.kind = settings.step_solver}, .tolerance = 1e-5}};
  if (settings.floor) {
    options.walls.push_back(
        {.normal = Vec3::Unit(dimension - 1), .offset = *settings.floor, .friction = settings.wall_friction});
  }
  if (settings.room) {
    const AxisBox room = whole(*settings.room, dimension, "--room");
    const std::vector<Wall> walls = room_walls(room.low, room.high, settings.wall_friction, dimension);
    options.walls.insert(options.walls.end(), walls.begin(), walls.end());
  }
  if (settings.obstacle) {
    const AxisBox box = whole(*settings.obstacle, dimension, "--obstacle");
    options.walls.push_back({.friction = settings.wall_friction, .box = {{box.low, box.high}}});
  }
  return options;
}

}  // namespace palpate
