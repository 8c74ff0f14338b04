// MPI ranks as the processes of a bake.
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

/// All ranks of MPI_COMM_WORLD, led by rank 0. Their threads draw tiles from a counter in a window of rank 0,
/// and the main thread of each rank reports what they have written to the leader, sleeping between polls. One
/// thread of a rank calls MPI at a time. If a rank dies, MPI ends the others.
class RankTeam : public Team {
 public:
  /// Requires MPI_Init_thread with MPI_THREAD_SERIALIZED.
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

  /// Frees MPI objects; call it last, in all ranks.
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
  MPI_Win counter_ = MPI_WIN_NULL;  // next tile to draw; in rank 0
  std::mutex calls_;                // guards MPI calls while threads draw
  std::mutex telling_;              // guards news_ and the failure of a round
  std::string news_;                // reports for the leader
};

}  // namespace palpate
