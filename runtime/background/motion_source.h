// Steps packed dynamics, a live or a warped body beside the tick.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <thread>
#include <vector>

#include "base/latest.h"
#include "runtime/background/motion_stepper.h"
#include "runtime/tick/state.h"

namespace palpate {

struct MotionSourceOptions {
  bool in_background = true;  ///< else `receive` does the step itself: equal runs stay equal
  int jobs = 0;               ///< threads that multiply; 0: one for each processor but one
};

/// Does the jobs of a state's FreeMotion for a live or warped body or one of packed dynamics: after each tick
/// `post`, before the next one `receive`. In the background neither waits: a step that is not there in time
/// comes later, and the body's time stands still meanwhile.
class MotionSource {
 public:
  /// `body` must live as long; `state` is one that the loop will use, or a copy. Throws Error unless the
  /// body is live or warped, or its dynamics are packed.
  MotionSource(const Body& body, const State& state, const MotionSourceOptions& options);
  ~MotionSource();
  MotionSource(const MotionSource&) = delete;
  MotionSource& operator=(const MotionSource&) = delete;

  void receive(State& state) noexcept;
  /// For a replay of a tick whose last sample was of `step`, of jobs up to 64 ago; not in the background.
  void receive(State& state, std::int64_t step) noexcept;
  /// Adds to the tools' force_error what their forces have come to be against a body that is to give way with
  /// time (a live one, dynamic contact) and stood still.
  void post(State& state) noexcept;

  [[nodiscard]] std::int64_t steps() const noexcept { return steps_; }     ///< done so far
  [[nodiscard]] double longest_step() const noexcept { return longest_; }  ///< [s]
  [[nodiscard]] const MotionStepper& stepper() const noexcept { return *stepper_; }

 private:
  void work() noexcept;
  void take(State& state) noexcept;
  void note_standing_still(State& state) noexcept;
  void do_job(const MotionJob& job) noexcept;

  const Body& body_;
  std::unique_ptr<MotionStepper> stepper_;
  bool in_background_;
  Latest<MotionJob> jobs_;
  Latest<MotionSample> samples_;
  std::deque<MotionJob> posted_;  // the last ones; not in the background
  std::vector<Vec3> timely_;      // [tools] force when the body was last in time [N]
  std::int64_t done_ = 0;         // the last job
  std::int64_t let_go_done_ = 0;  // of the body
  std::atomic<std::int64_t> steps_ = 0;
  std::atomic<double> longest_ = 0.0;
  std::atomic<bool> stop_ = false;
  std::thread worker_;
};

}  // namespace palpate
