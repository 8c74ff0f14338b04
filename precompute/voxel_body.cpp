#include "precompute/voxel_body.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "meshes/error.h"

namespace palpate {
namespace {

constexpr double small_part = 0.01;  // of the largest part

std::size_t voxel_count(const std::array<Index, 3>& size) {
  return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
         static_cast<std::size_t>(size[2]);
}

/// A group of voxels that are connected through faces and are all body or all empty.
struct Part {
  std::uint8_t inside;
  std::size_t voxels;
  std::size_t first;  ///< one of them
};

/// Numbers the parts; `part_of` gets each voxel's.
std::vector<Part> find_parts(const VoxelBody& body, std::vector<Index>& part_of) {
  std::vector<Part> parts;
  part_of.assign(body.inside.size(), -1);
  std::vector<std::array<Index, 3>> front;
  for (Index k = 0; k < body.size[2]; ++k) {
    for (Index j = 0; j < body.size[1]; ++j) {
      for (Index i = 0; i < body.size[0]; ++i) {
        if (part_of[body.at(i, j, k)] >= 0) {
          continue;
        }
        const auto number = static_cast<Index>(parts.size());
        Part part{body.inside[body.at(i, j, k)], 0, body.at(i, j, k)};
        part_of[part.first] = number;
        front.push_back({i, j, k});
        while (!front.empty()) {
          const std::array<Index, 3> voxel = front.back();
          front.pop_back();
          ++part.voxels;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const Index step : {-1, 1}) {
              std::array<Index, 3> next = voxel;
              next[axis] += step;
              if (next[axis] < 0 || next[axis] >= body.size[axis]) {
                continue;
              }
              const std::size_t at = body.at(next[0], next[1], next[2]);
              if (part_of[at] < 0 && body.inside[at] == part.inside) {
                part_of[at] = number;
                front.push_back(next);
              }
            }
          }
        }
        parts.push_back(part);
      }
    }
  }
  return parts;
}

std::string shown(const VoxelBody& body, std::size_t voxel) {
  const auto nx = static_cast<std::size_t>(body.size[0]), ny = static_cast<std::size_t>(body.size[1]);
  const std::array<std::size_t, 3> at = {voxel % nx, voxel / nx % ny, voxel / (nx * ny)};
  std::string text = "(";
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    text += (axis == 0 ? "" : ", ") +
            std::to_string(body.origin[a] + static_cast<double>(at[axis]) * body.spacing[a]);
  }
  return text + ")";
}

/// Replaces f by min_q f(q) + (spacing (p - q))^2 along one line: the lower envelope of parabolas.
class LineTransform {
 public:
  LineTransform(Index length, double spacing)
      : spacing2_(spacing * spacing),
        f_(static_cast<std::size_t>(length)),
        apex_(f_.size()),
        from_(f_.size() + 1) {}

  /// Line of the given length with `stride` between its entries.
  void operator()(float* line, std::size_t stride) {
    const std::size_t n = f_.size();
    for (std::size_t p = 0; p < n; ++p) {
      f_[p] = static_cast<double>(line[p * stride]);
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
      line[p * stride] = static_cast<float>(f_[apex_[active]] + spacing2_ * away * away);
    }
  }

 private:
  /// Where the parabola with apex b takes over from that with apex a < b.
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
std::vector<float> distance_to(const VoxelBody& grid, std::uint8_t to) {
  constexpr float far = 1e12F;  // finite: the parabolas of untouched lines must stay comparable
  std::vector<float> d2(grid.inside.size());
  std::transform(grid.inside.begin(), grid.inside.end(), d2.begin(),
                 [&](std::uint8_t v) { return v == to ? 0.0F : far; });
  std::size_t stride = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(grid.size[axis]);
    LineTransform transform(grid.size[axis], grid.spacing[static_cast<Eigen::Index>(axis)]);
    for (std::size_t line = 0; line < d2.size() / n; ++line) {
      transform(d2.data() + line / stride * stride * n + line % stride, stride);
    }
    stride *= n;
  }
  std::transform(d2.begin(), d2.end(), d2.begin(), [](float v) { return std::sqrt(v); });
  return d2;
}

/// Binomial filter (1/4, 1/2, 1/4) along each axis; the rim stays.
void smooth(const VoxelBody& grid, std::vector<float>& values) {
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

VoxelBody crop(const VoxelBody& body, Index margin) {
  std::array<Index, 3> low = body.size, high = {-1, -1, -1};
  for (Index k = 0; k < body.size[2]; ++k) {
    for (Index j = 0; j < body.size[1]; ++j) {
      for (Index i = 0; i < body.size[0]; ++i) {
        if (body.inside[body.at(i, j, k)] != 0) {
          low = {std::min(low[0], i), std::min(low[1], j), std::min(low[2], k)};
          high = {std::max(high[0], i), std::max(high[1], j), std::max(high[2], k)};
        }
      }
    }
  }
  VoxelBody result;
  result.spacing = body.spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    result.size[axis] = high[axis] - low[axis] + 1 + 2 * margin;
    result.origin[a] = body.origin[a] + body.spacing[a] * static_cast<double>(low[axis] - margin);
  }
  result.inside.assign(voxel_count(result.size), 0);
  for (Index k = low[2]; k <= high[2]; ++k) {
    for (Index j = low[1]; j <= high[1]; ++j) {
      for (Index i = low[0]; i <= high[0]; ++i) {
        result.inside[result.at(i - low[0] + margin, j - low[1] + margin, k - low[2] + margin)] =
            body.inside[body.at(i, j, k)];
      }
    }
  }
  return result;
}

