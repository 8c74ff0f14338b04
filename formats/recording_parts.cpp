#include "formats/recording_parts.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <iterator>
#include <limits>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/printable.h"
#include "base/write_file.h"
#include "formats/checksum.h"
#include "formats/compressed_row.h"

namespace palpate {
namespace {

constexpr std::int64_t major_version = 4, minor_version = 4;
constexpr std::int64_t highest_rate = 1'000'000;  // ticks a second
constexpr const char* format_name = "palpate-recording";
constexpr const char* units = "s, m, m/s, N, N m, N/m, Pa; names with _ns in ns";
constexpr const char* lock_name = "lock";
constexpr const char* master_name = "master.partial";
constexpr const char* altered_hint = "Copy the file again, or record the session again";
constexpr std::int64_t block = std::int64_t{4} << 20;  // bytes that are copied at once

/// A dataset with a row for each tick or frame.
struct RowField {
  const char* name;
  hdf5::ElementType type;
  std::vector<std::int64_t> row;  // shape
  bool of_frame;
  bool is_compressed = false;  // row by row, unless there are none

  [[nodiscard]] std::int64_t row_bytes() const {
    auto bytes = static_cast<std::int64_t>(type.bytes);
    for (const std::int64_t size : row) bytes *= size;
    return bytes;
  }
  [[nodiscard]] std::int64_t rows(const RecordingPart& part) const {
    return of_frame ? part.frames : part.ticks;
  }
  [[nodiscard]] bool compresses(std::int64_t rows) const {
    return is_compressed && rows > 0 && row_bytes() > 0;
  }
  [[nodiscard]] std::vector<std::int64_t> dims(std::int64_t rows) const {
    std::vector<std::int64_t> result = {rows};
    result.insert(result.end(), row.begin(), row.end());
    return result;
  }
};

std::vector<RowField> row_fields(const RecordingHead& head) {
  const std::int64_t surface_nodes = std::ssize(head.surface.nodes);
  std::vector<RowField> fields;
  for_each_tick_field(head, [&]<class Member>(const char* name, int components, Member TickRecord::*) {
    RowField field = {name, hdf5::element_type<Scalar<Member>>(), {}, false};
    if (components > 1) field.row = {components};
    fields.push_back(field);
  });
  fields.push_back({"/frames/tick", hdf5::element_type<std::int64_t>(), {}, true});
  fields.push_back({"/frames/time", hdf5::element_type<double>(), {}, true});
  fields.push_back({"/frames/displacement",
                    hdf5::element_type<float>(),
                    {surface_nodes, 3},
                    true,
                    head.has_compressed_frames});
  if (head.has_stress) {
    for (const char* name : {"/frames/von_mises", "/frames/pressure"})
      fields.push_back(
          {name, hdf5::element_type<float>(), {surface_nodes}, true, head.has_compressed_frames});
  }
  return fields;
}

/// Writes a dataset with its checksum.
template <class T>
StoredRows write_checked(hdf5::File& file, const char* name, std::span<const std::int64_t> dims,
                         const std::vector<T>& values) {
  ChunkedChecksum running;
  running.append(std::as_bytes(std::span(values)));
  const StoredRows stored = {.offset = file.write(name, hdf5::element_type<T>(), dims, values.data()),
                             .bytes = static_cast<std::int64_t>(values.size() * sizeof(T)),
                             .checksum = running.digits()};
  file.write_attribute(name, "xxh3", stored.checksum);
  return stored;
}

/// Writes rows [dims] of floats, compressed unless there are none, with their checksum. `row_of` gives each.
StoredRows write_compressed(hdf5::File& file, const char* name, std::span<const std::int64_t> dims,
                            const std::function<std::vector<float>(std::size_t)>& row_of) {
  ChunkedChecksum running;
  StoredRows stored;
  if (std::ranges::find(dims, 0) != dims.end()) {
    stored.offset = file.write(name, hdf5::element_type<float>(), dims, nullptr);
  } else {
    hdf5::CompressedRows rows = file.write_compressed(name, hdf5::element_type<float>(), dims);
    for (std::size_t k = 0; k < static_cast<std::size_t>(dims[0]); ++k) {
      const std::vector<float> values = row_of(k);
      const std::vector<std::byte> row = compress_row(std::as_bytes(std::span(values)), sizeof(float));
      rows.append(row);
      running.append(row);
    }
    stored.row_starts = rows.starts();
    stored.offset = stored.row_starts.front();
    stored.bytes = stored.row_starts.back() - stored.offset;
  }
  stored.checksum = running.digits();
  file.write_attribute(name, "xxh3", stored.checksum);
  return stored;
}

/// What is written has checksums, whatever it was read from.
std::int64_t minor_version_of(const RecordingHead& head) {
  if (!head.has_stress) return 0;
  if (!head.has_force_error) return 2;
  return head.has_compressed_frames ? minor_version : 3;
}

void write_head(hdf5::File& file, const RecordingHead& head) {
  file.write_attribute("/", "format", std::string(format_name));
  file.write_attribute("/", "version", std::array{major_version, minor_version_of(head)});
  file.write_attribute("/", "generator", head.generator);
  file.write_attribute("/", "units", std::string(units));
  file.write_attribute("/", "model", head.info.model_path);
  file.write_attribute("/", "content_hash", head.info.content_hash);
  file.write_attribute("/", "device", head.info.device);
  file.write_attribute("/", "rate", std::array{head.info.rate});
  file.write_attribute("/", "options", head.info.options);
  const RecordedSurface& surface = head.surface;
  std::vector<double> nodes;
  for (const Vec3& node : surface.nodes) nodes.insert(nodes.end(), node.begin(), node.end());
  write_checked<double>(file, "/surface/nodes", std::array{std::ssize(surface.nodes), 3L}, nodes);
  write_checked<Index>(
      file, "/surface/simplices",
      std::array{std::ssize(surface.simplices) / surface.corners, std::int64_t{surface.corners}},
      surface.simplices);
  if (!head.has_stress) return;
  std::vector<std::uint8_t> held = surface.held;
  held.resize(surface.nodes.size());
  write_checked<std::uint8_t>(file, "/surface/held", std::array{std::ssize(held)}, held);
}

/// Writes a file under a temporary name, then renames it.
void write_whole(const std::filesystem::path& path, const std::filesystem::path& partial, bool durably,
                 const std::function<void(hdf5::File&)>& fill) {
  make_anew(partial);
  try {
    hdf5::File file = hdf5::File::create(partial);
    fill(file);
    file.close();
    if (durably) {
      rename_durably(partial, path);
    } else {
      rename_file(partial, path);
    }
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw;
  }
}

/// Where the recording itself is written before it is renamed: in the folder of parts, which is ours.
std::filesystem::path unfinished_master(const std::filesystem::path& recording) {
  return parts_folder(recording) / master_name;
}

/// lock, master.partial, 12.h5, 12.h5.partial
bool is_of_a_recording(const std::filesystem::directory_entry& entry) {
  std::error_code failed;
  if (entry.symlink_status(failed).type() != std::filesystem::file_type::regular) return false;
  std::string name = entry.path().filename().string();
  if (name == lock_name || name == master_name) return true;
  const std::size_t digits = name.find_first_not_of("0123456789");
  return digits != 0 && digits != std::string::npos &&
         (name.substr(digits) == ".h5" || name.substr(digits) == ".h5.partial");
}

std::int64_t count_rows(std::span<const RecordingPart> parts, const RowField& field) {
  std::int64_t rows = 0;
  for (const RecordingPart& part : parts) rows += field.rows(part);
  return rows;
}

void expect_checksum(const std::filesystem::path& file, const std::string& dataset, const std::string& found,
                     const std::string& stored) {
  if (found != stored)
    throw Error(dataset + " was altered: its checksum is " + found + ", not " + stored, file.string(),
                altered_hint);
}

std::string stored_checksum(const hdf5::Contents& file, const std::string& dataset) {
  const auto stored = file.text_attribute(dataset, "xxh3");
  if (!stored) throw Error(dataset + " has no checksum", file.path().string(), altered_hint);
  return *stored;
}

/// Bytes of a file, one piece after another, with their checksum.
class RowBytes {
 public:
  RowBytes(const FileDescriptor& file, ChunkedChecksum& written) : file_(file), written_(written) {}

