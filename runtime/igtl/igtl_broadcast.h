// What all OpenIGTLink clients are to be sent.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "runtime/scene/drawn_picture.h"

namespace palpate {

/// The newest picture, and the newest one whose surface is sent: 30 a second of the run's time at most.
/// Messages are made when the first client wants them. Counts tell a client whether it has been sent what
/// there is. For the server's thread.
class IgtlBroadcast {
 public:
  using Clock = std::chrono::steady_clock;
  using Bytes = std::shared_ptr<const std::string>;

  void set_picture(DrawnPicture picture, Clock::time_point now);
  /// Has the surface of the newest picture sent too where no other picture has come for a while: a run that
  /// is paused or over is seen as it stands.
  void catch_up(Clock::time_point now);
  /// That, at once.
  void catch_up();

  [[nodiscard]] std::int64_t pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::int64_t surfaces() const noexcept { return surfaces_; }

  // Of what there is, see above.
  [[nodiscard]] const Bytes& surface_message();
  /// Tool and force.
  [[nodiscard]] const Bytes& hand_message();

 private:
  std::shared_ptr<const DrawnPicture> newest_;
  std::shared_ptr<const DrawnPicture> surface_;
  Clock::time_point came_;  // the newest
  std::int64_t pictures_ = 0;
  std::int64_t surfaces_ = 0;
  Bytes surface_message_;
  Bytes hand_message_;
};

}  // namespace palpate
