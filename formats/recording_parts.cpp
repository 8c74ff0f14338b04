#include "formats/recording_parts.h"

#include <sys/file.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <functional>
#include <limits>
#include <system_error>

#include "meshes/error.h"

namespace palpate {
namespace {

constexpr std::int64_t major_version = 4, minor_version = 1;
constexpr const char* format_name = "palpate-recording";
constexpr const char* units = "s, m, m/s, N, N m, N/m, Pa; names with _ns in ns";
constexpr std::int64_t block = std::int64_t{4} << 20;  // bytes that are copied at once

/// A dataset with a row for each tick or frame.
struct RowField {
  const char* name;
  hdf5::ElementType type;
  std::vector<std::int64_t> row;  // shape
  bool of_frame;

  [[nodiscard]] std::int64_t row_bytes() const {
    auto bytes = static_cast<std::int64_t>(type.bytes);
    for (const std::int64_t size : row) bytes *= size;
    return bytes;
  }
  [[nodiscard]] std::int64_t rows(const RecordingPart& part) const {
    return of_frame ? part.frames : part.ticks;
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
  for_each_tick_field([&]<class Member>(const char* name, int components, Member TickRecord::*) {
    RowField field = {name, hdf5::element_type<Scalar<Member>>(), {}, false};
    if (components > 1) field.row = {components};
    fields.push_back(field);
  });
  fields.push_back({"/frames/tick", hdf5::element_type<std::int64_t>(), {}, true});
  fields.push_back({"/frames/time", hdf5::element_type<double>(), {}, true});
  fields.push_back({"/frames/displacement", hdf5::element_type<float>(), {surface_nodes, 3}, true});
  if (head.has_stress) {
    for (const char* name : {"/frames/von_mises", "/frames/pressure"})
      fields.push_back({name, hdf5::element_type<float>(), {surface_nodes}, true});
  }
  return fields;
}

void write_head(hdf5::File& file, const RecordingHead& head) {
  file.write_attribute("/", "format", std::string(format_name));
  file.write_attribute("/", "version",
                       std::array{major_version, head.has_stress ? minor_version : std::int64_t{0}});
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
  file.write("/surface/nodes", hdf5::element_type<double>(), std::array{std::ssize(surface.nodes), 3L},
             nodes.data());
  file.write("/surface/simplices", hdf5::element_type<Index>(),
             std::array{std::ssize(surface.simplices) / surface.corners, std::int64_t{surface.corners}},
             surface.simplices.data());
  if (!head.has_stress) return;
  std::vector<std::uint8_t> held = surface.held;
  held.resize(surface.nodes.size());
  file.write("/surface/held", hdf5::element_type<std::uint8_t>(), std::array{std::ssize(held)}, held.data());
}

/// Writes a file under a temporary name, then renames it.
void write_whole(const std::filesystem::path& path, bool durably,
                 const std::function<void(hdf5::File&)>& fill) {
  const std::filesystem::path partial = with_suffix(path, ".partial");
  try {
    hdf5::File file = hdf5::File::create(partial);
    fill(file);
    file.close();
    if (durably) {
      rename_durably(partial, path);
    } else {
      std::error_code failed;
      std::filesystem::rename(partial, path, failed);
      if (failed) throw Error("cannot make the file: " + failed.message(), path.string(), "Check the path.");
    }
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw;
  }
}

std::int64_t count_rows(std::span<const RecordingPart> parts, const RowField& field) {
  std::int64_t rows = 0;
  for (const RecordingPart& part : parts) rows += field.rows(part);
  return rows;
}

std::int64_t count_rows(const hdf5::File& part, const char* time) {
  return part.locate(time, hdf5::element_type<double>(), 1).dims[0];
}

void write_rows_of(hdf5::File& to, std::span<const RecordingPart> parts, const RecordingHead& head) {
  const std::vector<RowField> fields = row_fields(head);
  for (const RowField& field : fields)
    to.write(field.name, field.type, field.dims(count_rows(parts, field)), nullptr);
  std::vector<std::byte> bytes;
  std::vector<std::int64_t> written(fields.size());
  for (const RecordingPart& part : parts) {
    const hdf5::File from = hdf5::File::open_to_read(part.file);
    for (std::size_t k = 0; k < fields.size(); ++k) {
      const RowField& field = fields[k];
      if (field.row_bytes() == 0) continue;
      const std::int64_t at_once = std::max<std::int64_t>(block / field.row_bytes(), 1);
      for (std::int64_t first = 0; first < field.rows(part); first += at_once) {
        const std::int64_t rows = std::min(at_once, field.rows(part) - first);
        bytes.resize(static_cast<std::size_t>(rows * field.row_bytes()));
        from.read_rows(field.name, field.type, first, rows, bytes.data());
        to.write_rows(field.name, field.type, written[k], rows, bytes.data());
        written[k] += rows;
      }
    }
  }
}

}  // namespace

std::filesystem::path parts_folder(const std::filesystem::path& recording) {
  return with_suffix(recording, ".parts");
}

std::optional<FileDescriptor> lock_parts(const std::filesystem::path& recording) {
  const std::filesystem::path folder = parts_folder(recording);
  std::error_code failed;
  std::filesystem::create_directory(folder, failed);
  if (failed)
    throw Error("cannot make the folder: " + failed.message(), folder.string(),
                "Check the path and the permissions of its folder.");
  FileDescriptor lock = open_file(folder / "lock", OpenMode::read_append);
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) return std::nullopt;
  return lock;
}

void clear_parts(const std::filesystem::path& recording) {
  std::error_code ignored;  // what stays is in nobody's way: no master names it
  for (const auto& entry : std::filesystem::directory_iterator(parts_folder(recording), ignored)) {
    if (entry.path().filename() != "lock") std::filesystem::remove(entry.path(), ignored);
  }
}

RecordingHead read_head(const hdf5::File& file) {
  const std::string path = file.path().string();
  const auto format = file.text_attribute("/", "format");
  if (format == "palpate")
    throw Error("is a model, not a recording", path,
                "palpate-runtime play " + path + " --view shows it and lets you push it.");
  if (format != format_name)
    throw Error("is not a recording", path, "Give a recording that palpate-runtime has written.");
  const auto version = file.integer_attribute("/", "version", 2);
  if (!version || (*version)[0] != major_version)
    throw Error("is a recording of another version", path, "Record the session again.");
  RecordingHead head;
  head.has_stress = (*version)[1] >= 1;
  head.info.model_path = file.text_attribute("/", "model").value_or("");
  head.info.content_hash = file.text_attribute("/", "content_hash").value_or("");
  head.info.device = file.text_attribute("/", "device").value_or("");
  const auto rate = file.integer_attribute("/", "rate", 1);
  if (!rate || (*rate)[0] < 1)
    throw Error("does not say how many ticks a second has", path, "Record the session again.");
  head.info.rate = (*rate)[0];
  head.info.options = file.text_attribute("/", "options").value_or("");
  head.generator = file.text_attribute("/", "generator").value_or("");

  const auto nodes = file.locate("/surface/nodes", hdf5::element_type<double>(), 2);
  const auto simplices = file.locate("/surface/simplices", hdf5::element_type<Index>(), 2);
  if (nodes.dims[1] != 3 || simplices.dims[1] < 2 || simplices.dims[1] > 3)
    throw Error("/surface is neither of triangles nor of lines", path, "Record the session again.");
  head.surface.corners = static_cast<int>(simplices.dims[1]);
  head.surface.nodes.resize(static_cast<std::size_t>(nodes.dims[0]));
  head.surface.simplices.resize(static_cast<std::size_t>(simplices.dims[0] * simplices.dims[1]));
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  if (!head.surface.nodes.empty())
    file.read_rows("/surface/nodes", hdf5::element_type<double>(), 0, nodes.dims[0],
                   head.surface.nodes.data());
  if (!head.surface.simplices.empty())
    file.read_rows("/surface/simplices", hdf5::element_type<Index>(), 0, simplices.dims[0],
                   head.surface.simplices.data());
  if (head.has_stress) {
    if (file.locate("/surface/held", hdf5::element_type<std::uint8_t>(), 1).dims[0] != nodes.dims[0])
      throw Error("/surface/held has another number of nodes", path, "Record the session again.");
    head.surface.held.resize(head.surface.nodes.size());
    if (!head.surface.held.empty())
      file.read_rows("/surface/held", hdf5::element_type<std::uint8_t>(), 0, nodes.dims[0],
                     head.surface.held.data());
  }
  return head;
}

std::vector<hdf5::File> open_parts(const hdf5::File& recording, const char* dataset) {
  std::vector<hdf5::File> parts;
  for (const std::string& source : recording.virtual_sources(dataset)) {
    const std::filesystem::path file =
        parts_folder(recording.path()) / std::filesystem::path(source).filename();
    if (!std::filesystem::exists(file))
      throw Error("its part " + file.string() + " is missing", recording.path().string(),
                  "Keep the folder of a recording that is not finished beside it, under its own name.");
    parts.push_back(hdf5::File::open_to_read(file));
  }
  if (parts.empty()) parts.push_back(hdf5::File::open_to_read(recording.path()));
  return parts;
}

RecordingPart write_part(const std::filesystem::path& path, std::span<const TickRecord> ticks,
                         std::span<const SurfaceFrame> frames, std::size_t surface_nodes) {
  write_whole(path, false, [&](hdf5::File& file) {
    for_each_tick_field([&]<class Member>(const char* name, int components, Member TickRecord::*member) {
      std::vector<Scalar<Member>> values(ticks.size() * static_cast<std::size_t>(components));
      for (std::size_t i = 0; i < ticks.size(); ++i)
        std::memcpy(&values[i * static_cast<std::size_t>(components)], &(ticks[i].*member), sizeof(Member));
      std::vector<std::int64_t> dims = {std::ssize(ticks)};
      if (components > 1) dims.push_back(components);
      file.write(name, hdf5::element_type<Scalar<Member>>(), dims, values.data());
    });
    std::vector<std::int64_t> tick;
    std::vector<double> time;
    for (const SurfaceFrame& frame : frames) {
      tick.push_back(frame.tick);
      time.push_back(frame.time);
    }
    const std::int64_t count = std::ssize(frames);
    file.write("/frames/tick", hdf5::element_type<std::int64_t>(), std::array{count}, tick.data());
    file.write("/frames/time", hdf5::element_type<double>(), std::array{count}, time.data());
    const auto nodes = static_cast<std::int64_t>(surface_nodes);
    const auto write_nodal = [&](const char* name, std::vector<std::int64_t> dims,
                                 std::vector<float> SurfaceFrame::*member, float absent) {
      file.write(name, hdf5::element_type<float>(), dims, nullptr);
      const std::vector<float> none(surface_nodes, absent);
      for (std::int64_t k = 0; k < count && nodes > 0; ++k) {
        const std::vector<float>& values = frames[static_cast<std::size_t>(k)].*member;
        file.write_rows(name, hdf5::element_type<float>(), k, 1, (values.empty() ? none : values).data());
      }
    };
    write_nodal("/frames/displacement", {count, nodes, 3}, &SurfaceFrame::displacement, 0.0F);
    write_nodal("/frames/von_mises", {count, nodes}, &SurfaceFrame::von_mises,
                std::numeric_limits<float>::quiet_NaN());
    write_nodal("/frames/pressure", {count, nodes}, &SurfaceFrame::pressure, 0.0F);
  });
  return {path, std::ssize(ticks), std::ssize(frames)};
}

RecordingPart merge_parts(const std::filesystem::path& path, std::span<const RecordingPart> parts,
                          const RecordingHead& head) {
  write_whole(path, false, [&](hdf5::File& file) { write_rows_of(file, parts, head); });
  RecordingPart merged = {path};
  for (const RecordingPart& part : parts) {
    merged.ticks += part.ticks;
    merged.frames += part.frames;
  }
  return merged;
}

void write_master(const std::filesystem::path& recording, const RecordingHead& head,
                  std::span<const RecordingPart> parts) {
  write_whole(recording, false, [&](hdf5::File& file) {
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
      } else {
        file.write_virtual(field.name, field.type, field.row, sources);
      }
    }
  });
}

void merge_recording(const std::filesystem::path& path) {
  std::vector<RecordingPart> parts;
  RecordingHead head;
  {
    const hdf5::File master = hdf5::File::open_to_read(path);
    head = read_head(master);
    for (const hdf5::File& part : open_parts(master, "/ticks/time"))
      parts.push_back({part.path(), count_rows(part, "/ticks/time"), 0});
    for (const hdf5::File& part : open_parts(master, "/frames/time"))
      parts.push_back({part.path(), 0, count_rows(part, "/frames/time")});
  }
  write_whole(path, true, [&](hdf5::File& file) {
    write_head(file, head);
    write_rows_of(file, parts, head);
  });
  std::error_code ignored;
  std::filesystem::remove_all(parts_folder(path), ignored);
}

}  // namespace palpate