  std::span<const std::byte> read(std::int64_t offset, std::int64_t bytes) {
    bytes_.resize(static_cast<std::size_t>(bytes));
    read_exactly(file_, bytes_, offset);
    found_.append(bytes_);
    written_.append(bytes_);
    return bytes_;
  }
  [[nodiscard]] std::string digits() const { return found_.digits(); }

 private:
  const FileDescriptor& file_;
  ChunkedChecksum& written_;  // of several parts
  ChunkedChecksum found_;
  std::vector<std::byte> bytes_;
};

/// Writes the rows of a field of all parts as one dataset, and proves their checksums. `files` are the parts.
StoredRows copy_rows(hdf5::File& to, const RowField& field, std::size_t number,
                     std::span<const RecordingPart> parts, std::span<const FileDescriptor> files) {
  const std::int64_t rows = count_rows(parts, field), row_bytes = field.row_bytes();
  const std::int64_t at_once = std::max<std::int64_t>(block / std::max<std::int64_t>(row_bytes, 1), 1);
  StoredRows copied;
  std::optional<hdf5::CompressedRows> compressed;
  if (field.compresses(rows)) {
    compressed = to.write_compressed(field.name, field.type, field.dims(rows));
  } else {
    copied.offset = to.write(field.name, field.type, field.dims(rows), nullptr);
  }
  ChunkedChecksum written;
  std::int64_t first = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const StoredRows& stored = parts[p].fields[number];
    const std::int64_t here = field.rows(parts[p]);
    if (here == 0 || row_bytes == 0) continue;
    RowBytes bytes(files[p], written);
    if (compressed) {
      for (std::size_t k = 0; k + 1 < stored.row_starts.size(); ++k)
        compressed->append(bytes.read(stored.row_starts[k], stored.row_starts[k + 1] - stored.row_starts[k]));
    } else {
      for (std::int64_t done = 0; done < here; done += at_once) {
        const std::int64_t now = std::min(at_once, here - done);
        to.write_rows(field.name, field.type, first + done, now,
                      bytes.read(stored.offset + done * row_bytes, now * row_bytes).data());
      }
    }
    if (!stored.checksum.empty()) expect_checksum(parts[p].file, field.name, bytes.digits(), stored.checksum);
    first += here;
    copied.bytes += stored.bytes;
  }
  if (compressed) copied.row_starts = compressed->starts();
  copied.checksum = written.digits();
  return copied;
}

std::vector<StoredRows> write_rows_of(hdf5::File& to, std::span<const RecordingPart> parts,
                                      const RecordingHead& head) {
  std::vector<FileDescriptor> files;
  for (const RecordingPart& part : parts) files.push_back(open_file(part.file, OpenMode::read));
  const std::vector<RowField> fields = row_fields(head);
  std::vector<StoredRows> copied;
  for (std::size_t k = 0; k < fields.size(); ++k) {
    copied.push_back(copy_rows(to, fields[k], k, parts, files));
    to.write_attribute(fields[k].name, "xxh3", copied.back().checksum);
  }
  return copied;
}

/// Where a plain file has the rows of a field, and how many. Throws Error unless all of it is there.
std::pair<StoredRows, std::int64_t> locate_rows(const hdf5::Contents& file, const RowField& field,
                                                bool has_checksums) {
  const std::size_t rank = 1 + field.row.size();
  const hdf5::Stored stored = field.is_compressed ? file.locate_rows(field.name, field.type, rank)
                                                  : file.locate(field.name, field.type, rank);
  if (!std::equal(field.row.begin(), field.row.end(), stored.dims.begin() + 1))
    throw Error(std::string(field.name) + " has rows of another size", file.path().string(), altered_hint);
  if (field.compresses(stored.dims[0]) && stored.row_starts.empty())
    throw Error(std::string(field.name) + " has rows that are not compressed", file.path().string(),
                altered_hint);
  return {{.offset = stored.offset,
           .bytes = stored.bytes,
           .row_starts = stored.row_starts,
           .checksum = has_checksums ? stored_checksum(file, field.name) : ""},
          stored.dims[0]};
}

/// All of one kind of field have as many rows.
std::vector<StoredRows> locate_fields(const hdf5::Contents& file, std::span<const RowField> fields,
                                      bool of_frame, bool has_checksums, std::int64_t& rows) {
  std::vector<StoredRows> located;
  const RowField* first = nullptr;
  for (const RowField& field : fields) {
    if (field.of_frame != of_frame) continue;
    auto [stored, here] = locate_rows(file, field, has_checksums);
    if (first == nullptr) rows = here;
    if (here != rows) {
      throw Error(std::string(field.name) + " has " + std::to_string(here) + " rows, " + first->name +
                      " has " + std::to_string(rows),
                  file.path().string(), altered_hint);
    }
    if (first == nullptr) first = &field;
    located.push_back(std::move(stored));
  }
  return located;
}

/// The files that hold a dataset's rows, by their places in `names`, to which new ones are added.
std::vector<std::size_t> name_parts(const hdf5::Contents& master, const char* dataset,
                                    std::vector<std::filesystem::path>& names) {
  std::vector<std::size_t> which;
  for (const std::string& source : master.virtual_sources(dataset)) {
    const std::filesystem::path file = parts_folder(master.path()) / std::filesystem::path(source).filename();
    const auto found = std::find(names.begin(), names.end(), file);
    const auto number = static_cast<std::size_t>(found - names.begin());
    if (std::find(which.begin(), which.end(), number) != which.end())
      throw Error(std::string(dataset) + " names its part " + file.string() + " twice",
                  master.path().string(), altered_hint);
    which.push_back(number);
    if (found == names.end()) names.push_back(file);
  }
  if (which.empty()) which.push_back(0);
  return which;
}

template <class T>
std::vector<T> read_surface(const hdf5::Contents& file, const char* name, const hdf5::Stored& stored,
                            bool has_checksums) {
  std::vector<T> values(static_cast<std::size_t>(stored.bytes) / sizeof(T));
  file.read_rows(name, hdf5::element_type<T>(), 0, stored.dims[0], values.data());
  ChunkedChecksum found;
  found.append(std::as_bytes(std::span(values)));
  if (has_checksums) expect_checksum(file.path(), name, found.digits(), stored_checksum(file, name));
  return values;
}

/// Throws Error unless the file is a recording of this version.
RecordingHead read_head(const hdf5::Contents& file) {
  const std::string path = file.path().string();
  const auto format = file.text_attribute("/", "format");
  if (format == "palpate")
    throw Error("is a model, not a recording", path,
                "palpate-runtime play " + shell_word(path) + " --view shows it and lets you push it");
  if (format != format_name)
    throw Error("is not a recording", path, "Give a recording that palpate-runtime has written");
  const auto version = file.integer_attribute("/", "version", 2);
  if (!version || (*version)[0] != major_version)
    throw Error("is a recording of another version", path, "Record the session again");
  RecordingHead head;
  head.has_stress = (*version)[1] >= 1;
  head.has_checksums = (*version)[1] >= 2;
  head.has_force_error = (*version)[1] >= 3;
  head.has_compressed_frames = (*version)[1] >= 4;
  head.has_greens_error = (*version)[1] >= 4;
  head.info.model_path = file.text_attribute("/", "model").value_or("");
  head.info.content_hash = file.text_attribute("/", "content_hash").value_or("");
  head.info.device = file.text_attribute("/", "device").value_or("");
  const auto rate = file.integer_attribute("/", "rate", 1);
  if (!rate || (*rate)[0] < 1 || (*rate)[0] > highest_rate)
    throw Error("does not say how many ticks a second has", path, "Record the session again");
  head.info.rate = (*rate)[0];
  head.info.options = file.text_attribute("/", "options").value_or("");
  head.generator = file.text_attribute("/", "generator").value_or("");

  const auto nodes = file.locate("/surface/nodes", hdf5::element_type<double>(), 2);
  const auto simplices = file.locate("/surface/simplices", hdf5::element_type<Index>(), 2);
  if (nodes.dims[1] != 3 || simplices.dims[1] < 2 || simplices.dims[1] > 3)
    throw Error("/surface is neither of triangles nor of lines", path, "Record the session again");
  RecordedSurface& surface = head.surface;
  surface.corners = static_cast<int>(simplices.dims[1]);
  const auto numbers = read_surface<double>(file, "/surface/nodes", nodes, head.has_checksums);
  for (std::size_t i = 0; i < numbers.size(); i += 3)
    surface.nodes.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  surface.simplices = read_surface<Index>(file, "/surface/simplices", simplices, head.has_checksums);
  if (!head.has_stress) return head;
  const auto held = file.locate("/surface/held", hdf5::element_type<std::uint8_t>(), 1);
  if (held.dims[0] != nodes.dims[0])
    throw Error("/surface/held has another number of nodes", path, "Record the session again");
  surface.held = read_surface<std::uint8_t>(file, "/surface/held", held, head.has_checksums);
  return head;
}

}  // namespace

