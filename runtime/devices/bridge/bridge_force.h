/* Force and torque that a device displays for a command, at its own rate. C99 and C++; SI units. */
#ifndef PALPATE_BRIDGE_FORCE_H
#define PALPATE_BRIDGE_FORCE_H

#include <math.h>

#include "bridge_wire.h"

/* Factor on a command `age` [s] after its arrival: 1 during its time to live, then it fades to 0. */
static inline double bridge_share(const struct bridge_command* command, double age) {
  const double late = age - 1e-3 * command->time_to_live, fade = 1e-3 * command->fade;
  if (command->mode == BRIDGE_ZERO || command->mode > BRIDGE_LOCAL_MODEL) return 0.0;
  if (late <= 0.0) return 1.0;
  return late < fade ? 1.0 - late / fade : 0.0;
}

/* Shortens the vector to at most `most` (0: unlimited); sets it to zero if its length is not finite. */
static inline void bridge_clamp(double vector[3], double most) {
  const double length = sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
  const double share = most > 0.0 && length > most ? most / length : 1.0;
  for (int k = 0; k < 3; ++k) vector[k] = isfinite(length) ? share * vector[k] : 0.0;
}

/* Computes the force [N] on the hand at x [m] with velocity v [m/s]: F - K (x - x0) - b v, with x - x0 cut
 * to the radius; F alone without a local model. */
static inline void bridge_force(const struct bridge_command* command, const double x[3], const double v[3],
                                double age, double device_max_force, double force[3]) {
  const float* K = command->stiffness;
  const double share = bridge_share(command, age);
  double d[3] = {0.0, 0.0, 0.0}, b = 0.0;
  if (command->mode == BRIDGE_LOCAL_MODEL) {
    b = command->damping;
    for (int k = 0; k < 3; ++k) d[k] = x[k] - command->point[k];
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), radius = fmax(command->radius, 0.0);
    /* NOLINTNEXTLINE(modernize-loop-convert): C has no other */
    for (int k = 0; k < 3; ++k) d[k] *= length > radius ? radius / length : 1.0;
  }
  force[0] = share * (command->force[0] - (K[0] * d[0] + K[3] * d[1] + K[5] * d[2]) - b * v[0]);
  force[1] = share * (command->force[1] - (K[3] * d[0] + K[1] * d[1] + K[4] * d[2]) - b * v[1]);
  force[2] = share * (command->force[2] - (K[5] * d[0] + K[4] * d[1] + K[2] * d[2]) - b * v[2]);
  bridge_clamp(force, command->max_force);
  bridge_clamp(force, device_max_force);
}

/* Computes the torque on the hand [N m]. */
static inline void bridge_torque(const struct bridge_command* command, double age, double device_max_torque,
                                 double torque[3]) {
  for (int k = 0; k < 3; ++k) torque[k] = bridge_share(command, age) * command->torque[k];
  bridge_clamp(torque, device_max_torque);
}

#endif
