#include "runtime/core/solve/surface_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "base/error.h"

namespace palpate {
namespace {

constexpr Index leaf_size = 4;
// Each split halves the number of simplices, so the depth is at most the number of bits of that number.
constexpr std::size_t max_depth = 32;
constexpr std::size_t word_bits = 64;  // bits per word of marks
constexpr double infinity = std::numeric_limits<double>::infinity();

std::size_t at(Index i) noexcept {
  return static_cast<std::size_t>(i);
}

/// Squared distance between two boxes, 0 if they overlap; finite even if it overflows.
double squared_gap(const Vec3& lower, const Vec3& upper, const Vec3& other_lower,
                   const Vec3& other_upper) noexcept {
  const Vec3 gap = (lower - other_upper).cwiseMax(other_lower - upper).cwiseMax(0.0);
  return std::min(gap.squaredNorm(), std::numeric_limits<double>::max());
}

}  // namespace

SurfaceTree::SurfaceTree(std::span<const Index> simplices, int corners, std::span<const Vec3> positions,
                         double margin)
    : corners_(corners),
      margin_(margin),
      positions_(positions.begin(), positions.end()),
      anchors_(positions_),
      numbers_(simplices.size() / static_cast<std::size_t>(corners)),
      leaf_(numbers_.size()) {
  if (numbers_.empty() || !(margin > 0.0)) {
    throw Error("a surface of " + std::to_string(numbers_.size()) + " simplices with boxes " +
                    std::to_string(margin) + " m larger cannot be searched",
                "the surface of the body", "give at least one simplex and a margin above 0");
  }
  const auto width = static_cast<std::size_t>(corners);
  std::vector<Vec3> centres(numbers_.size(), Vec3::Zero());
  for (std::size_t k = 0; k < simplices.size(); ++k) {
    centres[k / width] += positions_[at(simplices[k])] / corners;
  }
  std::iota(numbers_.begin(), numbers_.end(), 0);
  build(centres, 0, static_cast<Index>(numbers_.size()), -1);

  nodes_.reserve(simplices.size());
  for (const Index number : numbers_) {
    const auto nodes = simplices.subspan(width * at(number), width);
    nodes_.insert(nodes_.end(), nodes.begin(), nodes.end());
  }
  connect_nodes();
  marks_.assign((cells_.size() + word_bits - 1) / word_bits, 0);
  for (Index cell = static_cast<Index>(cells_.size()); cell-- > 0;) fit(cell);
}

void SurfaceTree::build(std::span<const Vec3> centres, Index first, Index last, Index parent) {
  const auto cell = static_cast<Index>(cells_.size());
  const bool is_leaf = last - first <= leaf_size;
  cells_.push_back({Vec3::Zero(), Vec3::Zero(), cell + 1, parent, first, is_leaf ? last - first : 0});
  if (is_leaf) {
    std::fill(leaf_.begin() + first, leaf_.begin() + last, cell);
    return;
  }
  Eigen::AlignedBox3d box;
  for (Index k = first; k < last; ++k) box.extend(centres[at(numbers_[at(k)])]);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const Index middle = first + (last - first) / 2;
  std::nth_element(numbers_.begin() + first, numbers_.begin() + middle, numbers_.begin() + last,
                   [&](Index a, Index b) {
                     const double of_a = centres[at(a)][axis];
                     const double of_b = centres[at(b)][axis];
                     return of_a != of_b ? of_a < of_b : a < b;
                   });
  build(centres, first, middle, cell);
  build(centres, middle, last, cell);
  cells_[at(cell)].end = static_cast<Index>(cells_.size());
}

void SurfaceTree::connect_nodes() {
  first_place_.assign(positions_.size() + 1, 0);
  for (const Index node : nodes_) ++first_place_[at(node) + 1];
  std::partial_sum(first_place_.begin(), first_place_.end(), first_place_.begin());
  std::vector<Index> next(first_place_.begin(), first_place_.end() - 1);
  places_.resize(nodes_.size());
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    places_[at(next[at(nodes_[k])]++)] = static_cast<Index>(k / static_cast<std::size_t>(corners_));
  }
}

