#include "formats/writer/model_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "base/error.h"
#include "base/file_io.h"
#include "formats/begun_model.h"
#include "formats/checksum.h"
#include "formats/content_hash.h"
#include "formats/contents.h"
#include "formats/dynamics_fields.h"
#include "formats/hierarchical_fields.h"
#include "formats/journal.h"
#include "formats/model_check.h"
#include "formats/model_fields.h"
#include "formats/model_file.h"
#include "formats/precision_fields.h"
#include "formats/writer/hdf5_file.h"
#include "formats/writer/hdf5_walk.h"

namespace palpate {
namespace {

constexpr std::array<std::int64_t, 2> written_version = {format_major, format_minor};
constexpr std::int64_t metadata_allowance = 1 << 20;  // more than HDF5 needs around our datasets [byte]
constexpr std::int64_t aligned_from = 1 << 16;  // datasets that come last: smaller ones begin anywhere [byte]
constexpr std::size_t near_matrix = 0;          // in Impl::matrices, where there is one
constexpr std::size_t values_at_once = 1 << 15;  // converted and written together

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

/// Writes one field of the model with its checksum.
template <class T>
void write_field(hdf5::File& file, const Field<T>& field, const Model& model, const Counts& counts) {
  const std::vector<T> values = field.take(model);
  file.write(field.path, number_type<T>(), counts.sizes(field.shape), values.data());
  file.write_attribute(field.path, "xxh3", checksum_of(values));
}

/// Datasets known before the Green's functions, including those of overlays, dynamics and [warp] if there are
/// any.
template <class Visitor>
void for_each_known_field(const Model& model, Visitor&& visit) {
  for_each_body_field(model.mesh.element, visit);
  if (model.overlay.refinement != 0) for_each_overlay_field(visit);
  if (model.dynamics.method != DynamicsMethod::none) for_each_dynamics_field(model, visit);
  if (model.warp.any()) for_each_warp_field(visit);
  if (model.greens.smooth() != nullptr) for_each_smooth_field(model, visit);
  if (model.force_errors.any()) visit_greens_errors(visit);
  if (model.dynamics.force_errors.any()) visit_inverse_errors(visit);
  if (model.compressed != nullptr) for_each_tree_field(visit);
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

/// Writes the group by which ParaView reads the file as an unstructured grid.
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

/// Adds the bytes [from, to) of a file to a running checksum.
void add_bytes(RunningChecksum& running, const FileDescriptor& file, std::int64_t from, std::int64_t to) {
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  while (from < to) {
    const auto part = std::span(buffer).first(std::min(buffer.size(), static_cast<std::size_t>(to - from)));
    read_exactly(file, part, from);
    running.update(part);
    from += static_cast<std::int64_t>(part.size());
  }
}

/// A range of bytes in the file.
struct Gap {
  std::int64_t at, bytes;
};

/// Checksum of all bytes of the file except the gaps.
std::string checksum_around(const FileDescriptor& file, std::vector<Gap> gaps) {
  std::sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.at < b.at; });
  RunningChecksum running;
  std::int64_t from = 0;
  for (const Gap& gap : gaps) {
    add_bytes(running, file, from, gap.at);
    from = gap.at + gap.bytes;
  }
  add_bytes(running, file, from, file_size(file));
  return running.digits();
}

/// Columns of the lower triangle from `first` on, with W W^T subtracted.
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
  /// A matrix written in pieces: packed matrices by columns, compressed ones by leaves of columns.
  struct Streamed {
    const char* path;
    const char* name;
    NumberType scalar;
    std::vector<std::int64_t> starts;  ///< [pieces + 1] first entry of each piece
    std::shared_ptr<const SmoothPart> smooth;
    std::vector<bool> done{};  ///< [pieces]
    PieceRange own{};          ///< pieces in this file

