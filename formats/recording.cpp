#include "formats/recording.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <thread>

#include "base/error.h"
#include "base/write_file.h"
#include "formats/recording_parts.h"
#include "formats/superblock.h"

namespace palpate {
namespace {

constexpr const char* hint = "Copy the file again, or record the session again";
constexpr double longest_time = 1e9;                                          // s
constexpr std::int64_t longest_ns = std::int64_t{1'000'000'000'000'000'000};  // ns

hdf5::Contents open_master(const std::filesystem::path& path) {
  FileDescriptor file = open_file(path, OpenMode::read);
  check_superblock(file, {"a recording", "Give a recording that palpate-runtime has written", hint});
  return hdf5::Contents::read(std::move(file));
}

// ---- rows ----

void read_ticks(const hdf5::Contents& part, const RecordingHead& head, std::vector<TickRecord>& ticks) {
  const auto before = ticks.size();
  const std::int64_t rows = part.locate("/ticks/time", hdf5::element_type<double>(), 1).dims[0];
  ticks.resize(before + static_cast<std::size_t>(rows));
  for_each_tick_field(head, [&]<class Member>(const char* name, int components, Member TickRecord::*member) {
    const auto width = static_cast<std::size_t>(components);
    std::vector<Scalar<Member>> values(static_cast<std::size_t>(rows) * width);
    part.read_rows(name, hdf5::element_type<Scalar<Member>>(), 0, rows, values.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(rows); ++i)
      std::memcpy(&(ticks[before + i].*member), &values[i * width], sizeof(Member));
  });
}

std::int64_t count_frames(const hdf5::Contents& part) {
  return part.locate("/frames/time", hdf5::element_type<double>(), 1).dims[0];
}

template <class T>
void append_column(const hdf5::Contents& part, const char* name, std::vector<T>& column) {
  const std::int64_t rows = count_frames(part);
  const std::size_t before = column.size();
  column.resize(before + static_cast<std::size_t>(rows));
  part.read_rows(name, hdf5::element_type<T>(), 0, rows, column.data() + before);
}

/// Values [frames x width] of some frames.
template <class T>
std::vector<T> read_some(const RecordingFiles& recording, const char* name, std::size_t width,
                         std::int64_t first, std::int64_t frames) {
  std::vector<T> values;
  std::int64_t before = 0, found = 0;
  for (const std::size_t file : recording.frame_files) {
    const hdf5::Contents& part = recording.files[file];
    const std::int64_t here = count_frames(part);
    const std::int64_t begin = std::max(first - before, std::int64_t{0});
    const std::int64_t end = std::min(first + frames - before, here);
    if (begin < end) {
      const std::size_t at = values.size();
      values.resize(at + width * static_cast<std::size_t>(end - begin));
      part.read_rows(name, hdf5::element_type<T>(), begin, end - begin, values.data() + at);
    }
    found += std::max(end - begin, std::int64_t{0});
    before += here;
  }
  if (first < 0 || found != frames) {
    throw Error("has " + std::to_string(before) + " frames, not " + std::to_string(frames) + " from number " +
                    std::to_string(first) + " on",
                recording.files.front().path().string(), "Ask for frames that are there");
  }
  return values;
}

// ---- what can be ----

/// Says what is wrong with an entry of a dataset.
class Checker {
 public:
  explicit Checker(std::string where) : where_(std::move(where)) {}

  template <class T>
  void expect(bool possible, const char* name, std::size_t row, T value, const char* needed) const {
    if (possible) return;
    throw Error(std::string(name) + ", row " + std::to_string(row) + ", holds " + std::to_string(value) +
                    ", which is not " + needed,
                where_, hint);
  }

