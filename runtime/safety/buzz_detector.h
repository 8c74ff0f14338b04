// Detection of chatter in the force and in the hand's motion.
#pragma once

#include <array>
#include <cstdint>

#include "base/vectors.h"

namespace palpate {

/// Counts how often a signal crosses from above `amplitude` to below -amplitude or back, on any axis, within
/// a time window.
class FlipCounter {
 public:
  /// `amplitude` in the signal's unit, `window` in [s].
  FlipCounter(double amplitude, double window) noexcept : amplitude_(amplitude), window_(window) {}

  /// Adds a sample and returns the number of crossings in the window that ends at `now` [ns]. At most 32 are
  /// stored.
  int count(const Vec3& signal, std::int64_t now) noexcept;

 private:
  double amplitude_;
  double window_;
  std::array<int, 3> side_{};  // -1, 0 (not yet known), 1
  std::array<std::int64_t, 32> times_{};
  std::size_t next_ = 0;
  std::size_t known_ = 0;
};

struct BuzzOptions {
  double speed = 0.02;      ///< amplitude of the velocity [m/s]; a tremor of 0.1 mm at 12 Hz has 0.008
  double force = 0.3;       ///< amplitude of the force about its mean [N]
  double mean_time = 0.05;  ///< time constant of that mean [s]
  double window = 0.25;     ///< length of the time window [s]
  int flips = 10;           ///< crossings in the window that count as buzzing: more than 20 Hz, faster than
                            ///< any hand
  double fade = 0.2;        ///< time from full to no force while it buzzes; at no force it is a fault [s]
  double recovery = 1.0;    ///< time back to full force once it has stopped [s]
};

/// Detects a limit cycle between device and body and scales the force down. That lowers the loop gain and
/// usually ends the cycle. (Sign changes of the velocity above an amplitude: OpenHaptics Programmer's Guide.)
class BuzzDetector {
 public:
  explicit BuzzDetector(const BuzzOptions& options) noexcept
      : options_(options), velocity_(options.speed, options.window), force_(options.force, options.window) {}

  /// Updates the detector; call once per tick. `shown` is the force on the hand [N]; a zero force never
  /// buzzes. `elapsed` is the time since the last call [s].
  void see(const Vec3& velocity, const Vec3& shown, std::int64_t now, double elapsed) noexcept;

  [[nodiscard]] double share() const noexcept { return share_; }  ///< factor on the force [0, 1]
  [[nodiscard]] bool buzzing() const noexcept { return buzzing_; }
  [[nodiscard]] bool failed() const noexcept { return share_ <= 0.0; }

  void reset() noexcept { *this = BuzzDetector(options_); }

 private:
  BuzzOptions options_;
  FlipCounter velocity_;
  FlipCounter force_;
  Vec3 mean_ = Vec3::Zero();  // running mean of the force [N]
  double share_ = 1.0;
  bool buzzing_ = false;
};

}  // namespace palpate
