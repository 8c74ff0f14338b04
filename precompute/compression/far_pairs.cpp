#include "precompute/compression/far_pairs.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "precompute/compression/block_solver.h"
#include "precompute/compression/float_entries.h"
#include "precompute/compression/out_of_reach.h"
#include "precompute/compression/recompression.h"

namespace palpate {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Dofs = std::vector<std::int64_t>;

constexpr Index spare_samples = 12;  // samples beyond the largest rank, which make it certain
constexpr Index samples = random_loads;
constexpr double front_share = 0.3;  // of the time of far pairs, a guess

/// DoubleRows of a matrix as combinations of some of them.
struct Interpolation {
  std::vector<Eigen::Index> skeleton;  ///< numbers of the rows that the others are combined from
  Eigen::MatrixXd follow;              ///< [rows x skeleton], the identity in the skeleton
};

/// Interpolation of the rows of A by as few of them as leave |W (A - follow A)| at most `cut`, in the
/// Frobenius norm.
Interpolation interpolate(const Rows& A, const Eigen::MatrixXd& W, double cut) {
  if (A.rows() == 0) return {};  // of children that need no terms
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(A.transpose());
  const Eigen::Index rows = A.rows(), most = std::min(A.rows(), A.cols());
  const Eigen::MatrixXd R = qr.matrixR().topRows(most).triangularView<Eigen::Upper>();
  const auto& order = qr.colsPermutation().indices();
  const Eigen::MatrixXd weights = W * qr.colsPermutation();
  const auto left = [&](Eigen::Index rank) {
    const auto others = weights.rightCols(rows - rank);
    return (others * R.bottomRightCorner(most - rank, rows - rank).transpose()).norm();
  };
  Eigen::Index rank = 0;
  for (Eigen::Index end = most; rank < end;) {  // smallest rank that leaves little enough
    const Eigen::Index middle = (rank + end) / 2;
    left(middle) <= cut ? end = middle : rank = middle + 1;
  }
  Interpolation result;
  result.follow = Eigen::MatrixXd::Zero(rows, rank);
  Eigen::MatrixXd T = R.block(0, rank, rank, rows - rank);
  if (T.size() > 0) R.topLeftCorner(rank, rank).triangularView<Eigen::Upper>().solveInPlace(T);
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

/// Bases from the leaves of the tree to its root, and with each level its couplings.
class FarPairs {
 public:
  FarPairs(const FarSource& source, Sharing& sharing)
      : source_(source), frame_(source.frame), sharing_(sharing) {}

  /// Bases and couplings, whose solves are by `solver`. False where `done` or the sharing said stop.
  template <class Real>
  bool climb(const SelectedSolverOf<Real>& solver, double cut, const std::function<bool(double)>& done);
  /// Bases and couplings, one after the other.
  HierarchicalMatrix packed();

 private:
  /// State of a cluster while its level is computed.
  struct Front {
    Dofs skeleton;        ///< stored dofs
    DoubleRows response;  ///< [skeleton x samples] to far loads, each row divided by the root of D
    DoubleRows load;      ///< [skeleton x samples]
    /// Norm of an error e of the responses on the leaves: |W e| = |L^-1 (error of the cluster's dofs)|, with
    /// L the Cholesky factors of the leaves.
    Eigen::MatrixXd W;
    Eigen::MatrixXd V;  ///< V of a leaf; of other clusters E of both children, one below the other
  };

  /// Dofs of K for stored dofs.
  Dofs dofs_of(const Dofs& stored) const {
    Dofs dofs;
    for (const std::int64_t dof : stored) dofs.push_back(source_.stored_dofs[at(dof)]);
    return dofs;
  }

  Front leaf_front(Index leaf) const;
  Front joined_front(Index c);
  void thin_out(Index c, double cut, Front& front) const;
  void check_rank(Index c) const;
  std::vector<Index> needed_of_level(int level) const;
  bool make_fronts(int level, double cut, const std::function<bool(double)>& done);
  template <class Real>
  bool make_couplings(int level, const SelectedSolverOf<Real>& solver,
                      const std::function<bool(double)>& done);
  template <class Real>
  void couple(Index c, int worker, BlockSolver<Real>& blocks);
  void take_off(Index c);

  const FarSource& source_;
  const HierarchicalMatrix& frame_;
  Sharing& sharing_;
  std::vector<bool> needed_;         // [clusters]
  std::vector<Front> fronts_;        // [clusters]
  std::vector<FloatRows> coupling_;  // [far pairs]
};

/// Front of a leaf: all its dofs, with the response to loads on its neighbours subtracted.
FarPairs::Front FarPairs::leaf_front(Index leaf) const {
  Front front;
  const std::int64_t first = first_dof(frame_, leaf), n = end_dof(frame_, leaf) - first;
  for (std::int64_t i = 0; i < n; ++i) front.skeleton.push_back(first + i);
  front.load = source_.load.block(first, 0, n, samples);
  front.response = source_.response.block(first, 0, n, samples) -
                   near_displacement(frame_, leaf, source_.load).leftCols(samples);
  for (std::int64_t i = 0; i < n; ++i)
    front.response.row(i) *= source_.root[first + i] > 0.0 ? 1.0 / source_.root[first + i] : 0.0;
  front.W = root_of_leaf(frame_, leaf - frame_.tree.first_leaf())
                .triangularView<Eigen::Lower>()
                .solve(Eigen::MatrixXd(source_.root.segment(first, n).asDiagonal()));
  return front;
}

/// Front of a parent: the skeletons of both children, with the response to loads on their partners
/// subtracted.
FarPairs::Front FarPairs::joined_front(Index c) {
  take_off(2 * c + 1);
  take_off(2 * c + 2);
  Front front;
  const Front &a = fronts_[at(2 * c + 1)], &b = fronts_[at(2 * c + 2)];
  front.skeleton = a.skeleton;
  front.skeleton.insert(front.skeleton.end(), b.skeleton.begin(), b.skeleton.end());
  const Eigen::Index m = samples;
  front.response.resize(a.response.rows() + b.response.rows(), m);
  front.response << a.response, b.response;
  front.load.resize(front.response.rows(), m);
  front.load << a.load, b.load;
  front.W = Eigen::MatrixXd::Zero(a.W.rows() + b.W.rows(), a.W.cols() + b.W.cols());
  front.W.topLeftCorner(a.W.rows(), a.W.cols()) = a.W;
  front.W.bottomRightCorner(b.W.rows(), b.W.cols()) = b.W;
  return front;
}

/// Chooses the skeleton among the dofs of the front and transfers loads and responses to it.
void FarPairs::thin_out(Index c, double cut, Front& front) const {
  const Interpolation chosen =
      interpolate(front.response, front.W,
                  cut * std::sqrt(double(samples) * double(end_dof(frame_, c) - first_dof(frame_, c))));
  const auto rank = std::ssize(chosen.skeleton);
  Front thin;
  thin.V = chosen.follow;  // of rows over the root of D
  for (Eigen::Index i = 0; i < thin.V.rows(); ++i) thin.V.row(i) *= source_.root[front.skeleton[at(i)]];
  thin.response.resize(rank, samples);
  for (std::int64_t k = 0; k < rank; ++k) {
    const std::int64_t i = chosen.skeleton[at(k)];
    const std::int64_t dof = front.skeleton[at(i)];
    thin.skeleton.push_back(dof);
    thin.V.col(k) /= source_.root[dof];
    thin.response.row(k) = front.response.row(i);
  }
  thin.load = thin.V.transpose() * front.load;
  const Eigen::MatrixXd W = front.W * chosen.follow;
  thin.W = W.householderQr().matrixQR().topRows(std::min(W.rows(), W.cols())).triangularView<Eigen::Upper>();
  front = std::move(thin);
}

/// Clusters of a level with far pairs, or inside a cluster that has some.
std::vector<Index> FarPairs::needed_of_level(int level) const {
  std::vector<Index> clusters;
  const Index first = frame_.tree.first_of_level(level);
  for (Index c = first; c < first + (Index{1} << level); ++c)
    if (needed_[at(c)]) clusters.push_back(c);
  return clusters;
}

/// Computes the couplings of the far pairs with the cluster as column.
template <class Real>
void FarPairs::couple(Index c, int worker, BlockSolver<Real>& blocks) {
  std::vector<Index> rows;
  Eigen::Index height = 0;
  for (const auto& [row, pair] : partners(frame_, c)) {
    if (row < c) continue;
    rows.push_back(row);
    height += std::ssize(fronts_[at(row)].skeleton);
  }
  Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> block(
      height, std::ssize(fronts_[at(c)].skeleton));
  blocks.solve(rows, c, worker, {block.data(), at(block.size())});
  Eigen::Index first = 0;
  for (const auto& [row, pair] : partners(frame_, c)) {
    if (row < c) continue;
    const auto count = std::ssize(fronts_[at(row)].skeleton);
    coupling_[at(pair)] = block.middleRows(first, count).template cast<float>();
    first += count;
  }
}

/// Subtracts the response to loads on the cluster's partners.
void FarPairs::take_off(Index c) {
  Front& front = fronts_[at(c)];
  DoubleRows by_partners = DoubleRows::Zero(front.response.rows(), front.response.cols());
  for (const auto& [other, pair] : partners(frame_, c)) {
    const DoubleRows S = coupling_[at(pair)].cast<double>();
    if (c > other) {
      by_partners.noalias() += S * fronts_[at(other)].load;
    } else {
      by_partners.noalias() += S.transpose() * fronts_[at(other)].load;
    }
  }
  for (Eigen::Index i = 0; i < by_partners.rows(); ++i)
    front.response.row(i) -= by_partners.row(i) / source_.root[front.skeleton[at(i)]];
}

/// Computes the fronts of the needed clusters of a level.
bool FarPairs::make_fronts(int level, double cut, const std::function<bool(double)>& done) {
  const std::vector<Index> clusters = needed_of_level(level);
  SharedItems fronts;
  fronts.count = std::ssize(clusters);
  fronts.work = [&](std::int64_t item, int) {
    const Index c = clusters[at(item)];
    Front front = level == frame_.tree.levels ? leaf_front(c) : joined_front(c);
    thin_out(c, cut, front);
    fronts_[at(c)] = std::move(front);
  };
  fronts.carry = [&](std::int64_t item, Parcel& results) {
    Front& front = fronts_[at(clusters[at(item)])];
    results.carry(front.skeleton);
    for (Rows* rows : {&front.response, &front.load}) results.carry(*rows);
    for (Eigen::MatrixXd* matrix : {&front.W, &front.V}) results.carry(*matrix);
  };
  fronts.done = done;
  if (!sharing_.for_each(fronts)) return false;
  for (const Index c : clusters) check_rank(c);
  return true;
}

/// Throws OutOfReach if the rank is too high. Separate, since here all processes have the front and all
/// throw. If all dofs are in the skeleton nothing is truncated, whatever the samples say.
void FarPairs::check_rank(Index c) const {
  const auto rank = std::ssize(fronts_[at(c)].skeleton);
  if (rank <= samples - spare_samples || rank == fronts_[at(c)].V.rows()) return;
  throw OutOfReach("a cluster of " + std::to_string(frame_.tree.end(c) - frame_.tree.begin(c)) +
                       " stored nodes needs more than " + std::to_string(samples - spare_samples) +
                       " terms, so the Green's functions cannot be compressed this exactly",
                   "[storage] tolerance", "Set a larger tolerance, or compression = \"none\"");
}

/// Computes the couplings of the far pairs of a level.
template <class Real>
bool FarPairs::make_couplings(int level, const SelectedSolverOf<Real>& solver,
                              const std::function<bool(double)>& done) {
  BlockSolver<Real> blocks(solver, frame_.tree, level, sharing_.jobs(), source_.forward_bytes,
                           [this](Index c) { return dofs_of(fronts_[at(c)].skeleton); });
  SharedItems groups;
  const Index first = frame_.tree.first_of_level(level), together = clusters_together(level);
  groups.count = (Index{1} << level) / together;
  const auto for_clusters = [&](std::int64_t group, const auto& use) {
    for (Index k = 0; k < together; ++k) use(first + static_cast<Index>(group) * together + k);
  };
  groups.work = [&](std::int64_t group, int worker) {
    for_clusters(group, [&](Index c) { couple(c, worker, blocks); });
  };
  groups.carry = [&](std::int64_t group, Parcel& results) {
    for_clusters(group, [&](Index c) {
      for (const auto& [row, pair] : partners(frame_, c))
        if (row > c) results.carry(coupling_[at(pair)]);
    });
  };
  groups.done = done;
  return sharing_.for_each(groups);
}

template <class Real>
bool FarPairs::climb(const SelectedSolverOf<Real>& solver, double cut,
                     const std::function<bool(double)>& done) {
  const ClusterTree& tree = frame_.tree;
  fronts_.assign(at(tree.clusters()), {});
  coupling_.assign(frame_.far_pair.size(), {});
  needed_.assign(at(tree.clusters()), false);
  std::int64_t count = 0;
  for (Index c = 1; c < tree.clusters(); ++c) {
    needed_[at(c)] = needed_[at(ClusterTree::parent(c))] || !partners(frame_, c).empty();
    count += needed_[at(c)] ? 1 : 0;
  }
  std::int64_t begun = 0;  // clusters
  for (int level = tree.levels; level > 0; --level) {
    const std::int64_t clusters = std::ssize(needed_of_level(level));
    if (clusters == 0) continue;
    const auto share = [&](double of_level) {
      return (double(begun) + of_level * double(clusters)) / double(count);
    };
    const auto told = [&](double from, double to) {
      return [&, from, to](double part) { return done(std::lerp(share(from), share(to), part)); };
    };
    if (!make_fronts(level, cut, told(0.0, front_share)) ||
        !make_couplings(level, solver, told(front_share, 1.0)))
      return false;
    begun += clusters;
    if (level == tree.levels) continue;
    const Index below = tree.first_of_level(level + 1);
    for (Index c = below; c < tree.first_of_level(level + 2); ++c) {
      fronts_[at(c)].response = fronts_[at(c)].load = {};
      fronts_[at(c)].W = {};
    }
  }
  return true;
}

HierarchicalMatrix FarPairs::packed() {
  const ClusterTree& tree = frame_.tree;
  HierarchicalMatrix matrix = frame_;
  for (Index c = 0; c < tree.clusters(); ++c)
    matrix.rank[at(c)] = static_cast<Index>(fronts_[at(c)].skeleton.size());
  matrix.index();
  const auto basis = floats(matrix.basis_at.back()), transfer = floats(matrix.transfer_at.back()),
             coupling = floats(matrix.coupling_at.back());
  const auto put = [](const auto& block, float* to) {
    Eigen::Map<FloatRows>(to, block.rows(), block.cols()) = block.template cast<float>();
  };
  for (Index c = 0; c < tree.clusters(); ++c) {
    const Eigen::MatrixXd& V = fronts_[at(c)].V;
    if (V.cols() == 0) continue;
    if (c >= tree.first_leaf()) {
      put(V, basis.get() + matrix.basis_at[at(c - tree.first_leaf())]);
    } else {
      put(V.topRows(matrix.rank[at(2 * c + 1)]), transfer.get() + matrix.transfer_at[at(2 * c + 1)]);
      put(V.bottomRows(matrix.rank[at(2 * c + 2)]), transfer.get() + matrix.transfer_at[at(2 * c + 2)]);
    }
  }
  for (std::size_t p = 0; p < coupling_.size(); ++p)
    put(coupling_[p], coupling.get() + matrix.coupling_at[p]);
  fronts_ = {};
  coupling_ = {};
  matrix.basis = basis;
  matrix.transfer = transfer;
  matrix.coupling = coupling;
  return matrix;
}

}  // namespace

std::span<const HierarchicalMatrix::Pair> neighbours(const HierarchicalMatrix& matrix, Index leaf) {
  const std::size_t i = at(leaf - matrix.tree.first_leaf());
  return std::span(matrix.neighbour)
      .subspan(at(matrix.near_from[i]), at(matrix.near_from[i + 1] - matrix.near_from[i]));
}

std::span<const HierarchicalMatrix::Pair> partners(const HierarchicalMatrix& matrix, Index c) {
  return std::span(matrix.partner)
      .subspan(at(matrix.partner_from[at(c)]),
               at(matrix.partner_from[at(c) + 1] - matrix.partner_from[at(c)]));
}

DoubleRows near_displacement(const HierarchicalMatrix& matrix, Index leaf, const DoubleRows& loads) {
  const std::int64_t n = end_dof(matrix, leaf) - first_dof(matrix, leaf);
  DoubleRows u = DoubleRows::Zero(n, loads.cols());
  for (const auto& [other, pair] : neighbours(matrix, leaf)) {
    const std::int64_t width = end_dof(matrix, other) - first_dof(matrix, other);
    const float* near = matrix.near.get() + matrix.near_at[at(pair)];
    const auto f = loads.middleRows(first_dof(matrix, other), width);
    if (leaf >= other) {
      u.noalias() += Eigen::Map<const FloatRows>(near, n, width).cast<double>() * f;
    } else {
      u.noalias() += Eigen::Map<const FloatRows>(near, width, n).cast<double>().transpose() * f;
    }
  }
  return u;
}

std::optional<HierarchicalMatrix> with_far_pairs(const FarSource& source, double cut, Sharing& sharing,
                                                 const std::function<bool(double)>& done) {
  FarPairs pairs(source, sharing);
  const Factor& factor = source.solver.factor();
  const bool whole = source.single ? pairs.climb(SelectedSolverOf<float>(factor, sharing.jobs()), cut, done)
                                   : pairs.climb(source.solver, cut, done);
  return whole ? std::optional(pairs.packed()) : std::nullopt;
}

}  // namespace palpate
