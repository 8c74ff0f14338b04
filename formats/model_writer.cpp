#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "base/error.h"
#include "base/file_io.h"
#include "formats/checksum.h"
#include "formats/content_hash.h"
#include "formats/dynamics_fields.h"
#include "formats/hdf5.h"
#include "formats/hdf5_contents.h"
#include "formats/journal.h"
#include "formats/model_check.h"
#include "formats/model_fields.h"
#include "formats/model_file.h"
#include "formats/precision_fields.h"

namespace palpate {
namespace {

constexpr std::array<std::int64_t, 2> written_version = {format_major, format_minor};
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

/// Datasets that are known before the Green's functions, those of overlays and dynamics where there are any.
template <class Visitor>
void for_each_known_field(const Model& model, Visitor&& visit) {
  for_each_body_field(model.mesh.element, visit);
  if (model.overlay.refinement != 0) for_each_overlay_field(visit);
  if (model.dynamics.method != DynamicsMethod::none) for_each_dynamics_field(model, visit);
  if (model.greens.smooth() != nullptr) for_each_smooth_field(model, visit);
  if (model.force_errors.any()) visit_greens_errors(visit);
  if (model.dynamics.force_errors.any()) visit_inverse_errors(visit);
}

void write_attributes(hdf5::File& file, const Model& model, const FileHeader& header) {
  file.write_attribute("/", "format", std::string("palpate"));
  file.write_attribute("/", "version", written_version);
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

/// Checksum of all bytes of the file except `gap_bytes` from each of the places.
std::string checksum_around(const FileDescriptor& file, std::vector<std::int64_t> gaps_at,
                            std::int64_t gap_bytes) {
  std::sort(gaps_at.begin(), gaps_at.end());
  RunningChecksum running;
  std::int64_t from = 0;
  for (const std::int64_t gap : gaps_at) {
    add_bytes(running, file, from, gap);
    from = gap + gap_bytes;
  }
  add_bytes(running, file, from, file_size(file));
  return running.digits();
}

/// Columns of the lower triangle from `first` on, W W^T taken off.
std::vector<double> without(const SmoothPart& smooth, std::int64_t first, std::int64_t order,
                            std::span<const double> packed) {
  std::vector<double> remainder(packed.begin(), packed.end());
  auto entry = remainder.begin();
  for (std::int64_t j = first; entry != remainder.end(); ++j)
    for (std::int64_t i = j; i < order; ++i) *entry++ -= smooth(i, j);
  return remainder;
}

}  // namespace

struct ModelWriter::Impl {
  /// A packed matrix that arrives by columns.
  struct Streamed {
    const char* path;
    const char* name;
    std::vector<bool> done;  ///< [n] columns
    std::shared_ptr<const SmoothPart> smooth;
  };

  Impl(std::filesystem::path to, const Model& model, Precision precision, Leftovers leftovers);