std::span<const Index> SurfaceTree::nodes_at(Index place) const noexcept {
  const auto width = static_cast<std::size_t>(corners_);
  return std::span(nodes_).subspan(width * at(place), width);
}

std::span<const Index> SurfaceTree::places_around(Index node) const noexcept {
  const Index first = first_place_[at(node)];
  return std::span(places_).subspan(at(first), at(first_place_[at(node) + 1] - first));
}

void SurfaceTree::move(Index node, const Vec3& position) noexcept {
  positions_[at(node)] = position;
  Vec3& anchor = anchors_[at(node)];
  const bool is_near = (position.array() >= anchor.array() - margin_).all() &&
                       (position.array() <= anchor.array() + margin_).all();
  if (is_near) return;
  anchor = position;
  for (const Index place : places_around(node)) mark(leaf_[at(place)]);
}

void SurfaceTree::mark(Index cell) noexcept {
  const std::size_t word = at(cell) / word_bits;
  marks_[word] |= std::uint64_t{1} << (at(cell) % word_bits);
  marks_end_ = std::max(marks_end_, word + 1);
}

void SurfaceTree::refit() noexcept {
  // From the last cell to the first: children are stored after their parents.
  while (marks_end_ > 0) {
    const std::uint64_t word = marks_[marks_end_ - 1];
    if (word == 0) {
      --marks_end_;
      continue;
    }
    const std::size_t bit = word_bits - 1 - static_cast<std::size_t>(std::countl_zero(word));
    const std::size_t cell = (marks_end_ - 1) * word_bits + bit;
    marks_[marks_end_ - 1] = word & ~(std::uint64_t{1} << bit);
    if (fit(static_cast<Index>(cell)) && cells_[cell].parent >= 0) mark(cells_[cell].parent);
  }
}

bool SurfaceTree::fit(Index cell) noexcept {
  Cell& c = cells_[at(cell)];
  Vec3 lower = Vec3::Constant(infinity);
  Vec3 upper = Vec3::Constant(-infinity);
  const auto enclose = [&](const Vec3& other_lower, const Vec3& other_upper) {
    lower = lower.cwiseMin(other_lower);
    upper = upper.cwiseMax(other_upper);
  };
  if (c.count > 0) {
    for (Index place = c.first; place < c.first + c.count; ++place) {
      for (const Index node : nodes_at(place)) {
        const Vec3& anchor = anchors_[at(node)];
        enclose(anchor.array() - margin_, anchor.array() + margin_);
      }
    }
  } else {
    const Cell& left = cells_[at(cell) + 1];
    const Cell& right = cells_[at(left.end)];
    enclose(left.lower, left.upper);
    enclose(right.lower, right.upper);
  }
  if (lower == c.lower && upper == c.upper) return false;
  c.lower = lower;
  c.upper = upper;
  return true;
}

std::size_t SurfaceTree::near_segment(const Vec3& p, const Vec3& q, double reach,
                                      std::span<Index> found) const noexcept {
  const Vec3 segment_lower = p.cwiseMin(q);
  const Vec3 segment_upper = p.cwiseMax(q);
  const auto is_near = [&](const Vec3& lower, const Vec3& upper) {
    return squared_gap(lower, upper, segment_lower, segment_upper) <= reach * reach;
  };
  std::size_t count = 0;
  for (Index cell = 0; cell < cells_.front().end;) {
    const Cell& c = cells_[at(cell)];
    if (!is_near(c.lower, c.upper)) {
      cell = c.end;
      continue;
    }
    for (Index place = c.first; place < c.first + c.count; ++place) {
      const auto nodes = nodes_at(place);
      Vec3 lower = position(nodes[0]);
      Vec3 upper = lower;
      for (const Index node : nodes.subspan(1)) {
        lower = lower.cwiseMin(position(node));
        upper = upper.cwiseMax(position(node));
      }
      if (!is_near(lower, upper)) continue;
      if (count < found.size()) found[count] = numbers_[at(place)];
      ++count;
    }
    ++cell;
  }
  return count;
}

