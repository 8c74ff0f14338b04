#include "precompute/numerics/touched_boundary.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "matrices/hierarchical_product.h"

namespace palpate {
namespace {

/// Normal of a line in the plane or of a triangle; its length is the measure.
Vec3 measure_normal(const Model& model, std::span<const Index> nodes) {
  const auto x = [&](std::size_t i) -> const Vec3& {
    return model.mesh.nodes[static_cast<std::size_t>(nodes[i])];
  };
  const Vec3 edge = x(1) - x(0);
  if (nodes.size() == 2) return {edge.y(), -edge.x(), 0.0};
  return edge.cross(x(2) - x(0)) / 2.0;
}

/// Barycentric coordinates of the point on a line nearest to p.
Vec3 nearest_on_line(const Vec3& a, const Vec3& b, const Vec3& p) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return {1.0 - t, t, 0.0};
}

/// Barycentric coordinates of the point on a triangle nearest to p: inside by projection, else on the nearest
/// side.
Vec3 nearest_on_triangle(const std::array<Vec3, 3>& x, const Vec3& p) {
  const Vec3 normal = (x[1] - x[0]).cross(x[2] - x[0]);
  const double area = normal.squaredNorm();
  Vec3 weights((x[2] - x[1]).cross(p - x[1]).dot(normal) / area,
               (x[0] - x[2]).cross(p - x[2]).dot(normal) / area,
               (x[1] - x[0]).cross(p - x[0]).dot(normal) / area);
  if (weights.minCoeff() >= 0.0) return weights;
  Vec3 best = Vec3::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const Vec3 on_side = nearest_on_line(x[i], x[j], p);
    const double distance = (on_side[0] * x[i] + on_side[1] * x[j] - p).squaredNorm();
    if (distance >= least) continue;
    least = distance;
    best.setZero();
    best[static_cast<Eigen::Index>(i)] = on_side[0];
    best[static_cast<Eigen::Index>(j)] = on_side[1];
  }
  return best;
}

}  // namespace

TouchedBoundary::TouchedBoundary(const Model& model)
    : model_(model),
      stored_of_node_(model.mesh.nodes.size(), -1),
      normals_(model.mesh.nodes.size(), Vec3::Zero()),
      areas_(model.mesh.nodes.size(), 0.0) {
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k) {
    stored_of_node_[static_cast<std::size_t>(model.stored_nodes[k])] = static_cast<Index>(k);
  }
  const auto d = static_cast<std::size_t>(model.dimension());
  const std::size_t count = model.surface.size() / d;
  double edges = 0.0;
  for (std::size_t s = 0; s < count; ++s) {
    const std::span<const Index> nodes = simplex(s);
    const Vec3 normal = measure_normal(model, nodes);
    for (std::size_t i = 0; i < d; ++i) {
      const auto a = static_cast<std::size_t>(nodes[i]), b = static_cast<std::size_t>(nodes[(i + 1) % d]);
      normals_[a] += normal;
      areas_[a] += normal.norm() / static_cast<double>(d);
      edges += (model.mesh.nodes[a] - model.mesh.nodes[b]).norm();
    }
  }
  mean_edge_ = edges / static_cast<double>(count * d);
  for (std::size_t node = 0; node < normals_.size(); ++node) {
    if (areas_[node] == 0.0) continue;
    normals_[node].normalize();
    if (stored_of_node_[node] >= 0 && model.fixed[node] == 0) free_nodes_.push_back(static_cast<Index>(node));
  }
}

std::span<const Index> TouchedBoundary::simplex(std::size_t s) const noexcept {
  const auto d = static_cast<std::size_t>(model_.dimension());
  return {model_.surface.data() + d * s, d};
}

Tip TouchedBoundary::tip(const Vec3& place, double radius) const {
  Tip tip;
  double total = 0.0, least = std::numeric_limits<double>::infinity();
  Index nearest = -1;
  for (std::size_t node = 0; node < areas_.size(); ++node) {
    if (areas_[node] == 0.0) continue;
    const Index stored = stored_of_node_[node];
    const double r2 = (model_.mesh.nodes[node] - place).squaredNorm();
    if (stored >= 0 && model_.fixed[node] == 0 && r2 < least) {
      least = r2;
      nearest = stored;
    }
    if (!(r2 < radius * radius)) continue;
    const double share = areas_[node] * (1.0 - r2 / (radius * radius));
    total += share;
    if (stored < 0) continue;
    tip.stored.push_back(stored);
    tip.share.push_back(share);
  }
  if (tip.stored.empty()) return {{nearest}, {1.0}};
  for (double& share : tip.share) share /= total;
  return tip;
}

Vec3 TouchedBoundary::node_displacement(Index stored, const Tip& tip, const Vec3& direction) const {
  const std::int64_t d = model_.dimension(), width = d * std::ssize(tip.stored);
  std::vector<double> Xi(static_cast<std::size_t>(d * width));
  if (model_.compressed != nullptr) gather_blocks(*model_.compressed, stored, tip.stored, Xi);
  Vec3 u = Vec3::Zero();
  for (std::size_t k = 0; k < tip.stored.size(); ++k) {
    for (std::int64_t i = 0; i < d; ++i) {
      for (std::int64_t j = 0; j < d; ++j) {
        const double entry =
            model_.compressed != nullptr
                ? Xi[static_cast<std::size_t>(i * width + j) + static_cast<std::size_t>(d) * k]
                : model_.greens(d * stored + i, d * tip.stored[k] + j);
        u[i] += tip.share[k] * direction[j] * entry;
      }
    }
  }
  return u;
}

double TouchedBoundary::compliance(const Tip& tip, const Vec3& direction) const {
  double mean = 0.0;
  for (std::size_t k = 0; k < tip.stored.size(); ++k) {
    mean += tip.share[k] * direction.dot(node_displacement(tip.stored[k], tip, direction));
  }
  return mean;
}

TouchedBoundary::Place TouchedBoundary::nearest(const Vec3& point) const {
  Place best{0, Vec3::Zero(), std::numeric_limits<double>::infinity()};
  const std::size_t count = model_.surface.size() / static_cast<std::size_t>(model_.dimension());
  for (std::size_t s = 0; s < count; ++s) {
    const std::span<const Index> nodes = simplex(s);
    std::array<Vec3, 3> x{};
    for (std::size_t i = 0; i < nodes.size(); ++i)
      x[i] = model_.mesh.nodes[static_cast<std::size_t>(nodes[i])];
    const Vec3 weights =
        nodes.size() == 2 ? nearest_on_line(x[0], x[1], point) : nearest_on_triangle(x, point);
    Vec3 found = Vec3::Zero();
    for (std::size_t i = 0; i < nodes.size(); ++i) found += weights[static_cast<Eigen::Index>(i)] * x[i];
    const double distance = (found - point).norm();
    if (distance < best.distance) best = {s, weights, distance};
  }
  return best;
}

Vec3 TouchedBoundary::displacement(const Place& at, const Tip& tip, const Vec3& direction) const {
  const std::span<const Index> nodes = simplex(at.simplex);
  Vec3 u = Vec3::Zero();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Index stored = stored_of_node_[static_cast<std::size_t>(nodes[i])];
    if (stored >= 0)
      u += at.weights[static_cast<Eigen::Index>(i)] * node_displacement(stored, tip, direction);
  }
  return u;
}

}  // namespace palpate
