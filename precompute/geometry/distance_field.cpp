#include "precompute/geometry/distance_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <utility>

namespace palpate {
namespace {

constexpr std::size_t lines_at_once = 16;  // adjacent floats, a cache line

/// Replaces f by min_q f(q) + (spacing (p - q))^2 along one line: the lower envelope of parabolas.
class LineTransform {
 public:
  LineTransform(Index length, double spacing)
      : spacing2_(spacing * spacing),
        f_(static_cast<std::size_t>(length)),
        apex_(f_.size()),
        from_(f_.size() + 1) {}

  /// Transforms a line of the given length.
  void operator()(float* line) {
    const std::size_t n = f_.size();
    std::copy_n(line, n, f_.begin());
    if (std::ranges::all_of(f_, [this](double f) { return f == f_[0]; })) {
      return;  // equally far everywhere, as on most lines away from the body: they do not change
    }
    std::size_t last = 0;
    apex_[0] = 0;
    from_[0] = -std::numeric_limits<double>::infinity();
    for (std::size_t q = 1; q < n; ++q) {
      double s = crossing(apex_[last], q);
      while (s <= from_[last]) {
        s = crossing(apex_[--last], q);
      }
      apex_[++last] = q;
      from_[last] = s;
    }
    from_[last + 1] = std::numeric_limits<double>::infinity();
    std::size_t active = 0;
    for (std::size_t p = 0; p < n; ++p) {
      while (from_[active + 1] < static_cast<double>(p)) {
        ++active;
      }
      const double away = static_cast<double>(p) - static_cast<double>(apex_[active]);
      line[p] = static_cast<float>(f_[apex_[active]] + spacing2_ * away * away);
    }
  }

 private:
  /// Position where the parabola with apex b takes over from that with apex a < b.
  [[nodiscard]] double crossing(std::size_t a, std::size_t b) const {
    const auto x = static_cast<double>(a), y = static_cast<double>(b);
    return (f_[b] - f_[a] + spacing2_ * (y * y - x * x)) / (2.0 * spacing2_ * (y - x));
  }

  double spacing2_;
  std::vector<double> f_;
  std::vector<std::size_t> apex_;
  std::vector<double> from_;
};

/// Distance of each voxel centre to the nearest one with inside == `to`. [voxels]
std::vector<float> distance_to(const VoxelGrid& grid, const std::vector<std::uint8_t>& inside,
                               std::uint8_t to) {
  constexpr float far = 1e12F;  // finite: the parabolas of untouched lines must stay comparable
  std::vector<float> d2(inside.size());
  std::transform(inside.begin(), inside.end(), d2.begin(),
                 [&](std::uint8_t v) { return v == to ? 0.0F : far; });
  std::size_t stride = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(grid.size[axis]);
    LineTransform transform(grid.size[axis], grid.spacing[static_cast<Eigen::Index>(axis)]);
    std::vector<float> copies(lines_at_once * n);
    for (std::size_t line = 0, count = 0; line < d2.size() / n; line += count) {
      count = std::min(lines_at_once, stride - line % stride);  // side by side
      float* const first = d2.data() + line / stride * stride * n + line % stride;
      for (std::size_t p = 0; p < n; ++p) {
        for (std::size_t l = 0; l < count; ++l) copies[l * n + p] = first[p * stride + l];
      }
      for (std::size_t l = 0; l < count; ++l) transform(copies.data() + l * n);
      for (std::size_t p = 0; p < n; ++p) {
        for (std::size_t l = 0; l < count; ++l) first[p * stride + l] = copies[l * n + p];
      }
    }
    stride *= n;
  }
  std::transform(d2.begin(), d2.end(), d2.begin(), [](float v) { return std::sqrt(v); });
  return d2;
}

/// Binomial filter (1/4, 1/2, 1/4) along each axis; the rim does not change.
void smooth(const VoxelGrid& grid, std::vector<float>& values) {
  std::size_t stride = 1;
  for (const Index length : grid.size) {
    const auto n = static_cast<std::size_t>(length);
    for (std::size_t line = 0; line < values.size() / n; ++line) {
      float* v = values.data() + line / stride * stride * n + line % stride;
      float before = v[0];
      for (std::size_t p = 1; p + 1 < n; ++p) {
        const float here = v[p * stride];
        v[p * stride] = 0.25F * (before + 2.0F * here + v[(p + 1) * stride]);
        before = here;
      }
    }
    stride *= n;
  }
}

}  // namespace

