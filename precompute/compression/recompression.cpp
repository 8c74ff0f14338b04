#include "precompute/compression/recompression.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "base/parallel.h"
#include "precompute/compression/float_entries.h"
#include "precompute/compression/out_of_reach.h"

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;
using FloatRows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Matrix block(const std::shared_ptr<const float[]>& entries, std::int64_t first, Eigen::Index rows,
             Eigen::Index columns) {
  return Eigen::Map<const FloatRows>(entries.get() + first, rows, columns).cast<double>();
}

/// Block of Xi of a leaf with itself.
Matrix own_block(const HierarchicalMatrix& matrix, Index leaf) {
  const Index c = matrix.tree.first_leaf() + leaf;
  const Eigen::Index n = Eigen::Index{matrix.dimension} * (matrix.tree.end(c) - matrix.tree.begin(c));
  return block(matrix.near, matrix.near_at[at(matrix.first_near_pair(leaf))], n, n);
}

class Recompression {
 public:
  Recompression(const HierarchicalMatrix& matrix, double cut, Sharing& sharing)
      : from_(matrix),
        cut_(cut),
        sharing_(sharing),
        L_(at(matrix.tree.leaves())),
        Q_(at(matrix.tree.clusters())),
        R_(Q_.size()),
        U_(Q_.size()),
        weights_(Q_.size()),
        rows_(Q_.size()),
        S_(matrix.far_pair.size()) {}

  std::optional<HierarchicalMatrix> run() {
    parallel_for(std::ssize(L_), sharing_.jobs(), [&](std::int64_t leaf, int) {
      L_[at(leaf)] = root_of_leaf(from_, static_cast<Index>(leaf));
    });
    if (orthogonalise_all() && turn_couplings() && weigh_all() && truncate_all()) return packed();
    return {};
  }

 private:
  [[nodiscard]] Eigen::Index rank(Index c) const { return from_.rank[at(c)]; }
  [[nodiscard]] bool is_leaf(Index c) const { return c >= from_.tree.first_leaf(); }

  /// Clusters of a level that have a basis.
  [[nodiscard]] std::vector<Index> clusters_of(int level) const {
    std::vector<Index> clusters;
    const Index first = from_.tree.first_of_level(level);
    for (Index c = first; c < first + (Index{1} << level); ++c)
      if (rank(c) > 0) clusters.push_back(c);
    return clusters;
  }

  /// Calls work(c) and carry(c, results) for the clusters of a level.
  template <class Work, class Carry>
  bool for_level(int level, Work&& work, Carry&& carry) {
    const std::vector<Index> clusters = clusters_of(level);
    SharedItems items;
    items.count = std::ssize(clusters);
    items.work = [&](std::int64_t item, int) { work(clusters[at(item)]); };
    items.carry = [&](std::int64_t item, Parcel& results) { carry(clusters[at(item)], results); };
    return sharing_.for_each(items);
  }

  bool orthogonalise_all() {
    const auto carry = [&](Index c, Parcel& results) {
      results.carry(Q_[at(c)]);
      results.carry(R_[at(c)]);
    };
    for (int level = from_.tree.levels; level >= 0; --level) {
      if (!for_level(
              level, [&](Index c) { orthogonalise(c); }, carry))
        return false;
    }
    return true;
  }

  /// Transforms S to orthonormal bases.
  bool turn_couplings() {
    SharedItems pairs;
    pairs.count = std::ssize(S_);
    pairs.work = [&](std::int64_t p, int) {
      const auto [row, column] = from_.far_pair[at(p)];
      const Matrix S = block(from_.coupling, from_.coupling_at[at(p)], rank(row), rank(column));
      S_[at(p)] = (R_[at(row)] * S * R_[at(column)].transpose()).cast<float>();
    };
    pairs.carry = [&](std::int64_t p, Parcel& results) { results.carry(S_[at(p)]); };
    return sharing_.for_each(pairs);
  }

