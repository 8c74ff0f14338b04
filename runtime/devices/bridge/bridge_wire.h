/* The two messages of a bridge, each one packet with the memory layout of its struct. C99 and C++; SI units;
 * axes: x right, y away from the user, z up. docs/reference/devices-protocol.md has the offsets for other
 * languages. */
#ifndef PALPATE_BRIDGE_WIRE_H
#define PALPATE_BRIDGE_WIRE_H

#include <stdint.h>

/* NOLINTBEGIN(readability-identifier-naming): names of C */
enum { BRIDGE_VERSION = 3 };
enum { BRIDGE_BUTTONS = 0xFFFF, BRIDGE_IN_USE = 1 << 16, BRIDGE_DEVICE_FAULT = 1 << 17 };
enum { BRIDGE_ZERO = 0, BRIDGE_FORCE = 1, BRIDGE_LOCAL_MODEL = 2 };

/* From the device to the runtime, 112 bytes. */
struct bridge_state {
  char magic[4]; /* "PLPS" */
  uint32_t version;
  uint32_t sequence;               /* incremented with each message */
  uint32_t flags;                  /* bits 0-15 buttons (0 grabs), BRIDGE_IN_USE, BRIDGE_DEVICE_FAULT */
  uint64_t time;                   /* time of reading the device, CLOCK_MONOTONIC [ns] */
  double position[3], velocity[3]; /* [m], [m/s] */
  float orientation[4];            /* w, x, y, z: of length 1 */
  float gripper;                   /* [rad] */
  float limits[5]; /* force [N], torque [N m], stiffness [N/m], damping [N s/m], radius [m]; 0: unknown */
};

/* From the runtime to the device, 128 bytes. */
struct bridge_command {
  char magic[4]; /* "PLPC" */
  uint32_t version;
  uint32_t answers;      /* sequence of the state that it was computed from */
  uint32_t mode;         /* BRIDGE_ZERO, BRIDGE_FORCE or BRIDGE_LOCAL_MODEL */
  uint64_t time;         /* time of sending, CLOCK_MONOTONIC [ns] */
  double force[3];       /* F, on the hand with the device at `point` [N] */
  double point[3];       /* x0 [m] */
  float torque[3];       /* T, on the hand [N m] */
  float stiffness[6];    /* K: xx, yy, zz, xy, yz, zx [N/m] */
  float damping;         /* b [N s/m] */
  float radius;          /* radius of validity of the model about x0 [m] */
  float max_force;       /* 0: unlimited [N] */
  uint16_t time_to_live; /* time from arrival for which it is displayed in full [ms] */
  uint16_t fade;         /* time to fade out after that [ms] */
  uint32_t zero;
};
/* NOLINTEND(readability-identifier-naming) */

#endif
