// Rows of the contact problem, and the compliance of many contact points.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/core/body/near_field.h"
#include "runtime/core/solve/contact_problem.h"

namespace palpate {

/// Row of J: a unit force along it exerts -body[n] on the near node at places[n], and `force` and the
/// `moment` about its origin on the tool.
struct ContactRow {
  std::array<Index, 3> places{-1, -1, -1};                             ///< in the near field; -1 for none
  std::array<Vec3, 3> body{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};  ///< zero if there is no node
  Index tool = -1;                                                     ///< -1: the row acts on no tool
  Vec3 force = Vec3::Zero();
  Vec3 moment = Vec3::Zero();  ///< [m]
};

/// J Xi J^T of many contact points, kept from tick to tick: only rows that have changed are computed. A row
/// is unchanged if it has the same weights of the same surface nodes, at whatever places in the near field.
/// All memory is allocated at construction.
class BodyCompliance {
 public:
  BodyCompliance(Index max_rows, Index max_near_dofs);

  /// Discards the stored rows, after a tick whose problem was not assembled here.
  void forget() noexcept { kept_rows_ = 0; }
  /// Sets problem.body_W to the body's compliance along problem.rows rows. It must still hold the result of
  /// the last call, except for its diagonal, which may have been changed. Rows from `first_tilt_row` on are
  /// tilt rows.
  void assemble(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
                ContactProblem& problem) noexcept;

  /// Number of rows computed by the last call.
  [[nodiscard]] Index renewed() const noexcept { return renewed_; }

 private:
  /// Largest number of entries of a row of J: d at each of three nodes. Entry t of row i is stored at t rows
  /// + i, so that all rows are processed at once.
  static constexpr int most_entries = 9;

  bool enter(const NearField& near, const ContactRow& row, Index i) noexcept;
  void respond(const NearField& near, Index row) noexcept;
  void project(Index begin, Index end, int entries, float* w) const noexcept;

  Index stride_;
  std::vector<Index> dof_;            // [9 x stride] d surface node + axis of each entry; -1: none
  std::vector<Index> place_;          // [9 x stride] dof of the near field; 0: none
  std::vector<float> factor_;         // [9 x stride] 0 if there is no entry
  std::vector<int> entries_;          // [stride] entries of each row
  std::vector<std::uint8_t> is_new_;  // [stride]
  std::vector<float> diagonal_;       // [stride] diagonal of the body's compliance
  std::vector<float> response_;       // [near dofs] column of Xi J^T [m/N]
  Index kept_rows_ = 0;
  Index renewed_ = 0;
  std::int64_t revision_ = -1;  // revision of the near field
};

}  // namespace palpate
