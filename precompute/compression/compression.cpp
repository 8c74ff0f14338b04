#include "precompute/compression/compression.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "matrices/hierarchical_product.h"
#include "precompute/compression/float_entries.h"
#include "precompute/compression/out_of_reach.h"
#include "precompute/compression/recompression.h"
#include "precompute/compression/selected_solver.h"

namespace palpate {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Dofs = std::vector<std::int64_t>;

constexpr Index spare_samples = 12;     // samples beyond the largest rank, which make it certain
constexpr double skeleton_share = 0.2;  // of the cut: skeletons must not add to the error
constexpr Index samples = random_loads;
constexpr std::size_t columns_at_once = 200;  // of couplings, solved together
constexpr Index leaves_estimated = 64;        // to estimate flops
constexpr std::int64_t loads_at_once = 32;    // solved together
constexpr double front_share = 0.3;           // of the time of far pairs, a guess
constexpr Index checks = 32;                  // more loads, to measure the error of the pairs

/// Rows of a matrix as combinations of some of its rows.
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

}  // namespace

struct Compression::Impl {
 public:
  Impl(const Factor& factor, std::span<const std::int64_t> stored_dofs, int dimension,
       const ClusteredNodes& nodes, Sharing& sharing, CompressionProgress progress)
      : solver_(factor),
        stored_dofs_(stored_dofs),
        sharing_(sharing),
        jobs_(sharing.jobs()),
        progress_(std::move(progress)),
        matrix_(compression_frame(nodes, dimension)),
        workspaces_(at(jobs_)) {}

  [[nodiscard]] Sharing& sharing() const noexcept { return sharing_; }
  void solve_near(Index leaf, int worker, std::vector<float>& entries);
  bool gather_near(const FetchNear& fetch);
  bool sample();
  bool climb(double cut);
  [[nodiscard]] HierarchicalMatrix packed();
  bool check(HierarchicalMatrix& matrix);

 private:
  /// State of a cluster while its level is computed.
  struct Front {
    Dofs skeleton;  ///< stored dofs
    Rows response;  ///< [skeleton x samples] to far loads, each row divided by the root of D
    Rows load;      ///< [skeleton x samples]
    /// Norm of an error e of the responses on the leaves: |W e| = |L^-1 (error of the cluster's dofs)|, with
    /// L the Cholesky factors of the leaves.
    Eigen::MatrixXd W;
    Eigen::MatrixXd V;  ///< V of a leaf; of other clusters E of both children, one below the other
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
  /// First entry of the near pairs of a leaf [0, leaves), and the end.
  [[nodiscard]] std::int64_t near_begin(Index leaf) const {
    return matrix_.near_at[at(matrix_.first_near_pair(leaf))];
  }
  [[nodiscard]] std::int64_t near_end(Index leaf) const { return near_begin(leaf + 1); }
  /// Dofs of K for stored dofs.
  [[nodiscard]] Dofs dofs_of(const Dofs& stored) const {
    Dofs dofs;
    for (const std::int64_t dof : stored) dofs.push_back(stored_dofs_[at(dof)]);
    return dofs;
  }

  /// Progress callback for items that make up a stage from fraction `from` to `to`.
  [[nodiscard]] std::function<bool(double)> told(CompressionStage stage, double from = 0.0, double to = 1.0) {
    return [=, this](double share) { return progress_(stage, std::lerp(from, to, share)); };
  }

  void solve_near_of(Index leaf, std::span<float> entries, SelectedSolver::Workspace& workspace);
  Front leaf_front(Index leaf) const;
  Front joined_front(Index c);
  void thin_out(Index c, double cut, Front& front) const;
  void check_rank(Index c) const;
  [[nodiscard]] std::vector<Index> groups_of(Index first, Index clusters) const;
  [[nodiscard]] std::vector<Index> needed_of_level(int level) const;
  bool make_fronts(int level, double cut, const std::function<bool(double)>& done);
  bool make_couplings(int level, const std::function<bool(double)>& done);
  void couple(Index first, Index end, SelectedSolver::Workspace& workspace);
  void take_off(Index c);

