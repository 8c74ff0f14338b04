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
  std::optional<LiveLaw> solver;           ///< empty: Green's functions
  std::optional<double> poissons_ratio{};  ///< for all materials; empty: from the file
  double step = 0.005;                     ///< solver time step, a whole number of ticks [s]
  Integrator integrator = Integrator::implicit_euler;
  SolverKind step_solver = SolverKind::factor;             ///< solver for the equations of an implicit step
  Vec3 gravity = Vec3::Zero();                             ///< [m/s^2]
  double mass_damping = 0.0;                               ///< [1/s]
  double stiffness_damping = 0.001;                        ///< [s]
  double yield = std::numeric_limits<double>::infinity();  ///< see Plasticity
  double creep = 10.0;                                     ///< see Plasticity [1/s]
  double most_plastic = std::numeric_limits<double>::infinity();  ///< see Plasticity
  bool free = false;                                              ///< remove all supports
  std::optional<double> floor{};      ///< height along z, in the plane y; empty: no floor [m]
  std::optional<AxisBox> room{};      ///< box that contains the body: walls and a floor, no lid
  std::optional<AxisBox> obstacle{};  ///< box that the body stays out of
  double wall_friction = 0.5;         ///< Coulomb coefficient of all walls

  bool operator==(const LiveSettings&) const = default;
};

/// Returns law, plasticity, damping and gravity of the settings, whose solver must be set.
LiveOptions live_options(const LiveSettings& settings);

/// Returns step, integrator and walls for a body of `dimension`. Throws Error for boxes whose corners are
/// swapped.
StepperOptions stepper_options(const LiveSettings& settings, int dimension);

}  // namespace palpate
