// Work divided among the processes of a bake, all of which need the results.
#pragma once

#include <functional>

#include "precompute/numerics/sharing.h"
#include "precompute/team.h"

namespace palpate {

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