    [[nodiscard]] std::int64_t pieces() const { return std::ssize(starts) - 1; }
    /// Number of entries before a piece in this file; and in total.
    [[nodiscard]] std::int64_t entry(std::int64_t piece) const {
      return starts[static_cast<std::size_t>(piece)] - starts[static_cast<std::size_t>(own.first)];
    }
    [[nodiscard]] std::int64_t entries() const { return entry(own.end); }
    /// Number of bytes before a piece in this file; and in total.
    [[nodiscard]] std::int64_t byte(std::int64_t piece) const {
      return entry(piece) * static_cast<std::int64_t>(scalar.bytes);
    }
    [[nodiscard]] std::int64_t bytes() const { return byte(own.end); }
    [[nodiscard]] bool has_in_file(std::int64_t first, std::int64_t count) const {
      return first >= own.first && count >= 0 && first <= own.end && count <= own.end - first;
    }
  };

  Impl(std::filesystem::path to, const Model& model, Precision precision,
       const std::optional<BakePart>& part);

  void begin(const Model& model, Leftovers leftovers);
  void join_in(const std::string& journal_text, std::function<void(const std::string&)> to_report);

  [[nodiscard]] JournalFrame examine(const Model& model);
  bool resume();
  [[nodiscard]] std::vector<JournalRange> undamaged(const std::vector<JournalRange>& ranges);
  [[nodiscard]] bool is_ours(const JournalContents& left) const;
  void start(const Model& model);
  void write_body(const Model& model);
  [[nodiscard]] static Streamed packed_by_columns(const char* path, const char* name,
                                                  const PackedGreens& matrix, Precision precision,
                                                  std::int64_t order);
  [[nodiscard]] static std::vector<Streamed> streamed(const Model& model, Precision precision);
  [[nodiscard]] bool has(std::size_t matrix, std::int64_t first, std::int64_t count) const;
  void expect_piece(std::size_t matrix, std::int64_t first, std::int64_t count, std::int64_t entries) const;
  template <class T, class From>
  void store(std::size_t matrix, std::int64_t first, std::int64_t count, std::span<const From> values);
  void seal(const std::vector<Probe>& probes, const std::shared_ptr<const HierarchicalMatrix>& compressed,
            bool keeps);
  void write_compressed(hdf5::File& file, const Model& extra);
  [[nodiscard]] std::int64_t streamed_bytes() const;
  [[nodiscard]] std::int64_t place(std::size_t matrix, std::int64_t piece) const;
  [[nodiscard]] std::vector<Gap> gaps(const JournalFrame& of) const;
  [[nodiscard]] std::string streamed_checksum(std::size_t matrix) const;
  void mark_done(const JournalRange& range);
  void record(const JournalRange& range);
  void add_part(const std::filesystem::path& from);
  void take_over(const FileDescriptor& file, std::int64_t origin, const JournalRange& range);
  void discard() noexcept;

  std::filesystem::path path, partial;
  FileHeader header;
  Counts counts;
  ContentHash content;
  ElementType element;
  std::int64_t order;
  std::vector<Streamed> matrices;
  JournalFrame frame;
  std::optional<Journal> journal;                  // nullopt if another process has it
  std::function<void(const std::string&)> report;  // to the process that has it
  FileDescriptor data;
  mutable std::mutex mutex;  // guards done and journal
};

ModelWriter::Impl::Streamed ModelWriter::Impl::packed_by_columns(const char* path, const char* name,
                                                                 const PackedGreens& matrix,
                                                                 Precision precision, std::int64_t order) {
  Streamed streamed{path,
                    name,
                    has_float_entries(precision) ? number_type<float>() : number_type<double>(),
                    {},
                    matrix.smooth()};
  for (std::int64_t j = 0; j <= order; ++j) streamed.starts.push_back(packed_column(j, order));
  return streamed;
}