  [[nodiscard]] JournalFrame examine(const Model& model);
  bool resume();
  [[nodiscard]] bool is_ours(const JournalContents& left) const;
  void start(const Model& model);
  void write_body(const Model& model);
  template <class T>
  void store(std::size_t matrix, std::int64_t first, std::int64_t count, std::span<const double> packed);
  void seal(const std::vector<Probe>& probes);
  [[nodiscard]] std::int64_t packed_bytes() const;
  [[nodiscard]] std::int64_t byte_of_column(std::size_t matrix, std::int64_t column) const;
  [[nodiscard]] std::string packed_checksum(std::size_t matrix) const;
  void mark_done(const JournalRange& range);
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
  mutable std::mutex mutex;  // guards what is done and the journal
  std::vector<Streamed> matrices;
};

ModelWriter::Impl::Impl(std::filesystem::path to, const Model& model, Precision precision,
                        Leftovers leftovers)
    : path(std::move(to)),
      partial(with_suffix(path, ".partial")),
      header{precision},
      counts(Counts::of(model, path.string())),
      element(model.mesh.element),
      order(model.stored_dofs()),
      frame(examine(model)),
      journal(with_suffix(path, ".progress")) {
  const std::vector<bool> none(static_cast<std::size_t>(order), false);
  matrices.push_back({greens_path, "the Green's functions", none, model.greens.smooth()});
  if (model.dynamics.method == DynamicsMethod::packed)
    matrices.push_back({inverse_path, "the inverse of K_bar", none, model.dynamics.inverse.smooth()});
  if (leftovers == Leftovers::resume && resume()) return;
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
  add_attributes(content, model, header, written_version);
  check_precision(model, header.precision, path.string());
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
  const int packed_matrices = model.dynamics.method == DynamicsMethod::packed ? 2 : 1;
  expected.file_bytes = bytes + packed_matrices * packed_bytes() + metadata_allowance;
  return expected;
}

/// Takes up what a killed run left; false when that is not the same model or was altered.
bool ModelWriter::Impl::resume() {
  const std::optional<JournalContents> left = journal.read();
  if (!left || left->frame.key != frame.key || left->frame.packed_at.size() != matrices.size() ||
      !std::filesystem::exists(partial))
    return false;
  if (!is_ours(*left)) return false;
  data = open_file(partial, OpenMode::write);
  const bool inside =
      std::all_of(left->frame.packed_at.begin(), left->frame.packed_at.end(),
                  [&](std::int64_t at) { return at <= left->frame.file_bytes - packed_bytes(); });
  if (file_size(data) != left->frame.file_bytes || !inside ||
      checksum_around(data, left->frame.packed_at, packed_bytes()) != left->frame.checksum)
    return false;

  frame = left->frame;
  std::vector<JournalRange> whole;
  for (const JournalRange& range : left->ranges) {
    if (range.matrix >= std::ssize(matrices) || range.first > order || range.count > order - range.first)
      continue;
    const auto matrix = static_cast<std::size_t>(range.matrix);
    RunningChecksum stored;
    add_bytes(stored, data, byte_of_column(matrix, range.first),
              byte_of_column(matrix, range.first + range.count));
    if (stored.digits() != range.checksum) continue;
    mark_done(range);
    whole.push_back(range);
  }
  journal.write({frame, whole});
  return true;
}

/// Whether the HDF5 library can be given what a killed run left, and its packed matrices lie where the
/// journal says.
bool ModelWriter::Impl::is_ours(const JournalContents& left) const {
  const hdf5::ElementType scalar =
      has_float_entries(header.precision) ? hdf5::element_type<float>() : hdf5::element_type<double>();
  try {
    const hdf5::Contents contents = hdf5::Contents::read(partial);
    for (std::size_t matrix = 0; matrix < matrices.size(); ++matrix) {
      const hdf5::Stored stored = contents.locate(matrices[matrix].path, scalar, 1);
      if (stored.offset != left.frame.packed_at[matrix] || stored.bytes != packed_bytes()) return false;
    }
  } catch (const Error&) {
    return false;
  }
  return true;
}

void ModelWriter::Impl::start(const Model& model) {
  journal.empty();
  data.close();
  check_free_space(partial, frame.file_bytes);
  make_anew(partial);
  write_body(model);
  data = open_file(partial, OpenMode::write);
  for (const std::int64_t at : frame.packed_at) reserve_space(data, at, packed_bytes());
  frame.file_bytes = file_size(data);
  frame.checksum = checksum_around(data, frame.packed_at, packed_bytes());
  journal.write({frame, {}});
}

/// Everything but what `finish` brings.
void ModelWriter::Impl::write_body(const Model& model) {
  const hdf5::Quiet quiet;
  const bool single = has_float_entries(header.precision);
  const hdf5::ElementType scalar = single ? hdf5::element_type<float>() : hdf5::element_type<double>();
  const std::int64_t entries = packed_size(order);

  hdf5::File file = hdf5::File::create(partial, packed_bytes());
  write_attributes(file, model, header);
  for_each_known_field(model, [&](const auto& field) { write_field(file, field, model, counts); });
  write_vtk_view(file);
  for (const Streamed& matrix : matrices) {
    frame.packed_at.push_back(file.write(matrix.path, scalar, std::array{entries}, nullptr));
  }
  file.close();
}

std::int64_t ModelWriter::Impl::packed_bytes() const {
  return packed_size(order) * bytes_per_scalar(header.precision);
}

std::int64_t ModelWriter::Impl::byte_of_column(std::size_t matrix, std::int64_t column) const {
  return frame.packed_at[matrix] + packed_column(column, order) * bytes_per_scalar(header.precision);
}

void ModelWriter::Impl::mark_done(const JournalRange& range) {
  const auto begin = matrices[static_cast<std::size_t>(range.matrix)].done.begin() + range.first;
  std::fill(begin, begin + range.count, true);
}

template <class T>
void ModelWriter::Impl::store(std::size_t matrix, std::int64_t first, std::int64_t count,
                              std::span<const double> packed) {
  RunningChecksum stored;
  std::vector<T> converted;
  std::int64_t at = byte_of_column(matrix, first);
  for (auto rest = packed; !rest.empty(); rest = rest.subspan(converted.size())) {
    const auto part = rest.first(std::min(values_at_once, rest.size()));
    converted.assign(part.begin(), part.end());
    for (T& value : converted)
      if (std::abs(value) < std::numeric_limits<T>::min()) value = T{0};
    if (!std::all_of(converted.begin(), converted.end(), [](T value) { return std::isfinite(value); })) {
      throw Error(std::string("columns ") + std::to_string(first) + " to " +
                      std::to_string(first + count - 1) + " of " + matrices[matrix].name +
                      " hold a value that is not finite in the stored precision",
                  path.string(), "Check the material and the mesh's quality, or store in double precision");
    }
    stored.update(bytes_of(converted));
    write_exactly(data, bytes_of(converted), at);
    at += static_cast<std::int64_t>(bytes_of(converted).size());
  }
  const std::scoped_lock lock(mutex);
  const JournalRange range{static_cast<std::int64_t>(matrix), first, count, stored.digits()};
  journal.add(range);
  mark_done(range);
}

/// Window by window, so that the file does not fill the memory.
std::string ModelWriter::Impl::packed_checksum(std::size_t matrix) const {
  ChunkedChecksum running;
  const std::int64_t end = byte_of_column(matrix, order);
  for (std::int64_t at = frame.packed_at[matrix]; at < end; at += window) {
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
  for (const Probe& probe : probes) {
    if (static_cast<std::int64_t>(probe.force.size()) != order ||
        probe.displacement.size() != probe.force.size())
      refuse(path.string(), "/probes/forces: a probe does not have " + std::to_string(order) + " values");
  }

  std::vector<std::string> checksums;
  for (std::size_t matrix = 0; matrix < matrices.size(); ++matrix) {
    checksums.push_back(packed_checksum(matrix));
    content.add_dataset(matrices[matrix].path, checksums.back());
  }
  const hdf5::Quiet quiet;
  hdf5::File file = hdf5::File::open_to_change(partial);
  for (std::size_t matrix = 0; matrix < matrices.size(); ++matrix)
    file.write_attribute(matrices[matrix].path, "xxh3", checksums[matrix]);
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

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         Leftovers leftovers)
    : impl_(std::make_unique<Impl>(std::move(path), model, precision, leftovers)) {}

ModelWriter::~ModelWriter() = default;

bool ModelWriter::has_columns(std::int64_t first, std::int64_t count, PackedMatrix matrix) const {
  const std::scoped_lock lock(impl_->mutex);
  const auto which = static_cast<std::size_t>(matrix);
  if (which >= impl_->matrices.size() || first < 0 || count < 0 || first > impl_->order ||
      count > impl_->order - first)
    return false;
  const auto begin = impl_->matrices[which].done.begin() + first;
  return std::all_of(begin, begin + count, [](bool done) { return done; });
}

void ModelWriter::write_columns(std::int64_t first, std::int64_t count, std::span<const double> packed,
                                PackedMatrix matrix) {
  const std::int64_t n = impl_->order;
  const auto which = static_cast<std::size_t>(matrix);
  if (which >= impl_->matrices.size() || first < 0 || count < 0 || first > n || count > n - first ||
      static_cast<std::int64_t>(packed.size()) != packed_column(first + count, n) - packed_column(first, n)) {
    throw Error("columns " + std::to_string(first) + " to " + std::to_string(first + count - 1) + " with " +
                    std::to_string(packed.size()) + " entries do not fit a matrix of order " +
                    std::to_string(n),
                impl_->path.string(), "This is a mistake in the program; please report it");
  }
  try {
    if (const SmoothPart* smooth = impl_->matrices[which].smooth.get(); smooth != nullptr)
      impl_->store<float>(which, first, count, without(*smooth, first, n, packed));
    else if (has_float_entries(impl_->header.precision))
      impl_->store<float>(which, first, count, packed);
    else
      impl_->store<double>(which, first, count, packed);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::finish(const std::vector<Probe>& probes) {
  for (const Impl::Streamed& matrix : impl_->matrices) {
    const auto missing = std::find(matrix.done.begin(), matrix.done.end(), false);
    if (missing != matrix.done.end()) {
      throw Error("column " + std::to_string(missing - matrix.done.begin()) + " of " + matrix.name +
                      " was not written",
                  impl_->path.string(), "This is a mistake in the program; please report it");
    }
  }
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
