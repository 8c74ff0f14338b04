// Signals while a file is being made.
#include "base/interrupt.h"

#include <gtest/gtest.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <functional>
#include <string>

namespace palpate::interrupt_test {
namespace {

/// How a process ends that does `work` after all of its signals were noted only, and what it says.
struct End {
  int status = 0;
  std::string said;
};

End end_of(const std::string& text, const std::function<void(const InterruptGuard&)>& work) {
  std::array<int, 2> pipe{};
  EXPECT_EQ(::pipe(pipe.data()), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(pipe[1], STDERR_FILENO);
    InterruptGuard guard;
    guard.note_from_now_on(text);
    work(guard);
    ::_exit(guard.requested() ? 7 : 8);
  }
  ::close(pipe[1]);
  End end;
  std::array<char, 256> bytes{};
  for (ssize_t size = 0; (size = ::read(pipe[0], bytes.data(), bytes.size())) > 0;)
    end.said.append(bytes.data(), static_cast<std::size_t>(size));
  ::close(pipe[0]);
  ::waitpid(child, &end.status, 0);
  return end;
}

/// As a library that never comes back.
[[noreturn]] void hang() {
  for (volatile bool forever = true; forever;) {
  }
  ::_exit(9);
}

TEST(Interrupt, WhatHangsIsEnded) {
  for (const int signal : {SIGINT, SIGTERM}) {
    const End end = end_of("interrupted: the columns are kept", [&](const InterruptGuard&) {
      ::raise(signal);
      hang();
    });
    ASSERT_TRUE(WIFEXITED(end.status));
    EXPECT_EQ(WEXITSTATUS(end.status), 130);
    EXPECT_EQ(end.said, "\ninterrupted: the columns are kept\n");
  }
}

TEST(Interrupt, WhatEndsByItselfIsLeftAlone) {
  for (const int signal : {SIGINT, SIGTERM, SIGUSR1}) {
    const End end = end_of("text", [&](const InterruptGuard&) { ::raise(signal); });
    EXPECT_EQ(WEXITSTATUS(end.status), 7);
    EXPECT_EQ(end.said, "");
  }
}

/// A batch system's signal, and ranks, have their time.
TEST(Interrupt, TimeRunsForSomeOnly) {
  const auto has_time = [](const std::string& text, int signal) {
    return WEXITSTATUS(end_of(text, [&](const InterruptGuard&) {
                         ::raise(signal);
                         itimerval left{};
                         ::getitimer(ITIMER_REAL, &left);
                         if (left.it_value.tv_sec == 0 && left.it_value.tv_usec == 0) ::_exit(3);
                       }).status) == 3;
  };
  EXPECT_FALSE(has_time("text", SIGTERM));
  EXPECT_TRUE(has_time("text", SIGUSR1));
  EXPECT_TRUE(has_time("", SIGTERM));
}

}  // namespace
}  // namespace palpate::interrupt_test
