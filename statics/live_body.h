// Constant part of a body that is solved while it moves.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "matrices/newmark.h"
#include "meshes/material.h"
#include "meshes/mesh.h"
#include "statics/live_law.h"
#include "statics/tangent_pattern.h"

namespace palpate {

struct Model;

/// Plastic flow, by which a body keeps a dent (Parker & O'Brien 2009; theory.md section 7). Strains are
/// Frobenius norms in the rotated frame.
struct Plasticity {
  double yield = std::numeric_limits<double>::infinity();  ///< elastic strain above which the body flows [-]
  double creep = 0.0;  ///< rate at which strain above the yield turns plastic [1/s]
  double maximum = std::numeric_limits<double>::infinity();  ///< largest plastic strain [-]

  [[nodiscard]] bool flows() const noexcept {
    return creep > 0.0 && yield < std::numeric_limits<double>::infinity();
  }
};

/// Input of a LiveBody. N nodes, d dofs each.
struct LiveInput {
  Mesh mesh;
  Analysis analysis = Analysis::solid;
  double thickness = 1.0;  ///< in the plane [m]; 1 in space
  std::vector<Material> materials;
  std::vector<Index> material_of_element{};  ///< [E]
  std::vector<std::uint8_t> fixed{};         ///< [N] bit `axis` is set if the node is held along it; empty:
                                             ///< nowhere
  std::vector<Vec3> held_displacement{};     ///< [N] along the axes on which a node is held [m]; empty: 0
  std::vector<Vec3> load{};                  ///< [N] constant force [N]; empty: none
};

/// The body of a baked file: mesh, materials, held nodes and loads. Needs no Green's functions.
LiveInput live_input(const Model& model);

struct LiveOptions {
  LiveLaw law = LiveLaw::corotational;
  Plasticity plasticity{};      ///< of linear and corotational laws
  Rayleigh damping{};           ///< C_d = mass M + stiffness K, K the tangent of the step
  Vec3 gravity = Vec3::Zero();  ///< [m/s^2]
};

/// A body ready for stepping: quadrature points, masses, and the pattern of its tangent. Const after
/// construction, usable from several threads. Positions, velocities and forces are [d N], dof d node + axis.
class LiveBody {
 public:
  /// Throws Error for initial strain where a law has no
  /// place for it, for plasticity of a law that does not flow, and for numbers out of their range.
  LiveBody(LiveInput input, const LiveOptions& options);

  [[nodiscard]] const Mesh& mesh() const noexcept { return input_.mesh; }
  [[nodiscard]] const LiveOptions& options() const noexcept { return options_; }
  [[nodiscard]] int dimension() const noexcept { return input_.mesh.dimension(); }  ///< d
  [[nodiscard]] Eigen::Index dofs() const noexcept { return rest_.size(); }         ///< d N
  [[nodiscard]] Index free_dofs() const noexcept { return static_cast<Index>(dof_of_free_.size()); }
  /// [d N] number of each dof among the free dofs, -1 if held.
  [[nodiscard]] std::span<const Index> free_of_dof() const noexcept { return free_of_dof_; }
  [[nodiscard]] std::span<const Index> dof_of_free() const noexcept { return dof_of_free_; }  ///< [n]

  [[nodiscard]] const Eigen::VectorXd& rest() const noexcept { return rest_; }  ///< positions in the mesh [m]
  /// Initial positions: of held dofs where they stay, of others as in the mesh [m].
  [[nodiscard]] const Eigen::VectorXd& start() const noexcept { return start_; }
  [[nodiscard]] const Eigen::VectorXd& mass() const noexcept { return mass_; }  ///< lumped [kg]
  [[nodiscard]] const Eigen::VectorXd& load() const noexcept { return load_; }  ///< with weight [N]

  // Quadrature points: element e has points() of them, from points() * e on.
  [[nodiscard]] int points() const noexcept { return points_; }  ///< per element
  [[nodiscard]] Index all_points() const noexcept { return static_cast<Index>(weight_.size()); }
  [[nodiscard]] double weight(Index point) const noexcept { return weight_[point]; }  ///< volume [m^3]
  /// [3 x nodes per element] gradients of the shape functions, one column per node; z is 0 in the plane
  /// [1/m].
  [[nodiscard]] Eigen::Map<const Eigen::Matrix3Xd> gradients(Index point) const noexcept {
    const auto nodes = static_cast<std::size_t>(nodes_per_element_);
    return {gradient_.data() + 3 * nodes * static_cast<std::size_t>(point), 3, nodes_per_element_};
  }
  [[nodiscard]] const LawConstants& constants(Index element) const noexcept {
    return constants_[input_.material_of_element[element]];
  }
  [[nodiscard]] const Mat3& initial_strain(Index element) const noexcept {
    return initial_strain_[input_.material_of_element[element]];
  }
  /// Is made when first asked for.
  [[nodiscard]] const TangentPattern& pattern() const;

 private:
  void check() const;
  void number_dofs();
  void find_points();
  void find_loads();

  LiveInput input_;
  LiveOptions options_;
  int points_ = 0;
  int nodes_per_element_ = 0;
  std::vector<Index> free_of_dof_, dof_of_free_;
  Eigen::VectorXd rest_, start_, mass_, load_;
  std::vector<double> weight_, gradient_;
  std::vector<LawConstants> constants_;  // [materials]
  std::vector<Mat3> initial_strain_;     // [materials]
  struct LatePattern;
  std::shared_ptr<LatePattern> pattern_;
};

}  // namespace palpate
