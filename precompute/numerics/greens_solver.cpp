#include "precompute/numerics/greens_solver.h"

#include <cblas.h>

#include <algorithm>

namespace palpate {
namespace {

const std::int64_t* row_positions(const cholmod_factor& L) {
  return static_cast<const std::int64_t*>(L.s);
}
const double* values(const cholmod_factor& L) {
  return static_cast<const double*>(L.x);
}
blasint blas(std::int64_t i) {
  return static_cast<blasint>(i);
}

/// How many of the ascending positions are before `end`.
std::int64_t count_before(std::span<const std::int64_t> positions, std::int64_t end) {
  return std::lower_bound(positions.begin(), positions.end(), end) - positions.begin();
}

}  // namespace

GreensSolver::GreensSolver(const Factor& factor, const std::vector<std::uint8_t>& stored,
                           std::span<const std::int64_t> mesh_dofs, int d)
    : factor_(factor) {
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

  const cholmod_factor& L = factor.supernodal();
  const auto* super = static_cast<const std::int64_t*>(L.super);
  const auto* pi = static_cast<const std::int64_t*>(L.pi);
  const auto* px = static_cast<const std::int64_t*>(L.px);
  supernodes_.resize(L.nsuper);
  supernode_of_.resize(L.n);
  for (std::size_t s = 0; s < L.nsuper; ++s) {
    Supernode& node = supernodes_[s];
    node.first = super[s];
    node.columns = super[s + 1] - super[s];
    node.below = pi[s + 1] - pi[s] - node.columns;
    node.rows = pi[s];
    node.values = px[s];
    node.subtree = node.first;
    const std::int64_t stored_before = count_before(positions_, node.end());
    node.last_stored = stored_before > 0 ? positions_[static_cast<std::size_t>(stored_before - 1)] : -1;
    max_below_ = std::max(max_below_, node.below);
    std::fill(supernode_of_.begin() + node.first, supernode_of_.begin() + node.end(),
              static_cast<std::int64_t>(s));
  }
  for (Supernode& node : supernodes_) {  // children come before parents
    node.parent = node.below > 0
                      ? supernode_of_[static_cast<std::size_t>(row_positions(L)[node.rows + node.columns])]
                      : -1;
    if (node.parent < 0) continue;
    Supernode& parent = supernodes_[static_cast<std::size_t>(node.parent)];
    parent.subtree = std::min(parent.subtree, node.subtree);
  }
}

std::vector<std::int64_t> GreensSolver::stored_dofs() const {
  std::vector<std::int64_t> dofs;
  dofs.reserve(place_.size());
  for (const std::int64_t place : place_) {
    dofs.push_back(
        place < 0
            ? -1
            : factor_.permutation()[static_cast<std::size_t>(positions_[static_cast<std::size_t>(place)])]);
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
  return (factor_.order() + max_below_ + order()) * width * static_cast<std::int64_t>(sizeof(double));
}

void GreensSolver::mark_paths(std::span<const std::int64_t> block, std::vector<std::uint8_t>& on_path) const {
  on_path.assign(supernodes_.size(), 0);
  for (const std::int64_t position : block) {
    std::int64_t s = supernode_of_[static_cast<std::size_t>(position)];
    while (s >= 0 && !on_path[static_cast<std::size_t>(s)]) {
      on_path[static_cast<std::size_t>(s)] = 1;
      s = supernodes_[static_cast<std::size_t>(s)].parent;
    }
  }
}

bool GreensSolver::needed(const Supernode& s, std::int64_t first_position) const noexcept {
  return s.last_stored >= std::max(s.subtree, first_position);
}

double GreensSolver::flops(std::int64_t first, std::int64_t count) const {
  const std::span<const std::int64_t> block = free_positions(first, count);
  if (block.empty()) return 0.0;
  std::vector<std::uint8_t> on_path;
  mark_paths(block, on_path);
  double total = 0.0;
  for (auto s = static_cast<std::size_t>(supernode_of_[static_cast<std::size_t>(block.front())]);
       s < supernodes_.size(); ++s) {
    const Supernode& node = supernodes_[s];
    const auto active = static_cast<double>(count_before(block, node.end()));
    const double sweep = active * static_cast<double>(node.columns * (node.columns + 2 * node.below));
    total += sweep * ((on_path[s] ? 1.0 : 0.0) + (needed(node, block.front()) ? 1.0 : 0.0));
  }
  return total;
}

// X_s := L_ss^-1 X_s, then X_below -= L_bs X_s. BLAS sees the transposes: a row of X is a column of a
// column-major matrix.
void GreensSolver::forward(const Supernode& s, std::int64_t active, std::int64_t width,
                           Workspace& workspace) const {
  const std::int64_t ld = s.columns + s.below;
  const double* L = values(factor_.supernodal()) + s.values;
  double* X = workspace.X_.data() + s.first * width;
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, blas(active), blas(s.columns),
              1.0, L, blas(ld), X, blas(width));
  if (s.below == 0) return;
  double* update = workspace.below_.data();
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, blas(active), blas(s.below), blas(s.columns), 1.0, X,
              blas(width), L + s.columns, blas(ld), 0.0, update, blas(active));
  const std::int64_t* rows = row_positions(factor_.supernodal()) + s.rows + s.columns;
  for (std::int64_t r = 0; r < s.below; ++r) {
    double* target = workspace.X_.data() + rows[r] * width;
    const double* source = update + r * active;
    for (std::int64_t c = 0; c < active; ++c) target[c] -= source[c];
  }
}

