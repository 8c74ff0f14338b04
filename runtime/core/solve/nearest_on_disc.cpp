#include "runtime/core/solve/nearest_on_disc.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palpate {
namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr double largest = std::numeric_limits<double>::max();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Limit of Newton steps, each of which at least halves the step or the bracket.
constexpr int most_steps = 80;

/// Point that moves from a (parameter 0) to b (parameter 1), relative to the disc.
class Runner {
 public:
  Runner(const Disc& disc, const Vec3& a, const Vec3& b) noexcept : radius_(disc.radius) {
    const Vec3 from = a - disc.centre;
    const Vec3 along = b - a;
    height_ = disc.axis.dot(from);
    rise_ = disc.axis.dot(along);
    offset_ = from - height_ * disc.axis;
    drift_ = along - rise_ * disc.axis;
  }

  struct Slope {
    double value;
    double rate;
  };

  /// Half of the derivative of the squared distance with respect to the parameter, which is monotonic, and
  /// its own derivative.
  [[nodiscard]] Slope slope(double share) const noexcept {
    Slope slope{(height_ + share * rise_) * rise_, rise_ * rise_};
    const Vec3 offset = offset_ + share * drift_;
    const double squared = offset.squaredNorm();
    if (squared > radius_ * radius_) {
      const double distance = std::sqrt(squared);
      const double outward = offset.dot(drift_);
      const double beyond = 1.0 - radius_ / distance;
      slope.value += outward * beyond;
      slope.rate += drift_.squaredNorm() * beyond + radius_ * outward * outward / (squared * distance);
    }
    return slope;
  }

  /// True if the line passes through the disc; then also the parameter.
  bool cuts(double& share) const noexcept {
    const double end = height_ + rise_;
    if (!((height_ > 0.0 && end < 0.0) || (height_ < 0.0 && end > 0.0))) return false;
    share = height_ / (height_ - end);
    return share >= 0.0 && share <= 1.0 && (offset_ + share * drift_).squaredNorm() <= radius_ * radius_;
  }

  [[nodiscard]] std::array<double, 2> over_rim() const noexcept {
    const double a = drift_.squaredNorm();
    const double b = offset_.dot(drift_);
    const double c = offset_.squaredNorm() - radius_ * radius_;
    const double root = b * b - a * c;
    if (!(a > 0.0 && root > 0.0)) return {nan, nan};
    const double q = -(b + std::copysign(std::sqrt(root), b));
    const double first = q / a;
    const double second = q != 0.0 ? c / q : first;
    return {std::min(first, second), std::max(first, second)};
  }

 private:
  double radius_;
  double height_;  // above the disc's plane at parameter 0
  double rise_;
  Vec3 offset_;  // from the axis at parameter 0
  Vec3 drift_;
};

/// Share at which the slope is 0, or the nearest end: Newton's method in a bracket, which is halved if a step
/// would leave it or the steps do not become shorter.
double nearest_share(const Runner& runner) noexcept {
  if (!(runner.slope(0.0).value < 0.0)) return 0.0;
  if (!(runner.slope(1.0).value > 0.0)) return 1.0;
  double low = 0.0;
  double high = 1.0;
  double share = 0.5;
  double last_step = 1.0;
  for (int k = 0; k < most_steps; ++k) {
    const auto [value, rate] = runner.slope(share);
    if (value == 0.0) break;
    (value < 0.0 ? low : high) = share;
    const double newton = share - value / rate;
    const bool is_good = newton > low && newton < high && 2.0 * std::abs(newton - share) < last_step;
    const double next = is_good ? newton : 0.5 * (low + high);
    last_step = std::abs(next - share);
    share = next;
    if (last_step < 2.0 * eps * share) break;
  }
  return share;
}

NearestPoint pair_at(const Disc& disc, const Vec3& a, const Vec3& b, double share) noexcept {
  NearestPoint pair;
  pair.weights = {1.0 - share, share, 0.0};
  pair.on_simplex = (1.0 - share) * a + share * b;
  pair.on_core = nearest_on_disc(disc, pair.on_simplex);
  pair.squared_distance = std::min((pair.on_simplex - pair.on_core).squaredNorm(), largest);
  return pair;
}

/// Component of a vector in the disc's plane.
Vec3 in_plane(const Disc& disc, const Vec3& v) noexcept {
  return v - disc.axis.dot(v) * disc.axis;
}

/// Diameter of the disc that is steepest relative to a triangle. Arbitrary if the triangle has no area or is
/// parallel.
std::pair<Vec3, Vec3> steepest_diameter(const Disc& disc, const Vec3& a, const Vec3& b,
                                        const Vec3& c) noexcept {
  const Vec3 slope = in_plane(disc, (b - a).cross(c - a));
  const double size = slope.norm();
  // Projected twice: for a slope that is small relative to the normal, rounding is significant.
  Vec3 along = in_plane(disc, slope / size);
  const double length = along.norm();
  along = length > 0.5 && length < 2.0 ? Vec3(along / length) : disc.axis.unitOrthogonal();
  return {disc.centre - disc.radius * along, disc.centre + disc.radius * along};
}

}  // namespace

Vec3 nearest_on_disc(const Disc& disc, const Vec3& p) noexcept {
  const Vec3 offset = in_plane(disc, p - disc.centre);
  const double squared = offset.squaredNorm();
  const double share = squared > disc.radius * disc.radius ? disc.radius / std::sqrt(squared) : 1.0;
  const Vec3 nearest = disc.centre + share * offset;
  return nearest.allFinite() ? nearest : disc.centre;
}

NearestPoint nearest_of_disc_and_line(const Disc& disc, const Vec3& a, const Vec3& b) noexcept {
  const Runner runner(disc, a, b);
  double share = 0.0;
  if (!runner.cuts(share)) return pair_at(disc, a, b, nearest_share(runner));
  NearestPoint through = pair_at(disc, a, b, share);
  through.squared_distance = 0.0;
  return through;
}

NearestPoint nearest_of_disc_and_triangle(const Disc& disc, const Vec3& a, const Vec3& b,
                                          const Vec3& c) noexcept {
  const std::array<const Vec3*, 3> corner = {&a, &b, &c};
  NearestPoint best;
  best.squared_distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    NearestPoint edge = nearest_of_disc_and_line(disc, *corner[i], *corner[j]);
    if (!(edge.squared_distance < best.squared_distance)) continue;
    const std::array<double, 3> weights = edge.weights;
    edge.weights = {};
    edge.weights[i] = weights[0];
    edge.weights[j] = weights[1];
    best = edge;
  }
  // Inside the face the nearest point is on the rim, where it is lowest above the triangle, or the disc cuts
  // the triangle at least in the middle of a chord.
  const auto [p, q] = steepest_diameter(disc, a, b, c);
  const NearestPoint in_face = nearest_of_segment_and_triangle(p, q, a, b, c);
  const bool is_in_face = *std::min_element(in_face.weights.begin(), in_face.weights.end()) > 0.0;
  return is_in_face && in_face.squared_distance < best.squared_distance ? in_face : best;
}

std::array<double, 2> shares_over_rim(const Disc& disc, const Vec3& a, const Vec3& b) noexcept {
  return Runner(disc, a, b).over_rim();
}

}  // namespace palpate