std::filesystem::path parts_folder(const std::filesystem::path& recording) {
  return with_suffix(link_target(recording), ".parts");
}

void expect_own_parts(const std::filesystem::path& recording) {
  const std::filesystem::path folder = parts_folder(recording);
  const auto refuse = [&](const std::string& what) {
    throw Error("is in the way: " + what, folder.string(), "Remove it, or record elsewhere");
  };
  std::error_code failed;
  const std::filesystem::file_type type = std::filesystem::symlink_status(folder, failed).type();
  if (type == std::filesystem::file_type::not_found) return;
  if (type != std::filesystem::file_type::directory) refuse("it is no folder of a recording");
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    if (!is_of_a_recording(entry))
      refuse("it holds " + entry.path().filename().string() + ", which is of no recording");
  }
  if (failed) refuse("it cannot be read: " + failed.message());
}

std::optional<FileDescriptor> lock_parts(const std::filesystem::path& recording) {
  const std::filesystem::path folder = parts_folder(recording);
  expect_own_parts(recording);
  std::error_code failed;
  std::filesystem::create_directory(folder, failed);
  if (failed)
    throw Error("cannot make the folder: " + failed.message(), folder.string(),
                "Check the path and the permissions of its folder");
  FileDescriptor lock = open_file(folder / lock_name, OpenMode::read_append);
  if (!lock_file(lock)) return std::nullopt;
  return lock;
}

