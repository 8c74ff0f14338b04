#include "precompute/numerics/compression.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "precompute/numerics/selected_solver.h"

namespace palpate {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Dofs = std::vector<std::int64_t>;

constexpr Index spare_samples = 12;         // more than the largest rank: what they say of it is certain
constexpr std::int64_t loads_at_once = 32;  // solved together

std::size_t at(std::int64_t i) {
  return static_cast<std::size_t>(i);
}

/// Rows of a matrix as combinations of some of them.
struct Interpolation {
  std::vector<Eigen::Index> skeleton;  ///< numbers of the rows that the others follow
  Eigen::MatrixXd follow;              ///< [rows x skeleton], the identity in the skeleton
};

/// Interpolation of the rows of A, cut off where what is left of them is at most `cut`.
Interpolation interpolate(const Rows& A, double cut) {
  if (A.rows() == 0) return {};  // of children that need no terms
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A.transpose());
  const auto& R = qr.matrixR();
  Eigen::Index rank = 0;
  while (rank < std::min(R.rows(), R.cols()) && std::abs(R(rank, rank)) > cut) ++rank;
  const Eigen::Index rows = A.rows();
  const auto& order = qr.colsPermutation().indices();
  Interpolation result;
  result.follow = Eigen::MatrixXd::Zero(rows, rank);
  const Eigen::MatrixXd T = R.topLeftCorner(rank, rank)
                                .triangularView<Eigen::Upper>()
                                .solve(Eigen::MatrixXd(R.block(0, rank, rank, rows - rank)));
  for (Eigen::Index j = 0; j < rows; ++j) {
    if (j < rank) {
      result.skeleton.push_back(order[j]);
      result.follow(order[j], j) = 1.0;
    } else {
      result.follow.row(order[j]) = T.col(j - rank).transpose();
    }
  }
  return result;
}

std::shared_ptr<float[]> floats(std::int64_t count) {
  return std::shared_ptr<float[]>(new float[at(std::max<std::int64_t>(count, 1))]);
}

class Compressor {
 public:
  Compressor(const Factor& factor, std::span<const std::int64_t> stored_dofs, int dimension,
             const ClusteredNodes& nodes, const CompressionOptions& options,
             const CompressionProgress& progress)
      : factor_(factor),
        solver_(factor),
        stored_dofs_(stored_dofs),
        options_(options),
        progress_(progress),
        workspaces_(at(options.jobs)) {
    matrix_.dimension = dimension;
    matrix_.tree = nodes.tree;
    matrix_.near_pair = nodes.near_pair;
    matrix_.far_pair = nodes.far_pair;
    matrix_.rank.assign(at(nodes.tree.clusters()), 0);
    matrix_.index();
  }

  std::optional<HierarchicalMatrix> run() {
    if (!solve_near() || !sample() || !climb()) return std::nullopt;
    pack();
    return std::move(matrix_);
  }

 private:
  /// What is known of a cluster while its level is worked on.
  struct Front {
    Dofs skeleton;      ///< stored dofs
    Rows response;      ///< [skeleton x samples] to loads that are far, each row over the root of D
    Rows load;          ///< [skeleton x samples]
    Eigen::MatrixXd V;  ///< of a leaf V, of others E of both children, one under the other
  };

  [[nodiscard]] std::int64_t first_dof(Index c) const {
    return std::int64_t{matrix_.dimension} * matrix_.tree.begin(c);
  }
  [[nodiscard]] std::int64_t end_dof(Index c) const {
    return std::int64_t{matrix_.dimension} * matrix_.tree.end(c);
  }
  [[nodiscard]] std::span<const HierarchicalMatrix::Pair> partners(Index c) const {
    return std::span(matrix_.partner)
        .subspan(at(matrix_.partner_from[at(c)]),
                 at(matrix_.partner_from[at(c) + 1] - matrix_.partner_from[at(c)]));
  }
  [[nodiscard]] std::span<const HierarchicalMatrix::Pair> neighbours(Index leaf) const {
    const std::size_t i = at(leaf - matrix_.tree.first_leaf());
    return std::span(matrix_.neighbour)
        .subspan(at(matrix_.near_from[i]), at(matrix_.near_from[i + 1] - matrix_.near_from[i]));
  }
  /// Dofs of K of stored dofs.
  [[nodiscard]] Dofs dofs_of(const Dofs& stored) const {
    Dofs dofs;
    for (const std::int64_t dof : stored) dofs.push_back(stored_dofs_[at(dof)]);
    return dofs;
  }

