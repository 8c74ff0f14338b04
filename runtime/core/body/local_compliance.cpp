#include "runtime/core/body/local_compliance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/body/greens_on_top.h"
#include "runtime/core/body/half_space.h"
#include "runtime/core/body/wedges.h"

namespace palpate {
namespace {

using Point = LocalCompliance::Point;
using half_space::Beside;
using half_space::Fade;
using half_space::least_share;
using half_space::of_lattice;

constexpr double edges_of_reach = 4.0;
constexpr double sharp =
    40.0 * std::numbers::pi / 180.0;     // [rad], below it an edge is round: overlay/rounding.h
constexpr double of_right_angle = 0.75;  // image of a point force in an edge of 90 degrees
constexpr double least_angle = std::numbers::pi / 3.0;  // of a wedge: the sharpest that was measured

std::size_t at(Index i) noexcept {
  return static_cast<std::size_t>(i);
}

half_space::Numbers numbers_of(const Point& p) noexcept {
  return {p.x.x(),
          p.x.y(),
          p.x.z(),
          p.normal.x(),
          p.normal.y(),
          p.normal.z(),
          p.reach,
          p.disc,
          p.edges[0].distance,
          p.edges[0].image,
          p.edges[1].distance,
          p.edges[1].image};
}

/// B along free axes, times pi E / (1 + nu) [1/m].
template <Fade fade>
Mat3 block(const Point& a, const Point& b, double nu) noexcept {
  const std::array<double, 9> of_all =
      half_space::compliance<fade, Beside::edges>(numbers_of(a), numbers_of(b), nu);
  return a.share.asDiagonal() * Mat3(Eigen::Map<const Mat3>(of_all.data()).transpose()) *
         b.share.asDiagonal();
}

/// Adds `part` of B to a point's rows.
template <Beside beside>
void add_rows(const Point& a, double part, double nu, const LocalPoints& loaded, Index count,
              double* rows) noexcept {
  const double *x = loaded[0], *y = loaded[1], *z = loaded[2], *u = loaded[3], *v = loaded[4], *w = loaded[5],
               *share_x = loaded[6], *share_y = loaded[7], *share_z = loaded[8], *reach = loaded[9],
               *disc = loaded[10], *t = loaded[11], *image = loaded[12], *t_too = loaded[13],
               *image_too = loaded[14];
  const half_space::Numbers of_a = numbers_of(a);
  const double ax = part * a.share.x(), ay = part * a.share.y(), az = part * a.share.z();
  double *row_x = rows, *row_y = rows + std::ptrdiff_t{3} * count, *row_z = rows + std::ptrdiff_t{6} * count;
#pragma omp simd
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    const half_space::Numbers b{x[k],     y[k],    z[k], u[k],     v[k],     w[k],
                                reach[k], disc[k], t[k], image[k], t_too[k], image_too[k]};
    const auto B = half_space::compliance<Fade::by_distance, beside>(of_a, b, nu);
    row_x[3 * k] += ax * share_x[k] * B[0];
    row_x[3 * k + 1] += ax * share_y[k] * B[1];
    row_x[3 * k + 2] += ax * share_z[k] * B[2];
    row_y[3 * k] += ay * share_x[k] * B[3];
    row_y[3 * k + 1] += ay * share_y[k] * B[4];
    row_y[3 * k + 2] += ay * share_z[k] * B[5];
    row_z[3 * k] += az * share_x[k] * B[6];
    row_z[3 * k + 1] += az * share_y[k] * B[7];
    row_z[3 * k + 2] += az * share_z[k] * B[8];
  }
}

/// Xi - D, with D by blocks between stored nodes.
class SmoothGreens final : public GreensOnTop {
 public:
  /// Block of D in the row of a node.
  struct Block {
    Index column;
    Eigen::Matrix3f D;
  };

