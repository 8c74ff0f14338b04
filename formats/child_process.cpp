#include "formats/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "meshes/error.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int exit_sent = 17;    // a status that a library's exit(0) or exit(1) does not give
constexpr int exit_thrown = 18;  // the work threw

/// A pipe whose ends are closed when it goes.
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

bool write_all(int file, const void* data, std::size_t size) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(file, at, size);
    if (written < 0 && errno != EINTR) {
      return false;
    }
    if (written > 0) {
      at += written;
      size -= static_cast<std::size_t>(written);
    }
  }
  return true;
}

/// The child's life: signals as a fresh program has them, no output, death with its parent.
[[noreturn]] void be_child(int pipe, pid_t parent, const std::function<ChildResult()>& work) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGPIPE}) {
    std::signal(signal, SIG_DFL);
  }
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) {
    _exit(EXIT_FAILURE);  // it went before prctl
  }
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  if (chdir("/proc/self") != 0) {
    _exit(EXIT_FAILURE);
  }
  try {
    const ChildResult result = work();
    const bool sent = write_all(pipe, &result.status, sizeof(result.status)) &&
                      write_all(pipe, result.bytes.data(), result.bytes.size());
    _exit(sent ? exit_sent : EXIT_FAILURE);
  } catch (const std::exception& error) {
    const std::string text = error.what();
    write_all(pipe, text.data(), text.size());
  } catch (...) {
    write_all(pipe, "unknown exception", 17);
  }
  _exit(exit_thrown);
}

enum class WaitEnd { closed, late, interrupted };

/// Reads until the child closes its end of the pipe.
WaitEnd read_until_closed(int pipe, Clock::time_point deadline, Bytes& bytes) {
  std::array<std::byte, 65536> chunk{};
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) {
      return WaitEnd::late;
    }
    pollfd wait_for{pipe, POLLIN, 0};
    const int ready = poll(&wait_for, 1, static_cast<int>(std::min<long long>(left, 60'000)));
    if (ready < 0) {
      return WaitEnd::interrupted;
    }
    if (ready == 0) {
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

int wait_for_end(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

std::string as_text(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

const char* const interrupted_hint = "start it again; nothing was written";

[[noreturn]] void report_end(const std::string& name, const std::string& where, int status,
                             const Bytes& bytes) {
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    if (signal == SIGINT || signal == SIGTERM) {
      throw Error(name + " was interrupted", where, interrupted_hint);
    }
    const std::string memory = signal == SIGKILL ? "; SIGKILL is often the lack of memory" : "";
    throw Error(name + " crashed (signal " + std::to_string(signal) + ", " + strsignal(signal) + ")", where,
                "simplify, repair or remesh the input" + memory);
  }
  if (WEXITSTATUS(status) == exit_thrown) {
    throw Error(name + " failed: " + as_text(bytes), where, "simplify, repair or remesh the input");
  }
  throw Error(name + " gave up (exit status " + std::to_string(WEXITSTATUS(status)) + ")", where,
              "simplify, repair or remesh the input");
}

}  // namespace

ChildResult run_in_child(const std::string& name, const std::string& where, std::chrono::seconds limit,
                         const std::function<ChildResult()>& work) {
  Pipe pipe;
  if (pipe2(pipe.ends.data(), O_CLOEXEC) != 0) {
    throw Error(std::string("cannot make a pipe: ") + strerror(errno), where,
                "close other programs and try again");
  }
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) {
    throw Error(std::string("cannot start a process: ") + strerror(errno), where,
                "close other programs and try again");
  }
  if (child == 0) {
    be_child(pipe.ends[1], parent, work);
  }
  pipe.close_end(1);

  Bytes bytes;
  const WaitEnd end = read_until_closed(pipe.ends[0], Clock::now() + limit, bytes);
  if (end != WaitEnd::closed) {
    kill(child, SIGKILL);
  }
  const int status = wait_for_end(child);
  if (end == WaitEnd::interrupted) {
    throw Error(name + " was interrupted", where, interrupted_hint);
  }
  if (end == WaitEnd::late) {
    throw Error(name + " did not finish within " + std::to_string(limit.count()) + " s", where,
                "use a coarser surface or a larger edge_length, or relax radius_edge and min_dihedral");
  }
  ChildResult result;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != exit_sent || bytes.size() < sizeof(result.status)) {
    report_end(name, where, status, bytes);
  }
  std::memcpy(&result.status, bytes.data(), sizeof(result.status));
  result.bytes.assign(bytes.begin() + sizeof(result.status), bytes.end());
  return result;
}

namespace {

template <typename T>
void append_array(Bytes& bytes, const std::vector<T>& values) {
  const std::size_t size = values.size();
  append_bytes(bytes, std::span<const std::size_t>(&size, 1));
  append_bytes(bytes, std::span<const T>(values));
}

/// Takes an array from the front of `bytes`.
template <typename T>
void take_array(std::span<const std::byte>& bytes, std::vector<T>& values) {
  std::size_t size = 0;
  std::memcpy(&size, bytes.data(), sizeof(size));
  bytes = bytes.subspan(sizeof(size));
  values.resize(size);
  std::copy_n(bytes.data(), size * sizeof(T), reinterpret_cast<std::byte*>(values.data()));
  bytes = bytes.subspan(size * sizeof(T));
}

}  // namespace

Bytes pack(const Mesh& mesh) {
  Bytes bytes = {static_cast<std::byte>(mesh.element)};
  append_array(bytes, mesh.nodes);
  append_array(bytes, mesh.connectivity);
  append_array(bytes, mesh.regions);
  append_array(bytes, mesh.tagged_facets);
  append_array(bytes, mesh.facet_tags);
  return bytes;
}

Mesh unpack_mesh(const Bytes& bytes) {
  Mesh mesh;
  mesh.element = static_cast<ElementType>(bytes.at(0));
  std::span<const std::byte> rest = std::span(bytes).subspan(1);
  take_array(rest, mesh.nodes);
  take_array(rest, mesh.connectivity);
  take_array(rest, mesh.regions);
  take_array(rest, mesh.tagged_facets);
  take_array(rest, mesh.facet_tags);
  return mesh;
}

}  // namespace palpate
