#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <optional>

#include "formats/checksum.h"
#include "formats/content_hash.h"
#include "formats/file_io.h"
#include "formats/hdf5.h"
#include "formats/journal.h"
#include "formats/model_check.h"
#include "formats/model_fields.h"
#include "formats/model_file.h"
#include "meshes/error.h"

namespace palpate {
namespace {

constexpr std::array<std::int64_t, 2> version = {format_major, format_minor};
constexpr std::int64_t metadata_allowance = 1 << 20;  // more than HDF5 needs around our datasets [byte]
constexpr std::size_t values_at_once = 1 << 15;       // converted and written together
constexpr std::int64_t window =
    16 * std::int64_t{ChunkedChecksum::chunk};  // of the file, looked at together [byte]

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

template <class T>
std::string checksum_of(const std::vector<T>& values) {
  ChunkedChecksum running;
  running.append(bytes_of(values));
  return running.digits();
}

/// Stores one field of the model with its checksum.
template <class T>
void write_field(hdf5::File& file, const Field<T>& field, const Model& model, const Counts& counts) {
  const std::vector<T> values = field.take(model);
  file.write(field.path, hdf5::element_type<T>(), counts.sizes(field.shape), values.data());
  file.write_attribute(field.path, "xxh3", checksum_of(values));
}

/// Datasets that are known before the Green's functions, those of overlays where there are any.
template <class Visitor>
void for_each_known_field(const Model& model, Visitor&& visit) {
  for_each_body_field(model.mesh.element, visit);
  if (model.overlay.refinement != 0) for_each_overlay_field(visit);
}

void write_attributes(hdf5::File& file, const Model& model, const FileHeader& header) {
  file.write_attribute("/", "format", std::string("palpate"));
  file.write_attribute("/", "version", version);
  for_each_attribute([&](const auto& attribute) {
    const auto value = attribute.take(model, header);
    if constexpr (std::is_same_v<decltype(value), const std::string>)
      file.write_attribute("/", attribute.name, value);
    else
      file.write_attribute("/", attribute.name, std::array{value});
  });
}

/// What makes ParaView read the file as an unstructured grid.
void write_vtk_view(hdf5::File& file) {
  constexpr std::array<std::int64_t, 2> vtkhdf_version = {1, 0};
  file.write_attribute("/VTKHDF", "Version", vtkhdf_version);
  file.write_attribute("/VTKHDF", "Type", std::string("UnstructuredGrid"));
  file.make_group("/VTKHDF/PointData");
  file.make_group("/VTKHDF/CellData");
  file.make_link("/VTKHDF/Points", "/mesh/nodes");
  file.make_link("/VTKHDF/Connectivity", "/mesh/connectivity");
  file.make_link("/VTKHDF/Offsets", "/mesh/offsets");
  file.make_link("/VTKHDF/Types", "/mesh/types");
  file.make_link("/VTKHDF/PointData/fixed", "/dofs/fixed");
  file.make_link("/VTKHDF/PointData/rest_displacement", "/rest/displacement");
  file.make_link("/VTKHDF/CellData/region", "/mesh/regions");
  file.make_link("/VTKHDF/CellData/material", "/material/of_element");
}

/// Checksum of the bytes [from, to) and what a running one had before.
void add_bytes(RunningChecksum& running, const FileDescriptor& file, std::int64_t from, std::int64_t to) {
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  while (from < to) {
    const auto part = std::span(buffer).first(std::min(buffer.size(), static_cast<std::size_t>(to - from)));
    read_exactly(file, part, from);
    running.update(part);
    from += static_cast<std::int64_t>(part.size());
  }
}

std::string checksum_around(const FileDescriptor& file, std::int64_t gap_begin, std::int64_t gap_end) {
  RunningChecksum running;
  add_bytes(running, file, 0, gap_begin);
  add_bytes(running, file, gap_end, file_size(file));
  return running.digits();
}

}  // namespace

struct ModelWriter::Impl {
  Impl(std::filesystem::path to, const Model& model, Precision precision);

  [[nodiscard]] JournalFrame examine(const Model& model);
  bool resume();
  void start(const Model& model);
  void write_body(const Model& model);
  template <class T>
  void store(std::int64_t first, std::int64_t count, std::span<const double> packed);
  void seal(const std::vector<Probe>& probes);
  [[nodiscard]] std::int64_t byte_of_column(std::int64_t column) const;
  [[nodiscard]] std::string greens_checksum() const;
  void mark_done(std::int64_t first, std::int64_t count);
  void discard() noexcept;

