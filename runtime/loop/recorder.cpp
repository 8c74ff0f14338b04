#include "runtime/loop/recorder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "runtime/loop/output.h"
#include "runtime/loop/session_xdmf.h"

namespace palpate {
namespace {

constexpr std::size_t ring_seconds = 16;  // ticks for which there is room
constexpr std::size_t frame_ring = 256;   // four seconds at 60 Hz
constexpr auto recorder_pause = std::chrono::milliseconds(1);
constexpr auto interval = std::chrono::milliseconds(500);    // between checkpoints
constexpr std::size_t most_waiting = std::size_t{32} << 20;  // bytes, for a checkpoint that is not due yet

}  // namespace

std::int64_t ticks_per_frame(std::int64_t rate, double frames_a_second) noexcept {
  const double ticks = static_cast<double>(rate) / frames_a_second;
  return std::max<std::int64_t>(std::llround(std::min(ticks, 1e15)), 1);
}

Recorder::Recorder(const std::filesystem::path& path, const SessionInfo& info, const RecordedSurface& surface,
                   OnFailure on_failure)
    : path_(path),
      on_failure_(std::move(on_failure)),
      writer_(path, info, surface),
      ticks_(ring_seconds * static_cast<std::size_t>(info.rate)),
      frames_(frame_ring),
      thread_([this] { write(); }) {}

Recorder::~Recorder() {
  closing_ = true;
  if (thread_.joinable()) thread_.join();
}

bool Recorder::try_push(const TickRecord& tick) noexcept {
  TickRecord copy = tick;
  return !failed_ && ticks_.push(copy);
}

bool Recorder::try_push(SurfaceFrame& frame) noexcept {
  return !failed_ && frames_.push(frame);
}

void Recorder::push(const TickRecord& tick) noexcept {
  if (!try_push(tick)) ++dropped_;
}

void Recorder::push_frame(SurfaceFrame frame) noexcept {
  if (!try_push(frame)) ++dropped_frames_;
}

void Recorder::push_waiting(const TickRecord& tick) noexcept {
  while (!try_push(tick)) {
    if (failed_) return push(tick);
    std::this_thread::sleep_for(recorder_pause);
  }
}

void Recorder::push_frame_waiting(SurfaceFrame frame) noexcept {
  while (!try_push(frame)) {
    if (failed_) return push_frame(std::move(frame));
    std::this_thread::sleep_for(recorder_pause);
  }
}

void Recorder::finish() {
  closing_ = true;
  thread_.join();
  if (failed_) std::rethrow_exception(failure_);
  writer_.finish();
  write_xdmf(path_, writer_.frames());
}

/// Bytes that were taken out of the rings.
std::size_t Recorder::take_all() {
  std::size_t taken = 0;
  TickRecord tick;
  for (; taken < most_waiting && ticks_.pop(tick); taken += sizeof tick) writer_.append({&tick, 1});
  SurfaceFrame frame;
  while (taken < most_waiting && frames_.pop(frame)) {
    const std::size_t numbers = frame.displacement.size() + frame.von_mises.size() + frame.pressure.size();
    taken += sizeof frame + numbers * sizeof(float);
    writer_.append(std::move(frame));
  }
  return taken;
}

void Recorder::write() noexcept {
  try {
    auto last = std::chrono::steady_clock::now();
    std::size_t waiting = 0;
    for (;;) {
      const bool closing = closing_;  // read before the rings: nothing is pushed after closing
      const std::size_t taken = take_all();
      waiting += taken;
      if (closing && taken == 0) break;
      const auto now = std::chrono::steady_clock::now();
      if (now - last >= interval || waiting >= most_waiting) {
        writer_.checkpoint();
        last = now;
        waiting = 0;
      }
      if (taken == 0) std::this_thread::sleep_for(recorder_pause);
    }
    writer_.checkpoint();
  } catch (const std::exception& error) {
    failure_ = std::current_exception();
    fail(error);
  }
}

void Recorder::fail(const std::exception& reason) noexcept {
  failed_ = true;
  if (on_failure_) on_failure_(as_error(reason));
}

}  // namespace palpate
