// Shape quality of a mesh.
#pragma once

#include <array>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

/// Summary kept in the file and printed by `palpate-precompute inspect`. Angles are dihedral angles between
/// faces (in the plane: corner angles; hex8: at each edge the mean of both ends, as faces may be warped).
/// Shape is the radius ratio d r_in / R_circum of simplices (tet10: of its corners), the smallest scaled
/// Jacobian of the corners of quad4 and hex8: 1 is best, 0 is flat.
struct QualityReport {
  static constexpr int bins = 18;  ///< angle histogram, 10 degrees each

  double min_angle = 0.0;                            ///< [degree], over all angles of all elements
  double max_angle = 0.0;                            ///< [degree]
  double min_shape = 0.0;                            ///< [-]
  double mean_shape = 0.0;                           ///< [-]
  double min_edge = 0.0;                             ///< [m]
  double max_edge = 0.0;                             ///< [m]
  double volume = 0.0;                               ///< of the whole body [m^3]; in the plane its area [m^2]
  Index worst_element = 0;                           ///< element with the smallest shape
  Vec3 worst_centroid = Vec3::Zero();                ///< its centroid [m]
  std::array<std::int64_t, bins> angle_histogram{};  ///< number of angles in each bin
};

QualityReport measure_quality(const Mesh& mesh);

}  // namespace palpate
