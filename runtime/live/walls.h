// What stands still around a body: floors, walls and boxes with friction.
#pragma once

#include <optional>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A half space that bodies stay out of, or a box that stands on axes.
struct Wall {
  Vec3 normal = Vec3::UnitZ();                 ///< of the plane, of length 1, to the side where bodies are
  double offset = 0.0;                         ///< of the plane: normal . x >= offset [m]
  double friction = 0.0;                       ///< Coulomb's coefficient
  std::optional<std::pair<Vec3, Vec3>> box{};  ///< in place of the plane: its lowest and highest corner [m]
};

/// A floor and walls around a box, open above; with a lid, closed. In the plane y is up, else z.
std::vector<Wall> room_walls(const Vec3& low, const Vec3& high, double friction, int dimension = 3,
                             bool has_lid = false);

/// How a node meets a wall: its gap along a normal.
struct WallGap {
  double gap;  ///< [m]; negative within the wall
  Vec3 normal;
};

/// The gap at `at` of a node that was at `from` when the step began. A box is met through the side that the
/// node was farthest out of; nothing where it passes beside it.
std::optional<WallGap> gap_to(const Wall& wall, const Vec3& from, const Vec3& at) noexcept;

/// Throws Error for normals that are not of length 1, friction below 0, boxes turned inside out.
void check_walls(const std::vector<Wall>& walls);

/// What walls do to a node in a step of h [s] of which nothing but the node's own motion is known: it ends on
/// the wall at most, and friction takes of its sliding what the normal part allows. For explicit steps with
/// lumped mass, where that is Coulomb's law. Restitution is zero. Whether it touched.
bool stop_at_walls(const std::vector<Wall>& walls, const Vec3& from, double h, Vec3& x, Vec3& v) noexcept;

}  // namespace palpate
