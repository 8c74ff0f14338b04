#include "statics/surface_warp.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/vectors.h"
#include "statics/polar.h"
#include "statics/rotation_vector.h"

namespace palpate {
namespace {

constexpr double least_share =
    1e-12;  // area of a triangle, relative to its longest edge squared, below which it has no direction

/// Groups of surface nodes connected by simplices.
class Parts {
 public:
  explicit Parts(std::size_t nodes) : parent_(nodes) { std::iota(parent_.begin(), parent_.end(), 0); }
  Index of(Index node) {
    while (parent_[static_cast<std::size_t>(node)] != node) {
      parent_[static_cast<std::size_t>(node)] =
          parent_[static_cast<std::size_t>(parent_[static_cast<std::size_t>(node)])];
      node = parent_[static_cast<std::size_t>(node)];
    }
    return node;
  }
  void join(Index a, Index b) { parent_[static_cast<std::size_t>(of(a))] = of(b); }

 private:
  std::vector<Index> parent_;
};

}  // namespace

SurfaceWarp::Place::Place(const SurfaceWarp& warp)
    : u(warp.surface_.rest.size(), Vec3::Zero()),
      w(warp.simplices_.size(), Vec3::Zero()),
      R(warp.simplices_.size(), Mat3::Identity()),
      x(warp.surface_.rest) {
  for (std::size_t axis = 0; axis < 3; ++axis) b[axis] = Eigen::VectorXd::Zero(warp.free_count_[axis]);
}

Index WarpSurface::stored_nodes() const noexcept {
  Index last = -1;
  for (const Index number : stored) last = std::max(last, number);
  return last + 1;
}

SurfaceWarp::SurfaceWarp(WarpSurface surface) : surface_(std::move(surface)), dimension_(surface_.dimension) {
  const std::span<const Index> nodes = surface_.simplices;
  const auto d = static_cast<std::size_t>(dimension_);
  for (std::size_t k = 0; k + d <= nodes.size(); k += d) {
    if (d == 3) {
      add_triangle({nodes[k], nodes[k + 1], nodes[k + 2]});
    } else {
      add_line(nodes[k], nodes[k + 1]);
    }
  }
  number_free_nodes();
  check_held();
  factor();
}

void SurfaceWarp::add_triangle(const std::array<Index, 3>& nodes) {
  const std::span<const Vec3> rest = surface_.rest;
  std::array<Vec3, 3> X;
  for (std::size_t k = 0; k < 3; ++k) X[k] = rest[static_cast<std::size_t>(nodes[k])];
  const Vec3 normal = (X[1] - X[0]).cross(X[2] - X[0]);  // twice the area
  double longest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, (X[(k + 1) % 3] - X[k]).squaredNorm());
  if (!(normal.norm() > least_share * longest)) return;
  Simplex simplex{
      .nodes = nodes, .h = {}, .N = normal.normalized(), .size = 0.5 * normal.norm(), .edges = {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
    // The gradient of node k's shape function is N x (X_b - X_a) / |normal|, and h = N x gradient.
    simplex.h[k] = (X[a] - X[b]) / normal.norm();
    const double cotangent = (X[a] - X[k]).dot(X[b] - X[k]) / normal.norm();
    simplex.edges[k] = {.a = nodes[a], .b = nodes[b], .c = 0.5 * cotangent, .X = X[a] - X[b]};
  }
  simplices_.push_back(simplex);
}

void SurfaceWarp::add_line(Index a, Index b) {
  const std::span<const Vec3> rest = surface_.rest;
  const Vec3 X = rest[static_cast<std::size_t>(a)] - rest[static_cast<std::size_t>(b)];
  const double length = X.norm();
  if (!(length > 0.0)) return;
  // w = z N . (u_a - u_b) / length, N across the line: as of a triangle with h along -z and its normal N.
  const Vec3 N = Vec3::UnitZ().cross(X) / length, h = -Vec3::UnitZ() / length;
  simplices_.push_back(
      {.nodes = {a, b, a},
       .h = {h, -h, Vec3::Zero()},
       .N = N,
       .size = length,
       .edges = {Edge{.a = a, .b = b, .c = 1.0 / length, .X = X}, Edge{.a = a, .b = b, .c = 0.0, .X = X},
                 Edge{.a = a, .b = b, .c = 0.0, .X = X}}});
}

/// Numbers the nodes that can move along each axis. A node that is not stored is held along all of them.
void SurfaceWarp::number_free_nodes() {
  const std::span<const Index> stored = surface_.stored;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension_); ++axis) {
    free_[axis].assign(stored.size(), -1);
    for (std::size_t node = 0; node < stored.size(); ++node) {
      if (stored[node] < 0) continue;
      if (((surface_.held[node] >> axis) & 1U) == 0) free_[axis][node] = free_count_[axis]++;
    }
  }
}

