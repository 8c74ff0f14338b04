// How long a run of several stages still takes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// What a run goes through, and the seconds that it is expected to take when nothing is measured yet.
struct Stage {
  std::string name;
  double seconds = 0.0;
};

/// Estimates the time left of a run from the expected seconds of its stages and from what is measured of
/// them: the shares that a stage reports correct its own rest, all measured stages together the rest of the
/// run. Has no clock: `now` are seconds since any fixed moment, never falling.
class TimeLeft {
 public:
  /// The stages that are to come, in order.
  void plan(std::vector<Stage> stages);

  /// Corrects the expected seconds of a planned stage, as long as it has not begun. Unknown names are passed
  /// over.
  void expect(std::string_view stage, double seconds);

  /// A planned stage begins: it and what follows is left. A name that is not planned changes nothing.
  void begin(std::string_view stage, double now);

  /// The stage under way has done this share (0..1) of its work.
  void reach(double share, double now);

  /// Whether stages were planned.
  [[nodiscard]] bool known() const noexcept { return !stages_.empty(); }

  /// Whether the rest was measured rather than expected: a tenth of all planned seconds is done.
  [[nodiscard]] bool measured() const noexcept;

  /// Seconds left of the stage under way and of all that follow.
  [[nodiscard]] double seconds(double now) const noexcept;

 private:
  [[nodiscard]] double planned() const noexcept;   // seconds of all stages
  [[nodiscard]] double slowness() const noexcept;  // measured seconds for an expected one

  std::vector<Stage> stages_;
  std::size_t at_ = 0;      // the stage under way ...
  bool under_way_ = false;  // ... once it has begun
  double begun_ = 0.0;      // when it began [s]
  double share_ = 0.0;      // of it that is done ...
  double reported_ = 0.0;   // ... as of then [s]
  double expected_ = 0.0;   // seconds of finished stages, as planned ...
  double spent_ = 0.0;      // ... and as measured
};

}  // namespace palpate
