// Preloaded into a program (LD_PRELOAD), starts it many times after its libraries were loaded once: loading
// takes longer than a run on a small file. FORK_SERVER names two file descriptors, "in,out". A request is
// "bytes\n", then that many bytes: the folder to run in, the file there for what is said, the limit of memory
// [byte] (0: none) and the arguments, each ended by a zero byte. The answer is "pid\n" and, at the end,
// "status seconds-of-the-processor largest-resident-KiB\n".
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

typedef int Main(int, char**, char**);
typedef int Start(Main*, int, char**, void (*)(void), void (*)(void), void (*)(void), void*);

enum { most_bytes = 65536, most_arguments = 64 };

static Main* program;
static int in, out;

static char* next(char** at) {
  char* here = *at;
  *at += strlen(here) + 1;
  return here;
}

static int run(char* name, char* at, const char* end, char** environment) {
  close(in);
  close(out);
  setsid();
  const char* folder = next(&at);
  const char* said = next(&at);
  const rlim_t memory = strtoull(next(&at), NULL, 10);
  const struct rlimit limit = {memory, memory}, no_core = {0, 0};
  const int file = chdir(folder) == 0 ? open(said, O_RDWR | O_CREAT | O_TRUNC, 0600) : -1;
  if (file < 0 || dup2(file, 1) < 0 || dup2(file, 2) < 0 || close(file) != 0) _exit(126);
  if (memory > 0 && setrlimit(RLIMIT_AS, &limit) != 0) _exit(126);
  setrlimit(RLIMIT_CORE, &no_core);
  char* arguments[most_arguments] = {name};
  int count = 1;
  while (at < end && count < most_arguments - 1) arguments[count++] = next(&at);
  return program(count, arguments, environment);
}

static int serve(int count, char** arguments, char** environment) {
  (void)count;
  static char request[most_bytes + 1];
  FILE* requests = fdopen(in, "r");
  size_t bytes;
  while (fscanf(requests, "%zu", &bytes) == 1 && bytes <= most_bytes && fgetc(requests) == '\n' &&
         fread(request, 1, bytes, requests) == bytes) {
    const pid_t child = fork();
    if (child == 0) return run(arguments[0], request, request + bytes, environment);
    int status;
    struct rusage usage;
    dprintf(out, "%d\n", (int)child);
    if (child < 0 || wait4(child, &status, 0, &usage) < 0) return 1;
    const double seconds = (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                           1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    dprintf(out, "%d %.6f %ld\n", status, seconds, usage.ru_maxrss);
  }
  _exit(0);
}

// Where the C library enters the program.
int __libc_start_main(Main* main, int count, char** arguments, void (*init)(void), void (*fini)(void),
                      void (*of_loader)(void), void* stack) {
  program = main;
  if (sscanf(getenv("FORK_SERVER"), "%d,%d", &in, &out) != 2) _exit(126);
  unsetenv("LD_PRELOAD");
  unsetenv("FORK_SERVER");
  Start* start = (Start*)dlsym(RTLD_NEXT, "__libc_start_main");
  return start(serve, count, arguments, init, fini, of_loader, stack);
}