  /// One of `count` items of a stage is done.
  void tick(CompressionStage stage, std::int64_t count) {
    const std::scoped_lock lock(mutex_);
    ++done_;
    if (!progress_(stage, static_cast<double>(done_) / static_cast<double>(count))) stopped_ = true;
  }
  [[nodiscard]] bool stopped() {
    const std::scoped_lock lock(mutex_);
    return stopped_;
  }

  bool solve_near();
  void solve_near_of(Index leaf, SelectedSolver::Workspace& workspace);
  bool sample();
  Front leaf_front(Index leaf) const;
  Front joined_front(Index c);
  void thin_out(Index c, Front& front) const;
  bool climb();
  void couple(Index c, SelectedSolver::Workspace& workspace);
  void take_off(Index c);
  void pack();

  const Factor& factor_;
  SelectedSolver solver_;
  std::span<const std::int64_t> stored_dofs_;
  CompressionOptions options_;
  const CompressionProgress& progress_;
  HierarchicalMatrix matrix_;
  std::shared_ptr<float[]> near_;
  Eigen::VectorXd root_;             // [order] of D, 0 where held
  Rows response_, load_;             // [order x samples]
  std::vector<Front> fronts_;        // [clusters]
  std::vector<FloatRows> coupling_;  // [far pairs]
  std::vector<SelectedSolver::Workspace> workspaces_;
  std::mutex mutex_;  // of what follows
  std::int64_t done_ = 0;
  bool stopped_ = false;
};

bool Compressor::solve_near() {
  near_ = floats(matrix_.near_at.back());
  const Index leaves = matrix_.tree.leaves();
  done_ = 0;
  parallel_for(leaves, options_.jobs, [&](std::int64_t leaf, int worker) {
    if (stopped()) return;
    solve_near_of(matrix_.tree.first_leaf() + static_cast<Index>(leaf), workspaces_[at(worker)]);
    tick(CompressionStage::near, leaves);
  });
  matrix_.near = near_;
  root_.resize(matrix_.order());
  for (std::size_t p = 0; p < matrix_.near_pair.size(); ++p) {
    const auto [row, column] = matrix_.near_pair[p];
    if (row != column) continue;
    const std::int64_t n = end_dof(row) - first_dof(row);
    for (std::int64_t i = 0; i < n; ++i)
      root_[first_dof(row) + i] = std::sqrt(double{near_[matrix_.near_at[p] + i * (n + 1)]});
  }
  return !stopped_;
}

/// The pairs in which the leaf is the column.
void Compressor::solve_near_of(Index leaf, SelectedSolver::Workspace& workspace) {
  const std::int64_t width = end_dof(leaf) - first_dof(leaf);
  Dofs rows;
  for (const auto& [row, pair] : neighbours(leaf)) {
    if (row < leaf) continue;
    for (std::int64_t dof = first_dof(row); dof < end_dof(row); ++dof) rows.push_back(stored_dofs_[at(dof)]);
  }
  std::vector<double> block(rows.size() * at(width));
  solver_.solve(rows, stored_dofs_.subspan(at(first_dof(leaf)), at(width)), workspace, block);
  const double* from = block.data();
  for (const auto& [row, pair] : neighbours(leaf)) {
    if (row < leaf) continue;
    const std::int64_t count = width * (end_dof(row) - first_dof(row));
    float* to = near_.get() + matrix_.near_at[at(pair)];
    std::transform(from, from + count, to, [](double value) { return static_cast<float>(value); });
    from += count;
    if (row != leaf) continue;
    for (std::int64_t i = 0; i < width; ++i)
      for (std::int64_t j = i + 1; j < width; ++j) to[i * width + j] = to[j * width + i];
  }
}

/// Loads of +-1 over the root of D on every stored dof, and what they do.
bool Compressor::sample() {
  const std::int64_t n = matrix_.order(), m = options_.samples;
  load_.resize(n, m);
  response_.resize(n, m);
  std::mt19937_64 random(20261125);
  for (std::int64_t i = 0; i < n; ++i)
    for (std::int64_t k = 0; k < m; ++k)
      load_(i, k) = root_[i] > 0.0 ? ((random() >> 63) != 0 ? 1.0 : -1.0) / root_[i] : 0.0;
  done_ = 0;
  for (std::int64_t first = 0; first < m; first += loads_at_once) {
    const std::int64_t count = std::min(loads_at_once, m - first);
    std::vector<double> f(at(factor_.order() * count), 0.0);
    for (std::int64_t i = 0; i < n; ++i) {
      if (stored_dofs_[at(i)] < 0) continue;
      for (std::int64_t k = 0; k < count; ++k)
        f[at(k * factor_.order() + stored_dofs_[at(i)])] = load_(i, first + k);
    }
    const std::vector<double> u = factor_.solve(f, count);
    for (std::int64_t i = 0; i < n; ++i) {
      for (std::int64_t k = 0; k < count; ++k)
        response_(i, first + k) = root_[i] > 0.0 ? u[at(k * factor_.order() + stored_dofs_[at(i)])] : 0.0;
    }
    tick(CompressionStage::samples, (m + loads_at_once - 1) / loads_at_once);
    if (stopped_) return false;
  }
  return true;
}

