// The C functions that read recordings back.
#include <algorithm>
#include <memory>
#include <string>

#include "formats/recording.h"
#include "runtime/library/c_error.h"
#include "runtime/library/palpate.h"
#include "runtime/library/sized_struct.h"
#include "runtime/loop/session_check.h"

using namespace palpate;

struct palpate_recording {
  explicit palpate_recording(const char* name) : file(name) { check_session(file.recording(), name); }

  RecordingFile file;
};

namespace {

template <std::size_t n>
void copy(const double (&from)[n], double (&to)[n]) noexcept {
  std::copy_n(from, n, to);
}

/// What is on the body in a recording is on the hand here.
template <std::size_t n>
void oppose(const double (&from)[n], double (&to)[n]) noexcept {
  std::transform(from, from + n, to, [](double value) { return -value; });
}

palpate_recorded_tick tick_of(const TickRecord& record) noexcept {
  palpate_recorded_tick tick{};
  tick.time = record.time;
  copy(record.device_position, tick.position);
  copy(record.device_orientation, tick.orientation);
  tick.grab = record.grab;
  oppose(record.force, tick.force);
  oppose(record.torque, tick.torque);
  copy(record.tool_position, tick.tool_position);
  copy(record.tool_orientation, tick.tool_orientation);
  tick.contacts = record.contacts;
  tick.status = record.status;
  return tick;
}

const RecordedFrames& frames_of(const palpate_recording* recording) noexcept {
  return recording->file.recording().frames;
}

}  // namespace

extern "C" {

palpate_recording* palpate_recording_open(const char* file, char* error, size_t error_size) noexcept {
  std::unique_ptr<palpate_recording> recording;
  tell_failure("palpate_recording_open", "close other programs", error, error_size, [&](int& code) {
    if (file == nullptr)
      throw Error("there is no file name", "palpate_recording_open", "name a recording, OUT.h5");
    code = PALPATE_ERROR_FILE;
    recording = std::make_unique<palpate_recording>(file);
  });
  return recording.release();
}

void palpate_recording_close(palpate_recording* recording) noexcept {
  const std::unique_ptr<palpate_recording> closed(recording);
}

int palpate_recording_count(const palpate_recording* recording, palpate_recording_counts* counts) noexcept {
  const Recording& read = recording->file.recording();
  const RecordedSurface& surface = read.frames.surface;
  const palpate_recording_counts all{
      .size = sizeof(palpate_recording_counts),
      .ticks = std::ssize(read.ticks),
      .rate = read.info.rate,
      .pictures = std::ssize(read.frames.tick),
      .nodes = static_cast<int32_t>(surface.nodes.size()),
      .simplices = static_cast<int32_t>(surface.simplices.size()) / surface.corners,
      .corners = surface.corners};
  return write_struct(all, counts) ? 0 : -1;
}

int palpate_recording_tick(const palpate_recording* recording, int64_t number,
                           palpate_recorded_tick* tick) noexcept {
  const std::vector<TickRecord>& ticks = recording->file.recording().ticks;
  const bool exists = number >= 0 && number < std::ssize(ticks);
  const palpate_recorded_tick told =
      exists ? tick_of(ticks[static_cast<std::size_t>(number)]) : palpate_recorded_tick{};
  return write_struct(told, tick) && exists ? 0 : -1;
}

void palpate_recording_rest(const palpate_recording* recording, double* xyz) noexcept {
  for (const Vec3& position : frames_of(recording).surface.nodes) xyz = std::copy_n(position.data(), 3, xyz);
}

void palpate_recording_simplices(const palpate_recording* recording, int32_t* corners) noexcept {
  const std::vector<Index>& simplices = frames_of(recording).surface.simplices;
  std::copy(simplices.begin(), simplices.end(), corners);
}

int palpate_recording_picture(const palpate_recording* recording, int64_t number, float* xyz, double* time,
                              char* error, size_t error_size) noexcept {
  return tell_failure("palpate_recording_picture", "close other programs", error, error_size, [&](int& code) {
    const int64_t pictures = std::ssize(frames_of(recording).tick);
    if (number < 0 || number >= pictures) {
      throw Error("there is no picture " + std::to_string(number), "palpate_recording_picture",
                  "ask for 0 to " + std::to_string(pictures - 1) + ", of which there are " +
                      std::to_string(pictures));
    }
    code = PALPATE_ERROR_FILE;
    const SurfaceFrame frame = recording->file.frame(number);
    if (xyz != nullptr) std::copy(frame.displacement.begin(), frame.displacement.end(), xyz);
    if (time != nullptr) *time = frame.time;
  });
}

}  // extern "C"
