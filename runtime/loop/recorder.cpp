#include "runtime/loop/recorder.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/error.h"
#include "runtime/safety/device.h"
#include "runtime/safety/fault.h"

namespace palpate {
namespace {

constexpr std::size_t ring_seconds = 16;   // capacity for ticks
constexpr std::size_t picture_ring = 256;  // four seconds at 60 Hz
constexpr auto recorder_pause = std::chrono::milliseconds(1);
constexpr auto interval = std::chrono::milliseconds(500);  // between checkpoints

constexpr int at_once = 1000;  // ticks between readings of the clock

constexpr double seconds(std::chrono::milliseconds time) {
  return 1e-3 * static_cast<double>(time.count());
}

constexpr std::array<std::pair<DeviceEvent, const char*>, 6> event_texts = {{
    {DeviceEvent::opened_again, "the device is back"},
    {DeviceEvent::lost, "the device is lost"},
    {DeviceEvent::acknowledged, "the fault was acknowledged"},
    {DeviceEvent::input_lost, "who moved the tool is gone"},
    {DeviceEvent::lifted, "the tool was lifted"},
    {DeviceEvent::resumed, "the run goes on after a pause"},
}};

}  // namespace

std::int64_t ticks_per_frame(std::int64_t rate, double frames_a_second) noexcept {
  const double ticks = static_cast<double>(rate) / frames_a_second;
  return std::max<std::int64_t>(std::llround(std::min(ticks, 1e15)), 1);
}

Recorder::Recorder(const std::filesystem::path& path, const SessionInfo& info, const RecordedSurface& surface,
                   OnFailure on_failure)
    : on_failure_(std::move(on_failure)),
      writer_(path, info, surface),
      ticks_(ring_seconds * static_cast<std::size_t>(info.rate)),
      pictures_(picture_ring),
      thread_([this] { write(); }) {}

Recorder::~Recorder() {
  closing_ = true;
  if (thread_.joinable()) thread_.join();
}

bool Recorder::try_push(const TickRecord& tick) noexcept {
  TickRecord copy = tick;
  return !failed_ && ticks_.push(copy);
}

bool Recorder::try_push(RecordedPicture& picture) noexcept {
  return !failed_ && pictures_.push(picture);
}

void Recorder::push(const TickRecord& tick) noexcept {
  ++ticks_given_.all;
  if (!try_push(tick)) ++ticks_given_.without_room;
}

void Recorder::push_picture(RecordedPicture picture) noexcept {
  ++pictures_given_.all;
  if (!try_push(picture)) ++pictures_given_.without_room;
}

void Recorder::push_waiting(const TickRecord& tick) noexcept {
  waits_ = true;
  ++ticks_given_.all;
  while (!try_push(tick)) {
    if (failed_) return;
    std::this_thread::sleep_for(recorder_pause);
  }
}

void Recorder::push_picture_waiting(RecordedPicture picture) noexcept {
  ++pictures_given_.all;
  while (!try_push(picture)) {
    if (failed_) return;
    std::this_thread::sleep_for(recorder_pause);
  }
}

void Recorder::finish() {
  closing_ = true;
  thread_.join();
  if (failed_) std::rethrow_exception(failure_);
  writer_.finish();
}

void Recorder::note_events(const TickRecord& tick) {
  const auto say = [&](const std::string& text) { writer_.append({.time = tick.time, .text = text}); };
  const auto begun = static_cast<DeviceEvent>(tick.event & ~last_.event);
  for (const auto& [event, text] : event_texts)
    if (has(begun, event)) say(text);
  if (tick.phase != last_.phase) say(std::string("phase: ") + safety_phase_names.at(tick.phase).second);
  if (tick.fault != last_.fault) say(std::string("fault: ") + fault_names.at(tick.fault).second);
  last_ = tick;
}

/// Writes the pictures of times before `before`; returns true if there were any.
bool Recorder::take_pictures(double before) {
  const auto time_of = [](const auto& picture) { return picture.time; };
  for (bool any = false;; any = true) {
    RecordedPicture popped;
    if (!next_ && pictures_.pop(popped)) next_ = std::move(popped);
    if (!next_ || !(std::visit(time_of, *next_) < before)) return any;
    std::visit([&](const auto& picture) { writer_.append(picture); }, *next_);
    next_.reset();
  }
}

void Recorder::take(const TickRecord& tick) {
  take_pictures(tick.time);
  if (waits_ && tick.time - kept_until_ >= seconds(interval)) {
    writer_.checkpoint();
    kept_until_ = tick.time;
  }
  note_events(tick);
  writer_.append(tick);
  last_time_ = tick.time;
}

/// Writes queued ticks and pictures, each picture between its tick and the next if it has arrived by then.
/// Returns true if there were any.
bool Recorder::take_all(bool closing) {
  TickRecord tick;
  int ticks = 0;
  for (; ticks < at_once && ticks_.pop(tick); ++ticks) take(tick);
  constexpr double end = std::numeric_limits<double>::infinity();
  const bool pictures = take_pictures(closing && ticks == 0 ? end : std::nextafter(last_time_, end));
  return ticks > 0 || pictures;
}

void Recorder::write() noexcept {
  try {
    auto last = std::chrono::steady_clock::now();
    for (;;) {
      const bool closing = closing_;  // read before the rings: nothing is pushed after closing
      const bool taken = take_all(closing);
      if (closing && !taken) break;
      const auto now = std::chrono::steady_clock::now();
      if (!waits_ && now - last >= interval) {
        writer_.checkpoint();
        last = now;
      }
      if (!taken) std::this_thread::sleep_for(recorder_pause);
    }
    writer_.checkpoint();
  } catch (const std::exception&) {
    failure_ = std::current_exception();
    fail(handled_error("", "close other programs"));
  }
}

void Recorder::fail(const Error& reason) noexcept {
  ticks_given_.kept = writer_.ticks();
  pictures_given_.kept = writer_.pictures();
  failed_ = true;
  if (on_failure_) on_failure_(reason);
}

}  // namespace palpate
