// From the tick to the recording, without the tick ever touching a file.
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

/// Ticks from one frame to the next, 1 or more, where so many frames a second are wanted (above 0).
[[nodiscard]] std::int64_t ticks_per_frame(std::int64_t rate, double frames_a_second) noexcept;

/// What shows the surface: where contact forces say all, these alone.
using RecordedPicture = std::variant<ContactLoads, SurfaceFrame>;

/// A thread that writes a session to a recording, fed through bounded lock-free rings: of ticks by one other
/// thread, of pictures by one too. Every half second all of it is put into the recording, so that no more
/// is lost however the program ends; where ticks are waited for, every half second of their own time, so that
/// equal runs make equal files. Where that fails (a full disk) nothing is kept any more, the reason is
/// told at once, and the run goes on.
class Recorder {
 public:
  /// Takes the reason why nothing is kept any more; called once at most, by the recorder's thread.
  using OnFailure = std::function<void(const Error& reason)>;

  /// Starts writing to `path`, in the place of what was there. Throws Error when it cannot be made.
  Recorder(const std::filesystem::path& path, const SessionInfo& info, const RecordedSurface& surface = {},
           OnFailure on_failure = {});
  ~Recorder();  ///< without `finish`, the recording is left as if the program had been killed
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Hands a tick over; never blocks. A full ring drops it and counts.
  void push(const TickRecord& tick) noexcept;
  /// Hands a picture over, likewise.
  void push_picture(RecordedPicture picture) noexcept;

  /// Hands a tick over, waiting for room. Only for runs that nobody feels.
  void push_waiting(const TickRecord& tick) noexcept;
  /// Hands a picture over, likewise.
  void push_picture_waiting(RecordedPicture picture) noexcept;

  /// Writes what is left, and the index. Throws Error when any of it could not be written; what could is in
  /// the recording.
  void finish();

  /// Ticks for which there was no room, or no disk any more: those of the rings too, which it did not reach.
  [[nodiscard]] std::int64_t dropped() const noexcept { return ticks_given_.dropped(failed_); }
  /// Pictures likewise.
  [[nodiscard]] std::int64_t dropped_pictures() const noexcept { return pictures_given_.dropped(failed_); }

 private:
  struct Given {
    std::atomic<std::int64_t> all = 0;
    std::atomic<std::int64_t> without_room = 0;
    std::atomic<std::int64_t> kept = 0;  // once it has failed

    [[nodiscard]] std::int64_t dropped(bool failed) const noexcept {
      return failed ? all.load() - kept.load() : without_room.load();
    }
  };

  bool try_push(const TickRecord& tick) noexcept;
  bool try_push(RecordedPicture& picture) noexcept;
  void write() noexcept;
  void fail(const std::exception& reason) noexcept;
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
  std::atomic<bool> waits_ = false;  // what is pushed
  // Of the thread:
  TickRecord last_;                      // that was written
  double last_time_ = -1.0;              // and its time, -1 before the first
  double kept_until_ = 0.0;              // time of the last checkpoint, where ticks are waited for
  std::optional<RecordedPicture> next_;  // picture that is not written yet
  std::thread thread_;
};

}  // namespace palpate
