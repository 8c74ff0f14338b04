// Bounds of the safety layer, each with its name, unit, range and meaning.
#pragma once

#include <string_view>

#include "base/number_range.h"
#include "runtime/safety/buzz_detector.h"
#include "runtime/safety/deadline_watch.h"
#include "runtime/safety/silence_watch.h"
#include "runtime/safety/stale_solution.h"

namespace palpate {

/// Safety bounds in SI units. A lower limit of the device takes precedence. A large value disables a bound.
struct SafetyOptions {
  double period = 0.001;          ///< period of the loop [s]
  double max_force = 3.0;         ///< [N]; the weakest hand-held device displays 3.3 (Touch)
  double max_torque = 0.1;        ///< [N m]; half that of a sigma.7
  double max_force_rate = 500.0;  ///< [N/s]; a wall of 1000 N/m hit at 0.5 m/s
  double max_torque_rate = 10.0;  ///< [N m/s]; the same wall at a lever of 2 cm
  double max_stiffness = 2000.0;  ///< stiffness of the local model [N/m]; that of a Polhem v3, between
                                  ///< Touch's 400 and omega's 5000
  double max_damping = 5.0;       ///< damping added by the passivity controller [N s/m]: K T / 2 of 10 kN/m
                                  ///< (Colgate and Brown); 0: it only observes
  double max_speed = 1.0;         ///< speed of the device [m/s]; palpation stays below 0.3
  double ramp = 1.0;              ///< time from no to full force [s]; CHAI3D takes 2
  double small_force = 0.1;       ///< force below which the gate may open [N]
  double calm_time = 0.01;        ///< time for which the force must have been that small [s]
  DeadlineOptions deadline{};
  SilenceOptions silence{};
  StaleOptions stale{};
  BuzzOptions buzz{};
};

/// Description of a bound for `--safety`, its help and the documentation.
struct SafetyField {
  std::string_view name;
  std::string_view unit;
  NumberRange range;
  std::string_view meaning;
};

/// Calls visit(field, number) for each bound; the number is a double or an int. The period is not a bound: it
/// follows from the loop rate. A new member of the options must be named here, otherwise this does not
/// compile.
template <class SomeOptions, class Visitor>
void for_each_safety_field(SomeOptions&& options, Visitor&& visit) {
  auto& [period, max_force, max_torque, max_force_rate, max_torque_rate, max_stiffness, max_damping,
         max_speed, ramp, small_force, calm_time, deadline, silence, stale, buzz] = options;
  auto& [late, late_fade, late_recovery, most_late, forgiveness] = deadline;
  auto& [silent, silence_fade, frozen, frozen_force] = silence;
  auto& [fresh, stale_life, stale_fade, stale_damping] = stale;
  auto& [buzz_speed, buzz_force, buzz_mean, buzz_window, buzz_flips, buzz_fade, buzz_recovery] = buzz;
  constexpr NumberRange positive = positive_number, from_zero = number_from_zero;
  constexpr NumberRange count{1.0, 1e9, true, true, "a whole number from 1 on"};
  using F = SafetyField;
  visit(F{"max_force", "N", from_zero, "largest force on the hand"}, max_force);
  visit(F{"max_torque", "N m", from_zero, "largest torque on the hand"}, max_torque);
  visit(F{"max_force_rate", "N/s", from_zero, "fastest change of the force"}, max_force_rate);
  visit(F{"max_torque_rate", "N m/s", from_zero, "fastest change of the torque"}, max_torque_rate);
  visit(F{"max_stiffness", "N/m", from_zero, "largest stiffness of the local model"}, max_stiffness);
  visit(F{"max_damping", "N s/m", from_zero,
          "largest damping that the passivity controller adds; 0: it only observes"},
        max_damping);
  visit(F{"max_speed", "m/s", from_zero, "largest speed of the device; faster is a fault"}, max_speed);
  visit(F{"ramp", "s", from_zero, "time from no force to full force, at the start and after a fault"}, ramp);
  visit(F{"small_force", "N", from_zero, "force starts only after it would have been below this"},
        small_force);
  visit(F{"calm_time", "s", from_zero, "for at least this long"}, calm_time);
  visit(F{"late", "s", from_zero, "a tick that starts this much late is a miss"}, late);
  visit(F{"late_fade", "s", positive, "time to fade out while ticks are late"}, late_fade);
  visit(F{"late_recovery", "s", positive, "time to fade back in once they are on time"}, late_recovery);
  visit(F{"most_late", "ticks", positive, "number of misses that is a fault"}, most_late);
  visit(F{"forgiveness", "ticks", from_zero, "misses forgiven per tick that is on time"}, forgiveness);
  visit(F{"silence", "s", positive, "time without a device report that is a fault"}, silent);
  visit(F{"silence_fade", "s", from_zero,
          "time without a report after which the force fades; it is gone at silence"},
        silence_fade);
  visit(F{"frozen", "s", positive, "time with the same numbers in every report that is a fault"}, frozen);
  visit(F{"frozen_force", "N", from_zero, "but only while the force is above this"}, frozen_force);
  visit(F{"stale", "s", from_zero, "age up to which a solution counts as current"}, fresh);
  visit(F{"stale_life", "s", from_zero, "age up to which an older solution is extrapolated"}, stale_life);
  visit(F{"stale_fade", "s", positive, "time to fade out after that"}, stale_fade);
  visit(F{"stale_damping", "N s/m", from_zero, "damping added to a solution that is extrapolated"},
        stale_damping);
  visit(F{"buzz_speed", "m/s", from_zero, "amplitude of the device speed that counts as buzzing"},
        buzz_speed);
  visit(F{"buzz_force", "N", from_zero, "amplitude of the force about its mean that counts as buzzing"},
        buzz_force);
  visit(F{"buzz_mean", "s", positive, "averaging time of that mean"}, buzz_mean);
  visit(F{"buzz_window", "s", positive, "time window in which sign changes are counted"}, buzz_window);
  visit(F{"buzz_flips", "", count, "sign changes in the window that are buzzing"}, buzz_flips);
  visit(F{"buzz_fade", "s", positive, "time to fade out while it buzzes; then a fault"}, buzz_fade);
  visit(F{"buzz_recovery", "s", positive, "time to fade back in once it has stopped"}, buzz_recovery);
}

}  // namespace palpate
