// A row of the contact problem: what a unit force along it does to the body and the tool.
#pragma once

#include <array>

#include "meshes/mesh.h"

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

}  // namespace palpate