void SurfaceWarp::check_held() const {
  Parts parts(surface_.rest.size());
  for (const Simplex& simplex : simplices_) {
    parts.join(simplex.nodes[0], simplex.nodes[1]);
    parts.join(simplex.nodes[0], simplex.nodes[2]);
  }
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension_); ++axis) {
    std::vector<bool> is_held(free_[axis].size(), false);
    for (std::size_t node = 0; node < free_[axis].size(); ++node) {
      if (free_[axis][node] < 0) is_held[static_cast<std::size_t>(parts.of(static_cast<Index>(node)))] = true;
    }
    for (const Simplex& simplex : simplices_) {
      if (is_held[static_cast<std::size_t>(parts.of(simplex.nodes[0]))]) continue;
      const Vec3& at = surface_.rest[static_cast<std::size_t>(simplex.nodes[0])];
      throw Error(
          fmt::format("nothing holds the part of the surface at ({:.4g}, {:.4g}, {:.4g}) m along {}, and "
                      "rotations add up along the surface from where it is held",
                      at.x(), at.y(), at.z(), "xyz"[axis]),
          "warping",
          "fix a region of that surface, or play the body with --solver corotational and no --warp");
    }
  }
}

void SurfaceWarp::factor() {
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension_); ++axis) {
    std::vector<Eigen::Triplet<double>> entries;
    const std::vector<Index>& free = free_[axis];
    for (const Simplex& simplex : simplices_) {
      for (const Edge& edge : simplex.edges) {
        const Index a = free[static_cast<std::size_t>(edge.a)], b = free[static_cast<std::size_t>(edge.b)];
        if (a >= 0) entries.emplace_back(a, a, edge.c);
        if (b >= 0) entries.emplace_back(b, b, edge.c);
        if (a >= 0 && b >= 0) {
          entries.emplace_back(a, b, -edge.c);
          entries.emplace_back(b, a, -edge.c);
        }
      }
    }
    Eigen::SparseMatrix<double> L(free_count_[axis], free_count_[axis]);
    L.setFromTriplets(entries.begin(), entries.end());
    factor_[axis].analyse(L);
    if (factor_[axis].factorise(L)) continue;
    throw Error("the edges of the surface do not say where its nodes are: it has triangles without area",
                "warping", "mesh the body anew, or play it with --solver corotational and no --warp");
  }
}

/// Solves for x of the nodes that can move, from b by axis, which is overwritten.
void SurfaceWarp::solve(std::array<Eigen::VectorXd, 3>& b, std::vector<Vec3>& x) const {
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension_); ++axis) {
    b[axis] = factor_[axis].solve(b[axis]);
    for (std::size_t node = 0; node < x.size(); ++node) {
      if (free_[axis][node] >= 0) x[node][static_cast<Eigen::Index>(axis)] = b[axis][free_[axis][node]];
    }
  }
}

Vec3 SurfaceWarp::rotation(const Simplex& simplex, const std::vector<Vec3>& u) const noexcept {
  Vec3 w = Vec3::Zero();
  double spin = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& uk = u[static_cast<std::size_t>(simplex.nodes[k])];
    spin += simplex.h[k].dot(uk);
    w -= simplex.N.dot(uk) * simplex.h[k];
  }
  return w + 0.5 * spin * simplex.N;
}

void SurfaceWarp::join(const Edge& edge, const Vec3& t, std::span<const Vec3> held, Place& place) const {
  const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension_); ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const Index to_a = free_[axis][a], to_b = free_[axis][b];
    if (to_a >= 0) place.b[axis][to_a] += edge.c * (t[k] + (to_b < 0 ? held[b][k] : 0.0));
    if (to_b >= 0) place.b[axis][to_b] -= edge.c * (t[k] - (to_a < 0 ? held[a][k] : 0.0));
  }
}

void SurfaceWarp::warp(std::span<const double> u, Place& place) const {
  const std::span<const Index> stored = surface_.stored;
  for (std::size_t node = 0; node < stored.size(); ++node)
    place.u[node] = stored[node] < 0 ? Vec3(Vec3::Zero()) : vector_at(u, dimension_, stored[node]);
  for (auto& b : place.b) b.setZero();
  const std::span<const Vec3> rest = surface_.rest;
  for (std::size_t s = 0; s < simplices_.size(); ++s) {
    const Simplex& simplex = simplices_[s];
    const Vec3 w = rotation(simplex, place.u);
    place.w[s] = w;
    place.R[s] = exp_of(w);
    for (const Edge& edge : simplex.edges) {
      const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
      join(edge, place.R[s] * (edge.X + place.u[a] - place.u[b] - w.cross(edge.X)), rest, place);
    }
  }
  solve(place.b, place.x);
}

