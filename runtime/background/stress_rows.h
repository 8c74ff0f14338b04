// Stress at nodes, as a linear function of displacement.
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
/// Stress by the three components of a vector.
using StressBlock = Eigen::Matrix<double, 6, 3>;

Stress stress_of(const Mat3& tensor) noexcept;
double von_mises(const Stress& stress) noexcept;

/// Hooke's law of a material, with what it says of the stress across a plane body.
struct HookesLaw {
  HookesLaw(const Material& material, Analysis analysis);

  double lambda;  ///< Lamé's first coefficient [Pa]; in plane stress that of the sheet
  double mu;      ///< shear modulus [Pa]
  Mat3 initial;   ///< D eps_0 [Pa], in the plane its xx, yy and xy
  bool is_plane;
  double across_by_sum = 0.0;   ///< in the plane: sigma_zz by sigma_xx + sigma_yy [-] ...
  double across_initial = 0.0;  ///< ... and the rest of it [Pa]

  /// In the plane: zz from xx and yy, of a stress that has a part by displacement or traction only.
  void complete(StressBlock& block) const noexcept;
  /// Completes the constant part of the stress.
  void complete(Stress& stress) const noexcept;
};

/// Stress by the displacement of a node whose shape function has the gradient g [1/m]. `projector` P keeps
/// the directions in which strain is known: lambda tr(e) P + 2 mu e with e = P sym(u g^T) P, where P g = g.
StressBlock stress_by_displacement(const HookesLaw& law, double lambda, const Mat3& projector,
                                   const Vec3& g) noexcept;

/// Each row: a node's stress by the displacement of some nodes.
struct StressRows {
  std::vector<Index> first;      ///< [rows + 1] of each row in `node` and `block`
  std::vector<Index> node;       ///< whose displacement
  std::vector<double> block;     ///< [6 x 3] each, column by column [Pa/m]
  std::vector<Stress> constant;  ///< [rows]; not a number where the stress is not known

  /// Stress of all rows by the displacement of all nodes [m].
  void apply(std::span<const Vec3> u, std::span<Stress> stress) const noexcept;

  /// Stress where parts of the body have turned, of each row in its own frame: what turns the nodes of a row
  /// as one about its own is taken off their displacement first. For rows whose number is that of their node,
  /// and that a shift of all nodes does not change. `at` [nodes]: where they are in the mesh [m]. Fills
  /// `turn` [rows] with the rotations.
  void apply_turned(std::span<const Vec3> at, bool is_plane, std::span<const Vec3> u, std::span<Mat3> turn,
                    std::span<Stress> stress) const noexcept;
};

/// Collects the weighted mean of what elements say of the stress at their nodes.
class StressMean {
 public:
  explicit StressMean(std::size_t rows) : rows_(rows) {}

  /// What one element says at a node: by displacement of its nodes, and constant.
  void add(Index row, double weight, std::span<const Index> nodes, std::span<const StressBlock> by_nodes,
           const Stress& constant);
  /// Not a number where nothing was added.
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
