// Threads and processes among which the columns of a bake are divided.
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
#include "precompute/numerics/sharing.h"

namespace palpate {

/// Columns, or leaves of near pairs, [first, first + count) that are solved together.
struct Tile {
  std::int64_t first = 0;
  std::int64_t count = 0;
  double cost = 0.0;  ///< in any unit
};

/// Part `number` of `parts` (from 1) of the tiles: adjacent tiles, with parts of about the same cost.
PieceRange share_of(const std::vector<Tile>& tiles, std::int64_t number, std::int64_t parts);

/// Numbers of tiles solved now, and kept from an earlier run.
struct TileCounts {
  std::int64_t solved = 0;
  std::int64_t kept = 0;
};

/// Callbacks for tiles.
struct TileWork {
  std::function<void(const Tile&, int worker)> solve;  ///< called by any thread, `worker` in [0, jobs)
  std::function<void(const Tile&)> done;               ///< called by the leader after each tile, one at a
                                                       ///< time
  std::function<bool()> interrupted;                   ///< true: no more tiles are begun
};

/// The processes of one bake. All make the same calls in the same order.
class Team {
 public:
  Team() = default;
  virtual ~Team() = default;
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  /// True if this process prints, writes everything except tiles, and completes the file.
  [[nodiscard]] virtual bool leads() const { return true; }

  /// True if this process reports its progress.
  [[nodiscard]] virtual bool prints() const { return leads(); }
  /// Number of this process; number of all processes, and of those on this machine.
  [[nodiscard]] virtual int rank() const { return 0; }
  [[nodiscard]] virtual int size() const { return 1; }
  [[nodiscard]] virtual int size_here() const { return 1; }
  /// Number of threads if none is requested.
  [[nodiscard]] virtual int default_jobs() const { return allotted_processors(); }

  /// Solves the leader's tiles with `jobs` threads of each process, in order, and returns in all processes
  /// once all tiles are done. Returns false, in all, if one was interrupted.
  virtual bool work(const std::vector<Tile>& tiles, int jobs, const TileWork& work);

  /// True if there are other processes that can each hold a part of a factor.
  [[nodiscard]] virtual bool can_spread() const { return false; }

  /// Distributes the numbers of a factor of K over the processes. `analysed`: factor of K, analysed. `jobs`:
  /// threads of each process. Throws Error.
  [[nodiscard]] virtual std::unique_ptr<SpreadNumbers> spread(const SparseMatrix& K, const Factor& analysed,
                                                              int jobs);

  /// True if `here` is true in any process.
  virtual bool any(bool here) { return here; }

  /// The leader's text, in all processes.
  virtual std::string share(std::string text) { return text; }

  /// Passes the bytes of each other process to `take`, by rank.
  virtual void exchange(const std::string& /*bytes*/, const std::function<void(std::string_view)>& /*take*/) {
  }

  /// Sends the leader a line for its `listen`, before the tile being solved counts as done.
  virtual void tell(const std::string& line) { listener_(line); }
  void listen(std::function<void(const std::string&)> listener) { listener_ = std::move(listener); }

 protected:
  std::function<void(const std::string&)> listener_ = [](const std::string&) {};
};

/// Threads of all processes of a team, which take items as they become free.
class TeamSharing : public Sharing {
 public:
  /// `jobs`: threads of each process. No more items are begun once any process is `interrupted`.
  TeamSharing(Team& team, int jobs, std::function<bool()> interrupted)
      : team_(team), jobs_(jobs), interrupted_(std::move(interrupted)) {}

  [[nodiscard]] int jobs() const override { return jobs_; }
  bool for_each(const SharedItems& items) override;

 private:
  Team& team_;
  int jobs_;
  std::function<bool()> interrupted_;
};

}  // namespace palpate
