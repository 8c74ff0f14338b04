#include "precompute/geometry/sharp_edges.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr Index least = 3;   // [voxels] length of an edge, and distance from others that are not kept
constexpr Index beside = 2;  // [voxels] from an edge, where smoothing would change the faces

using Corner = std::array<Index, 3>;  // of voxels: the lowest of the voxel of this number

/// Edges of voxels along an axis that lie in one line, from one corner to another.
struct Run {
  std::size_t axis;
  Corner from, to;
};

/// Calls work(corner) for the corners from `low` to, but without, `high`.
template <typename Work>
void for_corners(const Corner& low, const Corner& high, const Work& work) {
  Corner at{};
  for (at[2] = low[2]; at[2] < high[2]; ++at[2]) {
    for (at[1] = low[1]; at[1] < high[1]; ++at[1]) {
      for (at[0] = low[0]; at[0] < high[0]; ++at[0]) work(at);
    }
  }
}

/// Runs of a body's voxels, less those beside which other edges are.
class EdgesOfVoxels {
 public:
  explicit EdgesOfVoxels(const VoxelBody& body) : body_(body), kept_(body.voxels()) {}

  std::vector<Run> find() {
    std::vector<Run> runs = find_runs();
    std::size_t before = 0;
    while (runs.size() != before) {
      before = runs.size();
      std::ranges::fill(kept_, 0);
      for (const Run& run : runs) keep(run);
      std::erase_if(runs, [&](const Run& run) { return has_others_beside(run); });
    }
    return runs;
  }

 private:
  [[nodiscard]] std::vector<Run> find_runs() const {
    std::vector<Run> runs;
    const std::size_t y = body_.at(0, 1, 0), z = body_.at(0, 0, 1);
    for_corners({1, 1, 1}, body_.size, [&](const Corner& at) {
      const std::uint8_t* v = body_.inside.data() + body_.at(at[0], at[1], at[2]);
      const int around = v[0] + *(v - 1) + *(v - y) + *(v - y - 1) + *(v - z) + *(v - z - 1) + *(v - z - y) +
                         *(v - z - y - 1);
      if (around == 0 || around == 8) return;
      for (std::size_t axis = 0; axis < 3; ++axis) add_run_from(axis, at, runs);
    });
    return runs;
  }

  /// Adds the run that begins at a corner, if one does.
  void add_run_from(std::size_t axis, const Corner& at, std::vector<Run>& runs) const {
    const unsigned voxels = voxels_about(axis, at);
    const bool is_diagonal = voxels == 0b0110 || voxels == 0b1001;
    if (voxels == 0 || is_diagonal) return;
    Run run{axis, at, at};
    --run.to[axis];
    if (voxels_about(axis, run.to) == voxels) return;
    do ++run.to[axis];
    while (run.to[axis] < body_.size[axis] && voxels_about(axis, run.to) == voxels);
    if (run.to[axis] - at[axis] >= least) runs.push_back(run);
  }

  /// Bits of those of the four voxels about the edge from a corner on that are inside; 0 if there is no edge.
  [[nodiscard]] unsigned voxels_about(std::size_t axis, const Corner& at) const {
    const std::size_t b = (axis + 1) % 3, c = (axis + 2) % 3;
    unsigned bits = 0;
    for (unsigned k = 0; k < 4; ++k) {
      Corner voxel = at;
      voxel[b] -= k % 2;
      voxel[c] -= k / 2;
      const bool is_in_grid = voxel[b] >= 0 && voxel[c] >= 0;
      if (is_in_grid && body_.inside[body_.at(voxel[0], voxel[1], voxel[2])] != 0) bits |= 1U << k;
    }
    const bool is_flat = bits == 0b0011 || bits == 0b1100 || bits == 0b0101 || bits == 0b1010;
    return is_flat || bits == 0b1111 ? 0 : bits;
  }

  void keep(const Run& run) {
    for (Corner at = run.from; at[run.axis] < run.to[run.axis]; ++at[run.axis])
      kept_[body_.at(at[0], at[1], at[2])] |= static_cast<std::uint8_t>(1U << run.axis);
  }

  [[nodiscard]] bool has_others_beside(const Run& run) const {
    bool has_others = false;
    Corner low = run.from, high = run.to;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (axis == run.axis) continue;
      low[axis] = std::max<Index>(low[axis] - least, 0);
      high[axis] = std::min(high[axis] + least, body_.size[axis] - 1);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Corner end = high;
      for (std::size_t other = 0; other < 3; ++other) end[other] += other == axis ? 0 : 1;
      for_corners(low, end, [&](const Corner& at) {
        const bool is_kept = (kept_[body_.at(at[0], at[1], at[2])] >> axis & 1) != 0;
        has_others = has_others || (!is_kept && voxels_about(axis, at) != 0);
      });
    }
    return has_others;
  }

  const VoxelBody& body_;
  std::vector<std::uint8_t> kept_;  // [voxels] a bit for each axis: the edge that begins at the lowest corner
};

}  // namespace

SharpEdges sharp_edges(const VoxelBody& body) {
  const std::vector<Run> runs = EdgesOfVoxels(body).find();
  SharpEdges sharp;
  if (!runs.empty()) sharp.known.assign(body.voxels(), SharpEdges::by_field);
  const auto place = [&](const Corner& corner) {
    Vec3 x = body.origin - 0.5 * body.spacing;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      x[a] += static_cast<double>(corner[axis]) * body.spacing[a];
    }
    return x;
  };
  for (const Run& run : runs) {
    sharp.edges.push_back({place(run.from), place(run.to)});
    Corner low = run.from, high = run.to;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (axis == run.axis) continue;
      low[axis] = std::max<Index>(low[axis] - beside, 0);
      high[axis] = std::min(high[axis] + beside, body.size[axis]);
    }
    for_corners(low, high, [&](const Corner& voxel) {
      const std::size_t v = body.at(voxel[0], voxel[1], voxel[2]);
      sharp.known[v] = body.inside[v] != 0 ? SharpEdges::inside : SharpEdges::outside;
    });
  }
  return sharp;
}

}  // namespace palpate