void clear_parts(const std::filesystem::path& recording) {
  std::error_code ignored;  // what stays is in nobody's way: no master names it
  for (const auto& entry : std::filesystem::directory_iterator(parts_folder(recording), ignored)) {
    if (entry.path().filename() != lock_name && is_of_a_recording(entry))
      std::filesystem::remove(entry.path(), ignored);
  }
}

void remove_parts(const std::filesystem::path& recording) {
  clear_parts(recording);
  std::error_code ignored;  // a folder stays where it holds what is not ours
  const std::filesystem::path folder = parts_folder(recording);
  const std::filesystem::directory_iterator all(folder, ignored);
  if (std::distance(begin(all), end(all)) > 1) return;
  std::filesystem::remove(folder / lock_name, ignored);
  std::filesystem::remove(folder, ignored);
}

RecordingFiles open_recording(hdf5::Contents master) {
  const std::filesystem::path path = master.path();
  RecordingFiles recording;
  recording.head = read_head(master);
  std::vector<std::filesystem::path> names = {path};
  recording.tick_files = name_parts(master, "/ticks/time", names);
  recording.frame_files = name_parts(master, "/frames/time", names);
  std::vector<FileDescriptor> parts;
  for (std::size_t k = 1; k < names.size(); ++k) {
    if (!std::filesystem::exists(names[k]))
      throw Error("its part " + names[k].string() + " is missing", path.string(),
                  "Keep the folder of a recording that is not finished beside it, under its own name");
    parts.push_back(open_file(names[k], OpenMode::read));
  }
  recording.files.push_back(std::move(master));
  for (hdf5::Contents& part : hdf5::Contents::read(std::move(parts)))
    recording.files.push_back(std::move(part));
  return recording;
}

