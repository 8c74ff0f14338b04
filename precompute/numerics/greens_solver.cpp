#include "precompute/numerics/greens_solver.h"

#include <algorithm>

namespace palpate {
namespace {

/// Number of the ascending positions before `end`.
std::int64_t count_before(std::span<const std::int64_t> positions, std::int64_t end) {
  return std::lower_bound(positions.begin(), positions.end(), end) - positions.begin();
}

}  // namespace

GreensSolver::GreensSolver(const Factor& factor, const std::vector<std::uint8_t>& stored,
                           std::span<const std::int64_t> mesh_dofs, int d)
    : sweeps_(factor) {
  const std::span<const std::int64_t> permutation = factor.permutation();
  std::int64_t last_node = -1;
  for (std::size_t p = 0; p < permutation.size(); ++p) {
    const auto dof = static_cast<std::size_t>(permutation[p]);
    if (!stored[dof]) continue;
    if (const std::int64_t node = mesh_dofs[dof] / d; node != last_node) {
      place_.resize(place_.size() + static_cast<std::size_t>(d), -1);
      last_node = node;
    }
    place_[place_.size() - static_cast<std::size_t>(d - mesh_dofs[dof] % d)] =
        static_cast<std::int64_t>(positions_.size());
    positions_.push_back(static_cast<std::int64_t>(p));
  }
  free_before_.push_back(0);
  for (const std::int64_t place : place_) free_before_.push_back(free_before_.back() + (place < 0 ? 0 : 1));

  for (const Supernode& node : sweeps_.supernodes()) {
    const std::int64_t before = count_before(positions_, node.end());
    last_stored_.push_back(before > 0 ? positions_[static_cast<std::size_t>(before - 1)] : -1);
  }
}

std::vector<std::int64_t> GreensSolver::stored_dofs() const {
  std::vector<std::int64_t> dofs;
  dofs.reserve(place_.size());
  for (const std::int64_t place : place_) {
    dofs.push_back(place < 0 ? -1
                             : sweeps_.factor().permutation()[static_cast<std::size_t>(
                                   positions_[static_cast<std::size_t>(place)])]);
  }
  return dofs;
}

std::span<const std::int64_t> GreensSolver::free_positions(std::int64_t first, std::int64_t count) const {
  const std::int64_t begin = free_before_[static_cast<std::size_t>(first)];
  const std::int64_t end = free_before_[static_cast<std::size_t>(first + count)];
  return std::span(positions_)
      .subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
}

std::int64_t GreensSolver::workspace_bytes(std::int64_t width) const {
  return sweeps_.workspace_bytes(width) + order() * width * static_cast<std::int64_t>(sizeof(double));
}

void GreensSolver::mark_paths(std::span<const std::int64_t> block, std::vector<std::uint8_t>& on_path) const {
  on_path.assign(sweeps_.supernodes().size(), 0);
  for (const std::int64_t position : block) sweeps_.mark_path(position, on_path);
}

bool GreensSolver::needed(std::size_t supernode, std::int64_t first_position) const noexcept {
  return last_stored_[supernode] >= std::max(sweeps_.supernodes()[supernode].subtree, first_position);
}

double GreensSolver::flops(std::int64_t first, std::int64_t count) const {
  const std::span<const std::int64_t> block = free_positions(first, count);
  if (block.empty()) return 0.0;
  std::vector<std::uint8_t> on_path;
  mark_paths(block, on_path);
  double total = 0.0;
  for (auto s = static_cast<std::size_t>(sweeps_.supernode_of(block.front()));
       s < sweeps_.supernodes().size(); ++s) {
    const Supernode& node = sweeps_.supernodes()[s];
    const auto active = static_cast<double>(count_before(block, node.end()));
    const double sweep = active * static_cast<double>(node.columns * (node.columns + 2 * node.below));
    total += sweep * ((on_path[s] ? 1.0 : 0.0) + (needed(s, block.front()) ? 1.0 : 0.0));
  }
  return total;
}

void GreensSolver::columns(std::int64_t first, std::int64_t count, Workspace& workspace,
                           std::vector<double>& packed) const {
  const std::int64_t n = order();
  packed.assign(static_cast<std::size_t>(count * (n - first) - count * (count - 1) / 2), 0.0);
  const std::span<const std::int64_t> block = free_positions(first, count);
  if (block.empty()) return;
  const auto width = static_cast<std::int64_t>(block.size());
  sweeps_.prepare(workspace, width);
  mark_paths(block, workspace.on_path);
  const auto start = static_cast<std::size_t>(sweeps_.supernode_of(block.front()));
  const std::span<const Supernode> supernodes = sweeps_.supernodes();

  for (std::size_t s = start; s < supernodes.size(); ++s) {
    if (!workspace.on_path[s]) continue;
    std::fill_n(workspace.X.begin() + supernodes[s].first * width, supernodes[s].columns * width, 0.0);
  }
  for (std::int64_t c = 0; c < width; ++c)
    workspace.X[static_cast<std::size_t>(block[static_cast<std::size_t>(c)] * width + c)] = 1.0;

  for (std::size_t s = start; s < supernodes.size(); ++s) {
    if (workspace.on_path[s])
      sweeps_.forward(supernodes[s], count_before(block, supernodes[s].end()), width, workspace);
  }
  for (std::size_t s = supernodes.size(); s-- > start;) {
    if (!needed(s, block.front())) continue;
    sweeps_.backward(supernodes[s], workspace.on_path[s] != 0, count_before(block, supernodes[s].end()),
                     width, workspace);
  }

  constexpr std::int64_t tile =
      16;  // rows of X that are distributed to the columns at a time: each column gets a cache line
  const std::int64_t first_free = free_before_[static_cast<std::size_t>(first)];
  for (std::int64_t row = first; row < n; row += tile) {
    const std::int64_t row_end = std::min(row + tile, n);
    for (std::int64_t c = 0; c < count; ++c) {
      const std::int64_t right_hand_side = place_[static_cast<std::size_t>(first + c)] - first_free;
      if (right_hand_side < 0) continue;
      double* column = packed.data() + c * (n - first) - c * (c - 1) / 2;  // holds rows first + c .. n - 1
      for (std::int64_t r = std::max(row, first + c); r < row_end; ++r) {
        const std::int64_t place = place_[static_cast<std::size_t>(r)];
        if (place < 0) continue;
        const std::int64_t position = positions_[static_cast<std::size_t>(place)];
        column[r - first - c] = workspace.X[static_cast<std::size_t>(position * width + right_hand_side)];
      }
    }
  }
}

}  // namespace palpate