  bool weigh_all() {
    const auto carry = [&](Index c, Parcel& results) { results.carry(weights_[at(c)]); };
    for (int level = 0; level <= from_.tree.levels; ++level) {
      if (!for_level(
              level, [&](Index c) { weigh(c); }, carry))
        return false;
    }
    return true;
  }

  bool truncate_all() {
    const auto carry = [&](Index c, Parcel& results) {
      results.carry(U_[at(c)]);
      results.carry(rows_[at(c)]);
    };
    for (int level = from_.tree.levels; level >= 0; --level) {
      if (!for_level(
              level, [&](Index c) { truncate(c); }, carry))
        return false;
      for (const Index c : clusters_of(level)) check_rank(c);
      if (level == from_.tree.levels) continue;
      for (const Index below : clusters_of(level + 1)) rows_[at(below)].resize(0, 0);
    }
    return true;
  }

  /// Computes Q R of a leaf's L^-1 V, or of the children's R E.
  void orthogonalise(Index c) {
    Matrix V;
    if (is_leaf(c)) {
      const std::int64_t leaf = c - from_.tree.first_leaf();
      const Matrix& L = L_[at(leaf)];
      V = L.triangularView<Eigen::Lower>().solve(
          block(from_.basis, from_.basis_at[at(leaf)], L.rows(), rank(c)));
    } else {
      const Index a = 2 * c + 1, b = 2 * c + 2;
      V.resize(R_[at(a)].rows() + R_[at(b)].rows(), rank(c));
      V << R_[at(a)] * block(from_.transfer, from_.transfer_at[at(a)], rank(a), rank(c)),
          R_[at(b)] * block(from_.transfer, from_.transfer_at[at(b)], rank(b), rank(c));
    }
    const Eigen::HouseholderQR<Matrix> qr(V);
    const Eigen::Index k = std::min(V.rows(), V.cols());
    Q_[at(c)] = qr.householderQ() * Matrix::Identity(V.rows(), k);
    R_[at(c)] = qr.matrixQR().topRows(k).triangularView<Eigen::Upper>();
  }

  /// Computes the covariance of a cluster's response to far loads, in its orthonormal basis.
  void weigh(Index c) {
    const Eigen::Index k = Q_[at(c)].cols();
    Matrix G = Matrix::Zero(k, k);
    for (std::int64_t p = from_.partner_from[at(c)]; p < from_.partner_from[at(c) + 1]; ++p) {
      const auto [other, pair] = from_.partner[at(p)];
      const Matrix S = S_[at(pair)].cast<double>();
      if (c > other) {
        G.noalias() += S * S.transpose();
      } else {
        G.noalias() += S.transpose() * S;
      }
    }
    if (const Index parent = ClusterTree::parent(c); c > 0 && rank(parent) > 0) {
      const Matrix E = part(parent, c);
      G.noalias() += E * weights_[at(parent)] * E.transpose();
    }
    weights_[at(c)] = std::move(G);
  }

  /// Drops directions as long as no row of the cluster's leaves changes by more than the cut.
  void truncate(Index c) {
    rows_[at(c)] = spread_out(c);
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(weights_[at(c)]);
    const Matrix V = rows_[at(c)] * eigen.eigenvectors();  // smallest first
    const Eigen::Index k = V.cols();
    Eigen::ArrayXd tail = Eigen::ArrayXd::Zero(V.rows());
    Eigen::Index dropped = 0;
    for (; dropped < k; ++dropped) {
      tail += std::max(eigen.eigenvalues()[dropped], 0.0) * V.col(dropped).array().square();
      if (tail.maxCoeff() > cut_ * cut_) break;
    }
    U_[at(c)] = eigen.eigenvectors().rightCols(k - dropped).rowwise().reverse();
  }

  /// Throws OutOfReach if the rank is too high. Separate, since here all processes have the rank and all
  /// throw.
  void check_rank(Index c) const {
    const Eigen::Index kept = U_[at(c)].cols();
    if (kept <= most_rank) return;
    throw OutOfReach("a cluster of " + std::to_string(from_.tree.end(c) - from_.tree.begin(c)) +
                         " stored nodes needs " + std::to_string(kept) + " terms, " +
                         std::to_string(most_rank) + " are possible",
                     "[storage] tolerance", "Set a larger tolerance, or compression = \"none\"");
  }

