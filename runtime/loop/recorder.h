// Recorder: writes ticks to a recording without file access in the tick.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <variant>

#include "base/error.h"
#include "base/ring.h"
#include "formats/recording.h"

namespace palpate {

/// Returns the number of ticks between frames, at least 1, for a rate of frames per second (above 0).
[[nodiscard]] std::int64_t ticks_per_frame(std::int64_t rate, double frames_a_second) noexcept;

/// Picture of the surface: the contact forces alone, if they determine it.
using RecordedPicture = std::variant<ContactLoads, SurfaceFrame>;

/// Thread that writes a session to a recording, fed through bounded lock-free rings: one thread pushes ticks,
/// one pushes pictures. A checkpoint every half second bounds the loss however the program ends; if pushes
/// wait, the half second is that of the ticks, so that equal runs produce equal files. After a failure (a
/// full disk) nothing more is kept, the reason is reported at once, and the run continues.
class Recorder {
 public:
  /// Receives the reason of the failure; called at most once, by the recorder's thread.
  using OnFailure = std::function<void(const Error& reason)>;

  /// Starts writing to `path`, replacing an existing file. Throws Error if it cannot be created.
  Recorder(const std::filesystem::path& path, const SessionInfo& info, const RecordedSurface& surface = {},
           OnFailure on_failure = {});
  ~Recorder();  ///< without `finish`, leaves the recording as if the program had been killed
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Queues a tick; never blocks. If the ring is full, the tick is dropped and counted.
  void push(const TickRecord& tick) noexcept;
  /// Queues a picture; never blocks. If the ring is full, it is dropped and counted.
  void push_picture(RecordedPicture picture) noexcept;

  /// Queues a tick, waiting for capacity. Only for runs without a person's hand.
  void push_waiting(const TickRecord& tick) noexcept;
  /// Queues a picture, waiting for capacity. Only for runs without a person's hand.
  void push_picture_waiting(RecordedPicture picture) noexcept;

  /// Writes the remaining data and the index. Throws Error if any part could not be written; the rest is in
  /// the recording.
  void finish();

  /// Number of ticks lost to a full ring or a failed disk, including queued ones that were never written.
  [[nodiscard]] std::int64_t dropped() const noexcept { return ticks_given_.dropped(failed_); }
  /// Number of pictures lost in the same ways.
  [[nodiscard]] std::int64_t dropped_pictures() const noexcept { return pictures_given_.dropped(failed_); }

 private:
  struct Given {
    std::atomic<std::int64_t> all = 0;
    std::atomic<std::int64_t> without_room = 0;
    std::atomic<std::int64_t> kept = 0;  // after a failure

    [[nodiscard]] std::int64_t dropped(bool failed) const noexcept {
      return failed ? all.load() - kept.load() : without_room.load();
    }
  };

  bool try_push(const TickRecord& tick) noexcept;
  bool try_push(RecordedPicture& picture) noexcept;
  void write() noexcept;
  void fail(const Error& reason) noexcept;
  bool take_all(bool closing);
  void take(const TickRecord& tick);
  bool take_pictures(double before);
  void note_events(const TickRecord& tick);

  OnFailure on_failure_;
  RecordingWriter writer_;
  Ring<TickRecord> ticks_;
  Ring<RecordedPicture> pictures_;
  std::atomic<bool> closing_ = false;
  std::atomic<bool> failed_ = false;
  std::exception_ptr failure_;
  Given ticks_given_, pictures_given_;
  std::atomic<bool> waits_ = false;  // pushes wait
  // Used by the thread alone.
  TickRecord last_;                      // last tick written
  double last_time_ = -1.0;              // time of last_; -1 before the first
  double kept_until_ = 0.0;              // time of the last checkpoint, if pushes wait
  std::optional<RecordedPicture> next_;  // picture not yet written
  std::thread thread_;
};

}  // namespace palpate
