// What a person sees while waiting.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "precompute/time_left.h"

namespace palpate {

/// "40 s", "2 min 10 s", "3 h 5 min": no more digits than an estimate has.
std::string duration_text(double seconds);

/// Progress on standard error, with the seconds since the start: each stage as it begins, then how far it is
/// and the time that is left of the whole run, on a terminal in one line that is rewritten every second,
/// elsewhere in a line every five seconds, less often as it takes longer. Safe for several threads.
class Progress {
 public:
  /// `prints`: false for one of several processes, another of which prints.
  explicit Progress(bool prints = true);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// A remark, or something that is done, on a line of its own.
  void line(const std::string& text);

  /// What is probably a mistake: "warning: TEXT" between empty lines, so that it stands out.
  void warn(const std::string& text);

  /// The stages to come, with the seconds that they are expected to take; from now on a time left is shown.
  void plan(std::vector<Stage> stages);

  /// Corrects the expected seconds of a stage that was planned and has not begun.
  void expect(std::string_view stage, double seconds);

  /// A stage begins, and the one before it is over.
  void begin(const std::string& stage);

  /// The last stage is over.
  void end();

  /// The stages that are over, with the seconds that they took.
  [[nodiscard]] std::vector<Stage> stages();

  /// The share (0..1) of the stage that is done.
  void reach(double share);

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] double now() const;  // seconds since construction
  [[nodiscard]] std::string stage_text() const;
  void print(const std::string& text) const;
  void show(const std::string& text);  // of the stage under way
  void write_line(const std::string& text);
  void end_stage();
  [[nodiscard]] double next_showing() const;  // of the stage under way [s]
  void tick(const std::stop_token& stop);

  const Clock::time_point start_ = Clock::now();
  const bool prints_;
  const bool terminal_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  TimeLeft time_left_;
  std::vector<Stage> over_;
  std::string stage_;       // under way, empty: none
  double share_ = -1.0;     // of it, -1: it does not say
  double begun_ = 0.0;      // when it began [s]
  double shown_ = 0.0;      // when something was shown last [s]
  bool line_open_ = false;  // a line that can be rewritten
  std::jthread ticker_;     // last, so that it ends before what it uses
};

/// Tells that work goes on which says nothing of itself, as Progress does, once it has been silent for longer
/// than a person waits.
class Waiting {
 public:
  explicit Waiting(std::string what, std::chrono::milliseconds silence = std::chrono::seconds(2));

 private:
  std::jthread teller_;
};

}  // namespace palpate
