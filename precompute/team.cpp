#include "precompute/team.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <stdexcept>

#include "base/parallel.h"

namespace palpate {
namespace {

// Small items are combined, so that at most this many tiles, or this many per thread, are drawn.
constexpr std::int64_t most_tiles = 4096, most_of_thread = 16;

std::vector<Tile> tiles_of(std::int64_t items, std::int64_t threads) {
  const std::int64_t width =
      std::max<std::int64_t>(1, items / std::max(most_tiles, most_of_thread * threads));
  std::vector<Tile> tiles;
  for (std::int64_t first = 0; first < items; first += width)
    tiles.push_back({first, std::min(width, items - first), 1.0});
  return tiles;
}

}  // namespace

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

bool TeamSharing::for_each(const SharedItems& items) {
  const bool alone = team_.size() == 1;
  std::string own;  // results of this process, each after its item's number
  std::mutex mutex;
  std::int64_t finished = 0;
  std::atomic<bool> stopped{false};
  const TileWork work = {[&](const Tile& tile, int worker) {
                           Parcel results;
                           for (std::int64_t item = tile.first; item < tile.first + tile.count; ++item) {
                             items.work(item, worker);
                             if (alone) continue;
                             results.carry(item);
                             items.carry(item, results);
                           }
                           const std::scoped_lock lock(mutex);
                           own += results.bytes();
                         },
                         [&](const Tile& tile) {
                           finished += tile.count;
                           if (!items.done(static_cast<double>(finished) / static_cast<double>(items.count)))
                             stopped = true;
                         },
                         [&] { return stopped || interrupted_(); }};
  const std::vector<Tile> tiles = tiles_of(items.count, std::int64_t{jobs_} * team_.size());
  if (!team_.work(tiles, jobs_, work)) return false;
  team_.exchange(own, [&](std::string_view bytes) {
    Parcel results(bytes);
    while (!results.empty()) {
      std::int64_t item = 0;
      results.carry(item);
      items.carry(item, results);
    }
  });
  return true;
}

}  // namespace palpate
