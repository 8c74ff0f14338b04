// Programs beside this one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/file_io.h"

namespace palpate {

/// The program of this name beside the running one, in the folder of that name beside it (as in a build
/// tree), or on the PATH. Throws Error where there is none.
[[nodiscard]] std::filesystem::path find_program(const std::string& name);

/// The descriptor on which a program tells the one that started it something that no file's text can imitate.
inline constexpr int told_descriptor = 3;

/// A program that runs beside this one, in a folder of its own if it is given one. Of what it prints one
/// stream is read here, the other one goes where this program's does. It ends with the thread that started
/// it. For one thread.
class OtherProgram {
 public:
  enum class Stream { output, errors };

  struct Start {
    std::filesystem::path program;
    std::vector<std::string> arguments;
    Stream read = Stream::output;
    std::filesystem::path folder{};  ///< that it works in; empty: this program's
    bool has_terminal = true;        ///< else it hears no keys of a person, nor signals that they send
    bool tells =
        false;  ///< it has `told_descriptor` to write to, and beside it no descriptor of this program
  };

  /// Throws Error where there is no room for another program.
  explicit OtherProgram(const Start& start);
  ~OtherProgram();  ///< ends it and waits for that
  OtherProgram(const OtherProgram&) = delete;
  OtherProgram& operator=(const OtherProgram&) = delete;

  /// What it prints next, at most some kilobytes; empty once it prints nothing more.
  [[nodiscard]] std::string read();
  /// What it tells next, likewise. A program that keeps the descriptor to itself tells nothing more once it
  /// has ended.
  [[nodiscard]] std::string read_told();
  /// To wait for what it prints, and for what it tells (-1 where it does not).
  [[nodiscard]] int printed() const noexcept { return output_.get(); }
  [[nodiscard]] int told() const noexcept { return told_.get(); }
  /// Sends it a signal, without a terminal to all that it has started too.
  void send(int signal) noexcept;
  /// Its exit status, once it has ended; 128 + the signal that ended it. Throws Error where it could not be
  /// started at all.
  int wait();

 private:
  std::filesystem::path program_;
  bool leads_ = false;  // a process group
  FileDescriptor output_, told_;
  int process_ = -1;
};

/// How another program ended.
struct ProgramEnd {
  int status = 0;      ///< exit status; 128 + the signal that ended it
  std::string output;  ///< what it printed
};

/// Runs a program to its end. Its error stream is this one's; SIGINT and SIGTERM are for it to handle, and it
/// ends with this process. Throws Error where it cannot be started.
[[nodiscard]] ProgramEnd run_other_program(const std::filesystem::path& program,
                                           const std::vector<std::string>& arguments);

}  // namespace palpate
