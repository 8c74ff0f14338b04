// Who shares the columns of a bake: threads of this process, or of others too.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "formats/journal.h"
#include "precompute/machine/allotment.h"
#include "precompute/numerics/factor.h"

namespace palpate {

/// Columns, or leaves of near pairs, [first, first + count) that are solved together.
struct Tile {
  std::int64_t first = 0;
  std::int64_t count = 0;
  double cost = 0.0;  ///< in any unit
};

/// Tiles next to each other that are number `number` of `parts` shares, from 1, of about the same cost.
PieceRange share_of(const std::vector<Tile>& tiles, std::int64_t number, std::int64_t parts);

/// How many tiles were solved, and how many an earlier run has left.
struct TileCounts {
  std::int64_t solved = 0;
  std::int64_t kept = 0;
};

/// What is done with tiles.
struct TileWork {
  std::function<void(const Tile&, int worker)> solve;  ///< by any thread, `worker` in [0, jobs)
  std::function<void(const Tile&)> done;               ///< by the leader after each, one at a time
  std::function<bool()> interrupted;                   ///< no more tiles are begun
};

/// The processes of one bake. All make the same calls in the same order.
class Team {
 public:
  Team() = default;
  virtual ~Team() = default;
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  /// Whether this process prints, writes what is no tile, and seals.
  [[nodiscard]] virtual bool leads() const { return true; }

  /// Whether this process tells of its progress.
  [[nodiscard]] virtual bool prints() const { return leads(); }
  /// Number of this process, how many there are, and how many on this machine.
  [[nodiscard]] virtual int rank() const { return 0; }
  [[nodiscard]] virtual int size() const { return 1; }
  [[nodiscard]] virtual int size_here() const { return 1; }
  /// Threads where none are asked for.
  [[nodiscard]] virtual int default_jobs() const { return allotted_processors(); }

  /// Solves the leader's tiles with `jobs` threads of each process, in their order, and returns in all once
  /// all are done. False, in all, when one was interrupted.
  virtual bool work(const std::vector<Tile>& tiles, int jobs, const TileWork& work);

  /// Whether there are others that can hold a part of a factor each.
  [[nodiscard]] virtual bool can_spread() const { return false; }

  /// The numbers of a factor of K, which is analysed, over the processes. `jobs`: threads of each. Throws
  /// Error.
  [[nodiscard]] virtual std::unique_ptr<SpreadNumbers> spread(const SparseMatrix& K, const Factor& analysed,
                                                              int jobs);

  /// Whether any process says so.
  virtual bool any(bool here) { return here; }

  /// The leader's text.
  virtual std::string share(std::string text) { return text; }

  /// Gives `take` the bytes of each other process, by rank.
  virtual void exchange(const std::string& /*bytes*/, const std::function<void(std::string_view)>& /*take*/) {
  }

  /// Gives the leader, before the tile that is being solved counts as done, a line for its `listen`.
  virtual void tell(const std::string& line) { listener_(line); }
  void listen(std::function<void(const std::string&)> listener) { listener_ = std::move(listener); }

 protected:
  std::function<void(const std::string&)> listener_ = [](const std::string&) {};
};

}  // namespace palpate
