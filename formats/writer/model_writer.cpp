#include "formats/writer/model_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/file_io.h"
#include "formats/begun_model.h"
#include "formats/checksum.h"
#include "formats/contents.h"
#include "formats/dynamics_fields.h"
#include "formats/hierarchical_fields.h"
#include "formats/model_check.h"
#include "formats/model_fields.h"
#include "formats/model_file.h"
#include "formats/precision_fields.h"
#include "formats/writer/hdf5_file.h"

namespace palpate {
namespace {

constexpr std::array<std::int64_t, 2> written_version = {format_major, format_minor};
constexpr std::int64_t metadata_allowance = 1 << 20;  // more than HDF5 needs around our datasets [byte]
constexpr std::int64_t aligned_from = 1 << 16;  // datasets that come last: smaller ones begin anywhere [byte]
constexpr std::size_t near_matrix = 0;          // in PieceFile::matrices, where there is one

template <class T>
std::string checksum_of(const std::vector<T>& values) {
  ChunkedChecksum running;
  running.append(std::as_bytes(std::span(values)));
  return running.digits();
}

/// Writes one field of the model with its checksum.
template <class T>
void write_field(hdf5::File& file, const Field<T>& field, const Model& model, const Counts& counts) {
  const std::vector<T> values = field.take(model);
  file.write(field.path, number_type<T>(), counts.sizes(field.shape), values.data());
  file.write_attribute(field.path, "xxh3", checksum_of(values));
}

/// Datasets known before the Green's functions, including those of overlays and dynamics if there are any.
template <class Visitor>
void for_each_known_field(const Model& model, Visitor&& visit) {
  for_each_body_field(model.mesh.element, visit);
  if (model.overlay.refinement != 0) for_each_overlay_field(visit);
  if (model.dynamics.method != DynamicsMethod::none) for_each_dynamics_field(model, visit);
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

}  // namespace

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         const std::optional<BakePart>& part)
    : path_(std::move(path)),
      header_{precision},
      counts_(counts_of(model, path_.string())),
      element_(model.mesh.element),
      order_(model.stored_dofs()),
      pieces_(part ? path_ : with_suffix(path_, ".partial"), streamed_matrices(model, precision, part)),
      frame_(examine(model)) {
  frame_.part = part;
}

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         Leftovers leftovers)
    : ModelWriter(std::move(path), model, precision, std::nullopt) {
  begin(model, leftovers);
}

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         Leftovers leftovers, const BakePart& part)
    : ModelWriter(std::move(path), model, precision, std::optional(part)) {
  begin(model, leftovers);
}

ModelWriter::ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
                         const std::string& journal_text, std::function<void(const std::string& line)> report)
    : ModelWriter(std::move(path), model, precision, std::nullopt) {
  const std::optional<JournalContents> begun = read_journal(journal_text);
  if (!begun || begun->frame.key != frame_.key ||
      begun->frame.packed_at.size() != pieces_.matrices().size()) {
    throw Error("another rank has computed another model than this one", path_.string(),
                "Start the same build of palpate-precompute-mpi on all nodes, on one kind of processor, with "
                "the same files");
  }
  const std::string partial = pieces_.path().string();
  const std::string unshared =
      "Write to a folder that all nodes share, or bake in parts: palpate-precompute --part K/N";
  std::error_code missing;
  if (!std::filesystem::exists(partial, missing))
    throw Error("is not there, where another rank has made it: the nodes do not share this folder", partial,
                unshared);
  if (!pieces_.is_of(begun->frame))
    throw Error("is not the file that another rank has made: the nodes do not share this folder", partial,
                unshared);
  frame_ = begun->frame;
  pieces_.take(frame_, begun->ranges);
  pieces_.record_to([report = std::move(report)](const JournalRange& range) { report(line_of(range)); });
}

/// Checks that a reader will accept the model; returns the key and an upper bound of the file's size. Runs
/// before anything on the disk is touched, so that a mistake does not cost an earlier run's columns.
JournalFrame ModelWriter::examine(const Model& model) {
  add_attributes(content_, model, header_, written_version);
  check_precision(model, header_.precision, path_.string());
  std::int64_t bytes = 0;
  for_each_known_field(model, [&](const auto& field) {
    const auto values = field.take(model);
    check_values(field, values, counts_);
    content_.add_dataset(field.path, checksum_of(values));
    bytes += static_cast<std::int64_t>(values.size() * sizeof(values.front()));
  });
  check_model(model, path_.string());
  if (model.compressed != nullptr) check_tree(model, path_.string());
  JournalFrame expected;
  expected.key = content_.digits();
  expected.file_bytes = bytes + pieces_.bytes() + metadata_allowance;
  return expected;
}

