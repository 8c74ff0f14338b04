// The rows of the contact problem, and the compliance of many contact points.
#pragma once

#include <array>
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

/// The rows of J by what is not zero in them, which is at most d entries at each of three nodes: entry t of
/// row i is at t rows + i, so that all rows are gone through at once.
struct CompliancePattern {
  CompliancePattern(Index max_rows, Index max_near_dofs);

  Index stride;
  std::vector<Index> place;     ///< [9 x stride] dof of the near field
  std::vector<float> factor;    ///< [9 x stride] 0 where there is no entry
  std::vector<float> response;  ///< [near dofs] a column of Xi J^T [m/N]
};

/// problem.single_W = J Xi J^T. Rows from `first_tilt_row` on are those of tilts.
void assemble_single_compliance(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
                                CompliancePattern& pattern, ContactProblem& problem) noexcept;

}  // namespace palpate
