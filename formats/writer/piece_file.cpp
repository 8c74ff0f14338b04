#include "formats/writer/piece_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "formats/checksum.h"
#include "formats/dynamics_fields.h"
#include "formats/hierarchical_fields.h"
#include "formats/model_fields.h"
#include "formats/precision_fields.h"
#include "formats/writer/hdf5_walk.h"

namespace palpate {
namespace {

constexpr std::size_t values_at_once = 1 << 15;              // converted and written together
constexpr std::size_t bytes_at_once = std::size_t{1} << 20;  // read together

/// Adds the bytes [from, to) of a file to a running checksum.
void add_bytes(RunningChecksum& running, const FileDescriptor& file, std::int64_t from, std::int64_t to) {
  std::vector<std::byte> buffer(bytes_at_once);
  while (from < to) {
    const auto part = std::span(buffer).first(std::min(buffer.size(), static_cast<std::size_t>(to - from)));
    read_exactly(file, part, from);
    running.update(part);
    from += static_cast<std::int64_t>(part.size());
  }
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

StreamedMatrix packed_by_columns(const char* path, const char* name, const PackedGreens& matrix,
                                 Precision precision, std::int64_t order) {
  StreamedMatrix streamed{path,
                          name,
                          has_float_entries(precision) ? number_type<float>() : number_type<double>(),
                          {},
                          matrix.smooth()};
  for (std::int64_t j = 0; j <= order; ++j) streamed.starts.push_back(packed_column(j, order));
  return streamed;
}

}  // namespace

std::vector<StreamedMatrix> streamed_matrices(const Model& model, Precision precision,
                                              const std::optional<BakePart>& part) {
  std::vector<StreamedMatrix> matrices;
  if (model.scope == Scope::none) return matrices;
  const std::int64_t order = model.stored_dofs();
  if (const HierarchicalMatrix* compressed = model.compressed.get(); compressed != nullptr) {
    StreamedMatrix near{near_path, "the near pairs", number_type<float>(), {}, nullptr};
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
  for (std::size_t k = 0; k < matrices.size(); ++k) {
    matrices[k].done.assign(matrices[k].starts.size() - 1, false);
    matrices[k].own = part ? part->pieces.at(k) : PieceRange{0, matrices[k].pieces()};
  }
  return matrices;
}

PieceFile::PieceFile(std::filesystem::path path, std::vector<StreamedMatrix> matrices)
    : path_(std::move(path)), matrices_(std::move(matrices)) {}

std::int64_t PieceFile::bytes() const {
  std::int64_t bytes = 0;
  for (const StreamedMatrix& matrix : matrices_) bytes += matrix.bytes();
  return bytes;
}

void PieceFile::open() {
  data_ = open_file(path_, OpenMode::write);
}

void PieceFile::flush() {
  palpate::flush(data_);
}

void PieceFile::reserve(JournalFrame& frame) {
  open();
  for (std::size_t k = 0; k < matrices_.size(); ++k)
    if (matrices_[k].bytes() > 0) reserve_space(data_, frame.packed_at[k], matrices_[k].bytes());
  frame.file_bytes = file_size(data_);
  frame.checksum = checksum_around(frame.packed_at);
  packed_at_ = frame.packed_at;
}

bool PieceFile::is_of(const JournalFrame& frame) {
  if (frame.packed_at.size() != matrices_.size()) return false;
  try {
    FileDescriptor file = open_file(path_, OpenMode::read);
    const std::vector<std::byte> index = hdf5::index_of(file);
    const Contents contents = Contents::of(std::move(file), index);
    for (std::size_t k = 0; k < matrices_.size(); ++k) {
      if (matrices_[k].bytes() == 0) continue;
      const Stored stored = contents.locate(matrices_[k].path, matrices_[k].scalar, 1);
      if (stored.offset != frame.packed_at[k] || stored.bytes != matrices_[k].bytes()) return false;
    }
  } catch (const Error&) {
    return false;
  }
  open();
  for (std::size_t k = 0; k < matrices_.size(); ++k)
    if (frame.packed_at[k] > frame.file_bytes - matrices_[k].bytes()) return false;
  return file_size(data_) == frame.file_bytes && checksum_around(frame.packed_at) == frame.checksum;
}

void PieceFile::take(const JournalFrame& frame, const std::vector<JournalRange>& done) {
  packed_at_ = frame.packed_at;
  for (const JournalRange& range : done) mark_done(range);
}

std::vector<JournalRange> PieceFile::undamaged(const JournalFrame& frame,
                                               const std::vector<JournalRange>& ranges) {
  packed_at_ = frame.packed_at;
  std::vector<JournalRange> whole;
  for (const JournalRange& range : ranges) {
    if (range.matrix >= std::ssize(matrices_)) continue;
    const auto matrix = static_cast<std::size_t>(range.matrix);
    if (!matrices_[matrix].has_in_file(range.first, range.count)) continue;
    RunningChecksum stored;
    add_bytes(stored, data_, place(matrix, range.first), place(matrix, range.first + range.count));
    if (stored.digits() == range.checksum) whole.push_back(range);
  }
  return whole;
}

bool PieceFile::has(std::size_t matrix, std::int64_t first, std::int64_t count) const {
  const std::scoped_lock lock(mutex_);
  if (matrix >= matrices_.size()) return false;
  const std::int64_t pieces = matrices_[matrix].pieces();
  if (first < 0 || count < 0 || first > pieces || count > pieces - first) return false;
  const auto begin = matrices_[matrix].done.begin() + first;
  return std::all_of(begin, begin + count, [](bool done) { return done; });
}

void PieceFile::expect(std::size_t matrix, std::int64_t first, std::int64_t count,
                       std::int64_t entries) const {
  if (matrix < matrices_.size() && matrices_[matrix].has_in_file(first, count)) {
    const std::vector<std::int64_t>& starts = matrices_[matrix].starts;
    if (entries == starts[static_cast<std::size_t>(first + count)] - starts[static_cast<std::size_t>(first)])
      return;
  }
  throw Error("columns " + std::to_string(first) + " to " + std::to_string(first + count - 1) + " with " +
                  std::to_string(entries) + " entries do not fit the matrix",
              path_.string(), "This is a mistake in the program; please report it");
}

template <class T, class From>
void PieceFile::store_as(std::size_t matrix, std::int64_t first, std::int64_t count,
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
                      std::to_string(first + count - 1) + " of " + matrices_[matrix].name +
                      " hold a value that is not finite in the stored precision",
                  path_.string(), "Check the material and the mesh's quality, or store in double precision");
    }
    const auto bytes = std::as_bytes(std::span(converted));
    stored.update(bytes);
    write_exactly(data_, bytes, at);
    at += static_cast<std::int64_t>(bytes.size());
  }
  record({static_cast<std::int64_t>(matrix), first, count, stored.digits()});
}

