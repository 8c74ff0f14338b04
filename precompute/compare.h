// Comparison of the same touches on two baked files of one body, for choosing element, mesh and precision.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/model.h"

namespace palpate {

struct CompareOptions {
  int touches = 20;  ///< places, spread over the boundary
  std::optional<double>
      radius;  ///< of the finger tip [m]; 0: one node; empty: three mean edges of the coarser file
};

/// A round finger tip pressed against the boundary along its inward normal. The traction falls from its
/// middle as 1 - (r/R)^2, which every mesh resolves to second order; a single node's force has no limit (a
/// point load is singular; theory.md section 4).
struct TouchComparison {
  Vec3 place;          ///< node of the first file [m]
  double stiffness_a;  ///< force over the mean displacement under the tip [N/m]
  double stiffness_b;
  double
      field_difference;  ///< largest |u_a - u_b| on the boundary beside the tip, over the tip's displacement

  [[nodiscard]] double force_difference() const noexcept { return stiffness_b / stiffness_a - 1.0; }
};

struct Comparison {
  double radius;  ///< [m]
  std::vector<TouchComparison> touches;
};

/// Compares two files. Throws Error if they do not hold the same body (dimension, extent), or if their
/// boundaries have no free place in common.
Comparison compare(const Model& a, const Model& b, const CompareOptions& options);

/// Comparison as a table, with the median and the largest differences.
std::string to_text(const Comparison& comparison);

}  // namespace palpate