std::vector<float> signed_distances(const VoxelGrid& grid, const std::vector<std::uint8_t>& inside) {
  std::vector<float> distance = distance_to(grid, inside, 0);
  const std::vector<float> outside = distance_to(grid, inside, 1);
  std::transform(distance.begin(), distance.end(), outside.begin(), distance.begin(), std::minus<>());
  return distance;
}

DistanceField::DistanceField(const VoxelGrid& grid, const std::vector<std::uint8_t>& inside,
                             std::vector<std::uint8_t> known)
    : grid_(grid), distance_(signed_distances(grid, inside)), known_(std::move(known)) {
  smooth(grid_, distance_);  // the staircases of voxels are not the body's shape
}

/// Signed distance of a point in a known voxel to the faces of the voxels beside it; a voxel or more if there
/// are none.
double DistanceField::to_faces(const Vec3& x, const std::array<Index, 3>& voxel,
                               double smooth) const noexcept {
  const bool is_inside = known_[grid_.at(voxel[0], voxel[1], voxel[2])] == SharpEdges::inside;
  double nearest = grid_.spacing.maxCoeff();
  for (Index n = 0; n < 27; ++n) {
    const std::array<Index, 3> other = {voxel[0] + n % 3 - 1, voxel[1] + n / 3 % 3 - 1, voxel[2] + n / 9 - 1};
    if (std::ranges::any_of(std::array{0U, 1U, 2U},
                            [&](unsigned a) { return other[a] < 0 || other[a] >= grid_.size[a]; }))
      continue;
    const std::size_t v = grid_.at(other[0], other[1], other[2]);
    if ((known_[v] == SharpEdges::by_field ? distance_[v] > 0.0F : known_[v] == SharpEdges::inside) ==
        is_inside)
      continue;
    const Vec3 away = ((x - grid_.center(v)).cwiseAbs() - 0.5 * grid_.spacing).cwiseMax(0.0);
    nearest = std::min(nearest, away.norm());
  }
  nearest = std::max(nearest, is_inside ? smooth : -smooth);  // which is steeper on flat faces
  return is_inside ? nearest : -nearest;
}

double DistanceField::operator()(const Vec3& x) const noexcept {
  std::array<Index, 3> cell{}, voxel{};
  Vec3 t;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double last = static_cast<double>(grid_.size[axis] - 1);
    const double position = std::clamp((x[a] - grid_.origin[a]) / grid_.spacing[a], 0.0, last);
    cell[axis] = std::min(static_cast<Index>(position), grid_.size[axis] - 2);
    t[a] = position - static_cast<double>(cell[axis]);
    voxel[axis] = cell[axis] + (t[a] > 0.5 ? 1 : 0);
  }
  const auto row = [&](Index j, Index k) {
    const std::size_t at = grid_.at(cell[0], cell[1] + j, cell[2] + k);
    return (1.0 - t[0]) * static_cast<double>(distance_[at]) + t[0] * static_cast<double>(distance_[at + 1]);
  };
  const double front = (1.0 - t[1]) * row(0, 0) + t[1] * row(1, 0);
  const double back = (1.0 - t[1]) * row(0, 1) + t[1] * row(1, 1);
  const double smooth = (1.0 - t[2]) * front + t[2] * back;
  const bool is_known =
      !known_.empty() && known_[grid_.at(voxel[0], voxel[1], voxel[2])] != SharpEdges::by_field;
  return is_known ? to_faces(x, voxel, smooth) : smooth;
}