std::vector<ModelWriter::Impl::Streamed> ModelWriter::Impl::streamed(const Model& model,
                                                                     Precision precision) {
  std::vector<Streamed> matrices;
  if (model.scope == Scope::none) return matrices;
  const std::int64_t order = model.stored_dofs();
  if (const HierarchicalMatrix* compressed = model.compressed.get(); compressed != nullptr) {
    Streamed near{near_path, "the near pairs", number_type<float>(), {}, nullptr};
    for (Index leaf = 0; leaf <= compressed->tree.leaves(); ++leaf)
      near.starts.push_back(compressed->near_at[static_cast<std::size_t>(compressed->first_near_pair(leaf))]);
    matrices.push_back(std::move(near));
  } else {
    matrices.push_back(
        packed_by_columns(greens_path, "the Green's functions", model.greens, precision, order));
  }
  if (model.dynamics.method == DynamicsMethod::packed)
    matrices.push_back(
        packed_by_columns(inverse_path, "the inverse of K_bar", model.dynamics.inverse, precision, order));
  for (Streamed& matrix : matrices) {
    matrix.done.assign(matrix.starts.size() - 1, false);
    matrix.own = {0, matrix.pieces()};
  }
  return matrices;
}

ModelWriter::Impl::Impl(std::filesystem::path to, const Model& model, Precision precision,
                        const std::optional<BakePart>& part)
    : path(std::move(to)),
      partial(part ? path : with_suffix(path, ".partial")),
      header{precision},
      counts(counts_of(model, path.string())),
      element(model.mesh.element),
      order(model.stored_dofs()),
      matrices(streamed(model, precision)) {
  if (part) {
    for (std::size_t k = 0; k < matrices.size(); ++k) matrices[k].own = part->pieces.at(k);
  }
  frame = examine(model);
  frame.part = part;
}

/// Resumes an earlier run, or starts.
void ModelWriter::Impl::begin(const Model& model, Leftovers leftovers) {
  journal.emplace(with_suffix(path, ".progress"));
  if (leftovers == Leftovers::resume && resume()) return;
  try {
    start(model);
  } catch (...) {
    discard();
    throw;
  }
}

/// Checks that a reader will accept the model; returns the key and an upper bound of the file's size. Runs
/// before anything on the disk is touched, so that a mistake does not cost an earlier run's columns.
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
  if (model.compressed != nullptr) check_tree(model, path.string());
  JournalFrame expected;
  expected.key = content.digits();
  expected.file_bytes = bytes + streamed_bytes() + metadata_allowance;
  return expected;
}

/// Resumes a killed run; false if it was of another model or its file was altered.
bool ModelWriter::Impl::resume() {
  const std::optional<JournalContents> left = journal->read();
  if (!left || left->frame.key != frame.key || left->frame.part != frame.part ||
      left->frame.packed_at.size() != matrices.size() || !std::filesystem::exists(partial))
    return false;
  if (!is_ours(*left)) return false;
  data = open_file(partial, OpenMode::write);
  const std::vector<Gap> expected = gaps(left->frame);
  const bool inside = std::all_of(expected.begin(), expected.end(), [&](const Gap& gap) {
    return gap.at <= left->frame.file_bytes - gap.bytes;
  });
  if (file_size(data) != left->frame.file_bytes || !inside ||
      checksum_around(data, expected) != left->frame.checksum)
    return false;

  frame = left->frame;
  const std::vector<JournalRange> whole = undamaged(left->ranges);
  for (const JournalRange& range : whole) mark_done(range);
  journal->write({frame, whole});
  return true;
}

/// Ranges whose bytes still have their checksums.
std::vector<JournalRange> ModelWriter::Impl::undamaged(const std::vector<JournalRange>& ranges) {
  std::vector<JournalRange> whole;
  for (const JournalRange& range : ranges) {
    if (range.matrix >= std::ssize(matrices)) continue;
    const auto matrix = static_cast<std::size_t>(range.matrix);
    if (!matrices[matrix].has_in_file(range.first, range.count)) continue;
    RunningChecksum stored;
    add_bytes(stored, data, place(matrix, range.first), place(matrix, range.first + range.count));
    if (stored.digits() == range.checksum) whole.push_back(range);
  }
  return whole;
}