  /// Orthonormal basis of a cluster, one row per dof.
  [[nodiscard]] Matrix spread_out(Index c) {
    if (is_leaf(c)) return Q_[at(c)];
    const Matrix &a = rows_[at(2 * c + 1)], &b = rows_[at(2 * c + 2)];
    Matrix V(a.rows() + b.rows(), Q_[at(c)].cols());
    V << a * part(c, 2 * c + 1), b * part(c, 2 * c + 2);
    return V;
  }

  /// Rows of a parent's Q that belong to a child.
  [[nodiscard]] Matrix part(Index parent, Index child) const {
    const Matrix& Q = Q_[at(parent)];
    const Eigen::Index first = Q_[at(2 * parent + 1)].cols();
    return child == 2 * parent + 1 ? Q.topRows(first) : Q.bottomRows(Q.rows() - first);
  }

  /// E of a child for the truncated bases.
  [[nodiscard]] Matrix transfer_of(Index parent, Index child) const {
    return U_[at(child)].transpose() * part(parent, child) * U_[at(parent)];
  }

  /// S of a pair for the truncated bases.
  [[nodiscard]] Matrix coupling_of(std::size_t pair) const {
    const auto [row, column] = from_.far_pair[pair];
    return U_[at(row)].transpose() * S_[pair].cast<double>() * U_[at(column)];
  }

  /// V^T V' and V'^T V', with V' the truncated basis of a cluster, nested as stored, and V the one before.
  struct Products {
    Matrix with_old, with_itself;
  };

  [[nodiscard]] std::vector<Products> products() {
    std::vector<Products> all(U_.size());
    for (int level = from_.tree.levels; level >= 0; --level) {
      const std::vector<Index> clusters = clusters_of(level);
      parallel_for(std::ssize(clusters), sharing_.jobs(), [&](std::int64_t item, int) {
        const Index c = clusters[at(item)];
        Products& of = all[at(c)];
        const Eigen::Index kept = U_[at(c)].cols();
        if (is_leaf(c)) {
          of = {U_[at(c)], Matrix::Identity(kept, kept)};
          return;
        }
        of = {Matrix::Zero(Q_[at(c)].cols(), kept), Matrix::Zero(kept, kept)};
        for (const Index child : {2 * c + 1, 2 * c + 2}) {
          if (rank(child) == 0) continue;
          const Matrix E = transfer_of(c, child);
          of.with_old.noalias() += part(c, child).transpose() * all[at(child)].with_old * E;
          of.with_itself.noalias() += E.transpose() * all[at(child)].with_itself * E;
        }
      });
    }
    return all;
  }

  static void put(const Matrix& entries, float* to) {
    Eigen::Map<FloatRows>(to, entries.rows(), entries.cols()) = entries.cast<float>();
  }

  [[nodiscard]] std::optional<HierarchicalMatrix> packed() {
    HierarchicalMatrix matrix = from_;
    for (std::size_t c = 0; c < U_.size(); ++c) matrix.rank[c] = static_cast<Index>(U_[c].cols());
    matrix.index();
    if (!pack_couplings(matrix)) return {};
    pack_bases(matrix);
    return matrix;
  }

