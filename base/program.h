// What the `main` of every program has in common.
#pragma once

#include <functional>
#include <string>

namespace palpate {

/// Runs `body`, the work of a program called `name`, and returns the exit status. Errors are told on the
/// error stream and end with exit_input_error; `if_no_memory` is what to do where there is no more memory. A
/// write that fails ends no run: one over the limit of file sizes is an error and no signal, what cannot be
/// printed on the error stream is lost in silence, where fmt would throw in any thread, and where some of
/// what was printed is lost (a full disk), that is told and the status is exit_input_error in place of
/// exit_ok. Standard streams that are closed stay without use, so that no file that is opened becomes one.
[[nodiscard]] int run_program(const std::string& name, const std::string& if_no_memory,
                              const std::function<int()>& body);

/// Tells what is wrong with the command line and what to do; returns exit_usage.
[[nodiscard]] int tell_usage(const std::string& what, const std::string& hint);

/// From now on SIGBUS, which is what reading a mapped file gives that was cut off meanwhile or whose disk
/// failed, ends the program with an error line that names the file, and exit_input_error, in place of a
/// crash. A device's guardian then takes its force to zero. For programs, not for libraries.
void end_with_an_error_on_shrunk_files();

}  // namespace palpate