void SurfaceWarp::displacement(const Place& place, std::span<double> moved) const noexcept {
  const std::span<const Index> stored = surface_.stored;
  for (std::size_t node = 0; node < stored.size(); ++node) {
    if (stored[node] < 0) continue;
    set_vector(moved, dimension_, stored[node], place.x[node] - surface_.rest[node]);
  }
}

void SurfaceWarp::pull_back(Place& place, std::span<const double> f, std::span<double> g) const {
  const std::span<const Index> stored = surface_.stored;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension_); ++axis) {
    for (std::size_t node = 0; node < stored.size(); ++node) {
      if (free_[axis][node] >= 0)
        place.b[axis][free_[axis][node]] =
            f[static_cast<std::size_t>(dimension_) * static_cast<std::size_t>(stored[node]) + axis];
    }
  }
  std::vector<Vec3> by_f(stored.size(), Vec3::Zero());  // L^-1 f
  solve(place.b, by_f);
  std::vector<Vec3> sum(stored.size(), Vec3::Zero());
  for (std::size_t s = 0; s < simplices_.size(); ++s) {
    const Simplex& simplex = simplices_[s];
    const Vec3& w = place.w[s];
    Vec3 turning = Vec3::Zero(), turned = Vec3::Zero();
    for (const Edge& edge : simplex.edges) {
      const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
      const Vec3 p = place.R[s].transpose() * (edge.c * (by_f[a] - by_f[b]));
      sum[a] += p;
      sum[b] -= p;
      const Vec3 y = edge.X + place.u[a] - place.u[b] - w.cross(edge.X);
      turned += y.cross(p);
      turning += edge.X.cross(p);
    }
    const Vec3 moment = right_jacobian(w).transpose() * turned - turning;
    for (std::size_t k = 0; k < 3; ++k)
      sum[static_cast<std::size_t>(simplex.nodes[k])] +=
          0.5 * simplex.N.dot(moment) * simplex.h[k] - simplex.h[k].dot(moment) * simplex.N;
  }
  for (std::size_t node = 0; node < stored.size(); ++node) {
    if (stored[node] >= 0) set_vector(g, dimension_, stored[node], sum[node]);
  }
}

void SurfaceWarp::push_forward(Place& place, std::span<const double> du, std::span<double> dx) const {
  const std::span<const Index> stored = surface_.stored;
  std::vector<Vec3> change(stored.size(), Vec3::Zero());
  for (std::size_t node = 0; node < stored.size(); ++node) {
    if (stored[node] >= 0) change[node] = vector_at(du, dimension_, stored[node]);
  }
  for (auto& b : place.b) b.setZero();
  for (std::size_t s = 0; s < simplices_.size(); ++s) {
    const Simplex& simplex = simplices_[s];
    const Vec3 &w = place.w[s], dw = rotation(simplex, change), turn = right_jacobian(w) * dw;
    for (const Edge& edge : simplex.edges) {
      const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
      const Vec3 y = edge.X + place.u[a] - place.u[b] - w.cross(edge.X);
      join(edge, place.R[s] * (turn.cross(y) + change[a] - change[b] - dw.cross(edge.X)), change, place);
    }
  }
  std::fill(change.begin(), change.end(), Vec3::Zero());
  solve(place.b, change);
  for (std::size_t node = 0; node < stored.size(); ++node) {
    if (stored[node] >= 0) set_vector(dx, dimension_, stored[node], change[node]);
  }
}

void SurfaceWarp::rotations(const Place& place, std::vector<Mat3>& R) const {
  const std::span<const Index> stored = surface_.stored;
  std::vector<Vec3> mean(stored.size(), Vec3::Zero());
  std::vector<double> size(stored.size(), 0.0);
  for (std::size_t s = 0; s < simplices_.size(); ++s) {
    const std::size_t corners = dimension_ == 3 ? 3 : 2;
    for (std::size_t k = 0; k < corners; ++k) {
      const auto node = static_cast<std::size_t>(simplices_[s].nodes[k]);
      mean[node] += simplices_[s].size * place.w[s];
      size[node] += simplices_[s].size;
    }
  }
  R.assign(static_cast<std::size_t>(surface_.stored_nodes()), Mat3::Identity());
  for (std::size_t node = 0; node < stored.size(); ++node) {
    if (stored[node] >= 0 && size[node] > 0.0)
      R[static_cast<std::size_t>(stored[node])] = exp_of(mean[node] / size[node]);
  }
}

}  // namespace palpate