 private:
  std::string where_;
};

void check_surface(const RecordedSurface& surface, const Checker& check) {
  for (std::size_t i = 0; i < surface.nodes.size(); ++i)
    for (const double x : surface.nodes[i])
      check.expect(std::isfinite(x), "/surface/nodes", i, x, "a finite number");
  const auto nodes = std::ssize(surface.nodes);
  for (std::size_t i = 0; i < surface.simplices.size(); ++i) {
    check.expect(surface.simplices[i] >= 0 && surface.simplices[i] < nodes, "/surface/simplices",
                 i / static_cast<std::size_t>(surface.corners), surface.simplices[i],
                 "a node of the surface");
  }
  for (std::size_t i = 0; i < surface.held.size(); ++i)
    check.expect(surface.held[i] < 8, "/surface/held", i, int{surface.held[i]}, "a set of axes");
}

bool is_time(double time) {
  return time >= 0.0 && time <= longest_time;
}

bool is_moment(std::int64_t ns) {
  return ns >= -longest_ns && ns <= longest_ns;
}

void check_ticks(const std::vector<TickRecord>& ticks, const Checker& check) {
  double before = -1.0;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    const TickRecord& tick = ticks[k];
    check.expect(is_time(tick.time) && tick.time > before, "/ticks/time", k, tick.time,
                 "a time after the one before it");
    before = tick.time;
    check.expect(tick.contacts >= 0, "/ticks/contacts", k, tick.contacts, "a number of contacts");
    check.expect(std::isfinite(tick.force_error) && tick.force_error >= 0.0F, "/ticks/force_error", k,
                 tick.force_error, "the size of an error");
    check.expect(std::isfinite(tick.greens_error) && tick.greens_error >= 0.0F, "/ticks/greens_error", k,
                 tick.greens_error, "the size of an error");
    check.expect(tick.left_out >= 0, "/ticks/left_out", k, tick.left_out, "a number of contacts");
    check.expect(tick.patch >= -1, "/ticks/patch", k, tick.patch, "a node, or -1 for none");
    check.expect(tick.grab <= 1, "/ticks/grab", k, int{tick.grab}, "0 or 1");
    check.expect(is_moment(tick.arrived_ns), "/ticks/arrived_ns", k, tick.arrived_ns,
                 "a time of this session");
    check.expect(is_moment(tick.begun_ns), "/ticks/begun_ns", k, tick.begun_ns, "a time of this session");
  }
}

void check_frames(const RecordedFrames& frames, const Checker& check) {
  for (std::size_t k = 0; k < frames.tick.size(); ++k) {
    check.expect(frames.tick[k] >= (k > 0 ? frames.tick[k - 1] : 0), "/frames/tick", k, frames.tick[k],
                 "a tick after that of the frame before it");
    check.expect(is_time(frames.time[k]) && (k == 0 || frames.time[k] >= frames.time[k - 1]), "/frames/time",
                 k, frames.time[k], "a time after that of the frame before it");
  }
}

Recording read_once(const std::filesystem::path& path, const RecordingFiles& files) {
  check_rows(files);
  Recording recording;
  recording.info = files.head.info;
  recording.generator = files.head.generator;
  recording.frames.surface = files.head.surface;
  recording.frames.has_stress = files.head.has_stress;
  recording.finished = !std::filesystem::exists(parts_folder(path));
  for (const std::size_t file : files.tick_files) read_ticks(files.files[file], files.head, recording.ticks);
  for (const std::size_t file : files.frame_files) {
    append_column(files.files[file], "/frames/tick", recording.frames.tick);
    append_column(files.files[file], "/frames/time", recording.frames.time);
  }
  const Checker check(path.string());
  check_surface(recording.frames.surface, check);
  check_ticks(recording.ticks, check);
  check_frames(recording.frames, check);
  return recording;
}

}  // namespace

RecordingFile::RecordingFile(const std::filesystem::path& path) {
  // While it is recorded its parts are merged under a reader's hands: then what is there now is read.
  constexpr int attempts = 5;
  for (int attempt = 1;; ++attempt) {
    try {
      files_ = std::make_shared<const RecordingFiles>(open_recording(open_master(path)));
      recording_ = read_once(path, *files_);
      return;
    } catch (const Error&) {
      if (attempt == attempts || !std::filesystem::exists(parts_folder(path))) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

std::vector<float> RecordingFile::displacement(std::int64_t first, std::int64_t frames) const {
  return read_some<float>(*files_, "/frames/displacement", 3 * files_->head.surface.nodes.size(), first,
                          frames);
}

SurfaceFrame RecordingFile::frame(std::int64_t number) const {
  const std::size_t nodes = files_->head.surface.nodes.size();
  SurfaceFrame frame;
  frame.displacement = displacement(number, 1);
  if (files_->head.has_stress) {
    frame.von_mises = read_some<float>(*files_, "/frames/von_mises", nodes, number, 1);
    frame.pressure = read_some<float>(*files_, "/frames/pressure", nodes, number, 1);
  }
  frame.tick = read_some<std::int64_t>(*files_, "/frames/tick", 1, number, 1).front();
  frame.time = read_some<double>(*files_, "/frames/time", 1, number, 1).front();
  return frame;
}

Recording read_recording(const std::filesystem::path& path) {
  return RecordingFile(path).recording();
}

bool finish_recording(const std::filesystem::path& recording) {
  const std::filesystem::path path = link_target(recording);
  if (!std::filesystem::exists(parts_folder(path))) return true;
  const std::optional<FileDescriptor> lock = lock_parts(path);
  if (!lock) return false;
  const RecordingFiles files = open_recording(open_master(path));
  const hdf5::Quiet quiet;
  merge_recording(path, parts_of(files), files.head);
  return true;
}

}  // namespace palpate
