// Fixed obstacles around a body: floors, walls and boxes with friction.
#pragma once

#include <optional>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// Half-space that bodies stay out of, or an axis-aligned box.
struct Wall {
  Vec3 normal = Vec3::UnitZ();                 ///< normal of the plane, unit vector, towards the bodies
  double offset = 0.0;                         ///< half-space normal . x >= offset [m]
  double friction = 0.0;                       ///< Coulomb coefficient
  std::optional<std::pair<Vec3, Vec3>> box{};  ///< instead of the plane: lowest and highest corner [m]
};

/// A floor and walls around a box, open above. In the plane y is up, else z.
std::vector<Wall> room_walls(const Vec3& low, const Vec3& high, double friction, int dimension = 3);

/// Gap between a node and a wall, along a normal.
struct WallGap {
  double gap;  ///< [m]; negative inside the wall
  Vec3 normal;
};

/// Returns the gap at `at` for a node that was at `from` at the beginning of the step. For a box it is the
/// gap to the side that the node was farthest outside of; empty if it passes beside the box.
std::optional<WallGap> gap_to(const Wall& wall, const Vec3& from, const Vec3& at) noexcept;

/// Throws Error for normals that are not unit vectors, friction below 0, or boxes whose corners are swapped.
void check_walls(const std::vector<Wall>& walls);

/// Applies walls to a node in a step of h [s], knowing its own motion only: it ends on the wall at most, and
/// friction reduces its sliding by as much as the normal part allows. For explicit steps with lumped mass,
/// for which this is Coulomb's law. Restitution is zero. Returns true if it touched.
bool stop_at_walls(const std::vector<Wall>& walls, const Vec3& from, double h, Vec3& x, Vec3& v) noexcept;

}  // namespace palpate
