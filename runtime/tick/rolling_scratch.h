// Workspace of the derivative with turning normals.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A figure for each of the device's motions; the last is not used.
using Lanes = Eigen::Array4d;
/// A vector for each of the device's motions: its x, y and z.
using VectorLanes = std::array<Lanes, 3>;

/// What linearise_rolling keeps within a tick.
struct RollingScratch {
  /// A closed contact whose normal turns.
  struct Turning {
    Index row = 0;  ///< of the contact problem
    std::array<double, 3> weights{};
    Vec3 normal = Vec3::Zero();
    double spring = 0.0;  ///< by which it pushes: normal force over radius [N/m]
  };

  RollingScratch(int dimension, Index max_contacts, Index max_rows);

  std::vector<Turning> turning;  ///< [max_contacts]
  Index turning_count = 0;
  std::vector<Index> following;  ///< [max_rows] rows of the contact problem that are closed
  Index following_count = 0;
  bool answers = false;              ///< the body moves by the turning: T and B are there
  std::vector<double> T;             ///< [(d turning)^2] what turning forces move their contacts [m/N]
  std::vector<double> B;             ///< [following x d turning] what they move along the rows [m/N]
  std::vector<Lanes> turning_force;  ///< [d turning] change of the forces on the tool [N]
  std::vector<Lanes> next_force;     ///< [d turning] of the next pass [N]
  std::vector<Lanes> row_force;      ///< [following] change of lambda [N]
  std::vector<Lanes> device_change;  ///< [following] db without the turning [m]
};

}  // namespace palpate