template <class From>
void PieceFile::store(std::size_t matrix, std::int64_t first, std::int64_t count,
                      std::span<const From> values) {
  const StreamedMatrix& to = matrices_[matrix];
  if constexpr (std::is_same_v<From, double>) {
    if (to.smooth != nullptr)
      return store_as<float, double>(matrix, first, count, without(*to.smooth, first, to.pieces(), values));
  }
  if (to.scalar.bytes == sizeof(float))
    store_as<float>(matrix, first, count, values);
  else
    store_as<double>(matrix, first, count, values);
}

template void PieceFile::store(std::size_t, std::int64_t, std::int64_t, std::span<const double>);
template void PieceFile::store(std::size_t, std::int64_t, std::int64_t, std::span<const float>);

void PieceFile::read(std::size_t matrix, std::int64_t piece, std::span<std::byte> bytes) const {
  read_exactly(data_, bytes, place(matrix, piece));
}

void PieceFile::copy(const FileDescriptor& from, std::int64_t origin, const JournalRange& range) {
  const auto matrix = static_cast<std::size_t>(range.matrix);
  RunningChecksum copied;
  std::vector<std::byte> buffer(bytes_at_once);
  const std::int64_t end = place(matrix, range.first + range.count);
  for (std::int64_t at = place(matrix, range.first); at < end; at += std::ssize(buffer)) {
    const auto bytes = std::span(buffer).first(
        static_cast<std::size_t>(std::min<std::int64_t>(std::ssize(buffer), end - at)));
    read_exactly(from, bytes, at - packed_at_[matrix] + origin);
    copied.update(bytes);
    write_exactly(data_, bytes, at);
  }
  if (copied.digits() != range.checksum) {
    throw Error("has changed since it was made: its columns " + std::to_string(range.first) + " to " +
                    std::to_string(range.first + range.count - 1) + " have another checksum",
                from.path().string(), "Copy it again, or give its --part again");
  }
  record(range);
}

void PieceFile::record(const JournalRange& range) {
  const std::scoped_lock lock(mutex_);
  record_(range);
  mark_done(range);
}

/// Checksum of a matrix, read and not mapped, so that the file does not count as memory.
std::string PieceFile::checksum(std::size_t matrix) const {
  ChunkedChecksum running;
  const std::int64_t begin = packed_at_[matrix], end = place(matrix, matrices_[matrix].pieces());
  running.append_file(data_, begin, end - begin, nullptr);
  return running.digits();
}

/// Position of a piece in the file.
std::int64_t PieceFile::place(std::size_t matrix, std::int64_t piece) const {
  return packed_at_[matrix] + matrices_[matrix].byte(piece);
}

/// Checksum of all bytes of the file but the matrices at these places.
std::string PieceFile::checksum_around(const std::vector<std::int64_t>& packed_at) const {
  std::vector<std::pair<std::int64_t, std::int64_t>> gaps;  // where each begins and ends
  for (std::size_t k = 0; k < matrices_.size(); ++k)
    gaps.emplace_back(packed_at[k], packed_at[k] + matrices_[k].bytes());
  std::sort(gaps.begin(), gaps.end());
  RunningChecksum running;
  std::int64_t from = 0;
  for (const auto& [begin, end] : gaps) {
    add_bytes(running, data_, from, begin);
    from = end;
  }
  add_bytes(running, data_, from, file_size(data_));
  return running.digits();
}

void PieceFile::mark_done(const JournalRange& range) {
  if (range.matrix >= std::ssize(matrices_)) return;
  StreamedMatrix& matrix = matrices_[static_cast<std::size_t>(range.matrix)];
  if (!matrix.has_in_file(range.first, range.count)) return;
  const auto begin = matrix.done.begin() + range.first;
  std::fill(begin, begin + range.count, true);
}

}  // namespace palpate
