#include "precompute/team.h"

#include <mutex>
#include <stdexcept>

#include "base/parallel.h"

namespace palpate {

PieceRange share_of(const std::vector<Tile>& tiles, std::int64_t number, std::int64_t parts) {
  double whole = 0.0;
  for (const Tile& tile : tiles) whole += tile.cost;
  PieceRange share;
  bool begun = false;
  double before = 0.0;
  for (const Tile& tile : tiles) {
    // A tile belongs to the part that contains its middle.
    const double middle = whole > 0.0 ? (before + 0.5 * tile.cost) / whole : 0.0;
    before += tile.cost;
    const std::int64_t of =
        std::min(parts, 1 + static_cast<std::int64_t>(middle * static_cast<double>(parts)));
    if (of > number) break;
    if (of < number) {
      share.first = share.end = tile.first + tile.count;
      continue;
    }
    if (!begun) share.first = tile.first;
    begun = true;
    share.end = tile.first + tile.count;
  }
  return share;
}

bool Team::work(const std::vector<Tile>& tiles, int jobs, const TileWork& work) {
  std::mutex mutex;
  parallel_for(std::ssize(tiles), jobs, [&](std::int64_t k, int worker) {
    if (work.interrupted()) return;
    const Tile& tile = tiles[static_cast<std::size_t>(k)];
    work.solve(tile, worker);
    const std::scoped_lock lock(mutex);
    work.done(tile);
  });
  return !work.interrupted();
}

std::unique_ptr<SpreadNumbers> Team::spread(const SparseMatrix& /*K*/, const Factor& /*analysed*/,
                                            int /*jobs*/) {
  throw std::logic_error("a single process cannot spread a factor");
}

}  // namespace palpate
