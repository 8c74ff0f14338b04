// Ranks of MPI as the processes of a bake.
#pragma once

#include <mpi.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "precompute/team.h"

namespace palpate {

/// All ranks of MPI_COMM_WORLD, rank 0 leading. Their threads draw tiles from a counter in a window of rank
/// 0, and the main thread of each rank tells the leader what they have written. It sleeps between its looks.
/// One thread of a rank calls MPI at a time. Where a rank dies, MPI ends the others.
class RankTeam : public Team {
 public:
  /// MPI_Init_thread was called, for MPI_THREAD_SERIALIZED.
  RankTeam();

  [[nodiscard]] bool leads() const override { return rank_ == 0; }
  [[nodiscard]] int rank() const override { return rank_; }
  [[nodiscard]] int size() const override { return size_; }
  [[nodiscard]] int size_here() const override { return size_here_; }
  [[nodiscard]] int default_jobs() const override { return default_jobs_; }

  [[nodiscard]] bool can_spread() const override;
  [[nodiscard]] std::unique_ptr<SpreadNumbers> spread(const SparseMatrix& K, const Factor& analysed,
                                                      int jobs) override;

  bool work(const std::vector<Tile>& tiles, int jobs, const TileWork& work) override;
  bool any(bool here) override;
  std::string share(std::string text) override;
  void exchange(const std::string& bytes, const std::function<void(std::string_view)>& take) override;
  void tell(const std::string& line) override;

  /// After all else, in all ranks.
  void end();

 private:
  struct Round;
  std::int64_t draw();
  void set_counter(std::int64_t tile);
  void solve(Round& round, int worker);
  bool attend(Round& round);
  void pass_on(Round& round);
  void add_news(std::int64_t tile, const std::string& line);
  std::string take_news();
  void send_news(const std::string& news);
  std::string receive_news();
  void hear(std::string_view news, const std::function<void(std::int64_t tile)>& solved);
  bool is_over(MPI_Request& request);

  int rank_ = 0, size_ = 1, size_here_ = 1, default_jobs_ = 1;
  MPI_Win counter_ = MPI_WIN_NULL;  // the next tile that nobody has drawn; in rank 0
  std::mutex calls_;                // of MPI while threads draw
  std::mutex telling_;              // of what follows
  std::string news_;                // for the leader
};

}  // namespace palpate
