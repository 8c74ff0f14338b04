/* A ball goes down on a body, a thousand times a second, in a loop of your own. */
#define _POSIX_C_SOURCE 200809L
#include <palpate.h>
#include <stdio.h>
#include <time.h>

int main(void) {
  char error[4096];
  palpate_tool tool = PALPATE_TOOL_INIT;
  tool.radius = 0.01;
  palpate_session* session = palpate_create("block.palpate.hdf", &tool, 1, 32, error, sizeof error);
  palpate_record_options recorded = PALPATE_RECORD_OPTIONS_INIT;
  if (session == NULL || palpate_record(session, "loop.mcap", &recorded, error, sizeof error) != PALPATE_OK)
    return fputs(error, stderr), 1;

  palpate_pose pose = PALPATE_POSE_INIT;
  palpate_result felt = PALPATE_RESULT_INIT;
  struct timespec due;
  clock_gettime(CLOCK_MONOTONIC, &due);
  for (int tick = 0; tick <= 420; ++tick) {
    due.tv_nsec += 1000000; /* absolute times do not drift */
    if (due.tv_nsec >= 1000000000) due.tv_nsec -= 1000000000, ++due.tv_sec;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);

    pose.position[0] = pose.position[1] = 0.03; /* read your device here */
    pose.position[2] = 0.0402 - 0.00001 * tick;
    palpate_step(session, &pose);
    palpate_get(session, 0, &felt); /* and give it felt.force */
    if (tick % 70 == 0) printf("%3d ms: %.6f N, %d contacts\n", tick, felt.force[2], felt.contacts);
  }
  const int failed = palpate_record_end(session, error, sizeof error) != PALPATE_OK;
  palpate_destroy(session);
  return failed;
}