std::vector<RecordingPart> parts_of(const RecordingFiles& recording) {
  const std::vector<RowField> fields = row_fields(recording.head);
  const auto frame_fields = std::count_if(fields.begin(), fields.end(), [](auto& f) { return f.of_frame; });
  const auto tick_fields = std::ssize(fields) - frame_fields;
  std::vector<RecordingPart> parts;
  const auto add = [&](std::size_t file, bool of_frame) {
    const hdf5::Contents& contents = recording.files[file];
    RecordingPart part = {contents.path()};
    std::vector<StoredRows> located = locate_fields(contents, fields, of_frame, recording.head.has_checksums,
                                                    of_frame ? part.frames : part.ticks);
    part.fields.resize(static_cast<std::size_t>(of_frame ? tick_fields : 0));
    part.fields.insert(part.fields.end(), located.begin(), located.end());
    part.fields.resize(fields.size());
    parts.push_back(std::move(part));
  };
  for (const std::size_t file : recording.tick_files) add(file, false);
  for (const std::size_t file : recording.frame_files) add(file, true);
  return parts;
}

void check_rows(const RecordingFiles& recording) {
  const std::vector<RowField> fields = row_fields(recording.head);
  const auto check = [&](std::size_t which, bool of_frame) {
    const hdf5::Contents& file = recording.files[which];
    std::int64_t rows = 0;
    const std::vector<StoredRows> located =
        locate_fields(file, fields, of_frame, recording.head.has_checksums, rows);
    auto at = located.begin();
    for (const RowField& field : fields) {
      if (field.of_frame != of_frame) continue;
      const StoredRows& stored = *at++;
      if (stored.checksum.empty()) continue;
      ChunkedChecksum found;
      found.append_file(file.file(), stored.offset, stored.bytes, nullptr);
      expect_checksum(file.path(), field.name, found.digits(), stored.checksum);
    }
  };
  for (const std::size_t file : recording.tick_files) check(file, false);
  for (const std::size_t file : recording.frame_files) check(file, true);
}