/// All dofs of a leaf, loads on its neighbours taken off.
Compressor::Front Compressor::leaf_front(Index leaf) const {
  Front front;
  const std::int64_t first = first_dof(leaf), n = end_dof(leaf) - first;
  for (std::int64_t i = 0; i < n; ++i) front.skeleton.push_back(first + i);
  front.response = response_.middleRows(first, n);
  front.load = load_.middleRows(first, n);
  for (const auto& [other, pair] : neighbours(leaf)) {
    const std::int64_t width = end_dof(other) - first_dof(other);
    const float* near = near_.get() + matrix_.near_at[at(pair)];
    const auto loads = load_.middleRows(first_dof(other), width);
    if (leaf >= other) {
      const FloatRows block = Eigen::Map<const FloatRows>(near, n, width);
      front.response.noalias() -= block.cast<double>() * loads;
    } else {
      const FloatRows block = Eigen::Map<const FloatRows>(near, width, n);
      front.response.noalias() -= block.cast<double>().transpose() * loads;
    }
  }
  for (std::int64_t i = 0; i < n; ++i)
    front.response.row(i) *= root_[first + i] > 0.0 ? 1.0 / root_[first + i] : 0.0;
  return front;
}

/// The skeletons of both children.
Compressor::Front Compressor::joined_front(Index c) {
  Front front;
  const Front &a = fronts_[at(2 * c + 1)], &b = fronts_[at(2 * c + 2)];
  front.skeleton = a.skeleton;
  front.skeleton.insert(front.skeleton.end(), b.skeleton.begin(), b.skeleton.end());
  const Eigen::Index m = options_.samples;
  front.response.resize(a.response.rows() + b.response.rows(), m);
  front.response << a.response, b.response;
  front.load.resize(front.response.rows(), m);
  front.load << a.load, b.load;
  return front;
}

/// Chooses the skeleton among the dofs of the front and carries loads and responses over to it.
void Compressor::thin_out(Index c, Front& front) const {
  const Interpolation chosen =
      interpolate(front.response, options_.cut * std::sqrt(double(options_.samples)));
  const auto rank = std::ssize(chosen.skeleton);
  // Where all are in it nothing is cut off, whatever the samples say.
  const std::int64_t told = rank == front.response.rows() ? most_rank : options_.samples - spare_samples;
  if (rank > std::min<std::int64_t>(told, most_rank)) {
    throw Error("a cluster of " + std::to_string(matrix_.tree.end(c) - matrix_.tree.begin(c)) +
                    " stored nodes needs more than " + std::to_string(rank - 1) +
                    " terms, so the Green's functions cannot be compressed this exactly",
                "[storage] tolerance", "Set a larger tolerance, or compression = \"none\"");
  }
  Front thin;
  thin.V = chosen.follow;  // of rows over the root of D
  for (Eigen::Index i = 0; i < thin.V.rows(); ++i) thin.V.row(i) *= root_[front.skeleton[at(i)]];
  thin.response.resize(rank, options_.samples);
  for (std::int64_t k = 0; k < rank; ++k) {
    const std::int64_t i = chosen.skeleton[at(k)];
    const std::int64_t dof = front.skeleton[at(i)];
    thin.skeleton.push_back(dof);
    thin.V.col(k) /= root_[dof];
    thin.response.row(k) = front.response.row(i);
  }
  thin.load = thin.V.transpose() * front.load;
  front = std::move(thin);
}

/// The couplings of the far pairs in which the cluster is the column.
void Compressor::couple(Index c, SelectedSolver::Workspace& workspace) {
  Dofs rows;
  for (const auto& [row, pair] : partners(c)) {
    if (row > c) rows.insert(rows.end(), fronts_[at(row)].skeleton.begin(), fronts_[at(row)].skeleton.end());
  }
  const Dofs columns = dofs_of(fronts_[at(c)].skeleton);
  std::vector<double> block(rows.size() * columns.size());
  solver_.solve(dofs_of(rows), columns, workspace, block);
  const double* from = block.data();
  for (const auto& [row, pair] : partners(c)) {
    if (row < c) continue;
    const auto height = std::ssize(fronts_[at(row)].skeleton);
    coupling_[at(pair)] = Eigen::Map<const Rows>(from, height, std::ssize(columns)).cast<float>();
    from += height * std::ssize(columns);
  }
}

