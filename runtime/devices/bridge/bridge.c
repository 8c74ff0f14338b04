/* Example of a bridge: this process drives the device, palpate-runtime the body; they communicate through a
 * Unix socket. The device is a simulated hand, a mass drawn to a target by a spring and a damper. For your
 * own, replace the four device_ functions by calls of your SDK; if the SDK calls you a thousand times per
 * second, call bridge_cycle from there: docs/devices.md. Build: cc bridge.c -lm -o bridge
 * Usage: bridge [--socket FILE] [--rate 1000 Hz] [--seconds 10] [--from X,Y,Z m] [--to X,Y,Z m] [--period 0
 * s] The target moves from `from` to `to` and back once per period (0: it stays). Without --to it moves
 * straight down until the hand feels 0.5 N, at most to the workspace's end, and up again. The bridge must run
 * as the runtime's user; it then finds the socket itself. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "bridge_force.h"

static double seconds_now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* --- the device; yours goes here --- */

static double from[3] = {0.0, 0.0, 0.0}, to[3] = {0.0, 0.0, 0.0}, period = 0.0;
static int has_to = 0;
static struct {
  double x[3], v[3], force[3], start, last, down;
  int rises;
} hand;
static const float limits[5] = {8.0f, 0.0f, 2000.0f, 20.0f, 0.15f};

/* Depth of the target below `from` while it searches for a body [m]. */
static double probing_depth(double dt) {
  const double speed = 0.04, enough = 0.5, most = (double)limits[4]; /* m/s, N, m */
  if (hand.down >= most || hand.force[2] >= enough) hand.rises = 1;
  if (hand.down <= 0.0) hand.rises = 0;
  return hand.down = fmin(fmax(hand.down + (hand.rises ? -speed : speed) * dt, 0.0), most);
}

/* Returns 0, or another number if there is no device. */
static int device_open(void) {
  memcpy(hand.x, from, sizeof hand.x);
  hand.start = hand.last = seconds_now();
  return 0;
}

static void device_read(struct bridge_state* state) {
  const double mass = 0.15, damper = 8.0, spring = 300.0; /* kg, N s/m, N/m: a relaxed hand */
  const double now = seconds_now(), dt = fmin(now - hand.last, 0.005);
  const double way = period > 0.0 ? 0.5 - 0.5 * cos(2.0 * acos(-1.0) * (now - hand.start) / period) : 0.0;
  const double target[3] = {has_to ? from[0] + way * (to[0] - from[0]) : from[0],
                            has_to ? from[1] + way * (to[1] - from[1]) : from[1],
                            has_to ? from[2] + way * (to[2] - from[2]) : from[2] - probing_depth(dt)};
  *state = (struct bridge_state){.flags = BRIDGE_IN_USE, .orientation = {1.0f, 0.0f, 0.0f, 0.0f}};
  memcpy(state->limits, limits, sizeof limits);
  for (int k = 0; k < 3; ++k) {
    const double pull = spring * (target[k] - hand.x[k]) - damper * hand.v[k];
    hand.v[k] += dt * (pull + hand.force[k]) / mass;
    hand.x[k] += dt * hand.v[k];
    state->position[k] = hand.x[k];
    state->velocity[k] = hand.v[k];
  }
  hand.last = now;
}

static void device_show(const double force[3], const double torque[3]) {
  memcpy(hand.force, force, sizeof hand.force);
  (void)torque; /* this device has no motors for it */
}

static void device_close(void) {
  const double none[3] = {0.0, 0.0, 0.0};
  device_show(none, none);
}

/* --- the bridge --- */

/* Finds palpate/bridge.socket in the first of these folders that is set, as the runtime does. */
static void find_socket(char* path, size_t size) {
  const char *runtime = getenv("XDG_RUNTIME_DIR"), *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
  const char* folder = runtime != NULL && *runtime == '/' ? runtime
                       : state != NULL && *state == '/'   ? state
                                                          : home;
  snprintf(path, size, "%s%s/palpate/bridge.socket", folder != NULL ? folder : "",
           folder == home ? "/.local/state" : "");
}

static int wire = -1;
static struct sockaddr_un runtime = {.sun_family = AF_UNIX};
static double asked = 0.0; /* time of the last attempt to connect [s] */
static uint32_t said = 0;
static struct bridge_command command;
static double arrived; /* time of arrival of the command [s] */
static unsigned long commands = 0;

/* Tries to connect, at most five times per second. */
static void bridge_connect(void) {
  if (seconds_now() - asked < 0.2) return;
  asked = seconds_now();
  wire = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0);
  if (connect(wire, (const struct sockaddr*)&runtime, sizeof runtime) == 0) return;
  close(wire);
  wire = -1;
}

