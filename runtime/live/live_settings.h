// What a person chooses of a body that is solved while it is touched.
#pragma once

#include <limits>
#include <optional>

#include "runtime/live/integrator.h"
#include "statics/live_law.h"
#include "statics/solver_kind.h"

namespace palpate {

struct LiveOptions;
struct StepperOptions;

/// A box that stands on axes; in the plane z counts for nothing.
struct AxisBox {
  Vec3 low = Vec3::Zero();   ///< its lowest corner [m]
  Vec3 high = Vec3::Zero();  ///< its highest corner [m]

  bool operator==(const AxisBox&) const = default;
};

/// The live solver of a session. With default values a body moves as it was precomputed to: held where it is
/// held, without weight.
struct LiveSettings {
  std::optional<LiveLaw> solver;                           ///< none: Green's functions
  std::optional<double> poissons_ratio{};                  ///< of all materials; none: the file's
  double step = 0.005;                                     ///< of the solver; a whole number of ticks [s]
  Integrator integrator = Integrator::implicit_euler;      ///< not explicit Euler
  SolverKind step_solver = SolverKind::factor;             ///< of the equations of an implicit step
  Vec3 gravity = Vec3::Zero();                             ///< [m/s^2]
  double mass_damping = 0.0;                               ///< [1/s]
  double stiffness_damping = 0.001;                        ///< [s]
  double yield = std::numeric_limits<double>::infinity();  ///< as in Plasticity
  double creep = 10.0;                                     ///< as in Plasticity [1/s]
  double most_plastic = std::numeric_limits<double>::infinity();  ///< as in Plasticity
  bool free = false;                                              ///< nothing is held
  std::optional<double> floor{};      ///< height along z, in the plane y; none: there is none [m]
  std::optional<AxisBox> room{};      ///< the body stays in it: walls and a floor, no lid
  std::optional<AxisBox> obstacle{};  ///< the body stays out of it
  double wall_friction = 0.5;         ///< Coulomb's coefficient of all walls

  bool operator==(const LiveSettings&) const = default;
};

/// The law, plasticity, damping and gravity of the settings, whose solver must be set.
LiveOptions live_options(const LiveSettings& settings);

/// Step, integrator and walls of a body of `dimension`. Throws Error for boxes that are turned inside out.
StepperOptions stepper_options(const LiveSettings& settings, int dimension);

}  // namespace palpate
