// A body under a force on a part of its surface, computed in three ways.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "formats/model.h"
#include "meshes/surface.h"
#include "statics/live_body.h"
#include "statics/tangent_solver.h"
#include "statics/warp_balance.h"

namespace palpate {

/// Displacements of the surface's nodes from rest [S] [m].
using SurfaceDisplacement = std::vector<Vec3>;

/// Small strain, warping and a corotational body on one mesh, each under a force divided equally among some
/// nodes. All three have the file's rest state; the first two use a factor of K, equivalent to exact Green's
/// functions.
class BentBody {
 public:
  /// `nodes` [P]: mesh nodes on the surface under the force, ascending. `model` must outlive this. Throws
  /// Error if the body cannot be warped, or has no balance under its own loads.
  BentBody(const Model& model, std::vector<Index> nodes);

  /// Displacement by small strain, linear in the force [N].
  [[nodiscard]] SurfaceDisplacement linear(const Vec3& force) const;
  /// Displacement by warping, starting from the last call's solution; nullopt if it is not found.
  [[nodiscard]] std::optional<SurfaceDisplacement> warped(const Vec3& force);
  /// Displacement of the corotational body, starting from the last solution; nullopt if there is no balance,
  /// or an element is inverted there: the last solution is then kept.
  [[nodiscard]] std::optional<SurfaceDisplacement> corotational(const Vec3& force);
  /// Position of the corotational body, to which go_back returns it: [d N] positions [m].
  [[nodiscard]] const Eigen::VectorXd& place() const noexcept { return x_; }
  void go_back(const Eigen::VectorXd& place) { x_ = place; }

  /// Mean displacement of the loaded nodes [m].
  [[nodiscard]] Vec3 moved(const SurfaceDisplacement& u) const;
  /// Rotation that best fits the motion of the loaded nodes.
  [[nodiscard]] Mat3 turned(const SurfaceDisplacement& u) const;
  /// Largest rotation of a simplex of the surface [rad].
  [[nodiscard]] double rotation(const SurfaceDisplacement& u) const;
  /// [3 x 3] maps a force on the loaded nodes to `moved`, by small strain [m/N].
  [[nodiscard]] Mat3 softness() const;

 private:
  void solve_linear();
  void make_warp();
  [[nodiscard]] Eigen::VectorXd spread(const Vec3& force) const;
  [[nodiscard]] Vec3 rest_of(std::size_t surface_node) const;

  const Model& model_;
  int dimension_;
  std::vector<Index> nodes_;         // [P] mesh nodes
  std::vector<std::size_t> loaded_;  // [P] surface nodes
  SurfaceNumbering surface_;
  LiveBody small_, corotational_;  // bodies with those laws
  TangentSolver factor_;           // of small_
  LiveMatrix K_;
  std::array<SurfaceDisplacement, 3> unit_;  // by small strain, under 1 N along an axis
  Eigen::VectorXd rest_, x_;  // [d N] of corotational_: without the force, and the last solution
  std::unique_ptr<SurfaceWarp> warp_;
  std::unique_ptr<WarpBalance> balance_;
};

}  // namespace palpate
