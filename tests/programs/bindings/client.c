/* Plays poses through palpate.h, and records them if a second file is named: a line `x y z qw qx qy qz grab`
 * a tick on standard input; status and the bits of force and torque on standard output; at the end what a
 * tick cost, in nanoseconds: median and 99.9
 * %. */
#define _POSIX_C_SOURCE 200809L
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "palpate.h"

static int64_t now(void) {
  struct timespec time;
  clock_gettime(CLOCK_MONOTONIC, &time);
  return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static int by_size(const void* a, const void* b) {
  const int64_t x = *(const int64_t*)a, y = *(const int64_t*)b;
  return (x > y) - (x < y);
}

static void print(const double* xyz) {
  for (int k = 0; k < 3; ++k) {
    uint64_t bits;
    memcpy(&bits, xyz + k, sizeof bits);
    printf(" %016" PRIx64, bits);
  }
}

int main(int count, char** words) {
  char error[4096];
  palpate_tool tool = PALPATE_TOOL_INIT;
  tool.radius = 0.1;
  tool.friction = 0.3;
  tool.coupling_stiffness = 500.0;
  palpate_session* session = palpate_create(count > 1 ? words[1] : NULL, &tool, 1, 32, error, sizeof error);
  if (session == NULL) {
    fputs(error, stderr);
    return 1;
  }
  const palpate_record_options recorded = PALPATE_RECORD_OPTIONS_INIT;
  if (count > 2 && palpate_record(session, words[2], &recorded, error, sizeof error) != PALPATE_OK) {
    fputs(error, stderr);
    return 1;
  }
  static int64_t times[1 << 20];
  size_t ticks = 0;
  palpate_pose pose = PALPATE_POSE_INIT;
  palpate_result felt = PALPATE_RESULT_INIT;
  double *p = pose.position, *q = pose.orientation;
  while (scanf("%lf%lf%lf%lf%lf%lf%lf%d", p, p + 1, p + 2, q, q + 1, q + 2, q + 3, &pose.grab) == 8 &&
         ticks < sizeof times / sizeof times[0]) {
    const int64_t begin = now();
    const uint32_t status = palpate_step(session, &pose);
    palpate_get(session, 0, &felt);
    palpate_contact touched = PALPATE_CONTACT_INIT;
    int contacts = 0;
    palpate_get_contacts(session, 0, &touched, 1, &contacts);
    times[ticks++] = now() - begin;
    printf("%" PRIu32, status);
    print(felt.force);
    print(felt.torque);
    print(touched.position);
    print(touched.normal);
    putchar('\n');
  }
  if (count > 2 && palpate_record_end(session, error, sizeof error) != PALPATE_OK) {
    fputs(error, stderr);
    return 1;
  }
  palpate_destroy(session);
  qsort(times, ticks, sizeof times[0], by_size);
  if (ticks > 0) printf("# %" PRId64 " %" PRId64 "\n", times[ticks / 2], times[(ticks - 1) * 999 / 1000]);
  return 0;
}
