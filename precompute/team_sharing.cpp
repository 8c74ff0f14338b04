#include "precompute/team_sharing.h"

#include <atomic>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

bool TeamSharing::for_each(const SharedItems& items) {
  std::vector<Tile> tiles;
  for (std::int64_t item = 0; item < items.count; ++item) tiles.push_back({item, 1, 1.0});
  const bool alone = team_.size() == 1;
  std::string own;  // results of this process, each after its item's number
  std::mutex mutex;
  std::int64_t finished = 0;
  std::atomic<bool> stopped{false};
  const TileWork work = {
      [&](const Tile& tile, int worker) {
        items.work(tile.first, worker);
        if (alone) return;
        Parcel results;
        std::int64_t item = tile.first;
        results.carry(item);
        items.carry(item, results);
        const std::scoped_lock lock(mutex);
        own += results.bytes();
      },
      [&](const Tile&) {
        if (!items.done(static_cast<double>(++finished) / static_cast<double>(items.count))) stopped = true;
      },
      [&] { return stopped || interrupted_(); }};
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