  SelectedSolver solver_;
  std::span<const std::int64_t> stored_dofs_;
  Sharing& sharing_;
  int jobs_;  // threads of this process
  CompressionProgress progress_;
  HierarchicalMatrix matrix_;
  std::shared_ptr<float[]> near_;
  Eigen::VectorXd root_;             // [order] root of D, 0 where held
  Rows response_, load_;             // [order x (samples + checks)]
  std::vector<bool> needed_;         // [clusters]
  std::vector<Front> fronts_;        // [clusters]
  std::vector<FloatRows> coupling_;  // [far pairs]
  std::vector<SelectedSolver::Workspace> workspaces_;
};

void Compression::Impl::solve_near(Index leaf, int worker, std::vector<float>& entries) {
  entries.resize(at(near_end(leaf) - near_begin(leaf)));
  solve_near_of(matrix_.tree.first_leaf() + leaf, entries, workspaces_[at(worker)]);
}

bool Compression::Impl::gather_near(const FetchNear& fetch) {
  near_ = floats(matrix_.near_at.back());
  const auto entries_of = [&](std::int64_t leaf) {
    const std::int64_t begin = near_begin(static_cast<Index>(leaf)), end = near_end(static_cast<Index>(leaf));
    return std::span(near_.get() + begin, at(end - begin));
  };
  SharedItems leaves;
  leaves.count = matrix_.tree.leaves();
  leaves.work = [&](std::int64_t leaf, int worker) {
    if (fetch) {
      fetch(static_cast<Index>(leaf), entries_of(leaf));
    } else {
      solve_near_of(matrix_.tree.first_leaf() + static_cast<Index>(leaf), entries_of(leaf),
                    workspaces_[at(worker)]);
    }
  };
  leaves.carry = [&](std::int64_t leaf, Parcel& results) { results.carry(entries_of(leaf)); };
  if (!fetch) leaves.done = told(CompressionStage::near);
  if (!sharing_.for_each(leaves)) return false;
  matrix_.near = near_;
  const std::vector<double> root = root_of_diagonal(matrix_);
  root_ = Eigen::Map<const Eigen::VectorXd>(root.data(), std::ssize(root));
  return true;
}

/// Solves for the pairs with the leaf as column.
void Compression::Impl::solve_near_of(Index leaf, std::span<float> entries,
                                      SelectedSolver::Workspace& workspace) {
  const std::int64_t width = end_dof(leaf) - first_dof(leaf);
  Dofs rows;
  for (const auto& [row, pair] : neighbours(leaf)) {
    if (row < leaf) continue;
    for (std::int64_t dof = first_dof(row); dof < end_dof(row); ++dof) rows.push_back(stored_dofs_[at(dof)]);
  }
  std::vector<double> block(rows.size() * at(width));
  solver_.solve(rows, stored_dofs_.subspan(at(first_dof(leaf)), at(width)), workspace, block);
  std::transform(block.begin(), block.end(), entries.begin(),
                 [](double value) { return static_cast<float>(value); });
  for (std::int64_t i = 0; i < width; ++i)  // the leaf with itself comes first
    for (std::int64_t j = i + 1; j < width; ++j) entries[at(i * width + j)] = entries[at(j * width + i)];
}

/// Makes loads L^-T (+-1) on every leaf, with L its Cholesky factor, and solves for their responses.
bool Compression::Impl::sample() {
  const std::int64_t n = matrix_.order(), m = samples + checks;
  load_.resize(n, m);
  response_.resize(n, m);
  std::mt19937_64 random(20261125);
  for (std::int64_t i = 0; i < n; ++i)
    for (std::int64_t k = 0; k < m; ++k)
      load_(i, k) = root_[i] > 0.0 ? ((random() >> 63) != 0 ? 1.0 : -1.0) : 0.0;
  parallel_for(matrix_.tree.leaves(), jobs_, [&](std::int64_t leaf, int) {
    const Index c = matrix_.tree.first_leaf() + static_cast<Index>(leaf);
    auto of_leaf = load_.middleRows(first_dof(c), end_dof(c) - first_dof(c));
    const Eigen::MatrixXd L = root_of_leaf(matrix_, static_cast<Index>(leaf));
    L.transpose().triangularView<Eigen::Upper>().solveInPlace(of_leaf);
  });
  const auto of_block = [&](std::int64_t block) {
    return response_.middleCols(block * loads_at_once, loads_at_once);
  };
  SharedItems blocks;
  blocks.count = m / loads_at_once;
  blocks.work = [&](std::int64_t block, int worker) {
    const Rows f = load_.middleCols(block * loads_at_once, loads_at_once);
    Rows u(n, loads_at_once);
    solver_.multiply(stored_dofs_, loads_at_once, {f.data(), at(f.size())}, workspaces_[at(worker)],
                     {u.data(), at(u.size())});
    of_block(block) = u;
  };
  blocks.carry = [&](std::int64_t block, Parcel& results) {
    Rows u = of_block(block);
    results.carry(u);
    of_block(block) = u;
  };
  blocks.done = told(CompressionStage::samples);
  return sharing_.for_each(blocks);
}

/// Front of a leaf: all its dofs, with the response to loads on its neighbours subtracted.
Compression::Impl::Front Compression::Impl::leaf_front(Index leaf) const {
  Front front;
  const std::int64_t first = first_dof(leaf), n = end_dof(leaf) - first;
  for (std::int64_t i = 0; i < n; ++i) front.skeleton.push_back(first + i);
  front.response = response_.block(first, 0, n, samples);
  front.load = load_.block(first, 0, n, samples);
  for (const auto& [other, pair] : neighbours(leaf)) {
    const std::int64_t width = end_dof(other) - first_dof(other);
    const float* near = near_.get() + matrix_.near_at[at(pair)];
    const auto loads = load_.block(first_dof(other), 0, width, samples);
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
  front.W = root_of_leaf(matrix_, leaf - matrix_.tree.first_leaf())
                .triangularView<Eigen::Lower>()
                .solve(Eigen::MatrixXd(root_.segment(first, n).asDiagonal()));
  return front;
}

/// Front of a parent: the skeletons of both children, with the response to loads on their partners
/// subtracted.
Compression::Impl::Front Compression::Impl::joined_front(Index c) {
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
void Compression::Impl::thin_out(Index c, double cut, Front& front) const {
  const Interpolation chosen = interpolate(
      front.response, front.W, cut * std::sqrt(double(samples) * double(end_dof(c) - first_dof(c))));
  const auto rank = std::ssize(chosen.skeleton);
  Front thin;
  thin.V = chosen.follow;  // of rows over the root of D
  for (Eigen::Index i = 0; i < thin.V.rows(); ++i) thin.V.row(i) *= root_[front.skeleton[at(i)]];
  thin.response.resize(rank, samples);
  for (std::int64_t k = 0; k < rank; ++k) {
    const std::int64_t i = chosen.skeleton[at(k)];
    const std::int64_t dof = front.skeleton[at(i)];
    thin.skeleton.push_back(dof);
    thin.V.col(k) /= root_[dof];
    thin.response.row(k) = front.response.row(i);
  }
  thin.load = thin.V.transpose() * front.load;
  const Eigen::MatrixXd W = front.W * chosen.follow;
  thin.W = W.householderQr().matrixQR().topRows(std::min(W.rows(), W.cols())).triangularView<Eigen::Upper>();
  front = std::move(thin);
}

/// Clusters of a level with far pairs, or inside a cluster that has some.
std::vector<Index> Compression::Impl::needed_of_level(int level) const {
  std::vector<Index> clusters;
  const Index first = matrix_.tree.first_of_level(level);
  for (Index c = first; c < first + (Index{1} << level); ++c)
    if (needed_[at(c)]) clusters.push_back(c);
  return clusters;
}

/// Starts of the groups of clusters of a level that are solved together, and the end of the last one.
std::vector<Index> Compression::Impl::groups_of(Index first, Index clusters) const {
  std::vector<Index> starts = {first};
  std::size_t columns = 0;
  for (Index c = first; c < first + clusters; ++c) {
    columns += fronts_[at(c)].skeleton.size();
    if (columns <= columns_at_once || c == starts.back()) continue;
    starts.push_back(c);
    columns = fronts_[at(c)].skeleton.size();
  }
  starts.push_back(first + clusters);
  return starts;
}

/// Computes the couplings of the far pairs with the clusters [first, end) as columns: adjacent in the body,
/// they have most of a solve in common.
void Compression::Impl::couple(Index first, Index end, SelectedSolver::Workspace& workspace) {
  Dofs columns, rows;
  std::map<Index, std::int64_t> row_of;  // first row of a cluster's skeleton
  for (Index c = first; c < end; ++c) {
    const Dofs& skeleton = fronts_[at(c)].skeleton;
    columns.insert(columns.end(), skeleton.begin(), skeleton.end());
    for (const auto& [row, pair] : partners(c)) {
      if (row < c || !row_of.emplace(row, std::ssize(rows)).second) continue;
      rows.insert(rows.end(), fronts_[at(row)].skeleton.begin(), fronts_[at(row)].skeleton.end());
    }
  }
  Rows block(std::ssize(rows), std::ssize(columns));
  solver_.solve(dofs_of(rows), dofs_of(columns), workspace, {block.data(), at(block.size())});
  std::int64_t column = 0;
  for (Index c = first; c < end; ++c) {
    const auto width = std::ssize(fronts_[at(c)].skeleton);
    for (const auto& [row, pair] : partners(c)) {
      if (row > c)
        coupling_[at(pair)] =
            block.block(row_of[row], column, std::ssize(fronts_[at(row)].skeleton), width).cast<float>();
    }
    column += width;
  }
}

/// Subtracts the response to loads on the cluster's partners.
void Compression::Impl::take_off(Index c) {
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

/// Computes the fronts of the needed clusters of a level.
bool Compression::Impl::make_fronts(int level, double cut, const std::function<bool(double)>& done) {
  const std::vector<Index> clusters = needed_of_level(level);
  SharedItems fronts;
  fronts.count = std::ssize(clusters);
  fronts.work = [&](std::int64_t item, int) {
    const Index c = clusters[at(item)];
    Front front = level == matrix_.tree.levels ? leaf_front(c) : joined_front(c);
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
void Compression::Impl::check_rank(Index c) const {
  const auto rank = std::ssize(fronts_[at(c)].skeleton);
  if (rank <= samples - spare_samples || rank == fronts_[at(c)].V.rows()) return;
  throw OutOfReach("a cluster of " + std::to_string(matrix_.tree.end(c) - matrix_.tree.begin(c)) +
                       " stored nodes needs more than " + std::to_string(samples - spare_samples) +
                       " terms, so the Green's functions cannot be compressed this exactly",
                   "[storage] tolerance", "Set a larger tolerance, or compression = \"none\"");
}

/// Computes the couplings of the far pairs of a level.
bool Compression::Impl::make_couplings(int level, const std::function<bool(double)>& done) {
  const std::vector<Index> starts = groups_of(matrix_.tree.first_of_level(level), Index{1} << level);
  SharedItems groups;
  groups.count = std::ssize(starts) - 1;
  groups.work = [&](std::int64_t group, int worker) {
    couple(starts[at(group)], starts[at(group + 1)], workspaces_[at(worker)]);
  };
  groups.carry = [&](std::int64_t group, Parcel& results) {
    for (Index c = starts[at(group)]; c < starts[at(group + 1)]; ++c)
      for (const auto& [row, pair] : partners(c))
        if (row > c) results.carry(coupling_[at(pair)]);
  };
  groups.done = done;
  return sharing_.for_each(groups);
}

bool Compression::Impl::climb(double cut) {
  const ClusterTree& tree = matrix_.tree;
  fronts_.assign(at(tree.clusters()), {});
  coupling_.assign(matrix_.far_pair.size(), {});
  needed_.assign(at(tree.clusters()), false);
  std::int64_t count = 0;
  for (Index c = 1; c < tree.clusters(); ++c) {
    needed_[at(c)] = needed_[at(ClusterTree::parent(c))] || !partners(c).empty();
    count += needed_[at(c)] ? 1 : 0;
  }
  std::int64_t begun = 0;  // clusters
  for (int level = tree.levels; level > 0; --level) {
    const std::int64_t clusters = std::ssize(needed_of_level(level));
    if (clusters == 0) continue;
    const auto share = [&](double of_level) {
      return (double(begun) + of_level * double(clusters)) / double(count);
    };
    if (!make_fronts(level, cut, told(CompressionStage::far, share(0.0), share(front_share))) ||
        !make_couplings(level, told(CompressionStage::far, share(front_share), share(1.0))))
      return false;
    begun += clusters;
    if (level == tree.levels) continue;
    const Index below = tree.first_of_level(level + 1);
    for (Index c = below; c < tree.first_of_level(level + 2); ++c) {
      fronts_[at(c)].response = fronts_[at(c)].load = {};
      fronts_[at(c)].W = {};
    }
  }
  // Touches come next and have workspaces of their own.
  workspaces_ = std::vector<SelectedSolver::Workspace>(at(jobs_));
  return true;
}

/// Stores bases and couplings one after the other.
HierarchicalMatrix Compression::Impl::packed() {
  const ClusterTree& tree = matrix_.tree;
  HierarchicalMatrix matrix = matrix_;
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

/// Adds the errors of the skeletons to pair_error: the error that loads not used for choosing show beyond
/// pair_error is distributed in proportion to the pairs' couplings, since their bases are orthonormal in the
/// norms of L.
bool Compression::Impl::check(HierarchicalMatrix& matrix) {
  std::vector<Index> nodes(at(matrix.tree.nodes));
  std::iota(nodes.begin(), nodes.end(), 0);
  const NodeRange all{0, matrix.tree.nodes};
  std::vector<Eigen::VectorXd> displaced(checks);
  SharedItems loads;
  loads.count = checks;
  loads.work = [&](std::int64_t k, int) {
    const Eigen::VectorXd f = load_.col(samples + k);
    Eigen::VectorXd& u = displaced[at(k)];
    u.resize(f.size());
    displace(matrix, nodes, {f.data(), at(f.size())}, {&all, 1}, {u.data(), at(u.size())});
  };
  loads.carry = [&](std::int64_t k, Parcel& results) { results.carry(displaced[at(k)]); };
  if (!sharing_.for_each(loads)) return false;
  Rows missing(matrix.order(), checks);
  for (Index k = 0; k < checks; ++k) missing.col(k) = response_.col(samples + k) - displaced[at(k)];
  std::vector<double> squared(at(matrix.tree.leaves()));
  parallel_for(matrix.tree.leaves(), jobs_, [&](std::int64_t leaf, int) {
    const Index c = matrix.tree.first_leaf() + static_cast<Index>(leaf);
    Rows of_leaf = missing.middleRows(first_dof(c), end_dof(c) - first_dof(c));
    root_of_leaf(matrix, static_cast<Index>(leaf)).triangularView<Eigen::Lower>().solveInPlace(of_leaf);
    squared[at(leaf)] = of_leaf.squaredNorm() / double(checks);
  });
  const double measured = std::accumulate(squared.begin(), squared.end(), 0.0);
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
  return true;
}

Compression::Compression(const Factor& factor, std::span<const std::int64_t> stored_dofs, int dimension,
                         const ClusteredNodes& nodes, Sharing& sharing, CompressionProgress progress)
    : impl_(std::make_unique<Impl>(factor, stored_dofs, dimension, nodes, sharing, std::move(progress))) {}

Compression::~Compression() = default;

void Compression::solve_near(Index leaf, int worker, std::vector<float>& entries) {
  impl_->solve_near(leaf, worker, entries);
}

bool Compression::prepare(const FetchNear& fetch) {
  return impl_->gather_near(fetch) && impl_->sample();
}

std::shared_ptr<HierarchicalMatrix> Compression::compress(double cut) {
  if (!impl_->climb(skeleton_share * cut)) return nullptr;
  std::optional<HierarchicalMatrix> recompressed_matrix =
      recompressed(impl_->packed(), cut, impl_->sharing());
  if (!recompressed_matrix || !impl_->check(*recompressed_matrix)) return nullptr;
  return std::make_shared<HierarchicalMatrix>(*std::move(recompressed_matrix));
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
  const auto dofs_of = [&](Index c) {
    return stored_dofs.subspan(at(std::int64_t{frame.dimension} * tree.begin(c)),
                               at(std::int64_t{frame.dimension} * (tree.end(c) - tree.begin(c))));
  };
  const Index step = std::max<Index>(1, tree.leaves() / leaves_estimated);
  double flops = 0.0;
  Index counted = 0;
  for (Index leaf = 0; leaf < tree.leaves(); leaf += step, ++counted) {
    Dofs rows;
    for (std::int64_t p = frame.first_near_pair(leaf); p < frame.first_near_pair(leaf + 1); ++p) {
      const auto more = dofs_of(frame.near_pair[at(p)][0]);
      rows.insert(rows.end(), more.begin(), more.end());
    }
    flops += solver.flops(rows, dofs_of(tree.first_leaf() + leaf));
  }
  return flops * static_cast<double>(tree.leaves()) / static_cast<double>(counted);
}

std::int64_t compression_workspace(const Factor& factor, const HierarchicalMatrix& frame,
                                   std::int64_t columns) {
  const std::int64_t leaf = frame.tree.nodes / frame.tree.leaves() + 1;
  columns = std::max({columns, frame.dimension * leaf, static_cast<std::int64_t>(columns_at_once)});
  return SelectedSolver(factor).workspace_bytes(columns);
}

}  // namespace palpate