Index SurfaceTree::nearest_place(const Vec3& point, NearestPoint& nearest) const noexcept {
  struct Waiting {
    Index cell;
    double squared_distance;
  };
  std::array<Waiting, max_depth> waiting;
  std::size_t waits = 0;
  const auto look_at = [&](Index cell) {
    const Cell& c = cells_[at(cell)];
    return Waiting{cell, squared_gap(c.lower, c.upper, point, point)};
  };

  Index best = -1;
  nearest.squared_distance = infinity;
  waiting[waits++] = look_at(0);
  while (waits > 0) {
    Waiting next = waiting[--waits];
    while (next.squared_distance < nearest.squared_distance && cells_[at(next.cell)].count == 0) {
      Waiting nearer = look_at(next.cell + 1);
      Waiting farther = look_at(cells_[at(nearer.cell)].end);
      if (farther.squared_distance < nearer.squared_distance) std::swap(nearer, farther);
      waiting[waits++] = farther;
      next = nearer;
    }
    if (!(next.squared_distance < nearest.squared_distance)) continue;
    const Cell& leaf = cells_[at(next.cell)];
    for (Index place = leaf.first; place < leaf.first + leaf.count; ++place) {
      const auto nodes = nodes_at(place);
      const NearestPoint here =
          corners_ == 3
              ? nearest_on_triangle(point, position(nodes[0]), position(nodes[1]), position(nodes[2]))
              : nearest_on_line(point, position(nodes[0]), position(nodes[1]));
      if (!(here.squared_distance < nearest.squared_distance)) continue;
      best = place;
      nearest = here;
    }
  }
  return best;
}

NearestSimplex SurfaceTree::nearest(const Vec3& point) const noexcept {
  NearestSimplex result;
  const Index place = nearest_place(point, result.nearest);
  if (place >= 0) result.simplex = numbers_[at(place)];
  return result;
}

bool SurfaceTree::inside(const Vec3& point) const noexcept {
  if (!bounds().contains(point)) return false;
  NearestPoint nearest;
  const Index place = nearest_place(point, nearest);
  double scale = 0.0;
  for (const Index node : nodes_at(place)) scale = std::max(scale, position(node).norm());
  const double rounding = 8.0 * std::numeric_limits<double>::epsilon() * scale;
  if (nearest.squared_distance <= rounding * rounding) return false;
  return outward_normal(place, nearest).dot(point - nearest.on_simplex) < 0.0;
}

Vec3 SurfaceTree::outward_normal(Index place, const NearestPoint& nearest) const noexcept {
  std::array<Index, 3> feature{};
  std::size_t count = 0;
  const auto nodes = nodes_at(place);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (nearest.weights[k] > 0.0) feature[count++] = nodes[k];
  }
  const auto has = [this](Index other, Index node) {
    const auto of_other = nodes_at(other);
    return std::find(of_other.begin(), of_other.end(), node) != of_other.end();
  };
  Vec3 normal = Vec3::Zero();
  for (const Index other : places_around(feature[0])) {
    if (count > 1 && !has(other, feature[1])) continue;
    if (count > 2 && !has(other, feature[2])) continue;
    normal += (count == 1 ? angle(other, feature[0]) : 1.0) * unit_normal(other);
  }
  return normal;
}

Vec3 SurfaceTree::unit_normal(Index place) const noexcept {
  const auto nodes = nodes_at(place);
  const Vec3 along = position(nodes[1]) - position(nodes[0]);
  if (corners_ == 2) return Vec3(along.y(), -along.x(), 0.0).normalized();
  return along.cross(position(nodes[2]) - position(nodes[0])).normalized();
}

double SurfaceTree::angle(Index place, Index node) const noexcept {
  if (corners_ == 2) return 1.0;
  const auto nodes = nodes_at(place);
  const auto k = static_cast<std::size_t>(std::find(nodes.begin(), nodes.end(), node) - nodes.begin());
  const Vec3 a = position(nodes[(k + 1) % 3]) - position(node);
  const Vec3 b = position(nodes[(k + 2) % 3]) - position(node);
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace palpate
