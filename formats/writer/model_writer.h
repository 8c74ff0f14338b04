// Writer of NAME.palpate.hdf.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/content_hash.h"
#include "formats/field_counts.h"
#include "formats/journal.h"
#include "formats/model.h"
#include "formats/writer/piece_file.h"

namespace palpate {

namespace hdf5 {
class File;
}

/// A packed matrix that is streamed to disk.
enum class PackedMatrix : std::uint8_t {
  greens,   ///< Model::greens
  inverse,  ///< StoredDynamics::inverse, of models whose dynamics is packed
};

/// Treatment of a PATH.partial from an interrupted run of the same model.
enum class Leftovers : std::uint8_t { resume, discard };

/// Streams a model to disk. The constructor writes everything except packed matrices and probes to
/// PATH.partial and reserves the space of the packed matrices (contiguous, page-aligned). Columns then arrive
/// in any order from any thread. `finish` adds probes, checksums and content hash and renames PATH.partial to
/// PATH. Finished columns are journalled with their checksums in PATH.progress, so a run that was killed or
/// interrupted is continued by constructing the writer again with an equal model. An existing PATH is
/// untouched until the rename.
class ModelWriter {
 public:
  /// Ignores `model.probes`, and `model.greens` and `model.dynamics.inverse` except their smooth parts, which
  /// split precision needs. Continues PATH.partial if its journal has the same key (a hash of all other
  /// fields, the format and the precision) and each journalled range still has its checksum, unless leftovers
  /// are to be discarded. Throws Error if the file cannot be created or the disk cannot hold it (with the
  /// numbers).
  ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
              Leftovers leftovers = Leftovers::resume);

  /// Writes a part to PATH itself: everything that is written at once, and `part.pieces` of the matrices. The
  /// part stays there with PATH.progress until `add_part` takes it over. Resumes as above if the part is the
  /// same. Only these pieces may be written, and `finish` is not called.
  ModelWriter(std::filesystem::path path, const Model& model, Precision precision, Leftovers leftovers,
              const BakePart& part);

  /// Writes pieces of a model that another process's writer began, with its `journal_text`, to the same file;
  /// `report` gets the journal line of each. Throws Error if the model differs, or the file is not the one of
  /// that process.
  ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
              const std::string& journal_text, std::function<void(const std::string& line)> report);
  ModelWriter(const ModelWriter&) = delete;
  ModelWriter& operator=(const ModelWriter&) = delete;

  /// Key of a model in its journal. Throws Error if a reader would refuse the model.
  [[nodiscard]] static std::string key_of(const std::filesystem::path& path, const Model& model,
                                          Precision precision);

  /// True if columns [first, first + count) were written, by this run or an earlier one.
  [[nodiscard]] bool has_columns(std::int64_t first, std::int64_t count,
                                 PackedMatrix matrix = PackedMatrix::greens) const;

  /// Stores columns [first, first + count) of the lower triangle: `packed` holds their entries one column
  /// after the other, column j from its diagonal down; with split precision those of the full matrix, from
  /// which W W^T is subtracted here. Converts to the stored precision, and subnormal numbers, which slow a
  /// tick down many times, to 0. Thread-safe for disjoint ranges.
  void write_columns(std::int64_t first, std::int64_t count, std::span<const double> packed,
                     PackedMatrix matrix = PackedMatrix::greens);

  /// True if the near pairs with leaf [0, leaves) as column were written, by this run or an earlier one. For
  /// models whose `compressed` has the tree and the pairs.
  [[nodiscard]] bool has_near(Index leaf) const;
  /// Reads back the entries of these near pairs, pair after pair.
  void read_near(Index leaf, std::span<float> entries) const;
  /// Stores the entries of these near pairs. Thread-safe for different leaves.
  void write_near(Index leaf, std::span<const float> entries);

  /// Copies the pieces of a part of the same model, except those already present. Throws Error if the part is
  /// of another model, unfinished, or damaged.
  void add_part(const std::filesystem::path& path);

  /// Flushes written data to the file system, so that other machines see them (NFS holds them back until
  /// then).
  void flush();
  /// Makes data visible that other machines have flushed since the file was opened.
  void look_again();

  /// Contents of the journal, for writers of other processes.
  [[nodiscard]] std::string journal_text() const;
  /// Adds a piece written by another process to the journal.
  void note(const std::string& line);

  /// Adds the probes and, for a compressed model, ranks, certificate, bases and couplings, writes the hashes
  /// and renames. All columns of all matrices, and all near pairs, must have been written. With `keeps`, an
  /// existing PATH is not replaced but an Error.
  void finish(const std::vector<Probe>& probes,
              const std::shared_ptr<const HierarchicalMatrix>& compressed = nullptr, bool keeps = false);

  /// Removes PATH.partial and PATH.progress, unless another process began them.
  void discard() noexcept;

 private:
  ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
              const std::optional<BakePart>& part);
  [[nodiscard]] JournalFrame examine(const Model& model);
  void begin(const Model& model, Leftovers leftovers);
  bool resume();
  void start(const Model& model);
  void write_body(const Model& model);
  template <class From>
  void store(std::size_t matrix, std::int64_t first, std::int64_t count, std::span<const From> values);
  void seal(const std::vector<Probe>& probes, const std::shared_ptr<const HierarchicalMatrix>& compressed,
            bool keeps);
  void write_compressed(hdf5::File& file, const Model& extra);

  std::filesystem::path path_;
  FileHeader header_;
  Counts counts_;
  ContentHash content_;
  ElementType element_;
  std::int64_t order_;
  PieceFile pieces_;
  JournalFrame frame_;
  std::optional<Journal> journal_;  // nullopt if another process has it
};

/// Takes over all that an interrupted run of the same model computed with a factor (rest displacements,
/// dynamics, force errors, smooth parts) from its PATH.partial, and returns its precision. Nullopt if there
/// is none of the same model: all else must be equal, and the data taken over undamaged. A factor over
/// several processes does not reproduce the last digits, and columns depend on its smooth part.
std::optional<Precision> take_up_begun_model(const std::filesystem::path& path, Model& model);

}  // namespace palpate
