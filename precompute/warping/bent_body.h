// A body under a force on a part of its surface, by three ways to compute it.
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

/// Displacements from rest of the surface's nodes [S] [m].
using SurfaceDisplacement = std::vector<Vec3>;

/// Small strain, warping and a corotational body of one mesh, each under a force that some nodes share alike.
/// All three rest where the file says; the first two answer by a factor of K, as exact Green's functions
/// would.
class BentBody {
 public:
  /// `nodes` [P]: mesh nodes on the surface that share the force, ascending. `model` must live as long.
  /// Throws Error where the body cannot be warped, or has no balance under its own loads.
  BentBody(const Model& model, std::vector<Index> nodes);

  /// By small strain: linear in the force [N].
  [[nodiscard]] SurfaceDisplacement linear(const Vec3& force) const;
  /// By warping, searched from the last call's answer; nothing where it is not found.
  [[nodiscard]] std::optional<SurfaceDisplacement> warped(const Vec3& force);
  /// By the corotational body, searched from the last answer; nothing where there is no balance, or an
  /// element is inside out there: then the last answer stays.
  [[nodiscard]] std::optional<SurfaceDisplacement> corotational(const Vec3& force);
  /// Where the corotational body is, and back to there: [d N] positions [m].
  [[nodiscard]] const Eigen::VectorXd& place() const noexcept { return x_; }
  void go_back(const Eigen::VectorXd& place) { x_ = place; }

  /// The loaded nodes' mean displacement [m].
  [[nodiscard]] Vec3 moved(const SurfaceDisplacement& u) const;
  /// The rotation that fits how the loaded nodes have moved.
  [[nodiscard]] Mat3 turned(const SurfaceDisplacement& u) const;
  /// The largest rotation of a simplex of the surface [rad].
  [[nodiscard]] double rotation(const SurfaceDisplacement& u) const;
  /// [3 x 3] takes a force on the loaded nodes to `moved`, by small strain [m/N].
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
  LiveBody small_, corotational_;  // bodies of those laws
  TangentSolver factor_;           // of small_
  LiveMatrix K_;
  std::array<SurfaceDisplacement, 3> unit_;  // by small strain, under 1 N along an axis
  Eigen::VectorXd rest_, x_;  // [d N] of corotational_: without the force, and at the last answer
  std::unique_ptr<SurfaceWarp> warp_;
  std::unique_ptr<WarpBalance> balance_;
};

}  // namespace palpate
