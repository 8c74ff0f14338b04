#include "formats/recording.h"

#include <array>
#include <cstring>

#include "formats/file_io.h"
#include "formats/hdf5.h"
#include "meshes/error.h"

namespace palpate {
namespace {

constexpr std::size_t ticks_at_once = 4096;  // rows of a chunk; written together
constexpr std::array<std::int64_t, 2> version = {3, 0};
constexpr const char* format_name = "palpate-recording";

/// One dataset a field of TickRecord: path, number of components, member.
template <class Visitor>
void for_each_tick_field(Visitor&& visit) {
  visit("/ticks/time", 1, &TickRecord::time);
  visit("/ticks/device_position", 3, &TickRecord::device_position);
  visit("/ticks/device_orientation", 4, &TickRecord::device_orientation);
  visit("/ticks/tool_position", 3, &TickRecord::tool_position);
  visit("/ticks/tool_orientation", 4, &TickRecord::tool_orientation);
  visit("/ticks/force", 3, &TickRecord::force);
  visit("/ticks/torque", 3, &TickRecord::torque);
  visit("/ticks/contacts", 1, &TickRecord::contacts);
  visit("/ticks/stiffness", 6, &TickRecord::stiffness);
  visit("/ticks/status", 1, &TickRecord::status);
  visit("/ticks/compute_ns", 1, &TickRecord::compute_ns);
  visit("/ticks/grab", 1, &TickRecord::grab);
  visit("/ticks/patch", 1, &TickRecord::patch);
  visit("/ticks/handle_position", 3, &TickRecord::handle_position);
  visit("/ticks/handle_orientation", 4, &TickRecord::handle_orientation);
  visit("/ticks/handle_velocity", 3, &TickRecord::handle_velocity);
  visit("/ticks/buttons", 1, &TickRecord::buttons);
  visit("/ticks/sequence", 1, &TickRecord::sequence);
  visit("/ticks/arrived_ns", 1, &TickRecord::arrived_ns);
  visit("/ticks/begun_ns", 1, &TickRecord::begun_ns);
  visit("/ticks/shown_force", 3, &TickRecord::shown_force);
  visit("/ticks/shown_torque", 3, &TickRecord::shown_torque);
  visit("/ticks/share", 1, &TickRecord::share);
  visit("/ticks/phase", 1, &TickRecord::phase);
  visit("/ticks/fault", 1, &TickRecord::fault);
  visit("/ticks/event", 1, &TickRecord::event);
  visit("/ticks/motion_step", 1, &TickRecord::motion_step);
}

template <class Member>
using Scalar = std::remove_all_extents_t<Member>;

std::vector<hsize_t> row_shape(hsize_t rows, int components) {
  if (components == 1) return {rows};
  return {rows, static_cast<hsize_t>(components)};
}

hdf5::Id make_space(const std::vector<hsize_t>& sizes, const hsize_t* limits = nullptr) {
  return {H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), limits), H5Sclose};
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& doing) {
  throw Error("cannot " + doing, path.string(), "Check the disk: free some space or record elsewhere.");
}

void make_extendible(const hdf5::File& file, const char* path, int components,
                     const hdf5::ElementType& type) {
  const std::vector<hsize_t> none = row_shape(0, components), chunk = row_shape(ticks_at_once, components);
  std::vector<hsize_t> limits = none;
  limits[0] = H5S_UNLIMITED;
  const hdf5::Id space = make_space(none, limits.data());
  const hdf5::Id creation = hdf5::timeless(H5P_DATASET_CREATE);
  H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data());
  const hdf5::Id made(
      H5Dcreate2(file.id(), path, type.id, space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT), H5Dclose);
  if (!made.valid()) fail(file.path(), std::string("make ") + path);
}

void append_rows(const hdf5::File& file, const char* path, int components, const hdf5::ElementType& type,
                 hsize_t rows_before, hsize_t rows, const void* values) {
  const hdf5::Id dataset(H5Dopen2(file.id(), path, H5P_DEFAULT), H5Dclose);
  const std::vector<hsize_t> extended = row_shape(rows_before + rows, components),
                             added = row_shape(rows, components);
  if (!dataset.valid() || H5Dset_extent(dataset.get(), extended.data()) < 0)
    fail(file.path(), std::string("extend ") + path);
  const hdf5::Id target(H5Dget_space(dataset.get()), H5Sclose);
  const std::array<hsize_t, 2> start = {rows_before, 0};
  H5Sselect_hyperslab(target.get(), H5S_SELECT_SET, start.data(), nullptr, added.data(), nullptr);
  const hdf5::Id source = make_space(added);
  if (H5Dwrite(dataset.get(), type.id, source.get(), target.get(), H5P_DEFAULT, values) < 0)
    fail(file.path(), std::string("write ") + path);
}

}  // namespace

