// Child processes that run another program.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/file_io.h"

namespace palpate {

/// Finds the program of this name beside the running one, in the folder of that name beside it (as in a build
/// tree), or on the PATH. Throws Error if there is none.
[[nodiscard]] std::filesystem::path find_program(const std::string& name);

/// Descriptor for messages of a program to its parent, which no text of a file can imitate.
inline constexpr int told_descriptor = 3;

/// Program that runs as a child, optionally in another working folder. One of its output streams is read
/// here, the other is inherited. It ends with the thread that started it. For one thread.
class OtherProgram {
 public:
  enum class Stream { output, errors };

  struct Start {
    std::filesystem::path program;
    std::vector<std::string> arguments;
    Stream read = Stream::output;
    std::filesystem::path folder{};  ///< working folder; empty: this program's
    bool has_terminal = true;        ///< otherwise it receives no keys or signals of a person
    bool tells = false;              ///< it can write to `told_descriptor`, and inherits no other descriptor
  };

  /// Throws Error if no process can be created.
  explicit OtherProgram(const Start& start);
  ~OtherProgram();  ///< ends it and waits for its end
  OtherProgram(const OtherProgram&) = delete;
  OtherProgram& operator=(const OtherProgram&) = delete;

  /// Returns its next output, at most some kilobytes; empty at the end of the output.
  [[nodiscard]] std::string read();
  /// Returns its next message, likewise. If the program does not pass the descriptor on, the messages end
  /// with the program.
  [[nodiscard]] std::string read_told();
  /// Descriptors to poll for its output and its messages (-1 without messages).
  [[nodiscard]] int printed() const noexcept { return output_.get(); }
  [[nodiscard]] int told() const noexcept { return told_.get(); }
  /// Sends a signal to it; without a terminal, also to its own children.
  void send(int signal) noexcept;
  /// Waits and returns its exit status; 128 + the signal that ended it. Throws Error if it could not be
  /// started.
  int wait();

 private:
  std::filesystem::path program_;
  bool leads_ = false;  // it leads a process group
  FileDescriptor output_, told_;
  int process_ = -1;
};

/// Result of another program.
struct ProgramEnd {
  int status = 0;      ///< exit status; 128 + the signal that ended it
  std::string output;  ///< printed output
};

/// Runs a program to its end. It inherits the error stream, handles SIGINT and SIGTERM, and ends with this
/// process. Throws Error if it cannot be started.
[[nodiscard]] ProgramEnd run_other_program(const std::filesystem::path& program,
                                           const std::vector<std::string>& arguments);

}  // namespace palpate