  SmoothGreens(std::shared_ptr<const Greens> greens, std::vector<std::vector<Block>> rows)
      : GreensOnTop(std::move(greens)) {
    first_.push_back(0);
    for (std::vector<Block>& row : rows) {
      std::sort(row.begin(), row.end(), [](const Block& a, const Block& b) { return a.column < b.column; });
      blocks_.insert(blocks_.end(), row.begin(), row.end());
      first_.push_back(blocks_.size());
    }
  }

  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept override {
    below().gather(row, columns, blocks);
    const std::size_t width = 3 * columns.size();
    const std::span<const Block> of_row = this->of(row);
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const auto found = from(of_row, columns[k]);
      if (found == of_row.end() || found->column != columns[k]) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j)
          blocks[i * width + 3 * k + j] -=
              found->D(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      }
    }
  }

  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    below().displacement(nodes, f, ranges, u);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const Vec3 force(f[3 * k], f[3 * k + 1], f[3 * k + 2]);
      const std::span<const Block> of_node = of(nodes[k]);
      double* of_range = u.data();
      for (const NodeRange& range : ranges) {
        for (auto block = from(of_node, range.first); block != of_node.end() && block->column < range.end;
             ++block) {
          Eigen::Map<Vec3>(of_range + std::ptrdiff_t{3} * (block->column - range.first)) -=
              block->D.cast<double>().transpose() * force;
        }
        of_range += std::ptrdiff_t{3} * (range.end - range.first);
      }
    }
  }

 private:
  [[nodiscard]] std::span<const Block> of(Index node) const noexcept {
    return std::span(blocks_).subspan(first_[at(node)], first_[at(node) + 1] - first_[at(node)]);
  }
  static std::span<const Block>::iterator from(std::span<const Block> row, Index column) noexcept {
    return std::lower_bound(row.begin(), row.end(), column,
                            [](const Block& block, Index wanted) { return block.column < wanted; });
  }

  std::vector<std::size_t> first_;  // [stored + 1]
  std::vector<Block> blocks_;       // by rows, ascending
};

/// Calls visit(a, b) for points nearer to each other than the larger reach, each pair once.
void for_each_pair(const std::vector<Point>& points, std::size_t count, double reach, auto&& visit) {
  Eigen::AlignedBox3d box;
  for (std::size_t k = 0; k < count; ++k) box.extend(points[k].x);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  std::vector<Index> order;
  for (std::size_t k = 0; k < count; ++k) order.push_back(static_cast<Index>(k));
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return points[at(a)].x[axis] < points[at(b)].x[axis]; });
  for (std::size_t i = 0; i < count; ++i) {
    const Point& a = points[at(order[i])];
    for (std::size_t j = i + 1; j < count && points[at(order[j])].x[axis] - a.x[axis] < reach; ++j) {
      if ((points[at(order[j])].x - a.x).squaredNorm() < reach * reach) visit(order[i], order[j]);
    }
  }
}

/// D from the nodes of the body's own surface, their neighbours and the smooth part at each.
class MeshPart {
 public:
  MeshPart(const ElasticBody& body, std::span<const Index> mesh, const std::vector<Point>& points, double c,
           double nu)
      : body_(body), points_(points), c_(c), nu_(nu), beside_(body.surface_stored_nodes().size()) {
    for (std::size_t s = 0; s < mesh.size(); s += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = mesh[s + k], b = mesh[s + (k + 1) % 3];
        beside_[at(a)].insert(b);
        beside_[at(b)].insert(a);
      }
    }
    for (Index node = 0; node < std::ssize(beside_); ++node) smooth_.push_back(smooth_at(node));
  }

  [[nodiscard]] std::vector<std::vector<SmoothGreens::Block>> blocks(double reach) const {
    std::vector<std::vector<SmoothGreens::Block>> rows(at(body_.greens().nodes()));
    for (Index node = 0; node < std::ssize(beside_); ++node) {
      if (is_free(node))
        enter(node, node, xi(node, node) - smooth_[at(node)] - near(node, node) + faded(node, node), rows);
      for (const Index other : beside_[at(node)]) {
        if (other < node || !is_free(node) || !is_free(other)) continue;
        const double side = sides(node, other);
        const Mat3 smooth = 0.5 * (smooth_[at(node)] + smooth_[at(other)]);
        enter(node, other, side * (xi(node, other) - smooth) - near(node, other) + faded(node, other), rows);
      }
    }
    for_each_pair(points_, beside_.size(), reach, [&](Index a, Index b) {
      if (!is_free(a) || !is_free(b) || beside_[at(a)].contains(b)) return;
      const Mat3 B = faded(a, b);
      if (!B.isZero(0.0)) enter(a, b, B, rows);
    });
    return rows;
  }

 private:
  [[nodiscard]] Index stored(Index node) const noexcept { return body_.surface_stored_nodes()[at(node)]; }
  [[nodiscard]] bool is_free(Index node) const noexcept {
    return stored(node) >= 0 && !points_[at(node)].share.isZero(0.0);
  }
  [[nodiscard]] Mat3 xi(Index a, Index b) const { return body_.greens().block(stored(a), stored(b)); }
  [[nodiscard]] double sides(Index a, Index b) const noexcept {
    return half_space::share_of_sides(points_[at(a)].normal.dot(points_[at(b)].normal));
  }
  /// The half-space between two nodes, not faded.
  [[nodiscard]] Mat3 near(Index a, Index b) const noexcept {
    return c_ * block<Fade::none>(points_[at(a)], points_[at(b)], nu_);
  }
  [[nodiscard]] Mat3 faded(Index a, Index b) const noexcept {
    return c_ * block<Fade::by_distance>(points_[at(a)], points_[at(b)], nu_);
  }

  /// Mean of Xi - B at the nodes two edges away, where the mesh is right; of those one edge away if there are
  /// none. Zero if all of them are held.
  [[nodiscard]] Mat3 smooth_at(Index node) const {
    if (!is_free(node)) return Mat3::Zero();
    std::set<Index> ring;
    for (const Index other : beside_[at(node)])
      ring.insert(beside_[at(other)].begin(), beside_[at(other)].end());
    for (const Index other : beside_[at(node)]) ring.erase(other);
    ring.erase(node);
    if (ring.empty()) ring = beside_[at(node)];
    Mat3 sum = Mat3::Zero();
    double weight = 0.0;
    for (const Index other : ring) {
      if (!is_free(other)) continue;
      const double share = sides(node, other);
      if (share < least_share) continue;
      sum += share * xi(node, other) - near(node, other);
      weight += share;
    }
    if (weight == 0.0) return sum;
    return 0.5 / weight * (sum + sum.transpose());
  }

  void enter(Index a, Index b, const Mat3& of_all,
             std::vector<std::vector<SmoothGreens::Block>>& rows) const {
    const Mat3 D = points_[at(a)].part * points_[at(b)].part * of_all;
    rows[at(stored(a))].push_back({stored(b), D.cast<float>()});
    if (a != b) rows[at(stored(b))].push_back({stored(a), D.transpose().cast<float>()});
  }

  const ElasticBody& body_;
  const std::vector<Point>& points_;
  double c_, nu_;
  std::vector<std::set<Index>> beside_;  // [nodes of the body's surface]
  std::vector<Mat3> smooth_;             // [as these]
};

}  // namespace

