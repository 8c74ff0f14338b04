#include "base/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <optional>

#include "base/error.h"
#include "base/file_io.h"
#include "base/limits/address_space.h"
#include "base/limits/child_seal.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

/// Limits on reading untrusted files: estimates meant to be far above what a valid file takes (a surface,
/// with its checks, is the slowest), not measurements.
constexpr std::chrono::seconds reading_time{5};
constexpr std::chrono::seconds reading_time_per_megabyte{20};
constexpr std::int64_t reading_memory = 512LL << 20;
constexpr std::int64_t reading_memory_per_byte = 100;
constexpr int clock_per_processor = 12;

/// Header of a child's answer.
struct AnswerHeader {
  enum class Kind : std::int32_t { result, error, exception, no_memory };
  Kind kind = Kind::result;
  std::int32_t status = 0;
  std::uint64_t size = 0;
};

/// A pipe whose ends are closed by the destructor.
struct Pipe {
  std::array<int, 2> ends = {-1, -1};

  Pipe() = default;
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  ~Pipe() {
    close_end(0);
    close_end(1);
  }

  void close_end(std::size_t end) {
    if (ends[end] >= 0) {
      close(ends[end]);
      ends[end] = -1;
    }
  }
};

bool send(int pipe, AnswerHeader header, const Bytes& bytes) {
  header.size = bytes.size();
  const auto sent = [pipe](const void* data, std::size_t size) {
    return write_all(pipe, {static_cast<const char*>(data), size}) == 0;
  };
  return sent(&header, sizeof(header)) && sent(bytes.data(), bytes.size());
}

void append_text(Bytes& bytes, const std::string& text) {
  append_array(bytes, std::span<const char>(text));
}

void lower_limit(decltype(RLIMIT_AS) resource, std::int64_t to) {
  rlimit limit{};
  getrlimit(resource, &limit);
  limit.rlim_cur = std::min(limit.rlim_cur, static_cast<rlim_t>(to));
  setrlimit(resource, &limit);
}

void set_limits(const ChildLimits& limits) {
  lower_limit(RLIMIT_CORE, 0);
  lower_limit(RLIMIT_CPU, limits.processor.count());
  if (const std::int64_t present = address_space(); present != 0) {
    lower_limit(RLIMIT_AS, present + limits.memory);
  }
}

/// Runs the child: default signal handling, no input or output, limits, the seal, death with its parent.
[[noreturn]] void be_child(int pipe, pid_t parent, const ChildTask& task,
                           const std::function<ChildResult()>& work) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGPIPE,
                           SIGXCPU, SIGALRM, SIGCHLD}) {
    std::signal(signal, SIG_DFL);
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) {
    _exit(EXIT_FAILURE);  // the parent ended before prctl
  }
  const int nowhere = open("/dev/null", O_RDWR | O_CLOEXEC);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (nowhere < 0 || dup2(nowhere, stream) < 0) close(stream);
  }
  [[maybe_unused]] const int moved = chdir("/proc/self");  // no file can be made there, even without a seal
  set_limits(task.limits);
  std::vector<int> kept = task.files;
  kept.push_back(pipe);
  seal_process(kept);
  using Kind = AnswerHeader::Kind;
  Bytes bytes;
  try {
    const ChildResult result = work();
    _exit(send(pipe, {Kind::result, result.status}, result.bytes) ? EXIT_SUCCESS : EXIT_FAILURE);
  } catch (const Error& error) {
    for (const std::string& text : {std::string(error.what()), error.where(), error.hint()}) {
      append_text(bytes, text);
    }
    send(pipe, {Kind::error}, bytes);
  } catch (const std::bad_alloc&) {
    send(pipe, {Kind::no_memory}, bytes);
  } catch (const std::exception& error) {
    append_text(bytes, error.what());
    send(pipe, {Kind::exception}, bytes);
  } catch (...) {
    append_text(bytes, "unknown exception");
    send(pipe, {Kind::exception}, bytes);
  }
  _exit(EXIT_FAILURE);
}

enum class WaitEnd { closed, late, interrupted };

/// Reads until the child closes its end of the pipe.
WaitEnd read_until_closed(int pipe, Clock::time_point deadline, bool stop_at_signals, Bytes& bytes) {
  Bytes chunk(65536);  // not on the stack, which may be as small
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) {
      return WaitEnd::late;
    }
    pollfd wait_for{pipe, POLLIN, 0};
    const int ready = poll(&wait_for, 1, static_cast<int>(std::min<long long>(left, 60'000)));
    if (ready < 0 && stop_at_signals) {
      return WaitEnd::interrupted;
    }
    if (ready <= 0) {
      continue;
    }
    const ssize_t size = read(pipe, chunk.data(), chunk.size());
    if (size == 0) {
      return WaitEnd::closed;
    }
    if (size > 0) {
      bytes.insert(bytes.end(), chunk.begin(), chunk.begin() + size);
    }
  }
}

/// Exit status of the child, as of waitpid; nullopt if the host program has already collected it.
std::optional<int> wait_for_end(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return std::nullopt;
  }
  return status;
}

