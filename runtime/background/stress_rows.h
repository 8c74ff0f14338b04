// Nodal stress as a linear function of displacement.
#pragma once

#include <Eigen/Core>
#include <map>
#include <span>
#include <vector>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate {

/// [xx yy zz xy yz zx] [Pa], in the plane too.
using Stress = Eigen::Matrix<double, 6, 1>;
/// Stress per component of a vector.
using StressBlock = Eigen::Matrix<double, 6, 3>;

Stress stress_of(const Mat3& tensor) noexcept;
double von_mises(const Stress& stress) noexcept;

/// Hooke's law of a material, with the out-of-plane stress of a plane body.
struct HookesLaw {
  HookesLaw(const Material& material, Analysis analysis);

  double lambda;  ///< Lamé's first coefficient [Pa]; in plane stress the effective one
  double mu;      ///< shear modulus [Pa]
  Mat3 initial;   ///< D eps_0 [Pa], in the plane xx, yy and xy
  bool is_plane;
  double across_by_sum = 0.0;   ///< in the plane: sigma_zz = this (sigma_xx + sigma_yy) + ... [-]
  double across_initial = 0.0;  ///< in the plane: ... + this [Pa]

  /// Computes zz from xx and yy in the plane, for the part of a stress due to displacement or traction.
  void complete(StressBlock& block) const noexcept;
  /// Completes the constant part of the stress.
  void complete(Stress& stress) const noexcept;
};

/// Stress due to the displacement of a node whose shape function has the gradient g [1/m]. The projector P
/// selects the directions in which strain is known: lambda tr(e) P + 2 mu e with e = P sym(u g^T) P, where P
/// g = g.
StressBlock stress_by_displacement(const HookesLaw& law, double lambda, const Mat3& projector,
                                   const Vec3& g) noexcept;

/// Rows, each the stress of a node as a function of the displacement of some nodes.
struct StressRows {
  std::vector<Index> first;      ///< [rows + 1] begin of each row in `node` and `block`
  std::vector<Index> node;       ///< node whose displacement each block applies to
  std::vector<double> block;     ///< [6 x 3] each, column-major [Pa/m]
  std::vector<Stress> constant;  ///< [rows]; NaN where the stress is unknown

  /// Computes the stress of all rows from the displacement of all nodes [m].
  void apply(std::span<const Vec3> u, std::span<Stress> stress) const noexcept;

  /// Computes the stress of each row in its own rotated frame, for bodies whose parts have rotated: the
  /// common rotation of a row's nodes about its own node is first removed from their displacement. For rows
  /// with the number of their node, and invariant under a translation of all nodes. `at` [nodes]: positions
  /// in the mesh [m]. Writes the rotations to `turn` [rows].
  void apply_turned(std::span<const Vec3> at, bool is_plane, std::span<const Vec3> u, std::span<Mat3> turn,
                    std::span<Stress> stress) const noexcept;
};

/// Weighted mean of the elements' stresses at their nodes.
class StressMean {
 public:
  explicit StressMean(std::size_t rows) : rows_(rows) {}

  /// Adds the stress of one element at a node: the part due to its nodes' displacement, and the constant
  /// part.
  void add(Index row, double weight, std::span<const Index> nodes, std::span<const StressBlock> by_nodes,
           const Stress& constant);
  /// Returns the mean; NaN where nothing was added.
  [[nodiscard]] StressRows rows() const;

 private:
  struct Row {
    double weight = 0.0;
    std::map<Index, StressBlock> blocks;
    Stress constant = Stress::Zero();
  };
  std::vector<Row> rows_;
};

}  // namespace palpate
