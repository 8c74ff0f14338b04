// What a program prints, and whether it has arrived.
#pragma once

namespace palpate {

/// For the beginning of `main`: a write that fails ends no run. One over the limit of file sizes is an error
/// and no signal, and what cannot be printed on the error stream is lost in silence, where fmt would throw in
/// any thread. Standard streams that are closed stay without use, so that no file that is opened becomes one.
void prepare_output() noexcept;

/// For the end of `main`: flushes the standard output and returns `status`, or where some of what was printed
/// is lost (a full disk) says so on the error stream and returns `exit_input_error` in place of `exit_ok`.
[[nodiscard]] int finish_output(int status) noexcept;

}  // namespace palpate