  /// Computes the couplings, and the errors |V S V^T - V' S' V'^T| of pairs, in the Frobenius norm.
  bool pack_couplings(HierarchicalMatrix& matrix) {
    const std::vector<Products> all = products();
    const std::shared_ptr<float[]> coupling = floats(matrix.coupling_at.back());
    matrix.pair_error.resize(S_.size());
    SharedItems pairs;
    pairs.count = std::ssize(S_);
    pairs.work = [&](std::int64_t p, int) {
      const auto [row, column] = from_.far_pair[at(p)];
      const Products &a = all[at(row)], &b = all[at(column)];
      const Matrix S = S_[at(p)].cast<double>(), kept = coupling_of(at(p));
      const double squared = S.squaredNorm() -
                             2.0 * (a.with_old.transpose() * S * b.with_old).cwiseProduct(kept).sum() +
                             (a.with_itself * kept * b.with_itself).cwiseProduct(kept).sum();
      matrix.pair_error[at(p)] = std::sqrt(std::max(squared, 0.0));
      put(kept, coupling.get() + matrix.coupling_at[at(p)]);
    };
    pairs.carry = [&](std::int64_t p, Parcel& results) {
      results.carry(matrix.pair_error[at(p)]);
      results.carry(std::span(coupling.get() + matrix.coupling_at[at(p)],
                              coupling.get() + matrix.coupling_at[at(p + 1)]));
    };
    matrix.coupling = coupling;
    return sharing_.for_each(pairs);
  }

  void pack_bases(HierarchicalMatrix& matrix) const {
    const auto basis = floats(matrix.basis_at.back()), transfer = floats(matrix.transfer_at.back());
    parallel_for(matrix.tree.clusters(), sharing_.jobs(), [&](std::int64_t item, int) {
      const auto c = static_cast<Index>(item);
      if (is_leaf(c) && U_[at(c)].cols() > 0) {
        const std::int64_t leaf = c - matrix.tree.first_leaf();
        const Matrix own = own_block(matrix, static_cast<Index>(leaf));
        Matrix V = L_[at(leaf)].triangularView<Eigen::Lower>() * (Q_[at(c)] * U_[at(c)]);
        for (Eigen::Index i = 0; i < V.rows(); ++i)
          if (own(i, i) == 0.0) V.row(i).setZero();  // held: zero except for rounding
        put(V, basis.get() + matrix.basis_at[at(leaf)]);
      }
      const Index parent = ClusterTree::parent(c);
      if (c > 0 && rank(parent) > 0 && U_[at(c)].cols() > 0)
        put(transfer_of(parent, c), transfer.get() + matrix.transfer_at[at(c)]);
    });
    matrix.basis = basis;
    matrix.transfer = transfer;
  }

  const HierarchicalMatrix& from_;
  double cut_;
  Sharing& sharing_;
  std::vector<Matrix> L_;                           // [leaves]
  std::vector<Matrix> Q_, R_, U_, weights_, rows_;  // [clusters]
  std::vector<FloatRows> S_;                        // [far pairs] between orthonormal bases
};

}  // namespace

std::vector<double> root_of_diagonal(const HierarchicalMatrix& matrix) {
  std::vector<double> root(at(matrix.order()));
  for (std::size_t p = 0; p < matrix.near_pair.size(); ++p) {
    const auto [row, column] = matrix.near_pair[p];
    if (row != column) continue;
    const std::int64_t first = std::int64_t{matrix.dimension} * matrix.tree.begin(row),
                       count = std::int64_t{matrix.dimension} * matrix.tree.end(row) - first;
    for (std::int64_t i = 0; i < count; ++i)
      root[at(first + i)] = std::sqrt(double{matrix.near[matrix.near_at[p] + i * (count + 1)]});
  }
  return root;
}

Matrix root_of_leaf(const HierarchicalMatrix& matrix, Index leaf) {
  Matrix Xi = own_block(matrix, leaf);
  for (double& own : Xi.diagonal())
    if (own == 0.0) own = 1.0;  // held
  const Eigen::LLT<Matrix> factor(Xi);
  if (factor.info() != Eigen::Success) {
    throw OutOfReach(
        "the compliance of " + std::to_string(Xi.rows()) +
            " dofs of the surface that are side by side is not positive definite in single precision",
        "[storage] compression", "Set compression = \"none\"");
  }
  return factor.matrixL();
}

std::optional<HierarchicalMatrix> recompressed(const HierarchicalMatrix& matrix, double cut,
                                               Sharing& sharing) {
  return Recompression(matrix, cut, sharing).run();
}

}  // namespace palpate
