// Work in a child process: its answer, its end, its limits.
#include "base/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "base/error.h"
#include "base/limits/child_seal.h"
#include "tests/support/forbidden_calls.h"

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

/// Two descriptors of a pipe: [0] reads.
struct Pipe {
  std::array<int, 2> ends{};
  Pipe() { EXPECT_EQ(pipe(ends.data()), 0); }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    for (const int end : ends) close(end);
  }
};

/// A handler of SIGUSR1, as a program has that notes a signal and goes on, and a thread that sends it to the
/// thread which made this, again and again from when `start` can be read on, so that one arrives in the wait.
/// Each is told in `sent`.
class Signals {
 public:
  Signals(int start, int sent) {
    struct sigaction handler {};
    handler.sa_handler = [](int) {};
    handler.sa_flags = SA_RESTART;
    sigaction(SIGUSR1, &handler, &before_);
    sender_ = std::thread([this, start, sent, to = pthread_self()] {
      char byte = 0;
      EXPECT_EQ(read(start, &byte, 1), 1);
      while (!done_) {
        pthread_kill(to, SIGUSR1);
        if (told_ < 100) told_ += static_cast<int>(write(sent, "s", 1));
        std::this_thread::yield();
      }
    });
  }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;
  ~Signals() {
    done_ = true;
    sender_.join();
    sigaction(SIGUSR1, &before_, nullptr);
  }

 private:
  struct sigaction before_ {};
  std::atomic<bool> done_ = false;
  int told_ = 0;
  std::thread sender_;
};

/// Says that the work has begun, and waits until so many signals were sent.
void wait_for_signals(const Pipe& begun, const Pipe& sent, int count) {
  char byte = 0;
  if (write(begun.ends[1], "b", 1) != 1) _exit(1);
  for (int k = 0; k < count; ++k)
    if (read(sent.ends[0], &byte, 1) != 1) _exit(1);
}

TEST(ChildProcess, SignalsOfAHostProgramDoNotEndTheWait) {
  const Pipe begun, sent;
  const Signals signals(begun.ends[0], sent.ends[1]);
  ChildTask calm = task();
  calm.stop_at_signals = false;
  calm.files = {begun.ends[1], sent.ends[0]};
  const ChildResult result = run_in_child(calm, [&] {
    wait_for_signals(begun, sent, 100);
    return ChildResult{5, {}};
  });
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
  const Pipe begun, sent;
  const Signals signals(begun.ends[0], sent.ends[1]);
  ChildTask stoppable = task();
  stoppable.files = {begun.ends[1], sent.ends[0]};
  expect_mentions(child_error(
                      [&]() -> ChildResult {
                        wait_for_signals(begun, sent, 1);
                        for (;;) pause();
                      },
                      stoppable),
                  {"interrupted"});
}

TEST(ChildProcess, ReachesNoFileNoNetworkAndNoProcess) {
  if (!can_seal()) GTEST_SKIP() << "this kernel has no seccomp filters";
  const pid_t parent = getpid();
  const ChildResult result = run_in_child(task(), [parent]() -> ChildResult {
    const std::string calls = test::calls_that_are_not_refused(parent);
    if (!calls.empty()) throw Error(calls, "", "");
    return {4, {}};
  });
  EXPECT_EQ(result.status, 4);
  const pid_t unsealed = fork();
  if (unsealed == 0) {
    (void)test::calls_that_are_not_refused(parent);
    _exit(1);
  }
  int status = 0;
  waitpid(unsealed, &status, 0);
  EXPECT_EQ(status, 0) << "the calls fail without a seal, too, and prove nothing";
}

TEST(ChildProcess, HasTheDescriptorsThatItWasGivenAndNoOthers) {
  std::array<int, 7> open_ones{};
  for (int& fd : open_ones) fd = open("/dev/zero", O_RDONLY);
  ChildTask given = task();
  given.files = {open_ones[4], open_ones[1]};  // in no order
  const ChildResult result = run_in_child(given, [&] {
    char byte = 1;
    ChildResult read_ones;
    for (const int fd : open_ones) read_ones.bytes.push_back(std::byte(read(fd, &byte, 1) == 1));
    read_ones.bytes.push_back(std::byte(read(STDIN_FILENO, &byte, 1) == 1));
    return read_ones;
  });
  for (const int fd : open_ones) close(fd);
  const std::array expected = {0, 1, 0, 0, 1, 0, 0, 0};
  ASSERT_EQ(result.bytes.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_EQ(static_cast<int>(result.bytes[k]), expected[k]) << k;
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
