#include "precompute/numerics/supernodal_sweeps.h"

#include <algorithm>
#include <type_traits>

#include "base/parallel.h"

namespace palpate {
namespace {

const std::int64_t* row_positions(const cholmod_factor& L) {
  return static_cast<const std::int64_t*>(L.s);
}

// BLAS sees the transposes: a row of X is a column of a column-major matrix.

/// C := alpha A op(B) + beta C, A [m x k], C [m x n].
void multiply(CBLAS_TRANSPOSE op, std::int64_t m, std::int64_t n, std::int64_t k, double alpha,
              const double* A, std::int64_t lda, const double* B, std::int64_t ldb, double beta, double* C,
              std::int64_t ldc) {
  cblas_dgemm(CblasColMajor, CblasNoTrans, op, blas(m), blas(n), blas(k), alpha, A, blas(lda), B, blas(ldb),
              beta, C, blas(ldc));
}
void multiply(CBLAS_TRANSPOSE op, std::int64_t m, std::int64_t n, std::int64_t k, float alpha, const float* A,
              std::int64_t lda, const float* B, std::int64_t ldb, float beta, float* C, std::int64_t ldc) {
  cblas_sgemm(CblasColMajor, CblasNoTrans, op, blas(m), blas(n), blas(k), alpha, A, blas(lda), B, blas(ldb),
              beta, C, blas(ldc));
}

/// X := X op(L), X [m x n].
void multiply_lower(CBLAS_TRANSPOSE op, std::int64_t m, std::int64_t n, const double* L, double* X,
                    std::int64_t ldx) {
  cblas_dtrmm(CblasColMajor, CblasRight, CblasLower, op, CblasNonUnit, blas(m), blas(n), 1.0, L, blas(n), X,
              blas(ldx));
}
void multiply_lower(CBLAS_TRANSPOSE op, std::int64_t m, std::int64_t n, const float* L, float* X,
                    std::int64_t ldx) {
  cblas_strmm(CblasColMajor, CblasRight, CblasLower, op, CblasNonUnit, blas(m), blas(n), 1.0F, L, blas(n), X,
              blas(ldx));
}

/// Inverts the lower triangle of L [n x n], by halves.
void invert(std::int64_t n, double* L, std::int64_t ld) {
  if (n == 1) {
    *L = 1.0 / *L;
    return;
  }
  const std::int64_t half = n / 2, rest = n - half;
  double *B = L + half, *C = B + half * ld;
  invert(half, L, ld);
  invert(rest, C, ld);
  cblas_dtrmm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, blas(rest), blas(half), -1.0,
              C, blas(ld), B, blas(ld));
  cblas_dtrmm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, blas(rest), blas(half), 1.0,
              L, blas(ld), B, blas(ld));
}

}  // namespace

SupernodalTree::SupernodalTree(const Factor& factor) : factor_(factor) {
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
    most_below_ = std::max(most_below_, node.below);
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

std::span<const std::int64_t> SupernodalTree::rows(const Supernode& s) const noexcept {
  return {row_positions(factor_.supernodal()) + s.rows, static_cast<std::size_t>(s.columns + s.below)};
}

void SupernodalTree::mark_path(std::int64_t position, std::vector<std::uint8_t>& marks) const {
  std::int64_t s = supernode_of(position);
  while (s >= 0 && !marks[static_cast<std::size_t>(s)]) {
    marks[static_cast<std::size_t>(s)] = 1;
    s = supernodes_[static_cast<std::size_t>(s)].parent;
  }
}

template <class Real>
SupernodalSweeps<Real>::SupernodalSweeps(const Factor& factor, int jobs) : SupernodalTree(factor) {
  const auto* values = static_cast<const double*>(factor.supernodal().x);
  if (values == nullptr) return;
  std::int64_t size = 0;
  for (const Supernode& s : supernodes()) {
    inverse_at_.push_back(size);
    size += s.columns * s.columns;
  }
  // Not zeroed, which one thread would do.
  inverse_ = std::make_unique_for_overwrite<Real[]>(static_cast<std::size_t>(size));
  constexpr bool rounded = std::is_same_v<Real, float>;
  if constexpr (rounded)
    copy_ = std::make_unique_for_overwrite<Real[]>(static_cast<std::size_t>(factor.entries()));
  parallel_for(std::ssize(supernodes()), jobs, [&](std::int64_t item, int) {
    const Supernode& s = supernodes()[static_cast<std::size_t>(item)];
    const std::int64_t ld = s.columns + s.below;
    const double* from = values + s.values;
    std::vector<double> block(static_cast<std::size_t>(s.columns * s.columns));
    for (std::int64_t j = 0; j < s.columns; ++j)
      std::copy_n(from + j * (ld + 1), s.columns - j, block.data() + j * (s.columns + 1));
    invert(s.columns, block.data(), s.columns);
    const auto as_real = [](double value) { return static_cast<Real>(value); };
    std::transform(block.begin(), block.end(), inverse_.get() + inverse_at_[static_cast<std::size_t>(item)],
                   as_real);
    if constexpr (rounded) std::transform(from, from + s.columns * ld, copy_.get() + s.values, as_real);
  });
}

template <class Real>
void SupernodalSweeps<Real>::divide(const Supernode& s, CBLAS_TRANSPOSE op, std::int64_t active,
                                    std::int64_t width, Real* X) const {
  if (inverse_ != nullptr) {
    const auto number = static_cast<std::size_t>(&s - supernodes().data());
    multiply_lower(op, active, s.columns, inverse_.get() + inverse_at_[number], X, width);
  } else if constexpr (std::is_same_v<Real, double>) {
    cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, op, CblasNonUnit, blas(active), blas(s.columns), 1.0,
                static_cast<const double*>(factor().supernodal().x) + s.values, blas(s.columns + s.below), X,
                blas(width));
  }
}

