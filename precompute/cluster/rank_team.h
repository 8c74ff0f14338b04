// Ranks of MPI as the processes of a bake.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "precompute/team.h"

namespace palpate {

/// The ranks that share tiles, rank 0 leading. It hands out tiles as ranks ask for them, and hears of each
/// when it is written. MPI is called by the thread that called MPI_Init_thread alone, which sleeps between
/// messages; threads of the rank solve. A rank that is not heard of for a minute ends the run.
class RankTeam : public Team {
 public:
  /// All ranks of MPI_COMM_WORLD, each by itself until `form` is called. MPI_Init_thread was called.
  RankTeam();
  ~RankTeam() override;

  /// Forms the team: of all ranks, or, where those of a node have one factor, of the first of each node,
  /// which takes over the processors of the others. Those only wait.
  void form(FactorOf factor_of) override;

  [[nodiscard]] bool takes_part() const override;
  [[nodiscard]] bool leads() const override;
  [[nodiscard]] int rank() const override;
  [[nodiscard]] int size() const override;
  [[nodiscard]] int size_here() const override;
  [[nodiscard]] int default_jobs() const override;

  [[nodiscard]] Spreading spreading() const override;
  [[nodiscard]] std::unique_ptr<SpreadNumbers> spread(const SparseMatrix& K, const Factor& analysed,
                                                      int jobs) override;

  bool work(const std::vector<Tile>& tiles, int jobs, const TileWork& work) override;
  bool any(bool here) override;
  std::string share(std::string text) override;
  void exchange(const std::string& bytes, const std::function<void(std::string_view)>& take) override;
  std::vector<std::string> gather(const std::string& text) override;
  void tell(const std::string& line) override;

  /// Waits for all ranks, those that did not take part too.
  void end();

 protected:
  void hand_over_lines() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