/// Opens the file of another process for writing.
void ModelWriter::Impl::join_in(const std::string& journal_text,
                                std::function<void(const std::string&)> to_report) {
  const std::optional<JournalContents> begun = read_journal(journal_text);
  if (!begun || begun->frame.key != frame.key || begun->frame.packed_at.size() != matrices.size()) {
    throw Error("another rank has computed another model than this one", path.string(),
                "Start the same build of palpate-precompute-mpi on all nodes, on one kind of processor, with "
                "the same files");
  }
  const std::string unshared =
      "Write to a folder that all nodes share, or bake in parts: palpate-precompute --part K/N";
  std::error_code missing;
  if (!std::filesystem::exists(partial, missing))
    throw Error("is not there, where another rank has made it: the nodes do not share this folder",
                partial.string(), unshared);
  data = open_file(partial, OpenMode::write);
  if (file_size(data) != begun->frame.file_bytes || !is_ours(*begun) ||
      checksum_around(data, gaps(begun->frame)) != begun->frame.checksum)
    throw Error("is not the file that another rank has made: the nodes do not share this folder",
                partial.string(), unshared);
  frame = begun->frame;
  for (const JournalRange& range : begun->ranges) mark_done(range);
  report = std::move(to_report);
}

/// True if a killed run's file is safe for the HDF5 library, and its packed matrices lie where the journal
/// says.
bool ModelWriter::Impl::is_ours(const JournalContents& left) const {
  try {
    FileDescriptor file = open_file(partial, OpenMode::read);
    const std::vector<std::byte> index = hdf5::index_of(file);
    const Contents contents = Contents::of(std::move(file), index);
    for (std::size_t matrix = 0; matrix < matrices.size(); ++matrix) {
      if (matrices[matrix].bytes() == 0) continue;
      const Stored stored = contents.locate(matrices[matrix].path, matrices[matrix].scalar, 1);
      if (stored.offset != left.frame.packed_at[matrix] || stored.bytes != matrices[matrix].bytes())
        return false;
    }
  } catch (const Error&) {
    return false;
  }
  return true;
}

void ModelWriter::Impl::start(const Model& model) {
  journal->empty();
  data.close();
  check_free_space(partial, frame.file_bytes);
  make_anew(partial);
  write_body(model);
  data = open_file(partial, OpenMode::write);
  for (const Gap& gap : gaps(frame))
    if (gap.bytes > 0) reserve_space(data, gap.at, gap.bytes);
  frame.file_bytes = file_size(data);
  frame.checksum = checksum_around(data, gaps(frame));
  journal->write({frame, {}});
}

/// Writes everything except what `finish` adds.
void ModelWriter::Impl::write_body(const Model& model) {
  const hdf5::Quiet quiet;
  std::int64_t smallest = streamed_bytes();
  for (const Streamed& matrix : matrices)
    if (matrix.bytes() > 0) smallest = std::min(smallest, matrix.bytes());
  hdf5::File file = hdf5::File::create(partial, smallest);
  write_attributes(file, model, header);
  for_each_known_field(model, [&](const auto& field) { write_field(file, field, model, counts); });
  write_vtk_view(file);
  for (const Streamed& matrix : matrices) {
    frame.packed_at.push_back(
        matrix.bytes() == 0 ? 0
                            : file.write(matrix.path, matrix.scalar, std::array{matrix.entries()}, nullptr));
  }
  file.close();
}

void ModelWriter::Impl::expect_piece(std::size_t matrix, std::int64_t first, std::int64_t count,
                                     std::int64_t entries) const {
  if (matrix < matrices.size() && matrices[matrix].has_in_file(first, count)) {
    const std::vector<std::int64_t>& starts = matrices[matrix].starts;
    if (entries == starts[static_cast<std::size_t>(first + count)] - starts[static_cast<std::size_t>(first)])
      return;
  }
  throw Error("columns " + std::to_string(first) + " to " + std::to_string(first + count - 1) + " with " +
                  std::to_string(entries) + " entries do not fit a matrix of order " + std::to_string(order),
              path.string(), "This is a mistake in the program; please report it");
}

std::int64_t ModelWriter::Impl::streamed_bytes() const {
  std::int64_t bytes = 0;
  for (const Streamed& matrix : matrices) bytes += matrix.bytes();
  return bytes;
}

