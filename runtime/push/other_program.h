// Programs beside this one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

/// The program of this name beside the running one, in the folder of that name beside it (as in a build
/// tree), or on the PATH. Throws Error where there is none.
[[nodiscard]] std::filesystem::path find_program(const std::string& name);

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
