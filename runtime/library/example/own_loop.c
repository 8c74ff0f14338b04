/* Palpate in your own loop: lowers a sphere of 5 mm onto the body, presses it 3 mm deep and rubs it back and
 * forth along x by 3 mm, for two seconds at 1 kHz. Usage: own_loop NAME.palpate.hdf */
#define _POSIX_C_SOURCE 200809L
#include <palpate.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* Starts half a millimetre above the surface's highest node, over the centre of its nodes. */
static void place_above(const palpate_session* session, double radius, double position[3]) {
  palpate_counts counts = PALPATE_COUNTS_INIT;
  palpate_surface_counts(session, &counts);
  const int nodes = counts.nodes;
  double* xyz = malloc(3 * sizeof(double) * (size_t)nodes);
  if (xyz == NULL) abort();
  palpate_surface_rest(session, xyz);
  position[2] = xyz[2];
  for (int node = 0; node < nodes; ++node) {
    position[0] += xyz[3 * node] / nodes;
    position[1] += xyz[3 * node + 1] / nodes;
    if (xyz[3 * node + 2] > position[2]) position[2] = xyz[3 * node + 2];
  }
  position[2] += radius + 0.0005;
  free(xyz);
}

/* Your loop would leave printing to another thread. */
static void print(int tick, const palpate_pose* pose, const palpate_result* felt, uint32_t status) {
  const double *x = pose->position, *f = felt->force;
  printf("%4d ms  at %.4f %.4f %.4f m  force %10.4g %10.4g %10.4g N  stiffness along z %10.4g N/m", tick,
         x[0], x[1], x[2], f[0], f[1], f[2], felt->local_stiffness[8]);
  for (uint32_t bit = 1; bit != 0; bit <<= 1)
    if ((status & bit) != 0) printf("  %s", palpate_status_name(bit));
  printf("\n");
}

int main(int argc, char** argv) {
  char error[512] = "usage: own_loop NAME.palpate.hdf\n";
  palpate_tool tool = PALPATE_TOOL_INIT;
  tool.radius = 0.005;
  tool.coupling_stiffness = 2000.0; /* limit of the device */
  tool.max_force = 5.0;
  palpate_session* session = argc == 2 ? palpate_create(argv[1], &tool, 1, 32, error, sizeof error) : NULL;
  if (session == NULL) return fputs(error, stderr), 1;

  palpate_pose pose = PALPATE_POSE_INIT; /* read it from your device */
  place_above(session, tool.radius, pose.position);
  double pressed = 0.0, rubbed = 0.0, stride = 0.00002; /* 20 mm/s */
  struct timespec due;
  clock_gettime(CLOCK_MONOTONIC, &due);
  for (int tick = 1; tick <= 2000; ++tick) {
    due.tv_nsec += 1000000;
    due.tv_sec += due.tv_nsec / 1000000000;
    due.tv_nsec %= 1000000000;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);

    palpate_result felt = PALPATE_RESULT_INIT;
    const uint32_t status = palpate_step(session, &pose);
    palpate_get(session, 0, &felt); /* send felt.force to your device */
    if (tick % 200 == 0) print(tick, &pose, &felt, status);

    if (pressed < 0.003) pose.position[2] -= 0.00005;
    if (pressed >= 0.003) {
      pose.position[0] += stride;
      rubbed += stride;
      if (rubbed > 0.003 || rubbed < 0.0) stride = -stride;
    }
    if (felt.contacts > 0) pressed += 0.00005;
  }
  palpate_destroy(session);
  return 0;
}
