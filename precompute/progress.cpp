#include "precompute/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace palpate {
namespace {

constexpr double seconds_between_lines = 5.0;  // where lines cannot be rewritten

}  // namespace

Progress::Progress() : start_(Clock::now()), step_start_(start_), terminal_(isatty(STDERR_FILENO) != 0) {}

double Progress::seconds() const {
  return std::chrono::duration<double>(Clock::now() - start_).count();
}

void Progress::line(const std::string& text) {
  if (open_line_) std::fputc('\n', stderr);
  open_line_ = false;
  fmt::print(stderr, "[{:7.1f} s] {}\n", seconds(), text);
}

void Progress::step(const std::string& name, double share) {
  if (name != step_name_) {
    step_name_ = name;
    step_start_ = Clock::now();
    last_percent_ = -1;
    next_line_ = seconds_between_lines;
  }
  const int percent = static_cast<int>(100.0 * share);
  const double spent = std::chrono::duration<double>(Clock::now() - step_start_).count();
  if (percent == last_percent_ || (!terminal_ && percent < 100 && spent < next_line_)) return;
  last_percent_ = percent;
  next_line_ = spent + seconds_between_lines;
  const std::string left = share > 0.0 ? fmt::format(", {:.0f} s left", spent * (1.0 - share) / share) : "";
  const std::string text = fmt::format("{}: {} %{}", name, percent, left);
  if (!terminal_) {
    line(text);
    return;
  }
  fmt::print(stderr, "\r\033[K[{:7.1f} s] {}", seconds(), text);
  open_line_ = true;
  if (percent >= 100) {
    std::fputc('\n', stderr);
    open_line_ = false;
  }
}

}  // namespace palpate
