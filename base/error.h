// The one exception type of the offline and load-time code.
#pragma once

#include <stdexcept>
#include <string>

namespace palpate {

/// An error for the user: one sentence, its place and a hint. Thrown offline and at load, never in the tick;
/// run_program catches it, prints `to_text` and exits with `exit_input_error`.
class Error : public std::runtime_error {
 public:
  /// `what` says what is wrong (with the numbers), `where` names the file, field or line, `hint` says what to
  /// do, without a full stop at its end.
  Error(const std::string& what, std::string where, std::string hint)
      : std::runtime_error(what), where_(std::move(where)), hint_(std::move(hint)) {}

  [[nodiscard]] const std::string& where() const noexcept { return where_; }
  [[nodiscard]] const std::string& hint() const noexcept { return hint_; }

 private:
  std::string where_;
  std::string hint_;
};

/// The two printed lines: `error: WHERE: WHAT`, without WHERE if it is empty, and `hint: HINT`, which begins
/// with a capital letter.
std::string to_text(const Error& error);

/// The exception being handled, as an Error: itself if it is one, a lack of memory with the hint
/// `if_no_memory`, anything else as a bug in the program. `where` is the place of the last two.
[[nodiscard]] Error handled_error(const std::string& where, const std::string& if_no_memory);

/// Exit statuses of both programs. The reference of the book shows these comments.
enum ExitCode : int {
  exit_ok = 0,           ///< done
  exit_input_error = 1,  ///< bad input, bad file, no memory, full disk; or incomplete output
  exit_usage = 2,        ///< unknown, missing or wrong argument
  exit_differs = 3,  ///< `verify` found a difference or changed sources; a replay differs from its session
  exit_interrupted = 130,  ///< Ctrl-C, SIGTERM or SIGHUP; SIGUSR1 of a precomputation
};

}  // namespace palpate
