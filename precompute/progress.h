// Progress messages.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace palpate {

/// A stage of a run, with the seconds expected before anything is measured.
struct Stage {
  std::string name;
  double seconds = 0.0;
};

/// Estimate of the time left of a run from the expected seconds of its stages and from measurements: the
/// reported progress of a stage corrects its own rest, all measured stages together the rest of the run. Has
/// no clock: `now` are seconds since any fixed moment, never decreasing.
class TimeLeft {
 public:
  /// Sets the stages to come, in order.
  void plan(std::vector<Stage> stages);

  /// Corrects the expected seconds of a planned stage that has not begun. Unknown names are ignored.
  void expect(std::string_view stage, double seconds);

  /// Begins a planned stage; it and the following ones are left. A name that is not planned has no effect.
  void begin(std::string_view stage, double now);

  /// Reports the finished fraction (0..1) of the current stage.
  void reach(double share, double now);

  /// True if stages were planned.
  [[nodiscard]] bool known() const noexcept { return !stages_.empty(); }

  /// True if the rest is measured rather than expected: a tenth of all planned seconds is done.
  [[nodiscard]] bool measured() const noexcept;

  /// Seconds left of the current stage and all that follow.
  [[nodiscard]] double seconds(double now) const noexcept;

 private:
  [[nodiscard]] double planned() const noexcept;   // seconds of all stages
  [[nodiscard]] double slowness() const noexcept;  // measured seconds per expected one

  std::vector<Stage> stages_;
  std::size_t at_ = 0;      // current stage ...
  bool under_way_ = false;  // ... once it has begun
  double begun_ = 0.0;      // its start [s]
  double share_ = 0.0;      // finished fraction of it ...
  double reported_ = 0.0;   // ... at this time [s]
  double expected_ = 0.0;   // seconds of finished stages, as planned ...
  double spent_ = 0.0;      // ... and as measured
};

/// A duration with the precision of an estimate: "40 s", "2 min 10 s", "3 h 5 min".
std::string duration_text(double seconds);

/// Progress on standard error, with the seconds since the start: each stage when it begins, then its progress
/// and the time left of the whole run, on a terminal in one line rewritten every second, elsewhere in a line
/// every five seconds, less often as it takes longer. Thread-safe.
class Progress {
 public:
  /// `prints`: false for processes that leave printing to another.
  explicit Progress(bool prints = true);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Prints a remark or a finished step on a line of its own.
  void line(const std::string& text);

  /// Prints a probable mistake: "warning: TEXT" between empty lines, so that it stands out.
  void warn(const std::string& text);

  /// Sets the stages to come, with their expected seconds; from now on the time left is shown.
  void plan(std::vector<Stage> stages);

  /// Corrects the expected seconds of a planned stage that has not begun.
  void expect(std::string_view stage, double seconds);

  /// Begins a stage and ends the one before.
  void begin(const std::string& stage);

  /// Ends the last stage.
  void end();

  /// Finished stages with the measured seconds.
  [[nodiscard]] std::vector<Stage> stages();

  /// Reports the finished fraction (0..1) of the stage.
  void reach(double share);

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] double now() const;  // seconds since construction
  [[nodiscard]] std::string stage_text() const;
  void print(const std::string& text) const;
  void show(const std::string& text);  // for the current stage
  void write_line(const std::string& text);
  void end_stage();
  [[nodiscard]] double next_showing() const;  // of the current stage [s]
  void tick(const std::stop_token& stop);

  const Clock::time_point start_ = Clock::now();
  const bool prints_;
  const bool terminal_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  TimeLeft time_left_;
  std::vector<Stage> over_;
  std::string stage_;       // current stage; empty: none
  double share_ = -1.0;     // finished fraction of it; -1: not reported
  double begun_ = 0.0;      // its start [s]
  double shown_ = 0.0;      // time of the last output [s]
  bool line_open_ = false;  // a line that can be rewritten
  std::jthread ticker_;     // last, so that it ends before the members it uses
};

/// Progress of work that reports none itself: begins after `silence` and lasts as long as this lives.
class Waiting {
 public:
  explicit Waiting(std::string what, std::chrono::milliseconds silence = std::chrono::seconds(2));

 private:
  std::jthread teller_;
};

}  // namespace palpate