LocalCompliance::LocalCompliance(const ElasticBody& body, std::span<const Index> mesh, double E, double nu)
    : c_((1.0 + nu) / (std::numbers::pi * E)), nu_(nu), points_(body.surface_rest_positions().size()) {
  measure(body);
  follow(body, mesh);
  for (const Point& point : points_) reach_ = std::max(reach_, point.reach);
  find_edges(body);
  smooth_ = std::make_unique<const SmoothGreens>(body.shared_greens(),
                                                 MeshPart(body, mesh, points_, c_, nu_).blocks(reach_));
}

LocalCompliance::~LocalCompliance() = default;

/// Finds positions, normals and area of the surface's nodes.
void LocalCompliance::measure(const ElasticBody& body) {
  const std::span<const Index> simplices = body.simplices();
  std::vector<double> area(points_.size(), 0.0);
  for (std::size_t k = 0; k < points_.size(); ++k) points_[k].x = body.surface_rest_positions()[k];
  for (std::size_t s = 0; s < simplices.size(); s += 3) {
    const Vec3 &a = point(simplices[s]).x, &b = point(simplices[s + 1]).x, &c = point(simplices[s + 2]).x;
    const Vec3 normal = 0.5 * (b - a).cross(c - a);
    for (const Index node : simplices.subspan(s, 3)) {
      points_[at(node)].normal += normal;
      area[at(node)] += normal.norm();
    }
  }
  for (std::size_t k = 0; k < points_.size(); ++k) {
    points_[k].normal.normalize();
    points_[k].disc = std::sqrt(area[k] / 3.0 / std::numbers::pi);
  }
  for (std::size_t s = 0; s < simplices.size(); s += 3) {
    const Vec3 &a = point(simplices[s]).x, &b = point(simplices[s + 1]).x, &c = point(simplices[s + 2]).x;
    const Vec3 normal = (b - a).cross(c - a).normalized();
    for (const Index node : simplices.subspan(s, 3)) {
      Point& point = points_[at(node)];
      point.crease = std::max(point.crease, std::acos(std::clamp(normal.dot(point.normal), -1.0, 1.0)));
    }
  }
}

/// Finds the edges beside each point. Their images are as measured on wedges of 60, 90, 120 and 135 degrees
/// (scripts/studies/edges).
void LocalCompliance::find_edges(const ElasticBody& body) {
  const auto found = wedges_beside(body.surface_rest_positions(), body.simplices(), sharp, reach_);
  for (std::size_t k = 0; k < points_.size(); ++k) {
    for (std::size_t e = 0; e < found[k].size(); ++e) {
      const auto [distance, angle] = found[k][e];
      if (std::isinf(distance)) continue;
      // At the edge itself the image of a point's part of the surface is that part again.
      points_[k].edges[e] = {distance + 0.5 * points_[k].disc / of_lattice,
                             of_right_angle / std::pow(std::tan(0.5 * std::max(angle, least_angle)), 3.0)};
    }
  }
}

