// From the tick to the recording, without the tick ever touching a file.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "formats/recording.h"

namespace palpate {

/// A thread that writes ticks to an HDF5 recording, fed through a bounded lock-free ring by one other thread.
class Recorder {
 public:
  /// Starts writing to `path` (under a temporary name). Throws Error when it cannot be made.
  Recorder(const std::filesystem::path& path, const SessionInfo& info);
  ~Recorder();  ///< without `finish`, nothing is kept
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Hands a tick over; never blocks. A full ring drops it and counts.
  void push(const TickRecord& tick) noexcept;

  /// Hands a tick over, waiting for room. Only for runs that nobody feels.
  void push_waiting(const TickRecord& tick) noexcept;

  /// Writes what is left and puts the recording in its place. Throws Error when any of it could not be
  /// written.
  void finish();

  [[nodiscard]] std::int64_t dropped() const noexcept { return dropped_; }

 private:
  bool try_push(const TickRecord& tick) noexcept;
  void write_ticks() noexcept;

  RecordingWriter writer_;
  std::vector<TickRecord> ring_;
  std::atomic<std::size_t> pushed_ = 0;   // by the tick
  std::atomic<std::size_t> written_ = 0;  // by the recorder thread
  std::atomic<bool> closing_ = false;
  std::atomic<bool> failed_ = false;
  std::exception_ptr failure_;
  std::int64_t dropped_ = 0;
  std::thread thread_;
};

}  // namespace palpate
