/* A device behind a bridge: this process has the device, palpate-runtime the body; they speak by UDP over
 * loopback. As it stands the device is a simulated hand, a mass that a spring and a damper draw to a target.
 * For yours replace the four device_ functions by calls of your SDK, and where it calls you a thousand times
 * a second, let it call bridge_cycle: docs/devices.md. Build: cc bridge.c -lm -o bridge
 * Usage: bridge [--address 127.0.0.1] [--port 4270] [--key FILE] [--rate 1000 Hz] [--seconds 10]
 *               [--from X,Y,Z m] [--to X,Y,Z m] [--period 0 s]
 * The target goes from `from` to `to` and back once a period (0: it stays). Without --to it goes straight
 * down until the hand feels 0.5 N, at most to the workspace's end, and up again. The runtime writes the key
 * into a file of its user's, where we find it ourselves if we are the same user's, on the same machine. */
#define _POSIX_C_SOURCE 200809L
#include <arpa/inet.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "bridge_wire.h"

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

/* How far below `from` the target is that looks for a body [m]. */
static double probing_depth(double dt) {
  const double speed = 0.04, enough = 0.5, most = (double)limits[4]; /* m/s, N, m */
  if (hand.down >= most || hand.force[2] >= enough) hand.rises = 1;
  if (hand.down <= 0.0) hand.rises = 0;
  return hand.down = fmin(fmax(hand.down + (hand.rises ? -speed : speed) * dt, 0.0), most);
}

/* Not 0: there is none. */
static int device_open(void) {
  memcpy(hand.x, from, sizeof hand.x);
  hand.start = hand.last = seconds_now();
  return 0;
}

static void device_read(struct bridge_reading* reading) {
  const double mass = 0.15, damper = 8.0, spring = 300.0; /* kg, N s/m, N/m: a relaxed hand */
  const double now = seconds_now(), dt = fmin(now - hand.last, 0.005);
  const double way = period > 0.0 ? 0.5 - 0.5 * cos(2.0 * acos(-1.0) * (now - hand.start) / period) : 0.0;
  const double target[3] = {has_to ? from[0] + way * (to[0] - from[0]) : from[0],
                            has_to ? from[1] + way * (to[1] - from[1]) : from[1],
                            has_to ? from[2] + way * (to[2] - from[2]) : from[2] - probing_depth(dt)};
  *reading = (struct bridge_reading){.orientation = {1.0f, 0.0f, 0.0f, 0.0f}, .flags = BRIDGE_IN_USE};
  memcpy(reading->limits, limits, sizeof limits);
  for (int k = 0; k < 3; ++k) {
    const double pull = spring * (target[k] - hand.x[k]) - damper * hand.v[k];
    hand.v[k] += dt * (pull + hand.force[k]) / mass;
    hand.x[k] += dt * hand.v[k];
    reading->x[k] = hand.x[k];
    reading->v[k] = hand.v[k];
  }
  hand.last = now;
}

static void device_show(const double force[3], const double torque[3]) {
  memcpy(hand.force, force, sizeof hand.force);
  (void)torque; /* this one has no motors for it */
}

static void device_close(void) {
  const double none[3] = {0.0, 0.0, 0.0};
  device_show(none, none);
}

/* --- the bridge --- */

/* palpate/bridge-PORT.key in the first of these folders that is set, as the runtime has it; not 0: not there.
 */
static int read_key(const char* file, unsigned port, uint8_t key[BRIDGE_KEY_BYTES]) {
  const char *runtime = getenv("XDG_RUNTIME_DIR"), *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
  const char* folder = runtime != NULL && *runtime == '/' ? runtime
                       : state != NULL && *state == '/'   ? state
                                                          : home;
  char found[4096];
  if (file == NULL) {
    snprintf(found, sizeof found, "%s%s/palpate/bridge-%u.key", folder != NULL ? folder : "",
             folder == home ? "/.local/state" : "", port);
    file = found;
  }
  FILE* stream = fopen(file, "r");
  if (stream == NULL) return -1;
  unsigned byte = 0;
  int bad = 0;
  for (int k = 0; k < BRIDGE_KEY_BYTES; ++k) {
    bad |= fscanf(stream, "%2x", &byte) != 1;
    key[k] = (uint8_t)byte;
  }
  fclose(stream);
  return bad;
}

static int wire;
static struct bridge_session session;
static struct bridge_command command;
static double arrived; /* the command [s] */
static unsigned long commands = 0;

