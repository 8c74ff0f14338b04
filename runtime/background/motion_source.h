// Steps packed dynamics, or a body that is live or on two levels, beside the tick.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "base/latest.h"
#include "runtime/background/motion_stepper.h"
#include "runtime/body/body.h"
#include "runtime/core/tick/state.h"

namespace palpate {

struct MotionSourceOptions {
  bool in_background = true;  ///< false: `receive` performs the step itself, so that equal runs stay equal
  int jobs = 0;               ///< threads for multiplying; 0: one per processor but one
};

/// Performs the jobs of a state's FreeMotion for a body that is live or on two levels or for packed dynamics:
/// call `post` after each tick, `receive` before the next one. In the background neither waits: a step that
/// is late is received later, and the body's time stands still in between.
class MotionSource {
 public:
  /// `body` must outlive this; `state` is the loop's state or a copy. Throws Error unless the body is live or
  /// on two levels, or its dynamics are packed.
  MotionSource(const Body& body, const State& state, const MotionSourceOptions& options);
  ~MotionSource();
  MotionSource(const MotionSource&) = delete;
  MotionSource& operator=(const MotionSource&) = delete;

  void receive(State& state) noexcept;
  /// Repeats a tick in a replay whose last sample was from `step`, for jobs up to 64 ago; not in the
  /// background.
  void receive(State& state, std::int64_t step) noexcept;
  /// Posts the job of a tick. Adds to the tools' force_error the change of their forces since the body stood
  /// still, if it should have moved (live, or dynamic contact), or the error of the last job's forces.
  void post(State& state) noexcept;

  [[nodiscard]] std::int64_t steps() const noexcept { return steps_; }     ///< steps so far
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
  std::vector<MotionJob> posted_;  // last jobs; not in the background
  std::size_t next_posted_ = 0;
  std::int64_t posted_step_ = -1;  // of the last job posted
  std::int64_t posted_seen_ = -1;
  std::vector<Vec3> timely_;      // [tools] force when the body was last in time [N]
  std::int64_t done_ = 0;         // last job done
  std::int64_t let_go_done_ = 0;  // releases done
  std::atomic<std::int64_t> steps_ = 0;
  std::atomic<double> longest_ = 0.0;
  std::atomic<bool> stop_ = false;
  std::thread worker_;
};

}  // namespace palpate
