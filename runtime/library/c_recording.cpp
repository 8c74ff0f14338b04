// C functions that read recordings.
#include <algorithm>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "formats/recording.h"
#include "runtime/library/c_error.h"
#include "runtime/library/guarded.h"
#include "runtime/library/palpate.h"
#include "runtime/library/sized_struct.h"
#include "runtime/loop/recorded_pictures.h"
#include "runtime/loop/session_check.h"

using namespace palpate;

namespace {

template <std::size_t n>
void copy(const double (&from)[n], double (&to)[n]) noexcept {
  std::copy_n(from, n, to);
}

/// Negates a vector: a recording has the force on the body, palpate.h that on the hand.
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

}  // namespace

namespace palpate {

/// Contents of a palpate_recording.
struct ReadRecording {
  explicit ReadRecording(const char* name) : file(open_session(name)) {}

  RecordingFile file;
  std::mutex reading;                        // held while ticks and pictures are read
  std::optional<RecordedPictures> pictures;  // made at the first request
};

}  // namespace palpate

struct palpate_recording : Guarded<ReadRecording> {
  using Guarded::Guarded;
};

extern "C" {

palpate_recording* palpate_recording_open(const char* file, char* error, size_t error_size) noexcept {
  palpate_recording* recording = nullptr;
  tell_failure("palpate_recording_open", "close other programs", error, error_size, [&](int& code) {
    if (file == nullptr)
      throw Error("there is no file name", "palpate_recording_open", "name a recording, OUT.mcap");
    code = PALPATE_ERROR_FILE;
    recording = std::make_unique<palpate_recording>(std::make_unique<ReadRecording>(file)).release();
  });
  return recording;
}

void palpate_recording_close(palpate_recording* recording) noexcept {
  if (recording != nullptr) recording->end();
}

int palpate_recording_count(const palpate_recording* recording, palpate_recording_counts* counts) noexcept {
  const Inside<ReadRecording> inside = look(recording);
  if (!inside) return refused(recording);
  const RecordingFile& file = inside->file;
  const RecordedSurface& surface = file.surface();
  const palpate_recording_counts all{
      .size = sizeof(palpate_recording_counts),
      .ticks = file.ticks(),
      .rate = file.info().rate,
      .pictures = std::ssize(file.pictures()),
      .nodes = static_cast<int32_t>(surface.nodes.size()),
      .simplices = static_cast<int32_t>(surface.simplices.size()) / surface.corners,
      .corners = surface.corners};
  return write_struct(all, counts) ? 0 : -1;
}

int palpate_recording_tick(const palpate_recording* recording, int64_t number,
                           palpate_recorded_tick* tick) noexcept {
  const Inside<ReadRecording> inside = look(recording);
  palpate_recorded_tick told{};
  int code = inside ? -1 : refused(recording);
  if (inside && number >= 0 && number < inside->file.ticks()) {
    try {
      const std::lock_guard lock(inside->reading);
      told = tick_of(inside->file.tick(number));
      code = 0;
    } catch (...) {  // the file was cut, or there is no memory
      code = PALPATE_ERROR_FILE;
    }
  }
  return write_struct(told, tick) ? code : -1;
}

int palpate_recording_rest(const palpate_recording* recording, double* xyz) noexcept {
  const Inside<ReadRecording> inside = look(recording);
  if (!inside) return refused(recording);
  if (xyz == nullptr) return -1;
  for (const Vec3& position : inside->file.surface().nodes) xyz = std::copy_n(position.data(), 3, xyz);
  return 0;
}

int palpate_recording_simplices(const palpate_recording* recording, int32_t* corners) noexcept {
  const Inside<ReadRecording> inside = look(recording);
  if (!inside) return refused(recording);
  if (corners == nullptr) return -1;
  const std::vector<Index>& simplices = inside->file.surface().simplices;
  std::copy(simplices.begin(), simplices.end(), corners);
  return 0;
}

int palpate_recording_picture(const palpate_recording* recording, int64_t number, float* xyz, double* time,
                              char* error, size_t error_size) noexcept {
  constexpr const char* place = "palpate_recording_picture";
  return tell_failure(place, "close other programs", error, error_size, [&](int& code) {
    const Inside<ReadRecording> inside = look(recording);
    if (recording == nullptr) throw Error("there is no recording", place, "open one");
    code = PALPATE_ERROR_STATE;
    if (!inside) throw Error("the recording is closed", place, "open it again");
    code = PALPATE_ERROR_ARGUMENT;
    const int64_t pictures = std::ssize(inside->file.pictures());
    if (number < 0 || number >= pictures) {
      throw Error("there is no picture " + std::to_string(number), place,
                  "ask for 0 to " + std::to_string(pictures - 1) + ", of which there are " +
                      std::to_string(pictures));
    }
    code = PALPATE_ERROR_FILE;
    const std::lock_guard lock(inside->reading);
    if (!inside->pictures) inside->pictures.emplace(inside->file);
    const SurfaceFrame frame = inside->pictures->frame(number);
    if (xyz != nullptr) std::copy(frame.displacement.begin(), frame.displacement.end(), xyz);
    if (time != nullptr) *time = frame.time;
  });
}

}  // extern "C"
