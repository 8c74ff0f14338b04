// User settings of a live body.
#pragma once

#include <limits>
#include <optional>

#include "runtime/live/integrator.h"
#include "statics/live_law.h"
#include "statics/solver_kind.h"

namespace palpate {

struct LiveOptions;
struct StepperOptions;

/// Axis-aligned box; in the plane z is ignored.
struct AxisBox {
  Vec3 low = Vec3::Zero();   ///< lowest corner [m]
  Vec3 high = Vec3::Zero();  ///< highest corner [m]

  bool operator==(const AxisBox&) const = default;
};

/// Live solver of a session. By default a body has its precomputed supports and no weight.
struct LiveSettings {
  std::optional<LiveLaw> solver;           ///< none: Green's functions
  std::optional<double> poissons_ratio{};  ///< of all materials; none: the file's
  double step = 0.005;                     ///< of the solver; a whole number of ticks [s]
  Integrator integrator = Integrator::implicit_euler;
  SolverKind step_solver = SolverKind::factor;                    ///< of the equations of an implicit step
  Vec3 gravity = Vec3::Zero();                                    ///< [m/s^2]
  double mass_damping = 0.0;                                      ///< [1/s]
  double stiffness_damping = 0.001;                               ///< [s]
  double yield = std::numeric_limits<double>::infinity();         ///< as in Plasticity
  double creep = 10.0;                                            ///< as in Plasticity [1/s]
  double most_plastic = std::numeric_limits<double>::infinity();  ///< as in Plasticity
  bool free = false;                                              ///< nothing is held
  std::optional<double> floor{};      ///< height along z, in the plane y; none: there is none [m]
  std::optional<AxisBox> room{};      ///< the body stays in it: walls and a floor, no lid
  std::optional<AxisBox> obstacle{};  ///< the body stays out of it
  double wall_friction = 0.5;         ///< Coulomb's coefficient of all walls

  bool operator==(const LiveSettings&) const = default;
};

/// Returns law, plasticity, damping and gravity of the settings, whose solver must be set.
LiveOptions live_options(const LiveSettings& settings);

/// Returns step, integrator and walls for a body of `dimension`. Throws Error for boxes whose corners are
/// swapped.
StepperOptions stepper_options(const LiveSettings& settings, int dimension);

}  // namespace palpate