/* Reads the device, tells the runtime, shows what it said last. Nothing here waits. */
static void bridge_cycle(struct bridge_reading* reading, double force[3]) {
  uint8_t bytes[BRIDGE_COMMAND_BYTES + 1];
  device_read(reading);
  bridge_encode_state(bytes, reading, &session, (uint64_t)(1e9 * seconds_now()));
  send(wire, bytes, BRIDGE_STATE_BYTES,
       MSG_DONTWAIT); /* refused while there is no runtime: we go on asking */
  for (ssize_t size; (size = recv(wire, bytes, sizeof bytes, MSG_DONTWAIT)) >= 0 || errno == ECONNREFUSED;) {
    if (!bridge_decode_command(bytes, size, &session, &command)) continue;
    arrived = seconds_now();
    ++commands;
  }
  const double age = seconds_now() - arrived;
  double torque[3];
  bridge_force(&command, reading->x, reading->v, age, reading->limits[0], force);
  bridge_torque(&command, age, reading->limits[1], torque);
  device_show(force, torque);
}

static volatile sig_atomic_t stopped = 0;
static void stop(int number) {
  (void)number;
  stopped = 1;
}

struct options {
  struct sockaddr_in runtime;
  double rate, seconds;
  const char* key_file;
};

/* 0 where they cannot be understood. */
static int read_options(int argc, char** argv, struct options* options) {
  int bad = argc % 2 == 0 || inet_pton(AF_INET, "127.0.0.1", &options->runtime.sin_addr) != 1;
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
    else if (strcmp(option, "--key") == 0)
      options->key_file = value;
    else if (strcmp(option, "--address") == 0)
      bad |= inet_pton(AF_INET, value, &options->runtime.sin_addr) != 1;
    else if (strcmp(option, "--port") == 0)
      options->runtime.sin_port = htons((uint16_t)atoi(value));
    else
      bad = 1;
  }
  return !bad && options->rate > 0.0;
}

int main(int argc, char** argv) {
  struct options options = {
      .runtime = {.sin_family = AF_INET, .sin_port = htons(4270)}, .rate = 1000.0, .seconds = 10.0};
  if (!read_options(argc, argv, &options)) return fputs("usage: see the top of bridge.c\n", stderr), 2;
  wire = socket(AF_INET, SOCK_DGRAM, 0);
  if (wire < 0 || connect(wire, (const struct sockaddr*)&options.runtime, sizeof options.runtime) != 0)
    return perror("bridge"), 1;
  if (device_open() != 0) return fputs("bridge: there is no device\n", stderr), 1;
  signal(SIGINT, stop);
  signal(SIGTERM, stop);

  const double start = seconds_now();
  double now = start, due = start, said = start, asked = 0.0, largest = 0.0, late = 0.0, latest = 0.0;
  unsigned long cycles = 0;
  while (!stopped && now - start < options.seconds) {
    struct bridge_reading reading;
    double force[3];
    if (now - fmax(arrived, asked) >
        0.2) { /* nobody speaks to us: perhaps a runtime with another key has begun */
      read_key(options.key_file, ntohs(options.runtime.sin_port), session.key);
      asked = now;
    }
    bridge_cycle(&reading, force);
    largest = fmax(largest, sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]));
    ++cycles;
    due = fmax(due + 1.0 / options.rate, seconds_now()); /* what is missed is not made good in a burst */
    const struct timespec wake = {(time_t)due, (long)(1e9 * (due - floor(due)))};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, NULL);
    now = seconds_now();
    late += now - due;
    latest = fmax(latest, now - due);
    if (now - said < 1.0) continue;
    said = now;
    printf("%4.0f s  %5.0f Hz  at %8.5f %8.5f %8.5f m  force %7.3f %7.3f %7.3f N  %lu commands\n",
           now - start, (double)cycles / (now - start), reading.x[0], reading.x[1], reading.x[2], force[0],
           force[1], force[2], commands);
    fflush(stdout);
  }
  device_close();
  if (commands == 0)
    printf(
        "no runtime answered: is one there (palpate-runtime play MODEL --device bridge), of the same user, "
        "on port %u?\n",
        (unsigned)ntohs(options.runtime.sin_port));
  else if (!(largest > 0.0))
    printf("no force was ever felt: the tool did not touch the body, or the runtime holds a fault\n");
  printf("rate %.1f Hz, largest force %.3f N, late by %.1f us (mean), %.1f us (most), %lu commands\n",
         (double)cycles / (now - start), largest, 1e6 * late / (double)cycles, 1e6 * latest, commands);
  return close(wire);
}
