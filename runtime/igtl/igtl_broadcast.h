// Content sent to all OpenIGTLink clients.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "runtime/scene/drawn_picture.h"

namespace palpate {

/// Latest picture, and the latest one whose surface is sent: at most 30 per second of the run's time.
/// Messages are encoded when the first client needs them. By its counters a client knows whether it has
/// received the latest. For the server's thread.
class IgtlBroadcast {
 public:
  using Clock = std::chrono::steady_clock;
  using Bytes = std::shared_ptr<const std::string>;

  void set_picture(DrawnPicture picture, Clock::time_point now);
  /// Sends the latest picture's surface too if no other picture has arrived for a while, so that a paused or
  /// finished run is shown in its final state.
  void catch_up(Clock::time_point now);
  /// Does so at once.
  void catch_up();

  [[nodiscard]] std::int64_t pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::int64_t surfaces() const noexcept { return surfaces_; }

  // Messages of the current content.
  [[nodiscard]] const Bytes& surface_message();
  /// Tool and force.
  [[nodiscard]] const Bytes& hand_message();

 private:
  std::shared_ptr<const DrawnPicture> newest_;
  std::shared_ptr<const DrawnPicture> surface_;
  Clock::time_point came_;  // time of the latest picture
  std::int64_t pictures_ = 0;
  std::int64_t surfaces_ = 0;
  Bytes surface_message_;
  Bytes hand_message_;
};

}  // namespace palpate