/// Resumes an earlier run, or starts.
void ModelWriter::begin(const Model& model, Leftovers leftovers) {
  journal_.emplace(with_suffix(path_, ".progress"));
  pieces_.record_to([this](const JournalRange& range) { journal_->add(range); });
  if (leftovers == Leftovers::resume && resume()) return;
  try {
    start(model);
  } catch (...) {
    discard();
    throw;
  }
}

/// Resumes a killed run; false if it was of another model or its file was altered.
bool ModelWriter::resume() {
  const std::optional<JournalContents> left = journal_->read();
  if (!left || left->frame.key != frame_.key || left->frame.part != frame_.part ||
      !pieces_.is_of(left->frame))
    return false;
  frame_ = left->frame;
  const std::vector<JournalRange> whole = pieces_.undamaged(frame_, left->ranges);
  pieces_.take(frame_, whole);
  journal_->write({frame_, whole});
  return true;
}

void ModelWriter::start(const Model& model) {
  journal_->empty();
  pieces_.close();
  check_free_space(pieces_.path(), frame_.file_bytes);
  make_anew(pieces_.path());
  write_body(model);
  pieces_.reserve(frame_);
  journal_->write({frame_, {}});
}

/// Writes everything except what `finish` adds.
void ModelWriter::write_body(const Model& model) {
  const hdf5::Quiet quiet;
  std::int64_t smallest = pieces_.bytes();
  for (const StreamedMatrix& matrix : pieces_.matrices())
    if (matrix.bytes() > 0) smallest = std::min(smallest, matrix.bytes());
  hdf5::File file = hdf5::File::create(pieces_.path(), smallest);
  write_attributes(file, model, header_);
  for_each_known_field(model, [&](const auto& field) { write_field(file, field, model, counts_); });
  write_vtk_view(file);
  for (const StreamedMatrix& matrix : pieces_.matrices()) {
    frame_.packed_at.push_back(
        matrix.bytes() == 0 ? 0
                            : file.write(matrix.path, matrix.scalar, std::array{matrix.entries()}, nullptr));
  }
  file.close();
}

void ModelWriter::add_part(const std::filesystem::path& path) {
  Journal held(with_suffix(path, ".progress"));
  const std::optional<JournalContents> left = held.read();
  const std::string again = "Make this part again, with --part and --discard";
  const std::vector<StreamedMatrix>& matrices = pieces_.matrices();
  if (!left || !left->frame.part || left->frame.part->pieces.size() != matrices.size())
    throw Error("holds no part of this model", path.string(), again);
  if (left->frame.key != frame_.key) {
    const std::string other = Contents::read(path).text_attribute("/", "generator").value_or("");
    const std::string ours = "palpate-precompute " PALPATE_VERSION;
    if (other != ours) throw Error("was made by " + other + ", and this is " + ours, path.string(), again);
    throw Error(
        "is a part of another model, or was made on another kind of processor", path.string(),
        "Give join the same model.toml, geometry and place of the output as the parts had, on the same "
        "kind of processor");
  }
  const FileDescriptor file = open_file(path, OpenMode::read);
  for (const JournalRange& range : left->ranges) {
    if (range.matrix >= std::ssize(matrices)) continue;
    const auto matrix = static_cast<std::size_t>(range.matrix);
    const PieceRange& pieces = left->frame.part->pieces[matrix];
    if (range.first < pieces.first || range.first + range.count > pieces.end ||
        !matrices[matrix].has_in_file(range.first, range.count) ||
        pieces_.has(matrix, range.first, range.count))
      continue;
    pieces_.copy(file, left->frame.packed_at[matrix] - matrices[matrix].byte(pieces.first), range);
  }
}

/// Writes ranks, certificate, bases and couplings.
void ModelWriter::write_compressed(hdf5::File& file, const Model& extra) {
  const HierarchicalMatrix& matrix = *extra.compressed;
  counts_.set(Count::certified, std::ssize(matrix.certificate) / 6, "/greens/certificate");
  for_each_rank_field([&](const auto& field) {
    const auto values = field.take(extra);
    check_values(field, values, counts_);
    content_.add_dataset(field.path, checksum_of(values));
    write_field(file, field, extra, counts_);
  });
  for (const CompressedArray& array : compressed_arrays) {
    if (array.path == near_path) continue;  // streamed
    const std::int64_t entries = (matrix.*array.at).back();
    const float* numbers = (matrix.*array.data).get();
    if (!std::all_of(numbers, numbers + entries, [](float value) { return std::isfinite(value); }))
      refuse(path_.string(), std::string(array.path) + " holds a value that is not finite");
    file.write(array.path, number_type<float>(), std::array{entries}, numbers);
    ChunkedChecksum running;
    running.append(std::as_bytes(std::span(numbers, static_cast<std::size_t>(entries))));
    file.write_attribute(array.path, "xxh3", running.digits());
    content_.add_dataset(array.path, running.digits());
  }
}

