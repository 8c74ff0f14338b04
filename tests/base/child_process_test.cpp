// Work in a child process: its answer, its end, its limits.
#include "base/child_process.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <fstream>
#include <stdexcept>

#include "base/error.h"

namespace palpate::child_process_test {
namespace {

using namespace std::chrono_literals;

template <typename Work>
std::string error_of(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.where() + ": " + error.what() + " (" + error.hint() + ")";
  }
  ADD_FAILURE() << "no Error was thrown";
  return {};
}

void expect_mentions(const std::string& text, const std::vector<std::string>& pieces) {
  for (const std::string& piece : pieces) {
    EXPECT_NE(text.find(piece), std::string::npos) << "\"" << piece << "\" is not in: " << text;
  }
}

constexpr std::int64_t memory_limit = 512LL << 20;

ChildTask task(std::chrono::seconds clock = 280s) {
  return {.name = "TetGen", .where = "organ.off", .limits = {20s, clock, memory_limit}, .hint = "use less"};
}

std::string child_error(const std::function<ChildResult()>& work, const ChildTask& of = task()) {
  std::string text = error_of([&] { run_in_child(of, work); });
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a child was left";
  EXPECT_EQ(errno, ECHILD);
  return text;
}

TEST(ChildProcess, HandsBackALargeResult) {
  Bytes bytes(3'000'001);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<std::byte>(i * 2654435761U >> 13);
  }
  const ChildResult result = run_in_child(task(), [&] { return ChildResult{7, bytes}; });
  EXPECT_EQ(result.status, 7);
  EXPECT_EQ(result.bytes, bytes);
}

TEST(ChildProcess, CrashIsAnError) {
  expect_mentions(child_error([]() -> ChildResult { std::abort(); }),
                  {"organ.off: TetGen crashed (signal 6"});
  expect_mentions(child_error([]() -> ChildResult {
                    raise(SIGKILL);
                    return {};
                  }),
                  {"TetGen crashed (signal 9", "memory"});
}

TEST(ChildProcess, ExitIsAnError) {
  expect_mentions(child_error([]() -> ChildResult { _exit(0); }), {"TetGen gave up (exit status 0)"});
  expect_mentions(child_error([]() -> ChildResult { _exit(3); }), {"exit status 3"});
}

TEST(ChildProcess, ExceptionIsAnError) {
  expect_mentions(child_error([]() -> ChildResult { throw std::runtime_error("flat facet 12"); }),
                  {"flat facet 12"});
  expect_mentions(child_error([]() -> ChildResult { throw 3; }), {"TetGen failed"});
}

TEST(ChildProcess, EndlessWorkIsKilled) {
  expect_mentions(child_error(
                      []() -> ChildResult {
                        for (;;) {
                          pause();
                        }
                      },
                      task(1s)),
                  {"did not finish within 1 s"});
}

TEST(ChildProcess, EndlessCalculationIsKilled) {
  ChildTask short_task = task();  // of a busy machine it gets little
  short_task.limits.processor = 1s;
  expect_mentions(child_error(
                      []() -> ChildResult {
                        volatile bool forever = true;
                        while (forever) {
                        }
                        return {};
                      },
                      short_task),
                  {"did not finish within 1 s of the processor", "use less"});
}

TEST(ChildProcess, MemoryIsLimited) {
  const auto fill = [](std::int64_t bytes) {
    return [bytes]() -> ChildResult { return {0, Bytes(static_cast<std::size_t>(bytes), std::byte{1})}; };
  };
  EXPECT_EQ(run_in_child(task(), fill(1 << 20)).bytes.size(), 1U << 20);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // these end the program themselves
  expect_mentions(child_error(fill(2 * memory_limit)),
                  {"organ.off: TetGen needs more than 536 MB", "use less"});
#endif
}

TEST(ChildProcess, ErrorsArriveAsTheyWere) {
  const std::string text =
      child_error([]() -> ChildResult { throw Error("is open", "organ.off:7", "close the holes"); });
  EXPECT_EQ(text, "organ.off:7: is open (close the holes)");
}

TEST(ChildProcess, AHostThatReapsAllItsChildrenIsNoFault) {
  struct sigaction ignore {
  }, before{};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGCHLD, &ignore, &before);
  const ChildResult result = run_in_child(task(), [] { return ChildResult{3, {}}; });
  const std::string text = error_of([] { run_in_child(task(), []() -> ChildResult { std::abort(); }); });
  sigaction(SIGCHLD, &before, nullptr);
  EXPECT_EQ(result.status, 3);
  expect_mentions(text, {"TetGen crashed", "use less"});
}

TEST(ChildProcess, SignalsOfAHostProgramDoNotEndTheWait) {
  const pid_t parent = getpid();
  struct sigaction handler {
  }, before{};
  handler.sa_handler = [](int) {};
  sigaction(SIGUSR1, &handler, &before);
  ChildTask calm = task();
  calm.stop_at_signals = false;
  const ChildResult result = run_in_child(calm, [parent] {
    usleep(100'000);
    kill(parent, SIGUSR1);
    usleep(100'000);
    return ChildResult{5, {}};
  });
  sigaction(SIGUSR1, &before, nullptr);
  EXPECT_EQ(result.status, 5);
}

TEST(ChildProcess, TerminatedChildIsAnInterruption) {
  expect_mentions(child_error([]() -> ChildResult {
                    raise(SIGINT);
                    return {};
                  }),
                  {"interrupted"});
}

TEST(ChildProcess, ASignalToTheParentKillsTheChild) {
  const pid_t parent = getpid();
  struct sigaction handler {
  }, before{};
  handler.sa_handler = [](int) {};  // as a program that notes Ctrl-C and goes on
  handler.sa_flags = SA_RESTART;
  sigaction(SIGUSR1, &handler, &before);
  const std::string text = child_error([parent]() -> ChildResult {
    usleep(100'000);
    kill(parent, SIGUSR1);
    for (;;) {
      pause();
    }
  });
  sigaction(SIGUSR1, &before, nullptr);
  expect_mentions(text, {"interrupted"});
}

TEST(ChildProcess, CannotLeaveFiles) {
  const ChildResult result = run_in_child(task(), [] {
    std::ofstream dump("dump-of-a-library");
    return ChildResult{dump ? 1 : 0, {}};
  });
  EXPECT_EQ(result.status, 0);
}

}  // namespace
}  // namespace palpate::child_process_test
