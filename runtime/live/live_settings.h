// What a person chooses of a body that is solved while it is touched.
#pragma once

#include <limits>
#include <optional>

#include "runtime/live/integrator.h"
#include "runtime/live/live_law.h"

namespace palpate {

struct LiveOptions;
struct StepperOptions;

/// The live solver of a session. With default values a body moves as it was precomputed to: held where it is
/// held, without weight.
struct LiveSettings {
  std::optional<LiveLaw> solver;                           ///< none: Green's functions
  double step = 0.005;                                     ///< of the solver; a whole number of ticks [s]
  Integrator integrator = Integrator::implicit_euler;      ///< an implicit one
  Vec3 gravity = Vec3::Zero();                             ///< [m/s^2]
  double mass_damping = 1.0;                               ///< [1/s]
  double stiffness_damping = 0.001;                        ///< [s]
  double yield = std::numeric_limits<double>::infinity();  ///< as in Plasticity
  double creep = 10.0;                                     ///< as in Plasticity [1/s]
  double most_plastic = std::numeric_limits<double>::infinity();  ///< as in Plasticity
  bool free = false;                                              ///< nothing is held
  std::optional<double> floor;  ///< height along z, in the plane y; none: there is none [m]
  double floor_friction = 0.5;  ///< Coulomb's coefficient

  bool operator==(const LiveSettings&) const = default;
};

/// The law, plasticity, damping and gravity of the settings, whose solver must be set.
LiveOptions live_options(const LiveSettings& settings);

/// Step, integrator and floor of a body of `dimension`.
StepperOptions stepper_options(const LiveSettings& settings, int dimension);

}  // namespace palpate