struct RecordingWriter::Impl {
  Impl(std::filesystem::path to, const SessionInfo& info)
      : path(std::move(to)), partial(with_suffix(path, ".partial")), file(hdf5::File::create(partial)) {
    file.write_attribute("/", "format", std::string(format_name));
    file.write_attribute("/", "version", version);
    file.write_attribute("/", "generator", std::string("palpate " PALPATE_VERSION));
    file.write_attribute("/", "units", std::string("s, m, N, N m, N/m; compute_ns in ns"));
    file.write_attribute("/", "model", info.model_path);
    file.write_attribute("/", "content_hash", info.content_hash);
    file.write_attribute("/", "options", info.options);
    file.make_group("/ticks");
    for_each_tick_field([this]<class Member>(const char* name, int components, Member TickRecord::*) {
      make_extendible(file, name, components, hdf5::element_type<Scalar<Member>>());
    });
    waiting.reserve(ticks_at_once);
  }

  void write_waiting() {
    const hdf5::Quiet quiet;
    for_each_tick_field([this]<class Member>(const char* name, int components, Member TickRecord::*member) {
      std::vector<Scalar<Member>> values(waiting.size() * static_cast<std::size_t>(components));
      for (std::size_t i = 0; i < waiting.size(); ++i)
        std::memcpy(&values[i * static_cast<std::size_t>(components)], &(waiting[i].*member), sizeof(Member));
      append_rows(file, name, components, hdf5::element_type<Scalar<Member>>(), written, waiting.size(),
                  values.data());
    });
    written += waiting.size();
    waiting.clear();
  }

  std::filesystem::path path, partial;
  hdf5::File file;
  std::vector<TickRecord> waiting;
  hsize_t written = 0;
  bool finished = false;
};

RecordingWriter::RecordingWriter(std::filesystem::path path, const SessionInfo& info) {
  const hdf5::Quiet quiet;
  const std::filesystem::path partial = with_suffix(path, ".partial");
  try {
    impl_ = std::make_unique<Impl>(std::move(path), info);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw;
  }
}

RecordingWriter::~RecordingWriter() {
  if (impl_->finished) return;
  std::error_code ignored;
  std::filesystem::remove(impl_->partial, ignored);
}

void RecordingWriter::append(std::span<const TickRecord> ticks) {
  for (const TickRecord& tick : ticks) {
    impl_->waiting.push_back(tick);
    if (impl_->waiting.size() == ticks_at_once) impl_->write_waiting();
  }
}

void RecordingWriter::finish() {
  if (!impl_->waiting.empty()) impl_->write_waiting();
  const hdf5::Quiet quiet;
  impl_->file.close();
  rename_durably(impl_->partial, impl_->path);
  impl_->finished = true;
}

Recording read_recording(const std::filesystem::path& path) {
  const hdf5::Quiet quiet;
  const hdf5::File file = hdf5::File::open_to_read(path);
  const std::string hint = "Give a recording that palpate-runtime has written.";
  if (file.text_attribute("/", "format") != format_name)
    throw Error("is not a recording", path.string(), hint);
  if (const auto v = file.integer_attribute("/", "version", 2); !v || (*v)[0] != version[0])
    throw Error("is a recording of another version", path.string(), "Record the session again.");

  Recording recording;
  recording.info.model_path = file.text_attribute("/", "model").value_or("");
  recording.info.content_hash = file.text_attribute("/", "content_hash").value_or("");
  recording.info.options = file.text_attribute("/", "options").value_or("");
  bool first = true;
  for_each_tick_field([&]<class Member>(const char* name, int components, Member TickRecord::*member) {
    const hdf5::Id dataset(H5Dopen2(file.id(), name, H5P_DEFAULT), H5Dclose);
    const hdf5::Id space(H5Dget_space(dataset.get()), H5Sclose);
    const hssize_t points = H5Sget_simple_extent_npoints(space.get());
    const hsize_t stored = H5Dget_storage_size(dataset.get());
    if (points < 0 || points % components != 0 ||
        static_cast<hsize_t>(points) * sizeof(Scalar<Member>) > stored)
      throw Error(std::string(name) + " is missing or damaged", path.string(), hint);
    const auto ticks = static_cast<std::size_t>(points / components);
    if (first) recording.ticks.resize(ticks);
    first = false;
    std::vector<Scalar<Member>> values(static_cast<std::size_t>(points));
    const hid_t type = hdf5::element_type<Scalar<Member>>().id;
    if (ticks != recording.ticks.size() ||
        (ticks > 0 && H5Dread(dataset.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0))
      throw Error(std::string(name) + " is damaged", path.string(), hint);
    for (std::size_t i = 0; i < ticks; ++i)
      std::memcpy(&(recording.ticks[i].*member), &values[i * static_cast<std::size_t>(components)],
                  sizeof(Member));
  });
  return recording;
}

}  // namespace palpate