  std::filesystem::path path, partial;
  FileHeader header;
  Counts counts;
  ContentHash content;
  ElementType element;
  std::int64_t order;
  JournalFrame frame;
  Journal journal;
  FileDescriptor data;
  mutable std::mutex mutex;  // guards `done` and the journal
  std::vector<bool> done;    // [n] columns
};

ModelWriter::Impl::Impl(std::filesystem::path to, const Model& model, Precision precision)
    : path(std::move(to)),
      partial(with_suffix(path, ".partial")),
      header{precision},
      counts(Counts::of(model, path.string())),
      element(model.mesh.element),
      order(model.stored_dofs()),
      frame(examine(model)),
      journal(with_suffix(path, ".progress")),
      done(static_cast<std::size_t>(order), false) {
  if (resume()) return;
  try {
    start(model);
  } catch (...) {
    discard();
    throw;
  }
}

/// Proves that a reader will take the model; gives the key and an upper bound of the file's size. Before
/// anything on the disk is touched, so that a mistake does not cost an earlier run's columns.
JournalFrame ModelWriter::Impl::examine(const Model& model) {
  add_attributes(content, model, header, version);
  std::int64_t bytes = 0;
  for_each_known_field(model, [&](const auto& field) {
    const auto values = field.take(model);
    check_values(field, values, counts);
    content.add_dataset(field.path, checksum_of(values));
    bytes += static_cast<std::int64_t>(bytes_of(values).size());
  });
  check_model(model, path.string());
  JournalFrame expected;
  expected.key = content.digits();
  expected.file_bytes = bytes + packed_size(order) * bytes_per_scalar(header.precision) + metadata_allowance;
  return expected;
}

/// Takes up what a killed run left; false when that is not the same model or was altered.
bool ModelWriter::Impl::resume() {
  const std::optional<JournalContents> left = journal.read();
  if (!left || left->frame.key != frame.key || !std::filesystem::exists(partial)) return false;
  data = open_file(partial, OpenMode::write);
  const std::int64_t greens_end =
      left->frame.greens_at + packed_size(order) * bytes_per_scalar(header.precision);
  if (file_size(data) != left->frame.file_bytes || greens_end > left->frame.file_bytes ||
      checksum_around(data, left->frame.greens_at, greens_end) != left->frame.checksum)
    return false;

  frame = left->frame;
  std::vector<JournalRange> whole;
  for (const JournalRange& range : left->ranges) {
    if (range.first > order || range.count > order - range.first) continue;
    RunningChecksum stored;
    add_bytes(stored, data, byte_of_column(range.first), byte_of_column(range.first + range.count));
    if (stored.digits() != range.checksum) continue;
    mark_done(range.first, range.count);
    whole.push_back(range);
  }
  journal.write({frame, whole});
  return true;
}

void ModelWriter::Impl::start(const Model& model) {
  journal.empty();
  data.close();
  check_free_space(partial, frame.file_bytes);
  write_body(model);
  data = open_file(partial, OpenMode::write);
  const std::int64_t greens_end = byte_of_column(order);
  reserve_space(data, frame.greens_at, greens_end - frame.greens_at);
  frame.file_bytes = file_size(data);
  frame.checksum = checksum_around(data, frame.greens_at, greens_end);
  journal.write({frame, {}});
}

/// Everything but what `finish` brings.
void ModelWriter::Impl::write_body(const Model& model) {
  const hdf5::Quiet quiet;
  const bool single = header.precision == Precision::single_precision;
  const hdf5::ElementType scalar = single ? hdf5::element_type<float>() : hdf5::element_type<double>();
  const std::int64_t entries = packed_size(order);

  hdf5::File file = hdf5::File::create(partial, entries * bytes_per_scalar(header.precision));
  write_attributes(file, model, header);
  for_each_known_field(model, [&](const auto& field) { write_field(file, field, model, counts); });
  write_vtk_view(file);
  file.write(greens_path, scalar, std::array{entries}, nullptr);
  frame.greens_at = file.locate(greens_path, scalar, 1).offset;
  file.close();
}

std::int64_t ModelWriter::Impl::byte_of_column(std::int64_t column) const {
  return frame.greens_at + packed_column(column, order) * bytes_per_scalar(header.precision);
}

void ModelWriter::Impl::mark_done(std::int64_t first, std::int64_t count) {
  const auto begin = done.begin() + first;
  std::fill(begin, begin + count, true);
}

template <class T>
void ModelWriter::Impl::store(std::int64_t first, std::int64_t count, std::span<const double> packed) {
  RunningChecksum stored;
  std::vector<T> converted;
  std::int64_t at = byte_of_column(first);
  for (auto rest = packed; !rest.empty(); rest = rest.subspan(converted.size())) {
    const auto part = rest.first(std::min(values_at_once, rest.size()));
    converted.assign(part.begin(), part.end());
    if (!std::all_of(converted.begin(), converted.end(), [](T value) { return std::isfinite(value); }))
      throw Error("the Green's functions of columns " + std::to_string(first) + " to " +
                      std::to_string(first + count - 1) +
                      " hold a value that is not finite in the stored precision",
                  path.string(), "Check the material and the mesh's quality, or store in double precision.");
    stored.update(bytes_of(converted));
    write_exactly(data, bytes_of(converted), at);
    at += static_cast<std::int64_t>(bytes_of(converted).size());
  }
  const std::scoped_lock lock(mutex);
  journal.add({first, count, stored.digits()});
  mark_done(first, count);
}

/// Window by window, so that the file does not fill the memory.
std::string ModelWriter::Impl::greens_checksum() const {
  ChunkedChecksum running;
  const std::int64_t end = byte_of_column(order);
  for (std::int64_t at = frame.greens_at; at < end; at += window) {
    const std::int64_t bytes = std::min(window, end - at);
    const std::shared_ptr<const void> mapped = map_file(data, at, bytes);
    running.append({static_cast<const std::byte*>(mapped.get()), static_cast<std::size_t>(bytes)});
  }
  return running.digits();
}

void ModelWriter::Impl::seal(const std::vector<Probe>& probes) {
  Model extra;
  extra.mesh.element = element;
  extra.probes = probes;
  counts.set(Count::probes, static_cast<std::int64_t>(probes.size()), "/probes/forces");
  for (const Probe& probe : probes)
    if (static_cast<std::int64_t>(probe.force.size()) != order ||
        probe.displacement.size() != probe.force.size())
      refuse(path.string(), "/probes/forces: a probe does not have " + std::to_string(order) + " values");

  const std::string greens = greens_checksum();
  content.add_dataset(greens_path, greens);
  const hdf5::Quiet quiet;
  hdf5::File file = hdf5::File::open_to_change(partial);
  file.write_attribute(greens_path, "xxh3", greens);
  for_each_probe_field(element, [&](const auto& field) {
    const auto values = field.take(extra);
    check_values(field, values, counts);
    content.add_dataset(field.path, checksum_of(values));
    write_field(file, field, extra, counts);
  });
  file.write_attribute("/", "content_hash", content.digits());
  file.close();
  rename_durably(partial, path);
  journal.remove();
}

void ModelWriter::Impl::discard() noexcept {
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
  journal.remove();
}

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision)
    : impl_(std::make_unique<Impl>(std::move(path), model, precision)) {}

