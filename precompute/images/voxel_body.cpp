#include "precompute/images/voxel_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <queue>

#include "base/error.h"

namespace palpate {
namespace {

constexpr double small_part = 0.01;  // of the largest part

/// A group of voxels connected through faces that have the same value.
template <typename Value>
struct Part {
  Value value;
  std::size_t voxels;
  std::size_t first;  ///< one of its voxels
};

/// Calls work(neighbour) for the voxels that have a face in common with `voxel`.
template <typename Work>
void for_neighbours(const VoxelGrid& grid, std::size_t voxel, const Work& work) {
  std::size_t stride = 1;
  for (const Index length : grid.size) {
    const auto n = static_cast<std::size_t>(length);
    const std::size_t position = voxel / stride % n;
    if (position > 0) {
      work(voxel - stride);
    }
    if (position + 1 < n) {
      work(voxel + stride);
    }
    stride *= n;
  }
}

/// Numbers found to be of the same part: each refers to an earlier one, and the first to itself.
class EqualNumbers {
 public:
  Index add() {
    earlier_.push_back(count());
    return earlier_.back();
  }
  [[nodiscard]] Index count() const noexcept { return static_cast<Index>(earlier_.size()); }
  Index first(Index number) {
    Index* earlier = &at(number);
    while (*earlier != number) {
      *earlier = at(*earlier);  // halves the path for the next search
      number = *earlier;
      earlier = &at(number);
    }
    return number;
  }
  void join(Index a, Index b) {
    const auto [low, high] = std::minmax({first(a), first(b)});
    at(high) = low;
  }

 private:
  Index& at(Index number) { return earlier_[static_cast<std::size_t>(number)]; }

  std::vector<Index> earlier_;
};

/// Gives each voxel the number of an equal one before it, along x, y or z, or a new one; returns the numbers
/// of the same part (Rosenfeld and Pfaltz, Sequential operations in digital picture processing, 1966).
template <typename Value>
EqualNumbers number_voxels(const VoxelGrid& grid, const std::vector<Value>& values,
                           std::vector<Index>& number_of) {
  EqualNumbers equal;
  const std::array<std::size_t, 3> stride = {1, grid.at(0, 1, 0), grid.at(0, 0, 1)};
  const auto number = [&](std::size_t v, const std::array<bool, 3>& has_before) {
    Index found = -1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!has_before[axis] || values[v - stride[axis]] != values[v]) {
        continue;
      }
      const Index before = number_of[v - stride[axis]];
      if (found >= 0 && before != found) {
        equal.join(before, found);
      }
      found = before;
    }
    return found >= 0 ? found : equal.add();
  };
  std::size_t v = 0;
  for (Index k = 0; k < grid.size[2]; ++k) {
    for (Index j = 0; j < grid.size[1]; ++j) {
      for (Index i = 0; i < grid.size[0]; ++i, ++v) {
        number_of[v] = number(v, {i > 0, j > 0, k > 0});
      }
    }
  }
  return equal;
}

/// Numbers the parts in the order of their first voxels; `part_of` gets the part of each voxel.
template <typename Value>
std::vector<Part<Value>> find_parts(const VoxelGrid& grid, const std::vector<Value>& values,
                                    std::vector<Index>& part_of) {
  part_of.resize(values.size());
  EqualNumbers equal = number_voxels(grid, values, part_of);
  std::vector<Index> parts_of_numbers;
  Index count = 0;
  for (Index number = 0; number < equal.count(); ++number) {  // the first number of a part is that of its
                                                              // first voxel
    const Index first = equal.first(number);
    parts_of_numbers.push_back(first == number ? count++ : parts_of_numbers[static_cast<std::size_t>(first)]);
  }
  std::vector<Part<Value>> parts(static_cast<std::size_t>(count));
  for (std::size_t v = 0; v < values.size(); ++v) {
    part_of[v] = parts_of_numbers[static_cast<std::size_t>(part_of[v])];
    Part<Value>& part = parts[static_cast<std::size_t>(part_of[v])];
    if (part.voxels++ == 0) {
      part.value = values[v];
      part.first = v;
    }
  }
  return parts;
}

std::string shown(const VoxelGrid& grid, std::size_t voxel) {
  const Vec3 x = grid.center(voxel);
  return fmt::format("({:f}, {:f}, {:f})", x[0], x[1], x[2]);
}

/// Removes the label of parts smaller than `smallest`, but never of the largest; returns the numbers of
/// voxels and parts for each label.
std::map<Index, std::array<std::size_t, 2>> unlabel_specks(VoxelBody& body, std::size_t smallest) {
  std::vector<Index> part_of;
  const auto parts = find_parts(body, body.labels, part_of);
  std::size_t largest = 0;
  for (const auto& part : parts) {
    largest = part.value == VoxelBody::no_label ? largest : std::max(largest, part.voxels);
  }
  const std::size_t limit = std::min(smallest, largest);
  std::map<Index, std::array<std::size_t, 2>> specks;
  for (const auto& part : parts) {
    if (part.value != VoxelBody::no_label && part.voxels < limit) {
      specks[part.value][0] += part.voxels;
      ++specks[part.value][1];
    }
  }
  for (std::size_t v = 0; v < body.labels.size(); ++v) {
    if (parts[static_cast<std::size_t>(part_of[v])].voxels < limit) {
      body.labels[v] = VoxelBody::no_label;
    }
  }
  return specks;
}

