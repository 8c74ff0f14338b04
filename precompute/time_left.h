// Estimate of the time left of a run of several stages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
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

}  // namespace palpate
