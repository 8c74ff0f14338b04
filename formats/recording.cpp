#include "formats/recording.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

#include "formats/recording_parts.h"
#include "meshes/error.h"
#include "meshes/write_file.h"

namespace palpate {
namespace {

constexpr const char* hint = "Copy the file again, or record the session again.";

/// Number of rows of a dataset of a part. Throws Error unless all of it is there.
std::int64_t check_rows(const hdf5::File& part, const char* name, const hdf5::ElementType& type,
                        const std::vector<std::int64_t>& row) {
  const hdf5::Stored stored = part.locate(name, type, 1 + row.size());
  if (!std::equal(row.begin(), row.end(), stored.dims.begin() + 1))
    throw Error(std::string(name) + " has rows of another size", part.path().string(), hint);
  return stored.dims[0];
}

void read_ticks(const hdf5::File& part, std::vector<TickRecord>& ticks) {
  const auto before = ticks.size();
  bool first = true;
  for_each_tick_field([&]<class Member>(const char* name, int components, Member TickRecord::*member) {
    const hdf5::ElementType type = hdf5::element_type<Scalar<Member>>();
    const std::int64_t rows =
        check_rows(part, name, type,
                   components > 1 ? std::vector<std::int64_t>{components} : std::vector<std::int64_t>{});
    if (first) ticks.resize(before + static_cast<std::size_t>(rows));
    first = false;
    if (before + static_cast<std::size_t>(rows) != ticks.size())
      throw Error(std::string(name) + " has another number of rows", part.path().string(), hint);
    if (rows == 0) return;
    const auto width = static_cast<std::size_t>(components);
    std::vector<Scalar<Member>> values(static_cast<std::size_t>(rows) * width);
    part.read_rows(name, type, 0, rows, values.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(rows); ++i)
      std::memcpy(&(ticks[before + i].*member), &values[i * width], sizeof(Member));
  });
}

template <class T>
void read_column(const hdf5::File& part, const char* name, std::int64_t rows, std::vector<T>& column) {
  const hdf5::ElementType type = hdf5::element_type<T>();
  if (check_rows(part, name, type, {}) != rows)
    throw Error(std::string(name) + " has another number of rows", part.path().string(), hint);
  const std::size_t before = column.size();
  column.resize(before + static_cast<std::size_t>(rows));
  if (rows > 0) part.read_rows(name, type, 0, rows, column.data() + before);
}

std::int64_t count_frames(const hdf5::File& part, std::size_t surface_nodes) {
  return check_rows(part, "/frames/displacement", hdf5::element_type<float>(),
                    {static_cast<std::int64_t>(surface_nodes), 3});
}

void append_frames(const hdf5::File& part, RecordedFrames& frames) {
  const std::int64_t count = count_frames(part, frames.surface.nodes.size());
  read_column(part, "/frames/tick", count, frames.tick);
  read_column(part, "/frames/time", count, frames.time);
}

/// Values [frames x row] of some frames.
template <class T>
std::vector<T> read_some(const hdf5::File& file, std::span<const hdf5::File> parts, const char* name,
                         const std::vector<std::int64_t>& row, std::int64_t first, std::int64_t frames) {
  std::size_t width = 1;
  for (const std::int64_t size : row) width *= static_cast<std::size_t>(size);
  std::vector<T> values(static_cast<std::size_t>(frames) * width);
  std::int64_t before = 0, found = 0;
  for (const hdf5::File& part : parts) {
    const std::int64_t here = check_rows(part, name, hdf5::element_type<T>(), row);
    const std::int64_t begin = std::max(first - before, std::int64_t{0});
    const std::int64_t end = std::min(first + frames - before, here);
    if (begin < end && width > 0)
      part.read_rows(name, hdf5::element_type<T>(), begin, end - begin,
                     values.data() + width * static_cast<std::size_t>(found));
    found += std::max(end - begin, std::int64_t{0});
    before += here;
  }
  if (first < 0 || found != frames)
    throw Error("has " + std::to_string(before) + " frames, not " + std::to_string(frames) + " from number " +
                    std::to_string(first) + " on",
                file.path().string(), "Ask for frames that are there.");
  return values;
}

Recording read_once(const std::filesystem::path& path) {
  const hdf5::Quiet quiet;
  const hdf5::File file = hdf5::File::open_to_read(path);
  RecordingHead head = read_head(file);
  Recording recording;
  recording.info = std::move(head.info);
  recording.generator = std::move(head.generator);
  recording.frames.surface = std::move(head.surface);
  recording.frames.has_stress = head.has_stress;
  recording.finished = !std::filesystem::exists(parts_folder(path));
  const std::vector<hdf5::File> parts = open_parts(file, "/ticks/time");
  const std::vector<hdf5::File> frame_parts = open_parts(file, "/frames/time");
  for (const hdf5::File& part : parts) read_ticks(part, recording.ticks);
  for (const hdf5::File& part : frame_parts) append_frames(part, recording.frames);
  return recording;
}

}  // namespace

Recording read_recording(const std::filesystem::path& path) {
  // While it is recorded its parts are merged under a reader's hands: then what is there now is read.
  constexpr int attempts = 5;
  for (int attempt = 1;; ++attempt) {
    try {
      return read_once(path);
    } catch (const Error&) {
      if (attempt == attempts || !std::filesystem::exists(parts_folder(path))) throw;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

RecordedFrames read_frames(const std::filesystem::path& path) {
  const hdf5::Quiet quiet;
  const hdf5::File file = hdf5::File::open_to_read(path);
  RecordingHead head = read_head(file);
  RecordedFrames frames;
  frames.surface = std::move(head.surface);
  frames.has_stress = head.has_stress;
  for (const hdf5::File& part : open_parts(file, "/frames/time")) append_frames(part, frames);
  return frames;
}

std::vector<float> read_displacement(const std::filesystem::path& path, std::int64_t first,
                                     std::int64_t frames) {
  const hdf5::Quiet quiet;
  const hdf5::File file = hdf5::File::open_to_read(path);
  const std::int64_t nodes = std::ssize(read_head(file).surface.nodes);
  return read_some<float>(file, open_parts(file, "/frames/time"), "/frames/displacement", {nodes, 3}, first,
                          frames);
}

SurfaceFrame read_frame(const std::filesystem::path& path, std::int64_t number) {
  const hdf5::Quiet quiet;
  const hdf5::File file = hdf5::File::open_to_read(path);
  const RecordingHead head = read_head(file);
  const std::int64_t nodes = std::ssize(head.surface.nodes);
  const std::vector<hdf5::File> parts = open_parts(file, "/frames/time");
  SurfaceFrame frame;
  frame.displacement = read_some<float>(file, parts, "/frames/displacement", {nodes, 3}, number, 1);
  if (head.has_stress) {
    frame.von_mises = read_some<float>(file, parts, "/frames/von_mises", {nodes}, number, 1);
    frame.pressure = read_some<float>(file, parts, "/frames/pressure", {nodes}, number, 1);
  }
  frame.tick = read_some<std::int64_t>(file, parts, "/frames/tick", {}, number, 1).front();
  frame.time = read_some<double>(file, parts, "/frames/time", {}, number, 1).front();
  return frame;
}

bool finish_recording(const std::filesystem::path& recording) {
  const hdf5::Quiet quiet;
  const std::filesystem::path path = link_target(recording);
  read_head(hdf5::File::open_to_read(path));
  if (!std::filesystem::exists(parts_folder(path))) return true;
  const std::optional<FileDescriptor> lock = lock_parts(path);
  if (!lock) return false;
  merge_recording(path);
  return true;
}

}  // namespace palpate
