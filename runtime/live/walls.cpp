#include "runtime/live/walls.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace palpate {
namespace {

Vec3 shortened(const Vec3& v, double by) noexcept {
  const double length = v.norm();
  return length > by ? Vec3((1.0 - by / length) * v) : Vec3(Vec3::Zero());
}

}  // namespace

std::vector<Wall> room_walls(const Vec3& low, const Vec3& high, double friction, int dimension) {
  std::vector<Wall> walls;
  for (int axis = 0; axis < dimension; ++axis) {
    walls.push_back({.normal = Vec3::Unit(axis), .offset = low[axis], .friction = friction});
    if (axis < dimension - 1)
      walls.push_back({.normal = -Vec3::Unit(axis), .offset = -high[axis], .friction = friction});
  }
  return walls;
}

std::optional<WallGap> gap_to(const Wall& wall, const Vec3& from, const Vec3& at) noexcept {
  if (!wall.box) return WallGap{wall.normal.dot(at) - wall.offset, wall.normal};
  const Vec3 middle = 0.5 * (wall.box->first + wall.box->second),
             half = 0.5 * (wall.box->second - wall.box->first);
  Eigen::Index side = 0;
  const Vec3 out = (from - middle).cwiseAbs() - half;
  out.maxCoeff(&side);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (axis != side && std::abs(at[axis] - middle[axis]) > half[axis]) return std::nullopt;
  }
  const double sign = from[side] < middle[side] ? -1.0 : 1.0;
  return WallGap{sign * (at[side] - middle[side]) - half[side], sign * Vec3::Unit(side)};
}

void check_walls(const std::vector<Wall>& walls) {
  for (const Wall& wall : walls) {
    if (!(wall.friction >= 0.0) || !std::isfinite(wall.friction))
      throw Error("a wall's friction is not a number from 0 on", "walls",
                  "give Coulomb's coefficient, e.g. 0.5");
    if (wall.box && !((wall.box->second - wall.box->first).minCoeff() > 0.0))
      throw Error("a box has no size", "walls", "give its lowest corner, then its highest");
    if (!wall.box && !(std::abs(wall.normal.norm() - 1.0) < 1e-9 && std::isfinite(wall.offset)))
      throw Error("a wall's normal is not of length 1", "walls", "divide it by its length");
  }
}

bool stop_at_walls(const std::vector<Wall>& walls, const Vec3& from, double h, Vec3& x, Vec3& v) noexcept {
  bool touches = false;
  for (const Wall& wall : walls) {
    const std::optional<WallGap> at = gap_to(wall, from, x);
    if (!at || at->gap >= 0.0) continue;
    touches = true;
    const Vec3& n = at->normal;
    const Vec3 moved = x - from, slid = moved - n.dot(moved) * n;
    const double into = std::max(-n.dot(v), 0.0);
    x += -at->gap * n + shortened(slid, wall.friction * std::max(-at->gap, h * into)) - slid;
    const Vec3 sliding = v - n.dot(v) * n;
    v += into * n + shortened(sliding, wall.friction * into) - sliding;
  }
  return touches;
}

}  // namespace palpate