/// Eighth of a voxel, in which the field is assumed linear.
struct DistanceField::Eighth {
  double middle, width;  // of its values
};

void DistanceField::add_eighths(std::size_t voxel, double least_width, std::vector<Eighth>& to) const {
  std::array<double, 8> values{};
  std::array<double, 3> slopes{};
  for (unsigned k = 0; k < 8; ++k) {
    const Vec3 side((k & 1U) != 0 ? 0.25 : -0.25, (k & 2U) != 0 ? 0.25 : -0.25, (k & 4U) != 0 ? 0.25 : -0.25);
    values[k] = (*this)(grid_.center(voxel) + side.cwiseProduct(grid_.spacing));
    for (unsigned axis = 0; axis < 3; ++axis) slopes[axis] += (k >> axis & 1U) != 0 ? values[k] : -values[k];
  }
  const double width = (std::abs(slopes[0]) + std::abs(slopes[1]) + std::abs(slopes[2])) / 4.0 + least_width;
  for (const double value : values) to.push_back({value, width});
}

void DistanceField::grow_to(double voxels) {
  const double most = 2.0 * grid_.spacing.maxCoeff();  // largest shift of the boundary
  const double reach = 2.0 * grid_.spacing.norm();     // largest change of a field within a voxel
  double inside = 0.0;
  std::vector<Eighth> near;
  for (std::size_t v = 0; v < distance_.size(); ++v) {
    const auto middle = static_cast<double>(distance_[v]);
    if (!known_.empty() && known_[v] != SharpEdges::by_field) {
      inside += known_[v] == SharpEdges::inside ? 8.0 : 0.0;
    } else if (middle > reach) {
      inside += 8.0;
    } else if (middle > -most - reach) {
      add_eighths(v, 1e-9 * most, near);
    }
  }
  const auto volume = [&](double level) {
    double sum = inside;
    for (const Eighth& eighth : near)
      sum += std::clamp(0.5 + (eighth.middle - level) / eighth.width, 0.0, 1.0);
    return sum / 8.0;
  };
  double low = -most, high = 0.0;
  if (volume(high) >= voxels) return;
  for (int halving = 0; halving < 40; ++halving) {
    const double level = (low + high) / 2.0;
    (volume(level) < voxels ? high : low) = level;
  }
  for (float& distance : distance_) distance -= static_cast<float>(high);
}

LabelField::LabelField(const VoxelBody& body, const SharpEdges& sharp)
    : body_(body, body.inside, sharp.known) {
  std::set<Index> labels;
  Index last = VoxelBody::no_label;
  for (const Index label : body.labels) {
    if (label != last) {
      labels.insert(label);
      last = label;
    }
  }
  labels.erase(VoxelBody::no_label);
  labels_ = labels.empty() ? std::vector<Index>{0} : std::vector<Index>(labels.begin(), labels.end());
  if (labels_.size() == 1) {
    return;
  }
  std::vector<std::uint8_t> carries(body.labels.size());
  for (const Index label : labels_) {
    std::transform(body.labels.begin(), body.labels.end(), carries.begin(),
                   [&](Index l) { return l == label ? 1 : 0; });
    parts_.emplace_back(body, carries);
  }
}

LabelField::Place LabelField::operator()(const Vec3& x) const noexcept {
  const double below = body_(x);
  if (below <= 0.0) {
    return {0, 0.0};
  }
  if (parts_.empty()) {
    return {1, below};
  }
  Place place{1, parts_[0](x)};
  for (std::size_t p = 1; p < parts_.size(); ++p) {
    if (const double depth = parts_[p](x); depth > place.depth) {
      place = {static_cast<int>(p) + 1, depth};
    }
  }
  return {place.number, std::max(0.0, place.depth)};
}

}  // namespace palpate
