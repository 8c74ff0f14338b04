// Equilibrium of a warped body under given forces.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "statics/surface_warp.h"

namespace palpate {

/// Response of the linear body: fills u [n] with Xi f, for forces f [n] on all stored nodes.
using LinearResponse = std::function<void(std::span<const double> f, std::span<double> u)>;

struct WarpBalanceOptions {
  double tolerance = 1e-4;  ///< allowed change per round, relative to the largest displacement
  int most_rounds = 4;      ///< each multiplies by all Green's functions once
};

/// Finds u = Xi J(u)^T f: the linear body under the forces that f become on it after rotation (docs/warp.md),
/// so that x(u) is at rest for the energy u . K u / 2 of small strain in rotated parts. Anderson mixing from
/// the last solution, which converges in a few rounds for forces that follow the surface.
class WarpBalance {
 public:
  /// `warp`, and all that `linear` refers to, must outlive this.
  WarpBalance(const SurfaceWarp& warp, LinearResponse linear);

  /// Returns to the body without forces.
  void rest();
  /// Iterates towards the balance under forces on stored nodes (a node may occur several times) within the
  /// limits of `options`. Returns true if it converged.
  bool find(std::span<const Index> nodes, std::span<const double> forces, const WarpBalanceOptions& options);

  /// J Xi J^T p [n]: motion of the warped surface under small forces p [n] on the stored nodes, with the
  /// material's stiffness alone.
  void respond_to(std::span<const double> p, std::span<double> dx);

  /// Change of u in the last round, relative to its largest [-]; 0 at rest.
  [[nodiscard]] double residual() const noexcept { return residual_; }
  [[nodiscard]] const SurfaceWarp::Place& place() const noexcept { return place_; }
  [[nodiscard]] std::span<const double> linear() const noexcept { return u_; }  ///< u [n] [m]

 private:
  /// Result of a round: v = Xi J(u)^T f, r = v - u.
  struct Round {
    std::vector<double> v, r;
  };

  void respond(std::vector<double>& v);
  void mix(std::size_t rounds);
  void keep_within_reach();

  const SurfaceWarp& warp_;
  LinearResponse linear_;
  SurfaceWarp::Place place_;
  std::vector<double> u_, f_, g_;
  std::vector<Round> rounds_;  // [most of mixing] the last ones, in turn
  double residual_ = 0.0;
};

}  // namespace palpate