/// Position of a piece in the file.
std::int64_t ModelWriter::Impl::place(std::size_t matrix, std::int64_t piece) const {
  return frame.packed_at[matrix] + matrices[matrix].byte(piece);
}

std::vector<Gap> ModelWriter::Impl::gaps(const JournalFrame& of) const {
  std::vector<Gap> result;
  for (std::size_t k = 0; k < matrices.size(); ++k) result.push_back({of.packed_at[k], matrices[k].bytes()});
  return result;
}

bool ModelWriter::Impl::has(std::size_t matrix, std::int64_t first, std::int64_t count) const {
  const std::scoped_lock lock(mutex);
  if (matrix >= matrices.size()) return false;
  const std::int64_t pieces = matrices[matrix].pieces();
  if (first < 0 || count < 0 || first > pieces || count > pieces - first) return false;
  const auto begin = matrices[matrix].done.begin() + first;
  return std::all_of(begin, begin + count, [](bool done) { return done; });
}

void ModelWriter::Impl::mark_done(const JournalRange& range) {
  if (range.matrix >= std::ssize(matrices)) return;
  Streamed& matrix = matrices[static_cast<std::size_t>(range.matrix)];
  if (!matrix.has_in_file(range.first, range.count)) return;
  const auto begin = matrix.done.begin() + range.first;
  std::fill(begin, begin + range.count, true);
}

/// Records that a piece is in the file.
void ModelWriter::Impl::record(const JournalRange& range) {
  const std::scoped_lock lock(mutex);
  if (journal) {
    journal->add(range);
  } else {
    report(line_of(range));
  }
  mark_done(range);
}

