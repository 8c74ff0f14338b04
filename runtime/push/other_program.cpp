#include "runtime/push/other_program.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "base/limits/descriptors.h"

namespace palpate {
namespace {

constexpr int cannot_be_started = 127;

bool is_program(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::is_regular_file(file, error) && ::access(file.c_str(), X_OK) == 0;
}

/// Returns the last word of a program's name: "precompute".
std::string folder_name(const std::string& name) {
  return name.substr(name.rfind('-') + 1);
}

/// Leaves a person's signals to the other program during its lifetime.
class LeaveSignals {
 public:
  LeaveSignals() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals.at(i), &ignore, &before_.at(i));
  }
  ~LeaveSignals() {
    for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals.at(i), &before_.at(i), nullptr);
  }
  LeaveSignals(const LeaveSignals&) = delete;
  LeaveSignals& operator=(const LeaveSignals&) = delete;

 private:
  static constexpr std::array<int, 2> signals = {SIGINT, SIGTERM};
  std::array<struct sigaction, signals.size()> before_{};
};

/// Unblocks all signals in a child, whatever its parent blocks.
void let_all_signals() {
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
}

/// Creates a pipe, closed on exec.
std::array<int, 2> make_pipe(const std::filesystem::path& program) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) == 0) return pipe;
  throw Error(std::string("cannot make a pipe: ") + std::strerror(errno), program.string(),
              "close other programs and try again");
}

/// Becomes the program. Other file descriptors of this one are closed on exec.
[[noreturn]] void be_program(int output, int told, const OtherProgram::Start& start) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  dup2(output, start.read == OtherProgram::Stream::output ? STDOUT_FILENO : STDERR_FILENO);
  if (told == told_descriptor) fcntl(told, F_SETFD, 0);
  if (told >= 0) dup2(told, told_descriptor);
  if (told >= 0) close_descriptors(told_descriptor + 1, INT_MAX);  // including sockets of a server
  if (!start.has_terminal) {
    setpgid(0, 0);
    const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO);
  }
  if (!start.folder.empty() && ::chdir(start.folder.c_str()) != 0) _exit(cannot_be_started);
  std::string name = start.program.string();
  std::vector<std::string> words = start.arguments;
  std::vector<char*> pointers = {name.data()};
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(name.c_str(), pointers.data());
  _exit(cannot_be_started);
}

std::string read_from(int descriptor) {
  std::array<char, 4096> chunk{};
  for (;;) {
    const ssize_t size = ::read(descriptor, chunk.data(), chunk.size());
    if (size < 0 && errno == EINTR) continue;
    return {chunk.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
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
              "install the package " + name + " or build it, or add its folder to the PATH");
}

OtherProgram::OtherProgram(const Start& start) : program_(start.program), leads_(!start.has_terminal) {
  const std::array<int, 2> output = make_pipe(program_);
  const FileDescriptor written(output[1], program_);
  FileDescriptor read(output[0], program_);
  const std::array<int, 2> told = start.tells ? make_pipe(program_) : std::array{-1, -1};
  const FileDescriptor written_told(told[1], program_);
  FileDescriptor read_told(told[0], program_);
  process_ = ::fork();
  if (process_ == 0) {
    let_all_signals();
    be_program(output[1], told[1], start);
  }
  if (process_ < 0) throw Error("cannot be started", program_.string(), "close other programs and try again");
  if (leads_) setpgid(process_, process_);  // the child does the same: whichever comes first
  output_ = std::move(read);
  told_ = std::move(read_told);
}

OtherProgram::~OtherProgram() {
  send(SIGTERM);
  if (process_ > 0) wait_for(process_);
}

std::string OtherProgram::read() {
  return read_from(output_.get());
}

std::string OtherProgram::read_told() {
  return read_from(told_.get());
}

void OtherProgram::send(int signal) noexcept {
  if (process_ > 0) ::kill(leads_ ? -process_ : process_, signal);
}

int OtherProgram::wait() {
  const int status = wait_for(process_);
  process_ = -1;
  if (status == cannot_be_started)
    throw Error("cannot be started", program_.string(), "check that it is a program for this machine");
  return status;
}

ProgramEnd run_other_program(const std::filesystem::path& program,
                             const std::vector<std::string>& arguments) {
  OtherProgram other({.program = program, .arguments = arguments});
  const LeaveSignals signals;  // after the start, so that the program inherits the original handlers
  ProgramEnd end;
  for (std::string text = other.read(); !text.empty(); text = other.read()) end.output += text;
  end.status = other.wait();
  return end;
}

}  // namespace palpate
