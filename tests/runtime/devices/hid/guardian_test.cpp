// The guardian: a file stands for the device, to which it may write when a process has died.
#include "runtime/devices/hid/guardian.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkstemp
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "tests/support/devices/bytes.h"

namespace palpate::guardian_test {
namespace {

const std::vector<Bytes> reports = {{0, 1, 2}, {5, 0}};
const Bytes each_twice = {0, 1, 2, 0, 1, 2, 5, 0, 5, 0};

class GuardianTest : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = (std::filesystem::temp_directory_path() / "palpate-guardian-XXXXXX").string();
    const int file = mkstemp(path_.data());
    ASSERT_GE(file, 0);
    close(file);
  }
  void TearDown() override { std::filesystem::remove(path_); }

  [[nodiscard]] Bytes written() const {
    std::ifstream stream(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  /// Runs `life` in a process with a guardian; how that ended.
  template <typename Life>
  int run(const Life& life) {
    const pid_t child = fork();
    if (child == 0) {
      {
        Guardian guardian;
        life(guardian);
      }
      _exit(0);
    }
    int status = 0;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    return status;
  }

  /// Waits for what comes a moment after the death.
  [[nodiscard]] Bytes written_in_the_end() const {
    for (int k = 0; k < 1000 && written().size() < each_twice.size(); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return written();
  }

  std::string path_;
};

TEST_F(GuardianTest, TakesTheForceOffAfterEachDeath) {
  for (const int signal : {SIGKILL, SIGSEGV, SIGABRT, SIGTERM}) {
    std::filesystem::resize_file(path_, 0);
    const int status = run([&](Guardian& guardian) {
      guardian.guard("/nowhere", reports);
      guardian.guard(path_, reports);
      std::signal(signal, SIG_DFL);
      raise(signal);
    });
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(written_in_the_end(), each_twice) << signal;
  }
}

/// The only child of this process.
pid_t only_child() {
  std::ifstream children("/proc/self/task/" + std::to_string(getpid()) + "/children");
  pid_t child = -1;
  children >> child;
  return child;
}

TEST_F(GuardianTest, SurvivesWhatATerminalSends) {
  run([&](Guardian& guardian) {
    guardian.guard(path_, reports);
    for (const int signal : {SIGINT, SIGHUP, SIGTERM, SIGQUIT}) {
      kill(only_child(), signal);
    }
    raise(SIGKILL);
  });
  EXPECT_EQ(written_in_the_end(), each_twice);
}

TEST_F(GuardianTest, HasItsOwnSession) {
  const int status = run([&](Guardian&) {
    for (int k = 0; k < 1000 && getsid(only_child()) == getsid(0); ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (getsid(only_child()) != only_child()) _exit(7);
  });
  EXPECT_EQ(status, 0);
}

TEST_F(GuardianTest, HoldsNobodysOutput) {
  int ends[2] = {};
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    const Guardian guardian;
    close(ends[1]);
    close(STDOUT_FILENO);
    while (true) pause();
  }
  close(ends[1]);
  pollfd ending{ends[0], POLLIN, 0};
  EXPECT_EQ(poll(&ending, 1, 10'000), 1);
  EXPECT_NE(ending.revents & POLLHUP, 0);
  close(ends[0]);
  kill(child, SIGKILL);
  EXPECT_EQ(waitpid(child, nullptr, 0), child);
}

TEST_F(GuardianTest, DoesNothingAfterAGoodbye) {
  // The destructor waits for the guardian's end.
  EXPECT_EQ(run([&](Guardian& guardian) { guardian.guard(path_, reports); }), 0);
  EXPECT_EQ(written(), Bytes());
}

TEST_F(GuardianTest, DoesNothingForADeviceThatWasClosed) {
  run([&](Guardian& guardian) {
    guardian.guard(path_, reports);
    guardian.release();
    raise(SIGKILL);
  });
  run([&](Guardian& guardian) {
    guardian.guard(path_, {});
    raise(SIGKILL);
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(written(), Bytes());
}

}  // namespace
}  // namespace palpate::guardian_test