template <class T, class From>
void ModelWriter::Impl::store(std::size_t matrix, std::int64_t first, std::int64_t count,
                              std::span<const From> values) {
  RunningChecksum stored;
  std::vector<T> converted;
  std::int64_t at = place(matrix, first);
  for (auto rest = values; !rest.empty(); rest = rest.subspan(converted.size())) {
    const auto part = rest.first(std::min(values_at_once, rest.size()));
    converted.resize(part.size());
    std::transform(part.begin(), part.end(), converted.begin(),
                   [](From value) { return static_cast<T>(value); });
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
  record({static_cast<std::int64_t>(matrix), first, count, stored.digits()});
}

/// Copies the missing pieces of a part.
void ModelWriter::Impl::add_part(const std::filesystem::path& from) {
  Journal held(with_suffix(from, ".progress"));
  const std::optional<JournalContents> left = held.read();
  const std::string again = "Make this part again, with --part and --discard";
  if (!left || !left->frame.part || left->frame.part->pieces.size() != matrices.size())
    throw Error("holds no part of this model", from.string(), again);
  if (left->frame.key != frame.key) {
    const std::string other = Contents::read(from).text_attribute("/", "generator").value_or("");
    const std::string ours = "palpate-precompute " PALPATE_VERSION;
    if (other != ours) throw Error("was made by " + other + ", and this is " + ours, from.string(), again);
    throw Error(
        "is a part of another model, or was made on another kind of processor", from.string(),
        "Give join the same model.toml, geometry and place of the output as the parts had, on the same "
        "kind of processor");
  }
  const FileDescriptor file = open_file(from, OpenMode::read);
  for (const JournalRange& range : left->ranges) {
    if (range.matrix >= std::ssize(matrices)) continue;
    const auto matrix = static_cast<std::size_t>(range.matrix);
    const PieceRange& pieces = left->frame.part->pieces[matrix];
    if (range.first < pieces.first || range.first + range.count > pieces.end ||
        !matrices[matrix].has_in_file(range.first, range.count) || has(matrix, range.first, range.count))
      continue;
    take_over(file, left->frame.packed_at[matrix] - matrices[matrix].byte(pieces.first), range);
  }
}

/// Copies a range from a file in which the matrix would begin at `origin`.
void ModelWriter::Impl::take_over(const FileDescriptor& file, std::int64_t origin,
                                  const JournalRange& range) {
  const auto matrix = static_cast<std::size_t>(range.matrix);
  RunningChecksum copied;
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  const std::int64_t end = place(matrix, range.first + range.count);
  for (std::int64_t at = place(matrix, range.first); at < end; at += std::ssize(buffer)) {
    const auto bytes = std::span(buffer).first(
        static_cast<std::size_t>(std::min<std::int64_t>(std::ssize(buffer), end - at)));
    read_exactly(file, bytes, at - frame.packed_at[matrix] + origin);
    copied.update(bytes);
    write_exactly(data, bytes, at);
  }
  if (copied.digits() != range.checksum) {
    throw Error("has changed since it was made: its columns " + std::to_string(range.first) + " to " +
                    std::to_string(range.first + range.count - 1) + " have another checksum",
                file.path().string(), "Copy it again, or give its --part again");
  }
  record(range);
}

/// Checksum of a matrix, read and not mapped, so that the file does not count as memory.
std::string ModelWriter::Impl::streamed_checksum(std::size_t matrix) const {
  ChunkedChecksum running;
  const std::int64_t begin = frame.packed_at[matrix], end = place(matrix, matrices[matrix].pieces());
  running.append_file(data, begin, end - begin, nullptr);
  return running.digits();
}

/// Writes ranks, certificate, bases and couplings.
void ModelWriter::Impl::write_compressed(hdf5::File& file, const Model& extra) {
  const HierarchicalMatrix& matrix = *extra.compressed;
  counts.set(Count::certified, std::ssize(matrix.certificate) / 6, "/greens/certificate");
  for_each_rank_field([&](const auto& field) {
    const auto values = field.take(extra);
    check_values(field, values, counts);
    content.add_dataset(field.path, checksum_of(values));
    write_field(file, field, extra, counts);
  });
  for (const CompressedArray& array : compressed_arrays) {
    if (array.path == near_path) continue;  // streamed
    const std::int64_t entries = (matrix.*array.at).back();
    const float* numbers = (matrix.*array.data).get();
    if (!std::all_of(numbers, numbers + entries, [](float value) { return std::isfinite(value); }))
      refuse(path.string(), std::string(array.path) + " holds a value that is not finite");
    file.write(array.path, number_type<float>(), std::array{entries}, numbers);
    ChunkedChecksum running;
    running.append(std::as_bytes(std::span(numbers, static_cast<std::size_t>(entries))));
    file.write_attribute(array.path, "xxh3", running.digits());
    content.add_dataset(array.path, running.digits());
  }
}

void ModelWriter::Impl::seal(const std::vector<Probe>& probes,
                             const std::shared_ptr<const HierarchicalMatrix>& compressed, bool keeps) {
  Model extra;
  extra.compressed = compressed;
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
    checksums.push_back(streamed_checksum(matrix));
    content.add_dataset(matrices[matrix].path, checksums.back());
  }
  const hdf5::Quiet quiet;
  hdf5::File file = hdf5::File::open_to_change(partial, aligned_from);
  for (std::size_t matrix = 0; matrix < matrices.size(); ++matrix)
    file.write_attribute(matrices[matrix].path, "xxh3", checksums[matrix]);
  for_each_probe_field(element, [&](const auto& field) {
    const auto values = field.take(extra);
    check_values(field, values, counts);
    content.add_dataset(field.path, checksum_of(values));
    write_field(file, field, extra, counts);
  });
  if (compressed != nullptr) write_compressed(file, extra);
  file.write_attribute("/", "content_hash", content.digits());
  file.close();
  rename_durably(partial, path, keeps);
  journal->remove();
}

void ModelWriter::Impl::discard() noexcept {
  if (!journal) return;
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
  journal->remove();
}