ModelWriter::~ModelWriter() = default;

bool ModelWriter::has_columns(std::int64_t first, std::int64_t count) const {
  const std::scoped_lock lock(impl_->mutex);
  if (first < 0 || count < 0 || first > impl_->order || count > impl_->order - first) return false;
  const auto begin = impl_->done.begin() + first;
  return std::all_of(begin, begin + count, [](bool done) { return done; });
}

void ModelWriter::write_columns(std::int64_t first, std::int64_t count, std::span<const double> packed) {
  const std::int64_t n = impl_->order;
  if (first < 0 || count < 0 || first > n || count > n - first ||
      static_cast<std::int64_t>(packed.size()) != packed_column(first + count, n) - packed_column(first, n))
    throw Error("columns " + std::to_string(first) + " to " + std::to_string(first + count - 1) + " with " +
                    std::to_string(packed.size()) + " entries do not fit a matrix of order " +
                    std::to_string(n),
                impl_->path.string(), "This is a mistake in the program; please report it.");
  try {
    if (impl_->header.precision == Precision::single_precision)
      impl_->store<float>(first, count, packed);
    else
      impl_->store<double>(first, count, packed);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::finish(const std::vector<Probe>& probes) {
  const auto missing = std::find(impl_->done.begin(), impl_->done.end(), false);
  if (missing != impl_->done.end())
    throw Error("column " + std::to_string(missing - impl_->done.begin()) +
                    " of the Green's functions was not written",
                impl_->path.string(), "This is a mistake in the program; please report it.");
  try {
    impl_->seal(probes);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::discard() noexcept {
  impl_->discard();
}

}  // namespace palpate