void keep_one_part(VoxelBody& body, const std::string& where, std::vector<std::string>& notes) {
  std::vector<Index> part_of;
  const std::vector<Part> parts = find_parts(body, part_of);
  const auto largest = std::max_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    return (a.inside != 0 ? a.voxels : 0) < (b.inside != 0 ? b.voxels : 0);
  });
  const double limit = small_part * static_cast<double>(largest->voxels);
  const Index outside = part_of[0];

  std::vector<std::uint8_t> turned(parts.size(), 0);
  std::array<std::size_t, 2> turned_parts{}, turned_voxels{};
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Part& part = parts[p];
    const bool is_small = static_cast<double>(part.voxels) < limit;
    if (part.inside != 0 && &part != &*largest && !is_small) {
      throw Error("the image holds disconnected parts: one of " + std::to_string(largest->voxels) +
                      " voxels at " + shown(body, largest->first) + " and one of " +
                      std::to_string(part.voxels) + " at " + shown(body, part.first) + " (image units)",
                  where, "choose the labels of one organ by labels = [...] in [geometry]");
    }
    if (is_small && static_cast<Index>(p) != outside) {
      turned[p] = 1;
      ++turned_parts[part.inside];
      turned_voxels[part.inside] += part.voxels;
    }
  }
  for (std::size_t v = 0; v < body.inside.size(); ++v) {
    if (turned[static_cast<std::size_t>(part_of[v])] != 0) {
      body.inside[v] ^= 1;
    }
  }
  if (turned_parts[1] != 0) {
    notes.push_back("dropped " + std::to_string(turned_parts[1]) + " stray part(s) of the image, together " +
                    std::to_string(turned_voxels[1]) + " voxel(s)");
  }
  if (turned_parts[0] != 0) {
    notes.push_back("filled " + std::to_string(turned_parts[0]) +
                    " cavity(ies) inside the image's body, together " + std::to_string(turned_voxels[0]) +
                    " voxel(s)");
  }
}

std::size_t join_across_edges(VoxelBody& body) {
  const std::array<std::size_t, 3> stride = {1, body.at(0, 1, 0), body.at(0, 0, 1)};
  std::size_t filled = 0;
  for (std::size_t before = filled + 1;
       before != filled;) {  // a filled voxel may touch another one along an edge
    before = filled;
    for (std::size_t v = 0; v + stride[1] + stride[2] < body.inside.size(); ++v) {
      for (const auto& [a, b] : {std::pair{0U, 1U}, {0U, 2U}, {1U, 2U}}) {
        std::uint8_t &here = body.inside[v], &along_a = body.inside[v + stride[a]],
                     &along_b = body.inside[v + stride[b]], &across = body.inside[v + stride[a] + stride[b]];
        if (here == across && along_a == along_b && here != along_a) {
          (here == 0 ? here : along_a) = 1;
          ++filled;
        }
      }
    }
  }
  return filled;
}

std::vector<float> signed_distances(const VoxelBody& body) {
  std::vector<float> distance = distance_to(body, 0);
  const std::vector<float> outside = distance_to(body, 1);
  std::transform(distance.begin(), distance.end(), outside.begin(), distance.begin(), std::minus<>());
  return distance;
}

DistanceField::DistanceField(const VoxelBody& body) : grid_(body), distance_(signed_distances(body)) {
  grid_.inside.clear();
  smooth(grid_, distance_);  // the staircases of voxels are not the body's shape
}

double DistanceField::operator()(const Vec3& x) const noexcept {
  std::array<Index, 3> cell{};
  Vec3 t;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double last = static_cast<double>(grid_.size[axis] - 1);
    const double position = std::clamp((x[a] - grid_.origin[a]) / grid_.spacing[a], 0.0, last);
    cell[axis] = std::min(static_cast<Index>(position), grid_.size[axis] - 2);
    t[a] = position - static_cast<double>(cell[axis]);
  }
  const auto row = [&](Index j, Index k) {
    const std::size_t at = grid_.at(cell[0], cell[1] + j, cell[2] + k);
    return (1.0 - t[0]) * static_cast<double>(distance_[at]) + t[0] * static_cast<double>(distance_[at + 1]);
  };
  const double front = (1.0 - t[1]) * row(0, 0) + t[1] * row(1, 0);
  const double back = (1.0 - t[1]) * row(0, 1) + t[1] * row(1, 1);
  return (1.0 - t[2]) * front + t[2] * back;
}

}  // namespace palpate
