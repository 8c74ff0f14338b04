// The linear displacement under which a body that turns carries its forces.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "statics/surface_warp.h"

namespace palpate {

/// How the linear body answers: fills u [n] with Xi f, for forces f [n] on all stored nodes.
using LinearResponse = std::function<void(std::span<const double> f, std::span<double> u)>;

struct WarpBalanceOptions {
  double tolerance = 1e-4;  ///< of the largest linear displacement: what a further round may change
  int most_rounds = 4;      ///< each multiplies all Green's functions once
};

/// Finds u = Xi J(u)^T f: the linear body under the forces that f are on it once it has turned
/// (docs/warp.md), so that x(u) is at rest by the energy u . K u / 2 of small strain in turned parts. By
/// Anderson's mixing from where it was last, which for forces that follow the surface is there in a few
/// rounds.
class WarpBalance {
 public:
  /// `warp` must live as long, and what `linear` refers to.
  WarpBalance(const SurfaceWarp& warp, LinearResponse linear);

  /// Back to the body without forces.
  void rest();
  /// Goes towards the balance under forces on stored nodes (the same node may come several times), as far as
  /// `options` let it. True where it is there.
  bool find(std::span<const Index> nodes, std::span<const double> forces, const WarpBalanceOptions& options);

  /// J Xi J^T p [n]: how the warped surface moves with small forces p [n] on the stored nodes, by the
  /// stiffness of the material alone.
  void respond_to(std::span<const double> p, std::span<double> dx);

  /// The last change of u in a round, of its largest [-]; 0 at rest.
  [[nodiscard]] double residual() const noexcept { return residual_; }
  [[nodiscard]] const SurfaceWarp::Place& place() const noexcept { return place_; }
  [[nodiscard]] std::span<const double> linear() const noexcept { return u_; }  ///< u [n] [m]

 private:
  /// What a round came to: v = Xi J(u)^T f, r = v - u.
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
