#include "precompute/compression/compression.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include "base/parallel.h"
#include "precompute/compression/float_entries.h"
#include "precompute/compression/recompression.h"

namespace palpate {
namespace {

using Dofs = std::vector<std::int64_t>;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double skeleton_share = 0.2;        // of the cut: skeletons must not add to the error
constexpr Index leaves_estimated = 64;        // to estimate flops
constexpr std::int64_t loads_at_once = 32;    // solved together
constexpr std::int64_t checked_at_once = 8;   // of these, by a thread
constexpr Index checks = 32;                  // more loads, to measure the error of the pairs
constexpr double near_work = 1.6;             // of forward solutions: some are made twice, and multiplied
constexpr std::int64_t solutions_in_use = 3;  // of a thread (measured with 1 to 16 threads)
constexpr std::int64_t near_forward = 2;      // times the memory, as random loads need none yet
constexpr double single_share = 0.3;          // of the skeletons' cut, that single precision may add

/// Xi f for loads f [order x loads]: up the tree, across the far pairs, down the tree, and the near pairs.
DoubleRows product(const HierarchicalMatrix& matrix, const DoubleRows& f, int jobs) {
  const ClusterTree& tree = matrix.tree;
  std::vector<DoubleRows> strength(at(tree.clusters())), terms(at(tree.clusters()));
  DoubleRows u(f.rows(), f.cols());
  const auto rows_of = [&](Index leaf) { return end_dof(matrix, leaf) - first_dof(matrix, leaf); };
  const auto V = [&](Index leaf) {
    const float* entries = matrix.basis.get() + matrix.basis_at[at(leaf - tree.first_leaf())];
    return Eigen::Map<const FloatRows>(entries, rows_of(leaf), matrix.rank[at(leaf)]).cast<double>();
  };
  const auto E = [&](Index c) {
    const float* entries = matrix.transfer.get() + matrix.transfer_at[at(c)];
    return Eigen::Map<const FloatRows>(entries, matrix.rank[at(c)], matrix.rank[at(ClusterTree::parent(c))])
        .cast<double>();
  };
  const auto for_level = [&](int level, const auto& work) {
    const Index first = tree.first_of_level(level);
    parallel_for(Index{1} << level, jobs, [&](std::int64_t k, int) { work(first + static_cast<Index>(k)); });
  };
  for_level(tree.levels, [&](Index leaf) {
    strength[at(leaf)] = V(leaf).transpose() * f.middleRows(first_dof(matrix, leaf), rows_of(leaf));
  });
  for (int level = tree.levels - 1; level > 0; --level) {
    for_level(level, [&](Index c) {
      strength[at(c)] = E(2 * c + 1).transpose() * strength[at(2 * c + 1)] +
                        E(2 * c + 2).transpose() * strength[at(2 * c + 2)];
    });
  }
  for (int level = 0; level <= tree.levels; ++level) {
    for_level(level, [&](Index c) {
      terms[at(c)] = DoubleRows::Zero(matrix.rank[at(c)], f.cols());
      if (c > 0) terms[at(c)] += E(c) * terms[at(ClusterTree::parent(c))];
      for (const auto& [other, pair] : partners(matrix, c)) {
        const float* entries = matrix.coupling.get() + matrix.coupling_at[at(pair)];
        const Index own = matrix.rank[at(c)], others = matrix.rank[at(other)];
        if (c > other) {
          terms[at(c)] +=
              Eigen::Map<const FloatRows>(entries, own, others).cast<double>() * strength[at(other)];
        } else {
          terms[at(c)] += Eigen::Map<const FloatRows>(entries, others, own).cast<double>().transpose() *
                          strength[at(other)];
        }
      }
    });
  }
  for_level(tree.levels, [&](Index leaf) {
    u.middleRows(first_dof(matrix, leaf), rows_of(leaf)) =
        near_displacement(matrix, leaf, f) + V(leaf) * terms[at(leaf)];
  });
  return u;
}

}  // namespace

Compression::Compression(const Factor& factor, std::span<const std::int64_t> stored_dofs, int dimension,
                         const ClusteredNodes& nodes, Sharing& sharing, std::int64_t forward_bytes,
                         CompressionProgress progress)
    : solver_(factor, sharing.jobs()),
      stored_dofs_(stored_dofs),
      sharing_(sharing),
      progress_(std::move(progress)),
      matrix_(compression_frame(nodes, dimension)),
      forward_bytes_(forward_bytes),
      near_solver_(std::make_unique<BlockSolver<double>>(
          solver_, matrix_.tree, matrix_.tree.levels, sharing.jobs(), near_forward * forward_bytes,
          [this](Index leaf) {
            const auto dofs = stored_dofs_.subspan(at(first_dof(matrix_, leaf)),
                                                   at(end_dof(matrix_, leaf) - first_dof(matrix_, leaf)));
            return Dofs(dofs.begin(), dofs.end());
          })) {}

/// First entry of the near pairs of a leaf [0, leaves); the entries of the next leaf follow.
std::int64_t Compression::near_begin(Index leaf) const {
  return matrix_.near_at[at(matrix_.first_near_pair(leaf))];
}

void Compression::solve_near(Index leaf, int worker, std::vector<float>& entries) {
  entries.resize(at(near_begin(leaf + 1) - near_begin(leaf)));
  solve_near_of(matrix_.tree.first_leaf() + leaf, worker, entries);
}

bool Compression::gather_near(const FetchNear& fetch) {
  const std::shared_ptr<float[]> near = floats(matrix_.near_at.back());
  const auto entries_of = [&](std::int64_t leaf) {
    const std::int64_t begin = near_begin(static_cast<Index>(leaf)),
                       end = near_begin(static_cast<Index>(leaf) + 1);
    return std::span(near.get() + begin, at(end - begin));
  };
  SharedItems leaves;
  leaves.count = matrix_.tree.leaves();
  leaves.work = [&](std::int64_t leaf, int worker) {
    if (fetch) {
      fetch(static_cast<Index>(leaf), entries_of(leaf));
    } else {
      solve_near_of(matrix_.tree.first_leaf() + static_cast<Index>(leaf), worker, entries_of(leaf));
    }
  };
  leaves.carry = [&](std::int64_t leaf, Parcel& results) { results.carry(entries_of(leaf)); };
  if (!fetch) leaves.done = [&](double share) { return progress_(CompressionStage::near, share); };
  if (!sharing_.for_each(leaves)) return false;
  matrix_.near = near;
  const std::vector<double> root = root_of_diagonal(matrix_);
  root_ = Eigen::Map<const Eigen::VectorXd>(root.data(), std::ssize(root));
  return true;
}

/// Solves for the pairs with the leaf as column.
void Compression::solve_near_of(Index leaf, int worker, std::span<float> entries) {
  const std::int64_t width = end_dof(matrix_, leaf) - first_dof(matrix_, leaf);
  std::vector<Index> rows;
  for (const auto& [row, pair] : neighbours(matrix_, leaf))
    if (row >= leaf) rows.push_back(row);
  std::vector<double> block(entries.size());
  near_solver_->solve(rows, leaf, worker, block);
  std::transform(block.begin(), block.end(), entries.begin(),
                 [](double value) { return static_cast<float>(value); });
  for (std::int64_t i = 0; i < width; ++i)  // the leaf with itself comes first
    for (std::int64_t j = i + 1; j < width; ++j) entries[at(i * width + j)] = entries[at(j * width + i)];
}

/// Makes loads L^-T (+-1) on every leaf, with L its Cholesky factor, and solves for their responses.
bool Compression::sample() {
  const std::int64_t n = matrix_.order(), m = random_loads + checks;
  load_.resize(n, m);
  response_.resize(n, m);
  parallel_for(matrix_.tree.leaves(), sharing_.jobs(), [&](std::int64_t leaf, int) {
    const Index c = matrix_.tree.first_leaf() + static_cast<Index>(leaf);
    std::mt19937_64 random(20261125 + static_cast<std::uint64_t>(leaf));
    for (std::int64_t i = first_dof(matrix_, c); i < end_dof(matrix_, c); ++i)
      for (std::int64_t k = 0; k < m; ++k)
        load_(i, k) = root_[i] > 0.0 ? ((random() >> 63) != 0 ? 1.0 : -1.0) : 0.0;
    auto of_leaf = load_.middleRows(first_dof(matrix_, c), end_dof(matrix_, c) - first_dof(matrix_, c));
    const Eigen::MatrixXd L = root_of_leaf(matrix_, static_cast<Index>(leaf));
    L.transpose().triangularView<Eigen::Upper>().solveInPlace(of_leaf);
  });
  const auto of_block = [&](std::int64_t block) {
    return response_.middleCols(block * loads_at_once, loads_at_once);
  };
  std::vector<SelectedSolver::Workspace> workspaces(at(sharing_.jobs()));
  SharedItems blocks;
  blocks.count = m / loads_at_once;
  blocks.work = [&](std::int64_t block, int worker) {
    const DoubleRows f = load_.middleCols(block * loads_at_once, loads_at_once);
    DoubleRows u(n, loads_at_once);
    solver_.multiply(stored_dofs_, loads_at_once, {f.data(), at(f.size())}, workspaces[at(worker)],
                     {u.data(), at(u.size())});
    of_block(block) = u;
  };
  blocks.carry = [&](std::int64_t block, Parcel& results) {
    DoubleRows u = of_block(block);
    results.carry(u);
    of_block(block) = u;
  };
  blocks.done = [&](double share) { return progress_(CompressionStage::samples, share); };
  return sharing_.for_each(blocks);
}

/// Root mean squares, over some loads, of the rows of L^-1 u, for displacements u [order x loads].
Eigen::VectorXd Compression::weighed_rows(DoubleRows u) const {
  Eigen::VectorXd rows(u.rows());
  parallel_for(matrix_.tree.leaves(), sharing_.jobs(), [&](std::int64_t leaf, int) {
    const Index c = matrix_.tree.first_leaf() + static_cast<Index>(leaf);
    const std::int64_t first = first_dof(matrix_, c), count = end_dof(matrix_, c) - first;
    auto of_leaf = u.middleRows(first, count);
    root_of_leaf(matrix_, static_cast<Index>(leaf)).triangularView<Eigen::Lower>().solveInPlace(of_leaf);
    rows.segment(first, count) = of_leaf.rowwise().norm() / std::sqrt(double(u.cols()));
  });
  return rows;
}

/// Measures what solves in single precision are off by.
void Compression::try_single() {
  if (solver_.factor().spread_numbers() != nullptr) return;  // it has no numbers to round
  const SelectedSolverOf<float> solver(solver_.factor(), sharing_.jobs());
  std::vector<SelectedSolverOf<float>::Workspace> workspaces(at(sharing_.jobs()));
  DoubleRows off = response_.rightCols(checks);
  parallel_for(checks / checked_at_once, sharing_.jobs(), [&](std::int64_t block, int worker) {
    const std::int64_t first = block * checked_at_once;
    const FloatRows f = load_.middleCols(random_loads + first, checked_at_once).cast<float>();
    FloatRows u(f.rows(), f.cols());
    solver.multiply(stored_dofs_, f.cols(), {f.data(), at(f.size())}, workspaces[at(worker)],
                    {u.data(), at(u.size())});
    off.middleCols(first, checked_at_once) -= u.cast<double>();
  });
  const Eigen::VectorXd rows = weighed_rows(std::move(off));
  single_error_ = 0.0;
  for (Index c = matrix_.tree.first_leaf(); c < matrix_.tree.clusters(); ++c) {
    const std::int64_t first = first_dof(matrix_, c), count = end_dof(matrix_, c) - first;
    single_error_ = std::max(single_error_, rows.segment(first, count).norm() / std::sqrt(double(count)));
  }
}

bool Compression::prepare(const FetchNear& fetch) {
  if (!gather_near(fetch)) return false;
  near_solver_.reset();  // frees its memory
  if (!sample()) return false;
  try_single();
  return true;
}

std::shared_ptr<HierarchicalMatrix> Compression::compress(double cut) {
  const double cut_of_skeletons = skeleton_share * cut;
  const bool single = single_error_ <= single_share * cut_of_skeletons;
  std::optional<HierarchicalMatrix> matrix = with_far_pairs(
      {solver_, single, forward_bytes_, stored_dofs_, matrix_, root_, load_, response_}, cut_of_skeletons,
      sharing_, [&](double share) { return progress_(CompressionStage::far, share); });
  if (matrix) matrix = recompressed(*std::move(matrix), cut, sharing_);
  if (!matrix) return nullptr;
  check(*matrix);
  return std::make_shared<HierarchicalMatrix>(*std::move(matrix));
}

/// Adds the errors of the skeletons to pair_error: the error that loads not used for choosing show beyond
/// pair_error is distributed in proportion to the pairs' couplings, since their bases are orthonormal in the
/// norms of L.
void Compression::check(HierarchicalMatrix& matrix) const {
  DoubleRows missing =
      response_.rightCols(checks) - product(matrix, load_.rightCols(checks), sharing_.jobs());
  const double measured = weighed_rows(std::move(missing)).squaredNorm();
  std::vector<double> of_pair(matrix.pair_error.size());
  for (std::size_t p = 0; p < of_pair.size(); ++p) {
    const std::span entries(matrix.coupling.get() + matrix.coupling_at[p],
                            matrix.coupling.get() + matrix.coupling_at[p + 1]);
    for (const float entry : entries) of_pair[p] += double{entry} * double{entry};
  }
  const double whole = std::accumulate(of_pair.begin(), of_pair.end(), 0.0);
  double known = 0.0;
  for (const double e : matrix.pair_error) known += e * e;
  const double share = whole > 0.0 ? std::max(0.5 * measured - known, 0.0) / whole : 0.0;
  for (std::size_t p = 0; p < of_pair.size(); ++p)
    matrix.pair_error[p] = std::hypot(matrix.pair_error[p], std::sqrt(share * of_pair[p]));
}

HierarchicalMatrix compression_frame(const ClusteredNodes& nodes, int dimension) {
  HierarchicalMatrix frame;
  frame.dimension = dimension;
  frame.tree = nodes.tree;
  frame.near_pair = nodes.near_pair;
  frame.far_pair = nodes.far_pair;
  frame.rank.assign(at(nodes.tree.clusters()), 0);
  frame.index();
  return frame;
}

double near_flops(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                  const HierarchicalMatrix& frame) {
  const SelectedSolver solver(factor);
  const ClusterTree& tree = frame.tree;
  const Index step = std::max<Index>(1, tree.leaves() / leaves_estimated);
  double flops = 0.0;
  Index counted = 0;
  for (Index c = tree.first_leaf(); c < tree.clusters(); c += step, ++counted)
    flops += solver.forward_flops(
        stored_dofs.subspan(at(first_dof(frame, c)), at(end_dof(frame, c) - first_dof(frame, c))));
  return near_work * flops * static_cast<double>(tree.leaves()) / static_cast<double>(counted);
}

std::int64_t compression_workspace(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                                   const HierarchicalMatrix& frame) {
  const SelectedSolver solver(factor);
  const ClusterTree& tree = frame.tree;
  const Index together = clusters_together(tree.levels);
  std::int64_t forward = 0;
  for (Index c = tree.first_leaf(); c < tree.clusters(); c += together) {
    const std::int64_t begin = first_dof(frame, c), end = end_dof(frame, c + together - 1);
    forward = std::max(forward, solver.forward_bytes(stored_dofs.subspan(at(begin), at(end - begin))));
  }
  // Random loads and their responses, or else forward solutions.
  return std::max(2 * solver.workspace_bytes(loads_at_once), solutions_in_use * forward);
}

std::int64_t solver_bytes(const Factor& factor) {
  const SupernodalTree tree(factor);
  std::int64_t entries = 0;
  for (const Supernode& s : tree.supernodes()) entries += s.columns * s.columns;
  return entries * std::int64_t{sizeof(double)} + (factor.entries() + entries) * std::int64_t{sizeof(float)};
}

}  // namespace palpate