/* Sends the state and receives the latest command. */
static void bridge_exchange(const struct bridge_state* state) {
  struct bridge_command next;
  send(wire, state, sizeof *state, MSG_DONTWAIT | MSG_NOSIGNAL);
  for (;;) {
    const ssize_t size = recv(wire, &next, sizeof next, MSG_DONTWAIT | MSG_TRUNC);
    if (size < 0 && errno == ECONNRESET) continue; /* reported once; earlier messages are still there */
    if (size < 0) return;
    if (size == 0) break;
    if (size != (ssize_t)sizeof next || memcmp(next.magic, "PLPC", 4) != 0 || next.version != BRIDGE_VERSION)
      continue;
    command = next;
    arrived = seconds_now();
    ++commands;
  }
  close(wire); /* the runtime has gone: its last command expires, and it may return */
  wire = -1;
}

/* Reads the device, sends its state and displays the latest command. Never waits. */
static void bridge_cycle(struct bridge_state* state, double force[3]) {
  const uint64_t now = (uint64_t)(1e9 * seconds_now());
  device_read(state);
  memcpy(state->magic, "PLPS", 4);
  state->version = BRIDGE_VERSION;
  state->sequence = ++said;
  state->time = now;
  if (wire < 0) bridge_connect();
  if (wire >= 0) bridge_exchange(state);
  const double age = seconds_now() - arrived;
  double torque[3];
  bridge_force(&command, state->position, state->velocity, age, state->limits[0], force);
  bridge_torque(&command, age, state->limits[1], torque);
  device_show(force, torque);
}

static volatile sig_atomic_t stopped = 0;
static void stop(int number) {
  (void)number;
  stopped = 1;
}

struct options {
  double rate, seconds;
  const char* socket;
};

/* Returns 0 if the options are invalid. */
static int read_options(int argc, char** argv, struct options* options) {
  int bad = argc % 2 == 0;
  for (int k = 1; k + 1 < argc; k += 2) {
    const char *option = argv[k], *value = argv[k + 1];
    double* place = strcmp(option, "--from") == 0 ? from : strcmp(option, "--to") == 0 ? to : NULL;
    double* number = strcmp(option, "--rate") == 0      ? &options->rate
                     : strcmp(option, "--seconds") == 0 ? &options->seconds
                     : strcmp(option, "--period") == 0  ? &period
                                                        : NULL;
    has_to |= place == to;
    if (place != NULL)
      bad |= sscanf(value, "%lf,%lf,%lf", &place[0], &place[1], &place[2]) != 3;
    else if (number != NULL)
      *number = atof(value);
    else if (strcmp(option, "--socket") == 0)
      options->socket = value;
    else
      bad = 1;
  }
  return !bad && options->rate > 0.0;
}

int main(int argc, char** argv) {
  char socket_file[4096];
  find_socket(socket_file, sizeof socket_file);
  struct options options = {.rate = 1000.0, .seconds = 10.0, .socket = socket_file};
  if (!read_options(argc, argv, &options)) return fputs("usage: see the top of bridge.c\n", stderr), 2;
  if (snprintf(runtime.sun_path, sizeof runtime.sun_path, "%s", options.socket) >=
      (int)sizeof runtime.sun_path)
    return fprintf(stderr, "bridge: the name of the socket is too long: %s\n", options.socket), 2;
  if (device_open() != 0) return fputs("bridge: there is no device\n", stderr), 1;
  signal(SIGINT, stop);
  signal(SIGTERM, stop);

  const double start = seconds_now();
  double now = start, due = start, printed = start, largest = 0.0, late = 0.0, latest = 0.0;
  unsigned long cycles = 0;
  while (!stopped && now - start < options.seconds) {
    struct bridge_state state;
    double force[3];
    bridge_cycle(&state, force);
    largest = fmax(largest, sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]));
    ++cycles;
    due = fmax(due + 1.0 / options.rate, seconds_now()); /* missed cycles are not made up in a burst */
    const struct timespec wake = {(time_t)due, (long)(1e9 * (due - floor(due)))};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, NULL);
    now = seconds_now();
    late += now - due;
    latest = fmax(latest, now - due);
    if (now - printed < 1.0) continue;
    printed = now;
    printf("%4.0f s  %5.0f Hz  at %8.5f %8.5f %8.5f m  force %7.3f %7.3f %7.3f N  %lu commands\n",
           now - start, (double)cycles / (now - start), state.position[0], state.position[1],
           state.position[2], force[0], force[1], force[2], commands);
    fflush(stdout);
  }
  device_close();
  if (commands == 0)
    printf(
        "no runtime answered: is one there (palpate-runtime play MODEL --device bridge), of the same user, "
        "at %s?\n",
        runtime.sun_path);
  else if (!(largest > 0.0))
    printf("no force was ever felt: the tool did not touch the body, or the runtime holds a fault\n");
  printf("rate %.1f Hz, largest force %.3f N, late by %.1f us (mean), %.1f us (most), %lu commands\n",
         (double)cycles / (now - start), largest, 1e6 * late / (double)cycles, 1e6 * latest, commands);
  return 0;
}
