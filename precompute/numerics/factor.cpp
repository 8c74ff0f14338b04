#include "precompute/numerics/factor.h"

#include <fmt/format.h>

#include "base/error.h"

namespace palpate {
namespace {

cholmod_sparse view(const SparseMatrix& A, int values) {
  cholmod_sparse view{};
  view.nrow = static_cast<std::size_t>(A.rows());
  view.ncol = static_cast<std::size_t>(A.cols());
  view.nzmax = static_cast<std::size_t>(A.nonZeros());
  view.p = const_cast<std::int64_t*>(A.outerIndexPtr());
  view.i = const_cast<std::int64_t*>(A.innerIndexPtr());
  view.x = values == CHOLMOD_PATTERN ? nullptr : const_cast<double*>(A.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_LONG;
  view.xtype = values;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

/// Lower pattern of the node graph: the first dof of every node represents it.
SparseMatrix node_graph(const SparseMatrix& K, std::span<const std::int64_t> node_start) {
  const auto nodes = static_cast<std::int64_t>(node_start.size()) - 1;
  std::vector<std::int64_t> node_of_first(static_cast<std::size_t>(K.rows()), -1);
  for (std::int64_t a = 0; a < nodes; ++a) {
    node_of_first[static_cast<std::size_t>(node_start[static_cast<std::size_t>(a)])] = a;
  }
  std::vector<Eigen::Triplet<double, std::int64_t>> edges;
  for (std::int64_t a = 0; a < nodes; ++a) {
    for (SparseMatrix::InnerIterator entry(K, node_start[static_cast<std::size_t>(a)]); entry; ++entry) {
      const std::int64_t b = node_of_first[static_cast<std::size_t>(entry.row())];
      if (b >= 0) edges.emplace_back(b, a, 1.0);
    }
  }
  SparseMatrix graph(nodes, nodes);
  graph.setFromTriplets(edges.begin(), edges.end());
  return graph;
}

Error out_of_memory(const cholmod_common& common) {
  return {fmt::format("CHOLMOD ran out of memory (status {}, {:.2f} GB in use)", common.status,
                      static_cast<double>(common.memory_inuse) / 1e9),
          "factorisation of K",
          "Use a coarser mesh (mesh.edge_length) or a stronger grading, or a machine with more memory"};
}

}  // namespace

Factor::Factor(const SparseMatrix& K, std::span<const std::int64_t> node_start) : K_(K) {
  cholmod_l_start(&common_);
  common_.print = 0;
  common_.supernodal = CHOLMOD_SUPERNODAL;
  common_.nmethods = 1;
  common_.method[0].ordering = CHOLMOD_GIVEN;
  common_.postorder = 1;

  const SparseMatrix graph = node_graph(K, node_start);
  cholmod_sparse graph_view = view(graph, CHOLMOD_PATTERN);
  std::vector<std::int64_t> node_order(static_cast<std::size_t>(graph.cols()));
  bool ok = cholmod_l_metis(&graph_view, nullptr, 0, 1, node_order.data(), &common_) != 0;
  if (ok) {
    std::vector<std::int64_t> dof_order;
    dof_order.reserve(static_cast<std::size_t>(K.rows()));
    for (const std::int64_t node : node_order) {
      const auto a = static_cast<std::size_t>(node);
      for (std::int64_t dof = node_start[a]; dof < node_start[a + 1]; ++dof) dof_order.push_back(dof);
    }
    cholmod_sparse K_view = view(K, CHOLMOD_REAL);
    factor_ = cholmod_l_analyze_p(&K_view, dof_order.data(), nullptr, 0, &common_);
    ok = factor_ != nullptr;
  }
  if (!ok) {
    const Error error = out_of_memory(common_);
    cholmod_l_finish(&common_);
    throw error;
  }
}

Factor::~Factor() {
  cholmod_l_free_factor(&factor_, &common_);
  cholmod_l_finish(&common_);
}

void Factor::factorize() {
  if (spread_) return spread_->factorize();
  cholmod_sparse K_view = view(K_, CHOLMOD_REAL);
  cholmod_l_factorize(&K_view, factor_, &common_);
  if (common_.status == CHOLMOD_NOT_POSDEF) {
    throw Error(fmt::format("K is not positive definite (column {} of {})", factor_->minor, factor_->n),
                "factorisation of K",
                "Hold the body against every rigid motion, and look at the worst element of the mesh");
  }
  if (common_.status < CHOLMOD_OK) throw out_of_memory(common_);
}

std::vector<double> Factor::solve(std::span<const double> b, std::int64_t columns) const {
  if (spread_) return spread_->solve(b, columns);
  cholmod_dense rhs{};
  rhs.nrow = static_cast<std::size_t>(order());
  rhs.ncol = static_cast<std::size_t>(columns);
  rhs.nzmax = b.size();
  rhs.d = rhs.nrow;
  rhs.x = const_cast<double*>(b.data());
  rhs.xtype = CHOLMOD_REAL;
  rhs.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_l_solve(CHOLMOD_A, factor_, &rhs, &common_);
  if (x == nullptr) throw out_of_memory(common_);
  const auto* values = static_cast<const double*>(x->x);
  std::vector<double> result(values, values + b.size());
  cholmod_l_free_dense(&x, &common_);
  return result;
}

std::int64_t Factor::entries() const noexcept {
  return static_cast<std::int64_t>(factor_->xsize);
}

double Factor::flops() const noexcept {
  const auto* first = static_cast<const std::int64_t*>(factor_->super);
  const auto* rows = static_cast<const std::int64_t*>(factor_->pi);
  double total = 0.0;
  for (std::size_t s = 0; s < factor_->nsuper; ++s) {
    const auto columns = static_cast<double>(first[s + 1] - first[s]);
    const double below = static_cast<double>(rows[s + 1] - rows[s]) - columns;
    total += columns * (columns * columns / 3.0 + below * (columns + below));  // factor, solve, update
  }
  return total;
}

std::span<const std::int64_t> Factor::permutation() const noexcept {
  return {static_cast<const std::int64_t*>(factor_->Perm), factor_->n};
}

}  // namespace palpate
