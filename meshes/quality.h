// Shape quality of a tetrahedral mesh.
#pragma once

#include <array>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

/// Summary kept in the file and printed by `palpate-precompute inspect`.
struct QualityReport {
  static constexpr int bins = 18;  ///< dihedral angle histogram, 10 degrees each

  double min_dihedral = 0.0;           ///< [degree], over all six angles of all elements
  double max_dihedral = 0.0;           ///< [degree]
  double min_radius_ratio = 0.0;       ///< 3 r_in / R_circum: 1 for the regular tetrahedron, 0 for a flat one
  double mean_radius_ratio = 0.0;      ///< [-]
  double min_edge = 0.0;               ///< [m]
  double max_edge = 0.0;               ///< [m]
  double volume = 0.0;                 ///< of the whole body [m^3]
  Index worst_element = 0;             ///< the element with the smallest radius ratio
  Vec3 worst_centroid = Vec3::Zero();  ///< where it is [m]
  std::array<std::int64_t, bins> dihedral_histogram{};  ///< number of angles in each bin
};

QualityReport measure_quality(const Mesh& mesh);

}  // namespace palpate
