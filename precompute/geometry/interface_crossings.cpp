#include "precompute/geometry/interface_crossings.h"

#include <algorithm>
#include <map>

namespace palpate {
namespace {

constexpr double least_slope = 0.25;  // of the depth, inwards

/// Points with a minimum distance from each other.
class SparsePoints {
 public:
  explicit SparsePoints(double largest_distance) : cell_size_(largest_distance) {}

  /// Adds x unless another point is nearer than `distance`; returns true if added.
  bool add(const Vec3& x, double distance) {
    const Cell cell = cell_of(x);
    for (int n = 0; n < 27; ++n) {
      const auto near = points_.find({cell[0] + n % 3 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n / 9 - 1});
      if (near != points_.end() && std::any_of(near->second.begin(), near->second.end(),
                                               [&](const Vec3& p) { return (p - x).norm() < distance; })) {
        return false;
      }
    }
    points_[cell].push_back(x);
    return true;
  }

 private:
  using Cell = std::array<int, 3>;
  [[nodiscard]] Cell cell_of(const Vec3& x) const {
    const Vec3 cell = (x / cell_size_).array().floor();
    return {static_cast<int>(cell[0]), static_cast<int>(cell[1]), static_cast<int>(cell[2])};
  }

  double cell_size_;
  std::map<Cell, std::vector<Vec3>> points_;
};

/// Half the thickness of a label at a voxel on its border: the depth reached by moving to the deepest of the
/// 26 neighbours as long as that leads inwards, at most `limit`. Needs an empty rim.
double half_thickness(const VoxelBody& body, const LabelField& field, std::size_t voxel, double limit) {
  const LabelField::Place start = field(body.center(voxel));
  double depth = start.depth;
  bool inwards = false;
  do {
    std::size_t deepest = voxel;
    double most = depth;
    for (std::size_t n = 0; n < 27; ++n) {
      const std::size_t next =
          voxel + (n % 3) + (n / 3 % 3) * body.at(0, 1, 0) + (n / 9) * body.at(0, 0, 1) - body.at(1, 1, 1);
      const LabelField::Place place = field(body.center(next));
      if (place.number == start.number && place.depth > most) {
        most = place.depth;
        deepest = next;
      }
    }
    inwards = most - depth > least_slope * (body.center(deepest) - body.center(voxel)).norm();
    voxel = deepest;
    depth = most;
  } while (inwards && depth < limit);
  return std::min(depth, limit);
}

}  // namespace

std::vector<Crossing> interface_crossings(const VoxelBody& body, const LabelField& field,
                                          double largest_distance) {
  std::vector<Crossing> crossings;
  SparsePoints taken(largest_distance);
  const std::array<std::size_t, 3> stride = {1, body.at(0, 1, 0), body.at(0, 0, 1)};
  for (std::size_t v = 0; v + stride[2] < body.labels.size(); ++v) {
    for (const std::size_t step : stride) {
      const std::size_t next = v + step;
      if (body.labels[v] == body.labels[next] || body.inside[v] == 0 || body.inside[next] == 0) {
        continue;
      }
      const Vec3 from = body.center(v), to = body.center(next);
      if (field(from).number == field(to).number) {
        continue;  // smoothed away
      }
      const double half = std::min(half_thickness(body, field, v, largest_distance),
                                   half_thickness(body, field, next, largest_distance));
      if (taken.add((from + to) / 2.0, std::max(half, body.spacing.minCoeff()))) {
        crossings.push_back({from, to});
      }
    }
  }
  return crossings;
}

}  // namespace palpate
