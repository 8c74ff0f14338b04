/* The example's forces to the last digit: one line for each tick. */
#include <palpate.h>
#include <stdio.h>

static int get_and_print(const palpate_session* session, int tool, palpate_result* felt) {
  const int code = palpate_get(session, tool, felt);
  printf("%.17g %.17g %.17g %d\n", felt->force[0], felt->force[1], felt->force[2], felt->contacts);
  return code;
}

#define palpate_get get_and_print
#include "../../../runtime/library/example/own_loop.c"
