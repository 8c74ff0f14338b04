#include "precompute/numerics/supernodal_sweeps.h"

#include <algorithm>

namespace palpate {
namespace {

const std::int64_t* row_positions(const cholmod_factor& L) {
  return static_cast<const std::int64_t*>(L.s);
}
const double* values(const cholmod_factor& L) {
  return static_cast<const double*>(L.x);
}

}  // namespace

SupernodalSweeps::SupernodalSweeps(const Factor& factor) : factor_(factor) {
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
    max_below_ = std::max(max_below_, node.below);
    std::fill(supernode_of_.begin() + node.first, supernode_of_.begin() + node.end(),
              static_cast<std::int64_t>(s));
  }
  for (Supernode& node : supernodes_) {  // children come before parents
    node.parent = node.below > 0 ? supernode_of(row_positions(L)[node.rows + node.columns]) : -1;
    if (node.parent < 0) continue;
    Supernode& parent = supernodes_[static_cast<std::size_t>(node.parent)];
    parent.subtree = std::min(parent.subtree, node.subtree);
  }
}

std::span<const std::int64_t> SupernodalSweeps::rows(const Supernode& s) const noexcept {
  return {row_positions(factor_.supernodal()) + s.rows, static_cast<std::size_t>(s.columns + s.below)};
}

void SupernodalSweeps::prepare(Workspace& workspace, std::int64_t width) const {
  const auto fit = [width](std::vector<double>& values, std::int64_t rows) {
    const auto size = static_cast<std::size_t>(rows * width);
    if (size > values.capacity()) values = {};  // frees the old array first
    values.resize(size);
  };
  fit(workspace.X, factor_.order());
  fit(workspace.below, max_below_);
}

std::int64_t SupernodalSweeps::workspace_bytes(std::int64_t width) const {
  return (factor_.order() + max_below_) * width * static_cast<std::int64_t>(sizeof(double));
}

void SupernodalSweeps::mark_path(std::int64_t position, std::vector<std::uint8_t>& marks) const {
  std::int64_t s = supernode_of(position);
  while (s >= 0 && !marks[static_cast<std::size_t>(s)]) {
    marks[static_cast<std::size_t>(s)] = 1;
    s = supernodes_[static_cast<std::size_t>(s)].parent;
  }
}

// BLAS sees the transposes: a row of X is a column of a column-major matrix.
void SupernodalSweeps::forward(const Supernode& s, std::int64_t active, std::int64_t width,
                               Workspace& workspace) const {
  const std::int64_t ld = s.columns + s.below;
  const double* L = values(factor_.supernodal()) + s.values;
  double* X = workspace.X.data() + s.first * width;
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, blas(active), blas(s.columns),
              1.0, L, blas(ld), X, blas(width));
  if (s.below == 0) return;
  double* update = workspace.below.data();
  cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, blas(active), blas(s.below), blas(s.columns), 1.0, X,
              blas(width), L + s.columns, blas(ld), 0.0, update, blas(active));
  const std::int64_t* rows = row_positions(factor_.supernodal()) + s.rows + s.columns;
  for (std::int64_t r = 0; r < s.below; ++r) {
    double* target = workspace.X.data() + rows[r] * width;
    const double* source = update + r * active;
    for (std::int64_t c = 0; c < active; ++c) target[c] -= source[c];
  }
}

void SupernodalSweeps::backward(const Supernode& s, bool on_path, std::int64_t active, std::int64_t width,
                                Workspace& workspace) const {
  const std::int64_t ld = s.columns + s.below;
  const double* L = values(factor_.supernodal()) + s.values;
  double* X = workspace.X.data() + s.first * width;
  const std::int64_t* rows = row_positions(factor_.supernodal()) + s.rows + s.columns;
  double* below = workspace.below.data();
  for (std::int64_t r = 0; r < s.below; ++r)
    std::copy_n(workspace.X.data() + rows[r] * width, active, below + r * active);
  if (s.below > 0) {
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasNoTrans, blas(active), blas(s.columns), blas(s.below), -1.0,
                below, blas(active), L + s.columns, blas(ld), on_path ? 1.0 : 0.0, X, blas(width));
  } else if (!on_path) {  // the root of another part of the body: held nodes can split K in two
    std::fill_n(X, s.columns * width, 0.0);
  }
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, blas(active),
              blas(s.columns), 1.0, L, blas(ld), X, blas(width));
}

}  // namespace palpate