// X_s := L_ss^-T (X_s - L_bs^T X_below).
void GreensSolver::backward(const Supernode& s, bool on_path, std::int64_t active, std::int64_t width,
                            Workspace& workspace) const {
  const std::int64_t ld = s.columns + s.below;
  const double* L = values(factor_.supernodal()) + s.values;
  double* X = workspace.X_.data() + s.first * width;
  const std::int64_t* rows = row_positions(factor_.supernodal()) + s.rows + s.columns;
  double* below = workspace.below_.data();
  for (std::int64_t r = 0; r < s.below; ++r)
    std::copy_n(workspace.X_.data() + rows[r] * width, active, below + r * active);
  if (s.below > 0) {
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, blas(active), blas(s.columns), blas(s.below), -1.0,
                below, blas(active), L + s.columns, blas(ld), on_path ? 1.0 : 0.0, X, blas(width));
  } else if (!on_path) {  // the root of another part of the body: clamped nodes can cut K in two
    std::fill_n(X, s.columns * width, 0.0);
  }
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, blas(active),
              blas(s.columns), 1.0, L, blas(ld), X, blas(width));
}

void GreensSolver::columns(std::int64_t first, std::int64_t count, Workspace& workspace,
                           std::vector<double>& packed) const {
  const std::int64_t n = order();
  packed.assign(static_cast<std::size_t>(count * (n - first) - count * (count - 1) / 2), 0.0);
  const std::span<const std::int64_t> block = free_positions(first, count);
  if (block.empty()) return;
  const auto width = static_cast<std::int64_t>(block.size());
  workspace.X_.resize(static_cast<std::size_t>(factor_.order() * width));
  workspace.below_.resize(static_cast<std::size_t>(max_below_ * width));
  mark_paths(block, workspace.on_path_);
  const std::int64_t start = supernode_of_[static_cast<std::size_t>(block.front())];
  const auto supernodes = static_cast<std::int64_t>(supernodes_.size());

  for (std::int64_t s = start; s < supernodes; ++s) {
    if (!workspace.on_path_[static_cast<std::size_t>(s)]) continue;
    const Supernode& node = supernodes_[static_cast<std::size_t>(s)];
    std::fill_n(workspace.X_.begin() + node.first * width, node.columns * width, 0.0);
  }
  for (std::int64_t c = 0; c < width; ++c) {
    workspace.X_[static_cast<std::size_t>(block[static_cast<std::size_t>(c)] * width + c)] = 1.0;
  }

  for (std::int64_t s = start; s < supernodes; ++s) {
    if (!workspace.on_path_[static_cast<std::size_t>(s)]) continue;
    const Supernode& node = supernodes_[static_cast<std::size_t>(s)];
    forward(node, count_before(block, node.end()), width, workspace);
  }
  for (std::int64_t s = supernodes - 1; s >= start; --s) {
    const Supernode& node = supernodes_[static_cast<std::size_t>(s)];
    if (!needed(node, block.front())) continue;
    const bool on_path = workspace.on_path_[static_cast<std::size_t>(s)] != 0;
    backward(node, on_path, count_before(block, node.end()), width, workspace);
  }

  constexpr std::int64_t tile =
      16;  // rows of X that are spread over the columns at a time: each column gets a cache line
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
        column[r - first - c] = workspace.X_[static_cast<std::size_t>(position * width + right_hand_side)];
      }
    }
  }
}

}  // namespace palpate