RecordingPart write_part(const std::filesystem::path& path, std::span<const TickRecord> ticks,
                         std::span<const SurfaceFrame> frames, const RecordingHead& head) {
  RecordingPart part = {path, std::ssize(ticks), std::ssize(frames)};
  write_whole(path, with_suffix(path, ".partial"), false, [&](hdf5::File& file) {
    part.fields.clear();
    for_each_tick_field(head, [&]<class Member>(const char* name, int components,
                                                Member TickRecord::*member) {
      std::vector<Scalar<Member>> values(ticks.size() * static_cast<std::size_t>(components));
      for (std::size_t i = 0; i < ticks.size(); ++i)
        std::memcpy(&values[i * static_cast<std::size_t>(components)], &(ticks[i].*member), sizeof(Member));
      std::vector<std::int64_t> dims = {std::ssize(ticks)};
      if (components > 1) dims.push_back(components);
      part.fields.push_back(write_checked(file, name, dims, values));
    });
    std::vector<std::int64_t> tick;
    std::vector<double> time;
    for (const SurfaceFrame& frame : frames) {
      tick.push_back(frame.tick);
      time.push_back(frame.time);
    }
    part.fields.push_back(write_checked(file, "/frames/tick", std::array{part.frames}, tick));
    part.fields.push_back(write_checked(file, "/frames/time", std::array{part.frames}, time));
    const auto nodes = std::ssize(head.surface.nodes);
    const auto write_nodal = [&](const char* name, std::vector<std::int64_t> dims,
                                 std::vector<float> SurfaceFrame::*member, float absent) {
      part.fields.push_back(write_compressed(file, name, dims, [&](std::size_t k) {
        const std::vector<float>& values = frames[k].*member;
        return values.empty() ? std::vector<float>(head.surface.nodes.size(), absent) : values;
      }));
    };
    write_nodal("/frames/displacement", {part.frames, nodes, 3}, &SurfaceFrame::displacement, 0.0F);
    write_nodal("/frames/von_mises", {part.frames, nodes}, &SurfaceFrame::von_mises,
                std::numeric_limits<float>::quiet_NaN());
    write_nodal("/frames/pressure", {part.frames, nodes}, &SurfaceFrame::pressure, 0.0F);
  });
  return part;
}

RecordingPart merge_parts(const std::filesystem::path& path, std::span<const RecordingPart> parts,
                          const RecordingHead& head) {
  RecordingPart merged = {path};
  write_whole(path, with_suffix(path, ".partial"), false,
              [&](hdf5::File& file) { merged.fields = write_rows_of(file, parts, head); });
  for (const RecordingPart& part : parts) {
    merged.ticks += part.ticks;
    merged.frames += part.frames;
  }
  return merged;
}

void write_master(const std::filesystem::path& recording, const RecordingHead& head,
                  std::span<const RecordingPart> parts) {
  write_whole(recording, unfinished_master(recording), false, [&](hdf5::File& file) {
    write_head(file, head);
    const std::string folder = parts_folder(recording).filename().string() + "/";
    for (const RowField& field : row_fields(head)) {
      std::vector<hdf5::VirtualSource> sources;
      for (const RecordingPart& part : parts) {
        if (field.rows(part) > 0 && field.row_bytes() > 0)
          sources.push_back({folder + part.file.filename().string(), field.rows(part)});
      }
      if (sources.empty()) {
        file.write(field.name, field.type, field.dims(count_rows(parts, field)), nullptr);
        file.write_attribute(field.name, "xxh3", ChunkedChecksum().digits());
      } else {
        file.write_virtual(field.name, field.type, field.row, sources);
      }
    }
  });
}

void merge_recording(const std::filesystem::path& path, std::span<const RecordingPart> parts,
                     const RecordingHead& head) {
  write_whole(path, unfinished_master(path), true, [&](hdf5::File& file) {
    write_head(file, head);
    write_rows_of(file, parts, head);
  });
  remove_parts(path);
}

}  // namespace palpate