void ModelWriter::seal(const std::vector<Probe>& probes,
                       const std::shared_ptr<const HierarchicalMatrix>& compressed, bool keeps) {
  Model extra;
  extra.compressed = compressed;
  extra.mesh.element = element_;
  extra.probes = probes;
  counts_.set(Count::probes, static_cast<std::int64_t>(probes.size()), "/probes/forces");
  for (const Probe& probe : probes) {
    if (static_cast<std::int64_t>(probe.force.size()) != order_ ||
        probe.displacement.size() != probe.force.size())
      refuse(path_.string(), "/probes/forces: a probe does not have " + std::to_string(order_) + " values");
  }

  std::vector<std::string> checksums;
  for (std::size_t matrix = 0; matrix < pieces_.matrices().size(); ++matrix) {
    checksums.push_back(pieces_.checksum(matrix));
    content_.add_dataset(pieces_.matrices()[matrix].path, checksums.back());
  }
  const hdf5::Quiet quiet;
  hdf5::File file = hdf5::File::open_to_change(pieces_.path(), aligned_from);
  for (std::size_t matrix = 0; matrix < pieces_.matrices().size(); ++matrix)
    file.write_attribute(pieces_.matrices()[matrix].path, "xxh3", checksums[matrix]);
  for_each_probe_field(element_, [&](const auto& field) {
    const auto values = field.take(extra);
    check_values(field, values, counts_);
    content_.add_dataset(field.path, checksum_of(values));
    write_field(file, field, extra, counts_);
  });
  if (compressed != nullptr) write_compressed(file, extra);
  file.write_attribute("/", "content_hash", content_.digits());
  file.close();
  rename_durably(pieces_.path(), path_, keeps);
  journal_->remove();
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
  return ModelWriter(path, model, precision, std::nullopt).frame_.key;
}

bool ModelWriter::has_columns(std::int64_t first, std::int64_t count, PackedMatrix matrix) const {
  return pieces_.has(static_cast<std::size_t>(matrix), first, count);
}

void ModelWriter::write_columns(std::int64_t first, std::int64_t count, std::span<const double> packed,
                                PackedMatrix matrix) {
  store(static_cast<std::size_t>(matrix), first, count, packed);
}

bool ModelWriter::has_near(Index leaf) const {
  return pieces_.has(near_matrix, leaf, 1);
}

void ModelWriter::read_near(Index leaf, std::span<float> entries) const {
  pieces_.expect(near_matrix, leaf, 1, std::ssize(entries));
  pieces_.read(near_matrix, leaf, std::as_writable_bytes(entries));
}

void ModelWriter::write_near(Index leaf, std::span<const float> entries) {
  store(near_matrix, leaf, 1, entries);
}

template <class From>
void ModelWriter::store(std::size_t matrix, std::int64_t first, std::int64_t count,
                        std::span<const From> values) {
  pieces_.expect(matrix, first, count, std::ssize(values));
  try {
    pieces_.store(matrix, first, count, values);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::flush() {
  pieces_.flush();
}

void ModelWriter::look_again() {
  pieces_.open();
}

std::string ModelWriter::journal_text() const {
  const std::optional<JournalContents> contents = journal_->read();
  return contents ? text_of(*contents) : "";
}

void ModelWriter::note(const std::string& line) {
  const std::string_view range = line;
  if (const auto read = read_range(range.substr(0, range.find('\n')))) pieces_.record(*read);
}

void ModelWriter::finish(const std::vector<Probe>& probes,
                         const std::shared_ptr<const HierarchicalMatrix>& compressed, bool keeps) {
  for (const StreamedMatrix& matrix : pieces_.matrices()) {
    const auto missing = std::find(matrix.done.begin(), matrix.done.end(), false);
    if (missing != matrix.done.end()) {
      throw Error("column " + std::to_string(missing - matrix.done.begin()) + " of " + matrix.name +
                      " was not written",
                  path_.string(), "This is a mistake in the program; please report it");
    }
  }
  try {
    seal(probes, compressed, keeps);
  } catch (...) {
    discard();
    throw;
  }
}

void ModelWriter::discard() noexcept {
  if (!journal_) return;
  std::error_code ignored;
  std::filesystem::remove(pieces_.path(), ignored);
  journal_->remove();
}

}  // namespace palpate