/// Takes the loads on the cluster's partners off its response.
void Compressor::take_off(Index c) {
  Front& front = fronts_[at(c)];
  Rows by_partners = Rows::Zero(front.response.rows(), front.response.cols());
  for (const auto& [other, pair] : partners(c)) {
    const Rows S = coupling_[at(pair)].cast<double>();
    if (c > other) {
      by_partners.noalias() += S * fronts_[at(other)].load;
    } else {
      by_partners.noalias() += S.transpose() * fronts_[at(other)].load;
    }
  }
  for (Eigen::Index i = 0; i < by_partners.rows(); ++i)
    front.response.row(i) -= by_partners.row(i) / root_[front.skeleton[at(i)]];
}

bool Compressor::climb() {
  const ClusterTree& tree = matrix_.tree;
  fronts_.resize(at(tree.clusters()));
  coupling_.resize(matrix_.far_pair.size());
  std::vector<bool> needed(at(tree.clusters()), false);
  std::int64_t count = 0;
  for (Index c = 1; c < tree.clusters(); ++c) {
    needed[at(c)] = needed[at(ClusterTree::parent(c))] || !partners(c).empty();
    count += needed[at(c)] ? 1 : 0;
  }
  done_ = 0;
  for (int level = tree.levels; level > 0; --level) {
    const Index first = tree.first_of_level(level), clusters = Index{1} << level;
    const auto for_each = [&](auto&& work) {
      parallel_for(clusters, options_.jobs, [&](std::int64_t i, int worker) {
        if (const Index c = first + static_cast<Index>(i); needed[at(c)] && !stopped()) work(c, worker);
      });
    };
    for_each([&](Index c, int) {
      Front front = level == tree.levels ? leaf_front(c) : joined_front(c);
      thin_out(c, front);
      fronts_[at(c)] = std::move(front);
    });
    for_each([&](Index c, int worker) { couple(c, workspaces_[at(worker)]); });
    for_each([&](Index c, int) {
      take_off(c);
      tick(CompressionStage::far, count);
    });
    if (stopped_) return false;
    if (level == tree.levels) continue;
    const Index below = tree.first_of_level(level + 1);
    for (Index c = below; c < below + 2 * clusters; ++c) fronts_[at(c)].response = fronts_[at(c)].load = {};
  }
  return true;
}

/// Puts bases and couplings one after the other.
void Compressor::pack() {
  const ClusterTree& tree = matrix_.tree;
  for (Index c = 0; c < tree.clusters(); ++c)
    matrix_.rank[at(c)] = static_cast<Index>(fronts_[at(c)].skeleton.size());
  matrix_.index();
  const auto basis = floats(matrix_.basis_at.back()), transfer = floats(matrix_.transfer_at.back()),
             coupling = floats(matrix_.coupling_at.back());
  const auto put = [](const auto& block, float* to) {
    Eigen::Map<FloatRows>(to, block.rows(), block.cols()) = block.template cast<float>();
  };
  for (Index c = 0; c < tree.clusters(); ++c) {
    const Eigen::MatrixXd& V = fronts_[at(c)].V;
    if (V.cols() == 0) continue;
    if (c >= tree.first_leaf()) {
      put(V, basis.get() + matrix_.basis_at[at(c - tree.first_leaf())]);
    } else {
      put(V.topRows(matrix_.rank[at(2 * c + 1)]), transfer.get() + matrix_.transfer_at[at(2 * c + 1)]);
      put(V.bottomRows(matrix_.rank[at(2 * c + 2)]), transfer.get() + matrix_.transfer_at[at(2 * c + 2)]);
    }
  }
  for (std::size_t p = 0; p < coupling_.size(); ++p)
    put(coupling_[p], coupling.get() + matrix_.coupling_at[p]);
  matrix_.basis = basis;
  matrix_.transfer = transfer;
  matrix_.coupling = coupling;
}

}  // namespace

std::optional<HierarchicalMatrix> compress(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                                           int dimension, const ClusteredNodes& nodes,
                                           const CompressionOptions& options,
                                           const CompressionProgress& progress) {
  return Compressor(factor, stored_dofs, dimension, nodes, options, progress).run();
}

}  // namespace palpate