/// Spreads the labels, one layer of voxels after the other, over the body's voxels without one.
void spread_labels(VoxelBody& body) {
  std::queue<std::size_t> front;
  const auto lacks_label = [&](std::size_t v) {
    return body.inside[v] != 0 && body.labels[v] == VoxelBody::no_label;
  };
  for (std::size_t v = 0; v < body.labels.size(); ++v) {
    bool borders = false;
    if (body.labels[v] != VoxelBody::no_label) {
      for_neighbours(body, v, [&](std::size_t next) { borders = borders || lacks_label(next); });
    }
    if (borders) {
      front.push(v);
    }
  }
  while (!front.empty()) {
    const std::size_t from = front.front();
    front.pop();
    for_neighbours(body, from, [&](std::size_t next) {
      if (lacks_label(next)) {
        body.labels[next] = body.labels[from];
        front.push(next);
      }
    });
  }
}

}  // namespace

Vec3 VoxelGrid::center(std::size_t voxel) const noexcept {
  Vec3 x = origin;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(size[axis]);
    const auto a = static_cast<Eigen::Index>(axis);
    x[a] += static_cast<double>(voxel % n) * spacing[a];
    voxel /= n;
  }
  return x;
}

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
  result.file_unit = body.file_unit;
  result.shear = body.shear;
  result.sheared_about = body.sheared_about;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    result.size[axis] = high[axis] - low[axis] + 1 + 2 * margin;
    result.origin[a] = body.origin[a] + body.spacing[a] * static_cast<double>(low[axis] - margin);
  }
  result.inside.assign(result.voxels(), 0);
  result.labels.assign(body.labels.empty() ? 0 : result.voxels(), VoxelBody::no_label);
  for (Index k = low[2]; k <= high[2]; ++k) {
    for (Index j = low[1]; j <= high[1]; ++j) {
      for (Index i = low[0]; i <= high[0]; ++i) {
        const std::size_t from = body.at(i, j, k),
                          to = result.at(i - low[0] + margin, j - low[1] + margin, k - low[2] + margin);
        result.inside[to] = body.inside[from];
        if (!body.labels.empty()) {
          result.labels[to] = body.labels[from];
        }
      }
    }
  }
  return result;
}

std::size_t voxels_of_parts(const VoxelGrid& grid, const std::vector<std::uint8_t>& marks,
                            std::size_t least) {
  std::vector<Index> part_of;
  std::size_t voxels = 0;
  for (const auto& part : find_parts(grid, marks, part_of))
    if (part.value != 0 && part.voxels >= least) voxels += part.voxels;
  return voxels;
}

void keep_one_part(VoxelBody& body, const std::string& where, std::vector<std::string>& notes) {
  std::vector<Index> part_of;
  const auto parts = find_parts(body, body.inside, part_of);
  const auto largest = std::max_element(parts.begin(), parts.end(), [](const auto& a, const auto& b) {
    return (a.value != 0 ? a.voxels : 0) < (b.value != 0 ? b.voxels : 0);
  });
  const double limit = small_part * static_cast<double>(largest->voxels);
  const Index outside = part_of[0];

  std::vector<std::uint8_t> turned(parts.size(), 0);
  std::array<std::size_t, 2> turned_parts{}, turned_voxels{};
  for (std::size_t p = 0; p < parts.size(); ++p) {
    const Part<std::uint8_t>& part = parts[p];
    const bool is_small = static_cast<double>(part.voxels) < limit;
    if (part.value != 0 && &part != &*largest && !is_small) {
      throw Error(
          "the image holds disconnected parts: one of " + std::to_string(largest->voxels) + " voxels at " +
              shown(body, largest->first) + " and one of " + std::to_string(part.voxels) + " at " +
              shown(body, part.first) + " (image units)",
          where,
          "choose the labels of one organ by labels = [...] in [geometry]; of a grey image a range whose "
          "voxels hang together, or segment it");
    }
    if (is_small && static_cast<Index>(p) != outside) {
      turned[p] = 1;
      ++turned_parts[part.value];
      turned_voxels[part.value] += part.voxels;
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
      if (body.inside[v] == body.inside[v + stride[0]] && body.inside[v] == body.inside[v + stride[1]]) {
        continue;  // so no pair below differs along its first axis
      }
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

void complete_labels(VoxelBody& body, std::size_t smallest, std::vector<std::string>& notes) {
  for (std::size_t v = 0; v < body.labels.size(); ++v) {
    if (body.inside[v] == 0) {
      body.labels[v] = VoxelBody::no_label;
    }
  }
  for (const auto& [label, count] : unlabel_specks(body, smallest)) {
    notes.push_back(fmt::format(
        "{} voxel(s) of label {}, in {} part(s) too small for an element, went to the labels around them",
        count[0], label, count[1]));
  }
  spread_labels(body);
}

}  // namespace palpate