template <class Real>
const Real* SupernodalSweeps<Real>::below(const Supernode& s) const noexcept {
  if constexpr (std::is_same_v<Real, float>)
    return copy_.get() + s.values + s.columns;
  else
    return static_cast<const double*>(factor().supernodal().x) + s.values + s.columns;
}

template <class Real>
void SupernodalSweeps<Real>::prepare(Workspace& workspace, std::int64_t width) const {
  const auto fit = [width](std::vector<Real>& values, std::int64_t rows) {
    const auto size = static_cast<std::size_t>(rows * width);
    if (size > values.capacity()) values = {};  // frees the old array first
    values.resize(size);
  };
  fit(workspace.X, factor().order());
  fit(workspace.below, most_below());
}

template <class Real>
std::int64_t SupernodalSweeps<Real>::workspace_bytes(std::int64_t width) const {
  return (factor().order() + most_below()) * width * static_cast<std::int64_t>(sizeof(Real));
}

/// `row_of` is the row of X of a position.
template <class Real>
template <class RowOf>
void SupernodalSweeps<Real>::forward_rows(const Supernode& s, std::int64_t active, std::int64_t width,
                                          Real* X, Real* update, const RowOf& row_of) const {
  const std::int64_t ld = s.columns + s.below;
  Real* X_s = X + row_of(s.first) * width;
  divide(s, CblasTrans, active, width, X_s);
  if (s.below == 0) return;
  multiply(CblasTrans, active, s.below, s.columns, Real(1), X_s, width, below(s), ld, Real(0), update,
           active);
  for (const std::int64_t position : rows(s).subspan(static_cast<std::size_t>(s.columns))) {
    Real* target = X + row_of(position) * width;
    for (std::int64_t c = 0; c < active; ++c) target[c] -= update[c];
    update += active;
  }
}

template <class Real>
void SupernodalSweeps<Real>::forward(const Supernode& s, std::int64_t active, std::int64_t width,
                                     Workspace& workspace) const {
  forward_rows(s, active, width, workspace.X.data(), workspace.below.data(),
               [](std::int64_t position) { return position; });
}

template <class Real>
void SupernodalSweeps<Real>::forward(const Supernode& s, std::span<const std::int64_t> row,
                                     std::int64_t begin, std::int64_t end, std::int64_t width, Real* X,
                                     std::vector<Real>& below) const {
  const auto size = static_cast<std::size_t>(most_below() * (end - begin));
  if (below.size() < size) below.resize(size);
  forward_rows(s, end - begin, width, X + begin, below.data(), [&](std::int64_t position) {
    const auto of = static_cast<std::size_t>(supernode_of(position));
    return row[of] + position - supernodes()[of].first;
  });
}

template <class Real>
void SupernodalSweeps<Real>::backward(const Supernode& s, bool on_path, std::int64_t active,
                                      std::int64_t width, Workspace& workspace) const {
  const std::int64_t ld = s.columns + s.below;
  Real* X = workspace.X.data() + s.first * width;
  Real* gathered = workspace.below.data();
  for (const std::int64_t position : rows(s).subspan(static_cast<std::size_t>(s.columns)))
    gathered = std::copy_n(workspace.X.data() + position * width, active, gathered);
  if (s.below > 0) {
    multiply(CblasNoTrans, active, s.columns, s.below, Real(-1), workspace.below.data(), active, below(s), ld,
             on_path ? Real(1) : Real(0), X, width);
  } else if (!on_path) {  // the root of another part of the body: held nodes can split K in two
    std::fill_n(X, s.columns * width, Real(0));
  }
  divide(s, CblasNoTrans, active, width, X);
}

template class SupernodalSweeps<double>;
template class SupernodalSweeps<float>;

}  // namespace palpate
