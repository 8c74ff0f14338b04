#include "runtime/live/live_settings.h"

#include <cmath>

#include "runtime/live/live_stepper.h"

namespace palpate {

LiveOptions live_options(const LiveSettings& settings) {
  LiveOptions options{.law = settings.solver.value(),
                      .damping = {.mass = settings.mass_damping, .stiffness = settings.stiffness_damping},
                      .gravity = settings.gravity};
  if (std::isfinite(settings.yield))
    options.plasticity = {.yield = settings.yield, .creep = settings.creep, .maximum = settings.most_plastic};
  return options;
}

StepperOptions stepper_options(const LiveSettings& settings, int dimension) {
  StepperOptions options{.time_step = settings.step,
                         .scheme = {.integrator = settings.integrator, .tolerance = 1e-5}};
  if (settings.floor) {
    options.walls.push_back({.normal = Vec3::Unit(dimension - 1),
                             .offset = *settings.floor,
                             .friction = settings.floor_friction});
  }
  return options;
}

}  // namespace palpate
