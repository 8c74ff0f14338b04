/* The two datagrams of a bridge, for C99 and C++: runtime/devices/bridge/bridge_datagram.h says what they
 * are. */
#ifndef PALPATE_BRIDGE_WIRE_H
#define PALPATE_BRIDGE_WIRE_H

#include <string.h>

#include "bridge_force.h"
#include "bridge_seal.h"

enum { BRIDGE_VERSION = 2, BRIDGE_STATE_BYTES = 128, BRIDGE_COMMAND_BYTES = 160 };
enum { BRIDGE_IN_USE = 1 << 16, BRIDGE_DEVICE_FAULT = 1 << 17 };

/* What a device says: x right, y from the user, z up. */
struct bridge_reading {
  double x[3], v[3];    /* [m], [m/s] */
  float orientation[4]; /* w, x, y, z: of length 1 */
  float gripper;        /* [rad] */
  float limits[5]; /* force [N], torque [N m], stiffness [N/m], damping [N s/m], radius [m]; 0: not said */
  uint32_t flags;  /* bits 0-15 buttons (0 grabs), BRIDGE_IN_USE, BRIDGE_DEVICE_FAULT */
};

/* Which session we are in: all 0 to begin with, but for the key. */
struct bridge_session {
  uint8_t key[BRIDGE_KEY_BYTES]; /* that the runtime has written for us */
  uint64_t nonce;
  uint32_t said, heard; /* numbers of the last state and of the last command */
};

/* Low byte first. */
static inline void bridge_put(uint8_t* at, int bytes, uint64_t value) {
  for (int k = 0; k < bytes; ++k) at[k] = (uint8_t)(value >> (8 * k));
}

static inline uint64_t bridge_get(const uint8_t* at, int bytes) {
  uint64_t value = 0;
  for (int k = 0; k < bytes; ++k) value |= (uint64_t)at[k] << (8 * k);
  return value;
}

static inline void bridge_put_float(uint8_t* at, float value) {
  uint32_t bits;
  memcpy(&bits, &value, 4);
  bridge_put(at, 4, bits);
}

static inline void bridge_put_double(uint8_t* at, double value) {
  uint64_t bits;
  memcpy(&bits, &value, 8);
  bridge_put(at, 8, bits);
}

static inline double bridge_get_float(const uint8_t* at) {
  const uint32_t bits = (uint32_t)bridge_get(at, 4);
  float value;
  memcpy(&value, &bits, 4);
  return value;
}

static inline double bridge_get_double(const uint8_t* at) {
  const uint64_t bits = bridge_get(at, 8);
  double value;
  memcpy(&value, &bits, 8);
  return value;
}

/* The next state; `time` by a monotonic clock [ns]. */
static inline void bridge_encode_state(uint8_t at[BRIDGE_STATE_BYTES], const struct bridge_reading* reading,
                                       struct bridge_session* session, uint64_t time) {
  memset(at, 0, BRIDGE_STATE_BYTES);
  memcpy(at, "PLPS", 4);
  bridge_put(at + 4, 2, BRIDGE_VERSION);
  bridge_put(at + 6, 2, BRIDGE_STATE_BYTES);
  bridge_put(at + 8, 8, session->nonce);
  bridge_put(at + 16, 4, ++session->said);
  bridge_put(at + 20, 4, reading->flags);
  bridge_put(at + 24, 8, time);
  for (int k = 0; k < 3; ++k) {
    bridge_put_double(at + 32 + 8 * k, reading->x[k]);
    bridge_put_double(at + 56 + 8 * k, reading->v[k]);
  }
  for (int k = 0; k < 4; ++k) bridge_put_float(at + 80 + 4 * k, reading->orientation[k]);
  bridge_put_float(at + 96, reading->gripper);
  for (int k = 0; k < 5; ++k) bridge_put_float(at + 100 + 4 * k, reading->limits[k]);
  bridge_seal(session->key, at, BRIDGE_STATE_BYTES);
}

/* Fills `command` with one of our session that is ahead of the last one, and from the runtime that wrote our
 * key; otherwise returns 0. A command without force of another session is that of a runtime that has just
 * begun, or has given us up: we join it. */
static inline int bridge_decode_command(const uint8_t* at, long size, struct bridge_session* session,
                                        struct bridge_command* command) {
  if (size != BRIDGE_COMMAND_BYTES || memcmp(at, "PLPC", 4) != 0 || bridge_get(at + 4, 2) != BRIDGE_VERSION ||
      bridge_get(at + 6, 2) != BRIDGE_COMMAND_BYTES ||
      !bridge_is_sealed(session->key, at, BRIDGE_COMMAND_BYTES))
    return 0;
  const uint64_t nonce = bridge_get(at + 8, 8);
  const uint32_t number = (uint32_t)bridge_get(at + 16, 4), mode = (uint32_t)bridge_get(at + 32, 4);
  if (mode > BRIDGE_LOCAL_MODEL) return 0;
  if (nonce == session->nonce ? (int32_t)(number - session->heard) <= 0 : mode != BRIDGE_ZERO) return 0;
  session->nonce = nonce;
  session->heard = number;
  command->mode = mode;
  command->damping = bridge_get_float(at + 36);
  for (int k = 0; k < 3; ++k) {
    command->force[k] = bridge_get_double(at + 40 + 8 * k);
    command->point[k] = bridge_get_double(at + 64 + 8 * k);
    command->torque[k] = bridge_get_float(at + 88 + 4 * k);
  }
  for (int k = 0; k < 6; ++k) command->stiffness[k] = bridge_get_float(at + 100 + 4 * k);
  command->radius = bridge_get_float(at + 124);
  command->time_to_live = 1e-3 * (double)bridge_get(at + 128, 2);
  command->fade = 1e-3 * (double)bridge_get(at + 130, 2);
  command->max_force = bridge_get_float(at + 132);
  return 1;
}

#endif
