// The rows of the contact problem, and the compliance of many contact points.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/body/near_field.h"
#include "runtime/solve/contact_problem.h"

namespace palpate {

/// One row of J: a force of 1 along it puts -body[n] on the near node at places[n], and `force` and `moment`
/// about its origin on the tool.
struct ContactRow {
  std::array<Index, 3> places{-1, -1, -1};                             ///< in the near field, -1 for none
  std::array<Vec3, 3> body{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  ///< zero where there is no node
  Index tool = -1;                                                     ///< -1: the row does not act on a tool
  Vec3 force = Vec3::Zero();
  Vec3 moment = Vec3::Zero();  ///< [m]
};

/// J Xi J^T of many contact points, kept from tick to tick: what is computed is what rows have that are other
/// than in the tick before. A row is the same when it has the same share of the same surface nodes, wherever
/// they stand in the near field. All memory is taken at construction.
class BodyCompliance {
 public:
  BodyCompliance(Index max_rows, Index max_near_dofs);

  /// Keeps nothing: after a tick whose problem was not assembled here.
  void forget() noexcept { kept_rows_ = 0; }
  /// Makes problem.body_W the body's compliance along problem.rows rows. It has to hold what the last call
  /// left there, but for its diagonal, which may have been changed. Rows from `first_tilt_row` on are those
  /// of tilts.
  void assemble(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
                ContactProblem& problem) noexcept;

  /// Rows that the last call computed.
  [[nodiscard]] Index renewed() const noexcept { return renewed_; }

 private:
  /// Entries of J, which are at most d at each of three nodes: entry t of row i is at t rows + i, so that all
  /// rows are gone through at once.
  static constexpr int most_entries = 9;

  bool enter(const NearField& near, const ContactRow& row, Index i) noexcept;
  void respond(const NearField& near, Index row) noexcept;
  void project(Index begin, Index end, int entries, float* w) const noexcept;

  Index stride_;
  std::vector<Index> dof_;            // [9 x stride] d surface node + axis of each entry, -1 for none
  std::vector<Index> place_;          // [9 x stride] dof of the near field, 0 for none
  std::vector<float> factor_;         // [9 x stride] 0 where there is no entry
  std::vector<int> entries_;          // [stride] of each row
  std::vector<std::uint8_t> is_new_;  // [stride]
  std::vector<float> diagonal_;       // [stride] of the body's compliance
  std::vector<float> response_;       // [near dofs] a column of Xi J^T [m/N]
  Index kept_rows_ = 0;
  Index renewed_ = 0;
  std::int64_t revision_ = -1;  // of the near field
};

}  // namespace palpate
