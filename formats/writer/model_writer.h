// Writes NAME.palpate.hdf.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/model.h"

namespace palpate {

struct BakePart;

/// A packed matrix that is streamed to disk.
enum class PackedMatrix : std::uint8_t {
  greens,   ///< Model::greens
  inverse,  ///< StoredDynamics::inverse, of models whose dynamics is packed
};

/// What becomes of a PATH.partial that an interrupted run of the same model has left.
enum class Leftovers : std::uint8_t { resume, discard };

/// Streams a model to disk. Everything but packed matrices and probes is written by the constructor to
/// PATH.partial, with the space of the packed matrices reserved (contiguous, page-aligned); columns then
/// arrive in any order from any thread; `finish` adds probes, checksums and content hash and renames
/// PATH.partial to PATH. Which columns are done is journalled (with their checksums) in PATH.progress, so a
/// run that was killed or interrupted is continued by constructing the writer again with an equal model. An
/// existing PATH is untouched until the rename.
class ModelWriter {
 public:
  /// `model.probes` is ignored, and of `model.greens` and `model.dynamics.inverse` all but the smooth part,
  /// which split precision needs. Continues PATH.partial when its
  /// journal has the same key (a hash of all fields but those, and of format and precision) and each
  /// journalled range still has its checksum, unless leftovers are to be discarded. Throws Error when the
  /// file cannot be created or the disk cannot hold it (with the numbers).
  ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
              Leftovers leftovers = Leftovers::resume);

  /// Writes a part: all that is written at once, and `part.pieces` of the matrices, to PATH itself, where
  /// they stay with PATH.progress until `add_part` takes them up. Resumes as above, where the part is the
  /// same. Only these pieces may be written, and `finish` is not called.
  ModelWriter(std::filesystem::path path, const Model& model, Precision precision, Leftovers leftovers,
              const BakePart& part);

  /// Writes pieces of a model that the writer of another process began, with its `journal_text`, to the same
  /// file; `report` is given the journal's line of each. Throws Error where the model is another one, or the
  /// file that is there is not the one of that process.
  ModelWriter(std::filesystem::path path, const Model& model, Precision precision,
              const std::string& journal_text, std::function<void(const std::string& line)> report);
  ~ModelWriter();
  ModelWriter(const ModelWriter&) = delete;
  ModelWriter& operator=(const ModelWriter&) = delete;

  /// The key of a model in its journal. Throws Error where a reader would refuse it.
  [[nodiscard]] static std::string key_of(const std::filesystem::path& path, const Model& model,
                                          Precision precision);

  /// Whether columns [first, first + count) were written, by this run or an earlier one.
  [[nodiscard]] bool has_columns(std::int64_t first, std::int64_t count,
                                 PackedMatrix matrix = PackedMatrix::greens) const;

  /// Stores columns [first, first + count) of the lower triangle: `packed` holds their entries one column
  /// after the other, column j from its diagonal down; in split precision of the matrix, from which W W^T is
  /// taken off here. Converts to the stored precision, subnormal
  /// numbers to 0: a tick would take many times as long with them. Thread-safe for disjoint ranges.
  void write_columns(std::int64_t first, std::int64_t count, std::span<const double> packed,
                     PackedMatrix matrix = PackedMatrix::greens);

  /// Whether the near pairs in which a leaf [0, leaves) is the column were written, by this run or an earlier
  /// one. Of a model whose `compressed` has the tree and the pairs.
  [[nodiscard]] bool has_near(Index leaf) const;
  /// Reads them back: their entries, pair after pair.
  void read_near(Index leaf, std::span<float> entries) const;
  /// Stores them. Thread-safe for different leaves.
  void write_near(Index leaf, std::span<const float> entries);

  /// Takes over the pieces of a part of the same model, except those that are there. Throws Error where it is
  /// not of this model, not finished, or damaged.
  void add_part(const std::filesystem::path& path);

  /// Hands what was written over to the file system, so that other machines see it (NFS keeps it until then).
  void flush();
  /// Sees what other machines have handed over since the file was opened.
  void look_again();

  /// What the journal holds, for writers of other processes.
  [[nodiscard]] std::string journal_text() const;
  /// Journals a piece that another process wrote.
  void note(const std::string& line);

  /// Adds the probes, and of a compressed model ranks, certificate, bases and couplings, seals and renames.
  /// All columns of all matrices, and all near pairs, must have been written. `keeps`: what has the name PATH
  /// by now stays, and an Error is thrown.
  void finish(const std::vector<Probe>& probes,
              std::shared_ptr<const HierarchicalMatrix> compressed = nullptr, bool keeps = false);

  /// Removes PATH.partial and PATH.progress, except where another process began them.
  void discard() noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Takes over what was computed with a factor (rest displacements, dynamics, a study of warping, force
/// errors, smooth parts) from the PATH.partial of the same model that an interrupted run has left, and gives
/// its precision. Nothing where there is none of the same model: all else must be equal, and what is taken
/// over undamaged. A factor over several processes does not give the same last digits again, and columns go
/// with its smooth part.
std::optional<Precision> take_up_begun_model(const std::filesystem::path& path, Model& model);

}  // namespace palpate
