// The C functions that read recordings back.
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/recording.h"
#include "runtime/library/c_error.h"
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

}  // namespace

struct palpate_recording {
  explicit palpate_recording(const char* name) : file(open_session(name)) {
    for (std::int64_t row = 0; row < file.ticks(); ++row) ticks.push_back(tick_of(file.tick(row)));
  }

  RecordingFile file;
  std::vector<palpate_recorded_tick> ticks;
  mutable std::optional<RecordedPictures> pictures;  // from the first that is asked for on
};

extern "C" {

palpate_recording* palpate_recording_open(const char* file, char* error, size_t error_size) noexcept {
  std::unique_ptr<palpate_recording> recording;
  tell_failure("palpate_recording_open", "close other programs", error, error_size, [&](int& code) {
    if (file == nullptr)
      throw Error("there is no file name", "palpate_recording_open", "name a recording, OUT.mcap");
    code = PALPATE_ERROR_FILE;
    recording = std::make_unique<palpate_recording>(file);
  });
  return recording.release();
}

void palpate_recording_close(palpate_recording* recording) noexcept {
  const std::unique_ptr<palpate_recording> closed(recording);
}

int palpate_recording_count(const palpate_recording* recording, palpate_recording_counts* counts) noexcept {
  const RecordingFile& file = recording->file;
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
  const bool exists = number >= 0 && number < std::ssize(recording->ticks);
  const palpate_recorded_tick told =
      exists ? recording->ticks[static_cast<std::size_t>(number)] : palpate_recorded_tick{};
  return write_struct(told, tick) && exists ? 0 : -1;
}

void palpate_recording_rest(const palpate_recording* recording, double* xyz) noexcept {
  for (const Vec3& position : recording->file.surface().nodes) xyz = std::copy_n(position.data(), 3, xyz);
}

void palpate_recording_simplices(const palpate_recording* recording, int32_t* corners) noexcept {
  const std::vector<Index>& simplices = recording->file.surface().simplices;
  std::copy(simplices.begin(), simplices.end(), corners);
}

int palpate_recording_picture(const palpate_recording* recording, int64_t number, float* xyz, double* time,
                              char* error, size_t error_size) noexcept {
  return tell_failure("palpate_recording_picture", "close other programs", error, error_size, [&](int& code) {
    const int64_t pictures = std::ssize(recording->file.pictures());
    if (number < 0 || number >= pictures) {
      throw Error("there is no picture " + std::to_string(number), "palpate_recording_picture",
                  "ask for 0 to " + std::to_string(pictures - 1) + ", of which there are " +
                      std::to_string(pictures));
    }
    code = PALPATE_ERROR_FILE;
    if (!recording->pictures) recording->pictures.emplace(recording->file);
    const SurfaceFrame frame = recording->pictures->frame(number);
    if (xyz != nullptr) std::copy(frame.displacement.begin(), frame.displacement.end(), xyz);
    if (time != nullptr) *time = frame.time;
  });
}

}  // extern "C"
