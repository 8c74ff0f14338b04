// The matrices of a model's file that arrive in pieces, in any order and from any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/file_io.h"
#include "formats/contents.h"
#include "formats/journal.h"
#include "formats/model.h"

namespace palpate {

/// A matrix written in pieces: packed matrices by columns, compressed ones by leaves of columns.
struct StreamedMatrix {
  const char* path;  ///< of its dataset
  const char* name;
  NumberType scalar;
  std::vector<std::int64_t> starts;          ///< [pieces + 1] first entry of each piece
  std::shared_ptr<const SmoothPart> smooth;  ///< subtracted from arriving entries
  std::vector<bool> done{};                  ///< [pieces]
  PieceRange own{};                          ///< pieces in this file

  [[nodiscard]] std::int64_t pieces() const { return std::ssize(starts) - 1; }
  /// Entries, and bytes, of the file's pieces before a piece; of all of them.
  [[nodiscard]] std::int64_t entry(std::int64_t piece) const {
    return starts[static_cast<std::size_t>(piece)] - starts[static_cast<std::size_t>(own.first)];
  }
  [[nodiscard]] std::int64_t byte(std::int64_t piece) const {
    return entry(piece) * static_cast<std::int64_t>(scalar.bytes);
  }
  [[nodiscard]] std::int64_t entries() const { return entry(own.end); }
  [[nodiscard]] std::int64_t bytes() const { return byte(own.end); }
  [[nodiscard]] bool has_in_file(std::int64_t first, std::int64_t count) const {
    return first >= own.first && count >= 0 && first <= own.end && count <= own.end - first;
  }
};

/// Matrices of a model, of which a part has some pieces.
std::vector<StreamedMatrix> streamed_matrices(const Model& model, Precision precision,
                                              const std::optional<BakePart>& part);

/// A file with space for such matrices. Each piece that is stored is passed to `record`.
class PieceFile {
 public:
  PieceFile(std::filesystem::path path, std::vector<StreamedMatrix> matrices);

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] const std::vector<StreamedMatrix>& matrices() const noexcept { return matrices_; }
  [[nodiscard]] std::int64_t bytes() const;  ///< of all matrices

  /// From now on pieces are stored, and passed to `record`.
  void record_to(std::function<void(const JournalRange&)> record) { record_ = std::move(record); }

  /// Opens the file anew, and so sees what other machines have handed over; `flush` hands over.
  void open();
  void close() { data_.close(); }
  void flush();

  /// Takes the space at frame.packed_at of a file that is written except for the matrices, opens it, and adds
  /// its size and checksum to the frame.
  void reserve(JournalFrame& frame);

  /// True if the file, which is opened, is the one of the frame: the HDF5 library can be given it, matrices
  /// lie where the frame says, and all else has its checksum.
  [[nodiscard]] bool is_of(const JournalFrame& frame);

  /// Takes the places of an opened file, and these pieces as done.
  void take(const JournalFrame& frame, const std::vector<JournalRange>& done);

  /// The ranges whose bytes still have their checksums, in a file of the frame.
  [[nodiscard]] std::vector<JournalRange> undamaged(const JournalFrame& frame,
                                                    const std::vector<JournalRange>& ranges);

  /// True if pieces [first, first + count) are done.
  [[nodiscard]] bool has(std::size_t matrix, std::int64_t first, std::int64_t count) const;

  /// Throws Error where these are not pieces of the file with so many entries.
  void expect(std::size_t matrix, std::int64_t first, std::int64_t count, std::int64_t entries) const;

  /// Converts to the stored precision, subnormal numbers to 0, and stores. Thread-safe for disjoint pieces.
  template <class From>
  void store(std::size_t matrix, std::int64_t first, std::int64_t count, std::span<const From> values);
  void read(std::size_t matrix, std::int64_t piece, std::span<std::byte> bytes) const;

  /// Copies a range from a file in which the matrix would begin at `origin`. Throws Error where its checksum
  /// is another.
  void copy(const FileDescriptor& from, std::int64_t origin, const JournalRange& range);

  /// A range is in the file.
  void record(const JournalRange& range);

  /// Checksum of all of a matrix.
  [[nodiscard]] std::string checksum(std::size_t matrix) const;

 private:
  template <class T, class From>
  void store_as(std::size_t matrix, std::int64_t first, std::int64_t count, std::span<const From> values);
  [[nodiscard]] std::int64_t place(std::size_t matrix, std::int64_t piece) const;
  [[nodiscard]] std::string checksum_around(const std::vector<std::int64_t>& packed_at) const;
  void mark_done(const JournalRange& range);

  std::filesystem::path path_;
  std::vector<StreamedMatrix> matrices_;
  std::vector<std::int64_t> packed_at_;  // first byte of each
  std::function<void(const JournalRange&)> record_;
  FileDescriptor data_;
  mutable std::mutex mutex_;  // guards what is done, and `record`
};

}  // namespace palpate
