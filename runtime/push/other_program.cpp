#include "runtime/push/other_program.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "base/error.h"

namespace palpate {
namespace {

constexpr int cannot_be_started = 127;

bool is_program(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::is_regular_file(file, error) && ::access(file.c_str(), X_OK) == 0;
}

/// The last word of a program's name: "precompute".
std::string folder_name(const std::string& name) {
  return name.substr(name.rfind('-') + 1);
}

/// While it lives, signals of a person are left to the other program.
class LeaveSignals {
 public:
  LeaveSignals() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals.at(i), &ignore, &before_.at(i));
  }
  ~LeaveSignals() { restore(); }
  LeaveSignals(const LeaveSignals&) = delete;
  LeaveSignals& operator=(const LeaveSignals&) = delete;

  void restore() const noexcept {
    for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals.at(i), &before_.at(i), nullptr);
  }

 private:
  static constexpr std::array<int, 2> signals = {SIGINT, SIGTERM};
  std::array<struct sigaction, signals.size()> before_{};
};

[[noreturn]] void be_program(int output, const std::filesystem::path& program,
                             const std::vector<std::string>& arguments) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  dup2(output, STDOUT_FILENO);
  std::string name = program.string();
  std::vector<std::string> words = arguments;
  std::vector<char*> pointers = {name.data()};
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(program.c_str(), pointers.data());
  _exit(cannot_be_started);
}

std::string read_all(int pipe) {
  std::string text;
  std::array<char, 4096> chunk{};
  for (;;) {
    const ssize_t size = ::read(pipe, chunk.data(), chunk.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return text;
    text.append(chunk.data(), static_cast<std::size_t>(size));
  }
}

int wait_for(pid_t child) {
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

std::filesystem::path find_program(const std::string& name) {
  std::error_code error;
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const std::filesystem::path& file : {here / name, here.parent_path() / folder_name(name) / name})
    if (is_program(file)) return file;
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty() && is_program(std::filesystem::path(folder) / name))
      return std::filesystem::path(folder) / name;
  throw Error(name + " is neither beside this program nor on the PATH", here.string(),
              "install or build " + name + ", or add its folder to the PATH");
}

ProgramEnd run_other_program(const std::filesystem::path& program,
                             const std::vector<std::string>& arguments) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0)
    throw Error(std::string("cannot make a pipe: ") + std::strerror(errno), program.string(),
                "close other programs and try again");
  const LeaveSignals signals;
  const pid_t child = ::fork();
  if (child == 0) {
    signals.restore();
    be_program(pipe[1], program, arguments);
  }
  ::close(pipe[1]);
  ProgramEnd end;
  if (child > 0) {
    end.output = read_all(pipe[0]);
    end.status = wait_for(child);
  }
  ::close(pipe[0]);
  if (child < 0 || end.status == cannot_be_started)
    throw Error("cannot be started", program.string(), "check that it is a program for this machine");
  return end;
}

}  // namespace palpate
