#include "runtime/core/solve/nearest_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace palpate {
namespace {

using Weights = std::array<double, 3>;
using Corners = std::array<Vec3, 3>;

constexpr double largest = std::numeric_limits<double>::max();

// Threshold of a triangle's height relative to its longest edge: rounding moves points of the face of a
// thinner one by much more than itself.
constexpr double thin = 1e-4;

/// Pair of points with its distance, which is finite even if its square overflows.
NearestPoint pair_of(const Weights& weights, const Vec3& on_simplex, const Vec3& on_core) noexcept {
  return {weights, on_simplex, on_core, std::min((on_simplex - on_core).squaredNorm(), largest)};
}

void keep_nearer(NearestPoint& best, const NearestPoint& other) noexcept {
  if (other.squared_distance < best.squared_distance) best = other;
}

Vec3 between(const Vec3& a, const Vec3& b, double t) noexcept {
  return (1.0 - t) * a + t * b;
}

/// Share t of the line from a to b, 0 to 1, of the point nearest to p; 0 if it has no length.
double nearest_share(const Vec3& p, const Vec3& a, const Vec3& b) noexcept {
  const Vec3 ab = b - a;
  const double t = ab.dot(p - a) / ab.squaredNorm();
  if (!(t > 0.0)) return 0.0;
  return t < 1.0 ? t : 1.0;
}

NearestPoint nearest_on_edge(const Vec3& p, const Corners& corner, std::size_t i, std::size_t j) noexcept {
  const double t = nearest_share(p, corner[i], corner[j]);
  Weights weights{};
  weights[i] = 1.0 - t;
  weights[j] = t;
  return pair_of(weights, between(corner[i], corner[j], t), p);
}

NearestPoint nearest_of_corner(const Vec3& p, const Vec3& q, const Corners& corner, std::size_t i) noexcept {
  Weights weights{};
  weights[i] = 1.0;
  return pair_of(weights, corner[i], between(p, q, nearest_share(corner[i], p, q)));
}

/// Keeps the common perpendicular of segment p q and edge i j if it meets both between their ends.
void keep_nearer_perpendicular(NearestPoint& best, const Vec3& p, const Vec3& q, const Corners& corner,
                               std::size_t i, std::size_t j) noexcept {
  const Vec3 pq = q - p;
  const Vec3 edge = corner[j] - corner[i];
  const Vec3 n = pq.cross(edge);
  const Vec3 offset = corner[i] - p;
  const double s = n.dot(offset.cross(edge)) / n.squaredNorm();
  const double t = n.dot(offset.cross(pq)) / n.squaredNorm();
  if (!(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0)) return;
  Weights weights{};
  weights[i] = 1.0 - t;
  weights[j] = t;
  keep_nearer(best, pair_of(weights, between(corner[i], corner[j], t), between(p, q, s)));
}

/// Plane of a triangle.
class Face {
 public:
  explicit Face(const Corners& corner) noexcept
      : corner_(corner),
        ab_(corner[1] - corner[0]),
        bc_(corner[2] - corner[1]),
        ca_(corner[0] - corner[2]),
        n_(ca_.cross(ab_)) {}

  /// True if weights inside the face are unreliable on their own. True without area.
  [[nodiscard]] bool is_thin() const noexcept {
    const double squared_length = std::max({ab_.squaredNorm(), bc_.squaredNorm(), ca_.squaredNorm()});
    return !(n_.squaredNorm() > thin * thin * squared_length * squared_length);
  }

  /// Distance of p from the plane times twice the area, positive on the outward side.
  [[nodiscard]] double side(const Vec3& p) const noexcept { return n_.dot(p - corner_[0]); }

  /// Computes the weights of p's projection on the plane; false unless it is inside the triangle.
  bool foot(const Vec3& p, Weights& weights) const noexcept {
    const double a = n_.dot(bc_.cross(p - corner_[1]));
    const double b = n_.dot(ca_.cross(p - corner_[2]));
    const double c = n_.dot(ab_.cross(p - corner_[0]));
    const double sum = a + b + c;
    if (!(a > 0.0 && b > 0.0 && c > 0.0 && sum <= largest)) return false;
    weights = {a / sum, b / sum, c / sum};
    return true;
  }

  [[nodiscard]] Vec3 at(const Weights& weights) const noexcept {
    return weights[0] * corner_[0] + weights[1] * corner_[1] + weights[2] * corner_[2];
  }

 private:
  const Corners& corner_;
  Vec3 ab_, bc_, ca_;
  Vec3 n_;
};

NearestPoint nearest_on_corners(const Vec3& p, const Corners& corner, const Face& face) noexcept {
  Weights weights;
  const bool above_face = face.foot(p, weights);
  if (above_face && !face.is_thin()) return pair_of(weights, face.at(weights), p);
  NearestPoint best = nearest_on_edge(p, corner, 0, 1);
  keep_nearer(best, nearest_on_edge(p, corner, 1, 2));
  keep_nearer(best, nearest_on_edge(p, corner, 2, 0));
  if (above_face) keep_nearer(best, pair_of(weights, face.at(weights), p));
  return best;
}

/// Computes the intersection of segment p q with the face; false if there is none.
bool cut(const Vec3& p, const Vec3& q, const Face& face, NearestPoint& result) noexcept {
  const double side_of_p = face.side(p);
  const double side_of_q = face.side(q);
  if (!((side_of_p > 0.0 && side_of_q < 0.0) || (side_of_p < 0.0 && side_of_q > 0.0))) return false;
  const double s = side_of_p / (side_of_p - side_of_q);
  Weights weights;
  if (!(s >= 0.0 && s <= 1.0) || !face.foot(between(p, q, s), weights)) return false;
  result = pair_of(weights, face.at(weights), between(p, q, s));
  return true;
}

}  // namespace

NearestPoint nearest_on_line(const Vec3& p, const Vec3& a, const Vec3& b) noexcept {
  return nearest_on_edge(p, {a, b, b}, 0, 1);
}

NearestPoint nearest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
  const Corners corner = {a, b, c};
  return nearest_on_corners(p, corner, Face(corner));
}

NearestPoint nearest_of_segments(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b) noexcept {
  const Corners corner = {a, b, b};
  NearestPoint best = nearest_on_edge(p, corner, 0, 1);
  keep_nearer(best, nearest_on_edge(q, corner, 0, 1));
  keep_nearer(best, nearest_of_corner(p, q, corner, 0));
  keep_nearer(best, nearest_of_corner(p, q, corner, 1));
  keep_nearer_perpendicular(best, p, q, corner, 0, 1);
  return best;
}

NearestPoint nearest_of_segment_and_triangle(const Vec3& p, const Vec3& q, const Vec3& a, const Vec3& b,
                                             const Vec3& c) noexcept {
  const Corners corner = {a, b, c};
  const Face face(corner);
  NearestPoint through;
  const bool is_cut = cut(p, q, face, through);
  if (is_cut && !face.is_thin()) {
    through.squared_distance = 0.0;
    return through;
  }
  NearestPoint best = nearest_on_corners(p, corner, face);
  keep_nearer(best, nearest_on_corners(q, corner, face));
  for (std::size_t i = 0; i < 3; ++i) {
    keep_nearer(best, nearest_of_corner(p, q, corner, i));
    keep_nearer_perpendicular(best, p, q, corner, i, (i + 1) % 3);
  }
  if (is_cut) keep_nearer(best, through);
  return best;
}

}  // namespace palpate
