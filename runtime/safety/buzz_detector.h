// Force and hand that chatter.
#pragma once

#include <array>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

/// Counts how often a signal goes from above `amplitude` to below -amplitude or back, on any axis, within a
/// window.
class FlipCounter {
 public:
  /// `amplitude` in the signal's unit, `window` [s].
  FlipCounter(double amplitude, double window) noexcept : amplitude_(amplitude), window_(window) {}

  /// How many in the window that ends `now` [ns]; no more than 32 are remembered.
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
  double speed = 0.02;      ///< amplitude of the velocity [m/s]: tremor of 0.1 mm at 12 Hz has 0.008
  double force = 0.3;       ///< amplitude of the force about its mean [N]
  double mean_time = 0.05;  ///< of that mean [s]
  double window = 0.25;     ///< [s]
  int flips = 10;           ///< in the window: more than 20 Hz, which no hand does
  double fade = 0.2;        ///< from whole to no force while it buzzes; none left: a fault [s]
  double recovery = 1.0;    ///< back, while it does not [s]
};

/// A limit cycle between device and body: force is scaled down, which lowers the gain of the loop and as a
/// rule ends it. (Counting sign changes of the velocity above an amplitude: OpenHaptics Programmer's Guide.)
class BuzzDetector {
 public:
  explicit BuzzDetector(const BuzzOptions& options) noexcept
      : options_(options), velocity_(options.speed, options.window), force_(options.force, options.window) {}

  /// Each tick. `shown`: the force that the hand has [N]; without any there is no buzz. `elapsed` since the
  /// last call [s].
  void see(const Vec3& velocity, const Vec3& shown, std::int64_t now, double elapsed) noexcept;

  [[nodiscard]] double share() const noexcept { return share_; }  ///< of the force [0, 1]
  [[nodiscard]] bool buzzing() const noexcept { return buzzing_; }
  [[nodiscard]] bool failed() const noexcept { return share_ <= 0.0; }

  void reset() noexcept { *this = BuzzDetector(options_); }

 private:
  BuzzOptions options_;
  FlipCounter velocity_;
  FlipCounter force_;
  Vec3 mean_ = Vec3::Zero();  // of the force [N]
  double share_ = 1.0;
  bool buzzing_ = false;
};

}  // namespace palpate