std::optional<Precision> take_up_begun_model(const std::filesystem::path& path, Model& model) {
  const std::optional<JournalContents> journal = std::filesystem::exists(with_suffix(path, ".progress"))
                                                     ? peek_journal(with_suffix(path, ".progress"))
                                                     : std::nullopt;
  if (!journal) return {};
  std::optional<BegunModel> begun = read_begun_model(with_suffix(path, ".partial"));
  if (!begun) return {};
  const auto exchange = [&] {  // by field: others refer to the mesh and the rest of the model
    std::swap(model.rest_displacement, begun->model.rest_displacement);
    std::swap(model.dynamics, begun->model.dynamics);
    std::swap(model.warp, begun->model.warp);
    std::swap(model.greens, begun->model.greens);
    std::swap(model.force_errors, begun->model.force_errors);
  };
  exchange();
  try {
    if (ModelWriter::key_of(path, model, begun->precision) == journal->frame.key) return begun->precision;
  } catch (const Error&) {  // of another model
  }
  exchange();
  return {};
}

std::string ModelWriter::key_of(const std::filesystem::path& path, const Model& model, Precision precision) {
  return Impl(path, model, precision, std::nullopt).frame.key;
}

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         Leftovers leftovers)
    : impl_(std::make_unique<Impl>(std::move(path), model, precision, std::nullopt)) {
  impl_->begin(model, leftovers);
}

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         Leftovers leftovers, const BakePart& part)
    : impl_(std::make_unique<Impl>(std::move(path), model, precision, part)) {
  impl_->begin(model, leftovers);
}

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         const std::string& journal_text, std::function<void(const std::string& line)> report)
    : impl_(std::make_unique<Impl>(std::move(path), model, precision, std::nullopt)) {
  impl_->join_in(journal_text, std::move(report));
}

ModelWriter::~ModelWriter() = default;

bool ModelWriter::has_columns(std::int64_t first, std::int64_t count, PackedMatrix matrix) const {
  return impl_->has(static_cast<std::size_t>(matrix), first, count);
}

void ModelWriter::write_columns(std::int64_t first, std::int64_t count, std::span<const double> packed,
                                PackedMatrix matrix) {
  const auto which = static_cast<std::size_t>(matrix);
  impl_->expect_piece(which, first, count, std::ssize(packed));
  try {
    const Impl::Streamed& to = impl_->matrices[which];
    if (to.smooth != nullptr)
      impl_->store<float, double>(which, first, count, without(*to.smooth, first, impl_->order, packed));
    else if (to.scalar.bytes == sizeof(float))
      impl_->store<float>(which, first, count, packed);
    else
      impl_->store<double>(which, first, count, packed);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::add_part(const std::filesystem::path& path) {
  impl_->add_part(path);
}

void ModelWriter::flush() {
  palpate::flush(impl_->data);
}

void ModelWriter::look_again() {
  impl_->data = open_file(impl_->partial, OpenMode::write);
}

std::string ModelWriter::journal_text() const {
  const std::optional<JournalContents> contents = impl_->journal->read();
  return contents ? text_of(*contents) : "";
}

void ModelWriter::note(const std::string& line) {
  const std::string_view range = line;
  if (const auto read = read_range(range.substr(0, range.find('\n')))) impl_->record(*read);
}

bool ModelWriter::has_near(Index leaf) const {
  return impl_->has(near_matrix, leaf, 1);
}

void ModelWriter::read_near(Index leaf, std::span<float> entries) const {
  impl_->expect_piece(near_matrix, leaf, 1, std::ssize(entries));
  read_exactly(impl_->data, std::as_writable_bytes(entries), impl_->place(near_matrix, leaf));
}

void ModelWriter::write_near(Index leaf, std::span<const float> entries) {
  impl_->expect_piece(near_matrix, leaf, 1, std::ssize(entries));
  try {
    impl_->store<float>(near_matrix, leaf, 1, entries);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::finish(const std::vector<Probe>& probes,
                         std::shared_ptr<const HierarchicalMatrix> compressed, bool keeps) {
  for (const Impl::Streamed& matrix : impl_->matrices) {
    const auto missing = std::find(matrix.done.begin(), matrix.done.end(), false);
    if (missing != matrix.done.end()) {
      throw Error("column " + std::to_string(missing - matrix.done.begin()) + " of " + matrix.name +
                      " was not written",
                  impl_->path.string(), "This is a mistake in the program; please report it");
    }
  }
  try {
    impl_->seal(probes, compressed, keeps);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::discard() noexcept {
  impl_->discard();
}

}  // namespace palpate