/// Reach of the body's own nodes, by the edges that meet in each.
/// \returns the mean edge (m)
double LocalCompliance::set_reach_by_edges(std::size_t of_body, std::span<const Index> mesh) {
  std::vector<double> sum(of_body, 0.0), count(of_body, 0.0);
  double all = 0.0;
  for (std::size_t s = 0; s < mesh.size(); s += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = mesh[s + k], b = mesh[s + (k + 1) % 3];
      const double length = (point(a).x - point(b).x).norm();
      for (const Index node : {a, b}) {
        sum[at(node)] += length;
        count[at(node)] += 1.0;
      }
      all += length;
    }
  }
  const double mean = all / static_cast<double>(mesh.size());
  for (std::size_t node = 0; node < of_body; ++node)
    points_[node].reach = edges_of_reach * (count[node] > 0.0 ? sum[node] / count[node] : mean);
  return mean;
}

/// Finds the reach by the edges of the body's own mesh, and the axes that are free.
void LocalCompliance::follow(const ElasticBody& body, std::span<const Index> mesh) {
  const std::size_t of_body = body.surface_stored_nodes().size();
  const double mean = set_reach_by_edges(of_body, mesh);
  std::vector<Vec3> free(at(body.greens().nodes()), Vec3::Ones());
  for (std::size_t node = 0; node < of_body; ++node) {
    const Index stored = body.surface_stored_nodes()[node];
    if (stored < 0) continue;
    const Eigen::MatrixXd own = body.greens().block(stored, stored);
    for (Eigen::Index axis = 0; axis < 3; ++axis) free[at(stored)][axis] = own(axis, axis) > 0.0 ? 1.0 : 0.0;
  }
  fade_at_planes(body, free);
  for (std::size_t node = 0; node < points_.size(); ++node) {
    const SurfaceParts of_node = body.surface_parts(static_cast<Index>(node));
    double reach = 0.0, weight = 0.0, faded = 0.0, largest = 0.0;
    for (std::size_t k = 0; k < of_node.stored.size(); ++k) {
      points_[node].share += of_node.weights[k] * free[at(of_node.stored[k])];
      const double part = std::abs(of_node.weights[k]);
      if (part > largest) points_[node].follows = of_node.stored[k];
      largest = std::max(largest, part);
      reach += part * points_[at(body.surface_node_of_stored(of_node.stored[k]))].reach;
      faded += part * points_[at(body.surface_node_of_stored(of_node.stored[k]))].part;
      weight += part;
    }
    if (node < of_body) continue;
    points_[node].reach = weight > 0.0 ? reach / weight : edges_of_reach * mean;
    points_[node].part = weight > 0.0 ? faded / weight : 1.0;
  }
}

/// Planes of symmetry mirror a force, which the half-space knows nothing of: leaves it to the mesh there.
void LocalCompliance::fade_at_planes(const ElasticBody& body, const std::vector<Vec3>& free) {
  const std::span<const Index> stored = body.surface_stored_nodes();
  const auto is_held_in_part = [&](std::size_t node) {
    return stored[node] >= 0 && free[at(stored[node])].minCoeff() == 0.0;
  };
  double reach = 0.0;
  for (std::size_t node = 0; node < stored.size(); ++node) {
    reach = std::max(reach, points_[node].reach);
    if (is_held_in_part(node)) points_[node].part = 0.0;
  }
  for_each_pair(points_, stored.size(), reach, [&](Index a, Index b) {
    for (const auto& [node, other] : {std::pair(a, b), std::pair(b, a)}) {
      if (!is_held_in_part(at(other))) continue;
      const double q = (points_[at(node)].x - points_[at(other)].x).norm() / points_[at(node)].reach;
      points_[at(node)].part = std::min(points_[at(node)].part, q * q * (3.0 - 2.0 * std::min(q, 1.0)));
    }
  });
}

Mat3 LocalCompliance::between(const Point& a, const Point& b) const noexcept {
  return c_ * a.part * b.part * block<Fade::by_distance>(a, b, nu_);
}

void LocalCompliance::add_row(const Point& a, const LocalPoints& loaded, Index count,
                              double* rows) const noexcept {
  const bool has_edges = a.edges[0].image > 0.0;
  const auto add = has_edges ? add_rows<Beside::edges> : add_rows<Beside::nothing>;
  add(a, c_ * a.part, nu_, loaded, count, rows);
}

void LocalPoints::set(Index place, const LocalCompliance::Point& point) noexcept {
  double* to = of_.data() + place;
  for (const Vec3& of_axes : {point.x, point.normal, Vec3(point.part * point.share)}) {
    for (const double component : of_axes) {
      *to = component;
      to += room_;
    }
  }
  for (const double component : {point.reach, point.disc, point.edges[0].distance, point.edges[0].image,
                                 point.edges[1].distance, point.edges[1].image}) {
    *to = component;
    to += room_;
  }
}

void LocalPoints::move(Index from, Index to) noexcept {
  for (Index component = 0; component < components; ++component)
    of_[at(component * room_ + to)] = of_[at(component * room_ + from)];
}

}  // namespace palpate