std::string take_text(std::span<const std::byte>& bytes) {
  const std::vector<char> text = take_array<char>(bytes);
  return {text.begin(), text.end()};
}

const char* const interrupted_hint = "start it again; nothing was written";

[[noreturn]] void fail_on_time(const ChildTask& task, std::chrono::seconds limit, const char* of) {
  throw Error(task.name + " did not finish within " + std::to_string(limit.count()) + " s" + of, task.where,
              task.hint);
}

[[noreturn]] void fail_on_memory(const ChildTask& task) {
  throw Error(
      task.name + " needs more than " + std::to_string(task.limits.memory / 1'000'000) + " MB of memory",
      task.where, task.hint);
}

/// Throws Error: the child ended without an answer.
[[noreturn]] void report_end(const ChildTask& task, std::optional<int> status) {
  if (!status) {
    throw Error(task.name + " crashed", task.where, task.hint);
  }
  if (!WIFSIGNALED(*status)) {
    throw Error(task.name + " gave up (exit status " + std::to_string(WEXITSTATUS(*status)) + ")", task.where,
                task.hint);
  }
  const int signal = WTERMSIG(*status);
  if (signal == SIGINT || signal == SIGTERM) {
    throw Error(task.name + " was interrupted", task.where, interrupted_hint);
  }
  if (signal == SIGXCPU) {
    fail_on_time(task, task.limits.processor, " of the processor");
  }
  throw Error(task.name + " crashed (signal " + std::to_string(signal) + ", " + strsignal(signal) + ")",
              task.where, task.hint + (signal == SIGKILL ? "; SIGKILL is often the lack of memory" : ""));
}

/// Header of the answer, if the child has sent a whole one.
std::optional<AnswerHeader> whole_answer(const Bytes& bytes) {
  AnswerHeader header;
  if (bytes.size() < sizeof(header)) return std::nullopt;
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (bytes.size() - sizeof(header) != header.size) return std::nullopt;
  return header;
}

}  // namespace

ChildLimits child_limits(std::chrono::seconds processor, std::int64_t memory) {
  return {processor, clock_per_processor * processor, memory};
}

ChildLimits reading_limits(std::int64_t bytes) {
  return child_limits(reading_time + bytes / 1'000'000 * reading_time_per_megabyte,
                      reading_memory + reading_memory_per_byte * bytes);
}

ChildResult run_in_child(const ChildTask& task, const std::function<ChildResult()>& work) {
  Pipe pipe;
  if (pipe2(pipe.ends.data(), O_CLOEXEC) != 0) {
    throw Error(std::string("cannot make a pipe: ") + strerror(errno), task.where,
                "close other programs and try again");
  }
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    throw Error(std::string("cannot start a process: ") + strerror(errno), task.where,
                "close other programs and try again");
  }
  if (child == 0) {
    be_child(pipe.ends[1], parent, task, work);
  }
  pipe.close_end(1);

  Bytes bytes;
  const WaitEnd end =
      read_until_closed(pipe.ends[0], Clock::now() + task.limits.clock, task.stop_at_signals, bytes);
  if (end != WaitEnd::closed) {
    kill(child, SIGKILL);
  }
  const std::optional<int> status = wait_for_end(child);
  if (end == WaitEnd::interrupted) {
    throw Error(task.name + " was interrupted", task.where, interrupted_hint);
  }
  if (end == WaitEnd::late) {
    fail_on_time(task, task.limits.clock, "");
  }
  const std::optional<AnswerHeader> answer = whole_answer(bytes);
  if (!answer) {
    report_end(task, status);
  }
  std::span<const std::byte> rest = std::span(bytes).subspan(sizeof(AnswerHeader));
  switch (answer->kind) {
    case AnswerHeader::Kind::result:
      break;
    case AnswerHeader::Kind::error: {
      const std::string what = take_text(rest), where = take_text(rest);
      throw Error(what, where, take_text(rest));
    }
    case AnswerHeader::Kind::exception:
      throw Error(task.name + " failed: " + take_text(rest), task.where, task.hint);
    case AnswerHeader::Kind::no_memory:
      fail_on_memory(task);
  }
  return {answer->status, Bytes(rest.begin(), rest.end())};
}

void fail_on_answer() {
  throw Error("the answer of a child process is damaged", "palpate", "repair or remesh the input");
}

}  // namespace palpate
