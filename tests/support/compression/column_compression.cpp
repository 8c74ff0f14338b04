#include "tests/support/compression/column_compression.h"

#include <cblas.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <ctime>
#include <memory>
#include <utility>

#include "base/parallel.h"
#include "precompute/compression/compression.h"
#include "precompute/compression/recompression.h"

namespace palpate::test {
namespace {

using Matrix = Eigen::MatrixXd;

std::size_t at(std::int64_t i) {
  return static_cast<std::size_t>(i);
}

double seconds(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Adds the processor time of this thread since it was made to a number.
class Stopwatch {
 public:
  explicit Stopwatch(double& sum) : sum_(sum) {}
  ~Stopwatch() { sum_ += seconds(CLOCK_THREAD_CPUTIME_ID) - start_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& sum_;
  double start_ = seconds(CLOCK_THREAD_CPUTIME_ID);
};

/// The eigenvectors of a Gram matrix, largest first, without those whose eigenvalues add up to at most
/// `squared`.
Matrix leading(const Matrix& gram, double squared) {
  if (gram.rows() == 0) return gram;
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(gram);
  Eigen::Index dropped = 0;
  for (double tail = 0.0; dropped < gram.rows(); ++dropped) {
    tail += std::max(eigen.eigenvalues()[dropped], 0.0);
    if (tail > squared) break;
  }
  return eigen.eigenvectors().rightCols(gram.rows() - dropped).rowwise().reverse();
}

}  // namespace

ColumnCompression::ColumnCompression(const Factor& factor, std::span<const std::int64_t> stored_dofs,
                                     int dimension, const ClusteredNodes& nodes, int jobs, Index tile_leaves)
    : solver_(factor),
      stored_dofs_(stored_dofs),
      jobs_(jobs),
      tile_leaves_(std::min(tile_leaves, nodes.tree.leaves())),
      matrix_(compression_frame(nodes, dimension)),
      near_(new float[at(matrix_.near_at.back())]),
      root_(at(matrix_.tree.leaves())),
      needed_(at(matrix_.tree.clusters()), false),
      fronts_(needed_.size()),
      column_basis_(needed_.size()),
      rows_(matrix_.far_pair.size()),
      covariance_(needed_.size()),
      basis_(needed_.size()),
      compliance_(needed_.size()),
      change_(needed_.size()),
      place_(needed_.size() + 1) {
  matrix_.near = near_;
  for (Index c = 1; c < matrix_.tree.clusters(); ++c)
    needed_[at(c)] = needed_[at(ClusterTree::parent(c))] || !partners(c).empty();
}

std::int64_t ColumnCompression::first_dof(Index c) const {
  return std::int64_t{matrix_.dimension} * matrix_.tree.begin(c);
}

std::int64_t ColumnCompression::dofs(Index c) const {
  return std::int64_t{matrix_.dimension} * (matrix_.tree.end(c) - matrix_.tree.begin(c));
}

std::span<const HierarchicalMatrix::Pair> ColumnCompression::partners(Index c) const {
  return std::span(matrix_.partner)
      .subspan(at(matrix_.partner_from[at(c)]),
               at(matrix_.partner_from[at(c) + 1] - matrix_.partner_from[at(c)]));
}

/// The far pairs of a cluster and of those above it whose rows are later: the cluster's own come first.
std::vector<HierarchicalMatrix::Pair> ColumnCompression::later_pairs(Index c) const {
  std::vector<HierarchicalMatrix::Pair> pairs;
  for (; c > 0; c = ClusterTree::parent(c)) {
    for (const HierarchicalMatrix::Pair& partner : partners(c))
      if (partner[0] > c) pairs.push_back(partner);
  }
  return pairs;
}

/// Dofs of K of the leaves of a tile and of all later ones.
std::span<const std::int64_t> ColumnCompression::tile_rows(Index tile) const {
  return stored_dofs_.subspan(at(first_dof(first_of(tile))));
}

std::span<const std::int64_t> ColumnCompression::tile_columns(Index tile) const {
  const std::int64_t end = tile + 1 < tiles() ? first_dof(first_of(tile + 1)) : std::ssize(stored_dofs_);
  return tile_rows(tile).first(at(end - first_dof(first_of(tile))));
}

double ColumnCompression::flops_of(Index tile) const {
  const auto rows = tile_rows(tile), columns = tile_columns(tile);
  return solver_.forward_flops(columns) +  // and backward to the rows, for each column
         solver_.forward_flops(rows) * static_cast<double>(columns.size()) / static_cast<double>(rows.size());
}

double ColumnCompression::flops() const {
  double total = 0.0;
  for (Index tile = 0; tile < tiles(); ++tile) total += flops_of(tile);
  return total;
}

void ColumnCompression::solve_tile(Index tile, Desk& desk) {
  const auto rows = tile_rows(tile), columns = tile_columns(tile);
  desk.tile.resize(rows.size() * columns.size());
  solver_.solve(rows, columns, desk.workspace, desk.tile);
}

void ColumnCompression::keep_near(Index tile, const Desk& desk) {
  const Index first = first_of(tile);
  const std::int64_t width = std::ssize(tile_columns(tile));
  for (Index c = first; c < first + tile_leaves_; ++c) {
    const Index leaf = c - matrix_.tree.first_leaf();
    for (std::int64_t p = matrix_.first_near_pair(leaf); p < matrix_.first_near_pair(leaf + 1); ++p) {
      const Index row = matrix_.near_pair[at(p)][0];
      const Eigen::Map<const Rows> of_row(desk.tile.data() + (first_dof(row) - first_dof(first)) * width,
                                          dofs(row), width);
      Eigen::Map<FloatRows>(near_.get() + matrix_.near_at[at(p)], dofs(row), dofs(c)) =
          of_row.middleCols(first_dof(c) - first_dof(first), dofs(c)).cast<float>();
    }
    root_[at(leaf)] = root_of_leaf(matrix_, leaf);
    const Eigen::Map<const FloatRows> own(near_.get() + matrix_.near_at[at(matrix_.first_near_pair(leaf))],
                                          dofs(c), dofs(c));
    const std::int64_t free = (own.diagonal().array() > 0.0F).count();
    compliance_[at(c)] = double(own.trace()) / double(std::max<std::int64_t>(free, 1));
  }
}

/// The columns of a leaf c of the tile.
ColumnCompression::Front ColumnCompression::compress_leaf(Index c, Index tile, Desk& desk, double cut) {
  const std::int64_t first = first_dof(first_of(tile)), n = dofs(c);
  const std::int64_t height = std::ssize(tile_rows(tile)), width = std::ssize(tile_columns(tile));
  double* const corner = desk.tile.data() + (first_dof(c) - first);
  const Rows& L = root_[at(c - matrix_.tree.first_leaf())];
  cblas_dtrsm(CblasRowMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, static_cast<blasint>(height),
              static_cast<blasint>(n), 1.0, L.data(), static_cast<blasint>(n), corner,
              static_cast<blasint>(width));
  const auto of = [&](Index row) { return corner + (first_dof(row) - first) * width; };
  Rows gram = Rows::Zero(n, n);
  const std::vector<HierarchicalMatrix::Pair> pairs = later_pairs(c);
  for (const auto& [row, pair] : pairs) {
    cblas_dsyrk(CblasRowMajor, CblasLower, CblasTrans, static_cast<blasint>(n),
                static_cast<blasint>(dofs(row)), 1.0, of(row), static_cast<blasint>(width), 1.0, gram.data(),
                static_cast<blasint>(n));
  }
  column_basis_[at(c)] =
      leading(gram.selfadjointView<Eigen::Lower>(), cut * cut * double(n) * compliance_[at(c)]);
  const Rows V = column_basis_[at(c)];
  Front front;
  for (const auto& [row, pair] : pairs) {
    Rows rows(dofs(row), V.cols());
    if (V.cols() > 0) {
      cblas_dgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<blasint>(dofs(row)),
                  static_cast<blasint>(V.cols()), static_cast<blasint>(n), 1.0, of(row),
                  static_cast<blasint>(width), V.data(), static_cast<blasint>(V.cols()), 0.0, rows.data(),
                  static_cast<blasint>(V.cols()));
    }
    front.rows.push_back(rows.cast<float>());
  }
  return front;
}

/// Both siblings in a basis of their parent.
ColumnCompression::Front ColumnCompression::joined(Index parent, Front a, Front b, double cut) {
  const Eigen::Index m = column_basis_[at(2 * parent + 1)].cols(),
                     k = column_basis_[at(2 * parent + 2)].cols();
  const auto both = [&](std::size_t i) {
    Rows rows(a.rows[i].rows(), m + k);
    rows << a.rows[i].cast<double>(), b.rows[i].cast<double>();
    return rows;
  };
  Matrix gram = Matrix::Zero(m + k, m + k);
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    const Rows rows = both(i);
    gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
  }
  compliance_[at(parent)] = 0.5 * (compliance_[at(2 * parent + 1)] + compliance_[at(2 * parent + 2)]);
  column_basis_[at(parent)] = leading(gram.selfadjointView<Eigen::Lower>(),
                                      cut * cut * double(dofs(parent)) * compliance_[at(parent)]);
  Front front;
  for (std::size_t i = 0; i < a.rows.size(); ++i) {
    front.rows.push_back((both(i) * column_basis_[at(parent)]).cast<float>());
    a.rows[i] = b.rows[i] = {};
  }
  return front;
}

/// Moves the rows of the cluster's own pairs to where they are kept.
void ColumnCompression::keep_own_pairs(Index c, Front& front) {
  std::size_t own = 0;
  for (const auto& [row, pair] : partners(c))
    if (row > c) rows_[at(pair)] = std::move(front.rows[own++]);
  front.rows.erase(front.rows.begin(), front.rows.begin() + static_cast<std::ptrdiff_t>(own));
}

/// Goes up the tree for as long as siblings wait.
void ColumnCompression::hand_up(Index c, Front front, double cut) {
  while (needed_[at(c)]) {
    keep_own_pairs(c, front);
    const Index parent = ClusterTree::parent(c), sibling = c % 2 == 1 ? c + 1 : c - 1;
    Front other;
    {
      const std::scoped_lock lock(mutex_);
      if (!fronts_[at(sibling)].there) {
        front.there = true;
        fronts_[at(c)] = std::move(front);
        return;
      }
      other = std::exchange(fronts_[at(sibling)], {});
    }
    front = c < sibling ? joined(parent, std::move(front), std::move(other), cut)
                        : joined(parent, std::move(other), std::move(front), cut);
    c = parent;
  }
}

/// L^-1 on the rows of all far pairs.
void ColumnCompression::weigh_rows() {
  parallel_for(std::ssize(rows_), jobs_, [&](std::int64_t pair, int) {
    const Index row = matrix_.far_pair[at(pair)][0];
    const int down = matrix_.tree.levels - ClusterTree::level(row);
    const Index first = ((row + 1) << down) - 1, end = first + (Index{1} << down);
    for (Index c = first; c < end; ++c) {
      auto of_leaf = rows_[at(pair)].middleRows(first_dof(c) - first_dof(first), dofs(c));
      of_leaf = root_[at(c - matrix_.tree.first_leaf())]
                    .triangularView<Eigen::Lower>()
                    .solve(of_leaf.cast<double>())
                    .cast<float>();
    }
  });
}

/// Top down: of the cluster's own later rows, and of those of the clusters above it.
void ColumnCompression::find_column_covariances() {
  for (Index c = 1; c < matrix_.tree.clusters(); ++c) {
    if (!needed_[at(c)]) continue;
    const Eigen::Index k = column_basis_[at(c)].cols();
    Matrix& G = covariance_[at(c)] = Matrix::Zero(k, k);
    for (const auto& [row, pair] : partners(c)) {
      if (row < c) continue;
      const Matrix rows = rows_[at(pair)].cast<double>();
      G.noalias() += rows.transpose() * rows;
    }
    const Index parent = ClusterTree::parent(c);
    if (!needed_[at(parent)]) continue;
    const Matrix& E = column_basis_[at(parent)];
    const Matrix part = c % 2 == 1 ? E.topRows(k) : E.bottomRows(k);
    G.noalias() += part * covariance_[at(parent)] * part.transpose();
  }
}

/// The rows of a far pair that a cluster at or below its row has, as they are on the cluster's level.
Matrix ColumnCompression::part_in_rows(Index pair, Index c) const {
  Index first = matrix_.far_pair[at(pair)][0];
  for (int level = ClusterTree::level(first); level < ClusterTree::level(c); ++level) first = 2 * first + 1;
  return rows_[at(pair)]
      .middleRows(place_[at(c)] - place_[at(first)], place_[at(c + 1)] - place_[at(c)])
      .cast<double>();
}

/// The basis of the cluster's rows and columns, once those of its children are there.
void ColumnCompression::find_basis(Index c, double cut) {
  const bool leaf = c >= matrix_.tree.first_leaf();
  Matrix columns = column_basis_[at(c)];
  if (!leaf) {
    const Matrix &a = change_[at(2 * c + 1)], &b = change_[at(2 * c + 2)];
    Matrix changed(a.rows() + b.rows(), columns.cols());
    changed << a * columns.topRows(a.cols()), b * columns.bottomRows(b.cols());
    columns = std::move(changed);
  }
  Matrix gram = columns * covariance_[at(c)] * columns.transpose();
  for (Index above = c; above > 0; above = ClusterTree::parent(above)) {
    for (const auto& [column, pair] : partners(above)) {
      if (column > above) continue;
      const Matrix rows = part_in_rows(pair, c);
      gram.noalias() += rows * rows.transpose();
    }
  }
  basis_[at(c)] = leading(gram, cut * cut * double(dofs(c)));
  change_[at(c)] = basis_[at(c)].transpose() * columns;
}

/// The rows of a pair in the bases of the clusters of a level.
void ColumnCompression::shorten_rows(Index pair, int level) {
  const Index row = matrix_.far_pair[at(pair)][0];
  const int down = level - ClusterTree::level(row);
  if (down < 0) return;
  const Index first = ((row + 1) << down) - 1, end = first + (Index{1} << down);
  Eigen::Index count = 0;
  for (Index c = first; c < end; ++c) count += basis_[at(c)].cols();
  FloatRows shorter(count, rows_[at(pair)].cols());
  count = 0;
  for (Index c = first; c < end; ++c) {
    const Eigen::Index k = basis_[at(c)].cols();
    shorter.middleRows(count, k) = (basis_[at(c)].transpose() * part_in_rows(pair, c)).cast<float>();
    count += k;
  }
  rows_[at(pair)] = std::move(shorter);
}

void ColumnCompression::join_level(int level, double cut) {
  const ClusterTree& tree = matrix_.tree;
  const Index first = tree.first_of_level(level), end = first + (Index{1} << level);
  place_[at(first)] = 0;
  for (Index c = first; c < end; ++c) {
    const std::int64_t rows =
        level == tree.levels ? dofs(c) : basis_[at(2 * c + 1)].cols() + basis_[at(2 * c + 2)].cols();
    place_[at(c + 1)] = place_[at(c)] + rows;
  }
  parallel_for(end - first, jobs_, [&](std::int64_t i, int) {
    if (const Index c = first + static_cast<Index>(i); needed_[at(c)]) find_basis(c, cut);
  });
  parallel_for(std::ssize(rows_), jobs_,
               [&](std::int64_t pair, int) { shorten_rows(static_cast<Index>(pair), level); });
}

HierarchicalMatrix ColumnCompression::packed() {
  HierarchicalMatrix matrix = matrix_;
  const ClusterTree& tree = matrix.tree;
  for (Index c = 0; c < tree.clusters(); ++c) matrix.rank[at(c)] = static_cast<Index>(basis_[at(c)].cols());
  matrix.index();
  const std::shared_ptr<float[]> basis(new float[at(matrix.basis_at.back() + 1)]),
      transfer(new float[at(matrix.transfer_at.back() + 1)]),
      coupling(new float[at(matrix.coupling_at.back() + 1)]);
  const auto put = [](const Matrix& block, float* to) {
    Eigen::Map<FloatRows>(to, block.rows(), block.cols()) = block.cast<float>();
  };
  for (Index c = 1; c < tree.clusters(); ++c) {
    if (basis_[at(c)].cols() == 0) continue;
    if (c >= tree.first_leaf()) {
      const std::int64_t leaf = c - tree.first_leaf();
      Matrix V = root_[at(leaf)].triangularView<Eigen::Lower>() * basis_[at(c)];
      for (Eigen::Index i = 0; i < V.rows(); ++i)
        if (stored_dofs_[at(first_dof(c) + i)] < 0) V.row(i).setZero();  // held: but for rounding it is zero
      put(V, basis.get() + matrix.basis_at[at(leaf)]);
    } else {
      put(basis_[at(c)].topRows(matrix.rank[at(2 * c + 1)]),
          transfer.get() + matrix.transfer_at[at(2 * c + 1)]);
      put(basis_[at(c)].bottomRows(matrix.rank[at(2 * c + 2)]),
          transfer.get() + matrix.transfer_at[at(2 * c + 2)]);
    }
  }
  for (std::size_t p = 0; p < rows_.size(); ++p)
    put(rows_[p].cast<double>() * change_[at(matrix.far_pair[p][1])].transpose(),
        coupling.get() + matrix.coupling_at[p]);
  matrix.basis = basis;
  matrix.transfer = transfer;
  matrix.coupling = coupling;
  return matrix;
}

/// Solves for a tile and compresses its leaves: their fronts.
std::vector<ColumnCompression::Front> ColumnCompression::work_on(Index tile, Desk& desk, double cut) {
  {
    const Stopwatch watch(desk.times.solves);
    solve_tile(tile, desk);
  }
  const Stopwatch watch(desk.times.leaves);
  keep_near(tile, desk);
  std::vector<Front> fronts;
  for (Index c = first_of(tile); c < first_of(tile + 1); ++c)
    fronts.push_back(compress_leaf(c, tile, desk, cut));
  return fronts;
}

HierarchicalMatrix ColumnCompression::compress(double cut) {
  std::vector<Desk> desks(at(jobs_));
  parallel_for(tiles(), jobs_, [&](std::int64_t tile, int worker) {
    Desk& desk = desks[at(worker)];
    std::vector<Front> fronts = work_on(static_cast<Index>(tile), desk, cut);
    const Stopwatch watch(desk.times.joining);
    Index c = first_of(static_cast<Index>(tile));
    for (Front& front : fronts) hand_up(c++, std::move(front), cut);
  });
  for (const Desk& desk : desks) times_ += desk.times;
  desks.clear();
  for (const FloatRows& rows : rows_) kept_bytes_ += rows.size() * std::int64_t{sizeof(float)};
  const double start = seconds(CLOCK_PROCESS_CPUTIME_ID);
  weigh_rows();
  find_column_covariances();
  for (int level = matrix_.tree.levels; level > 0; --level) join_level(level, cut);
  HierarchicalMatrix matrix = packed();
  times_.joining += seconds(CLOCK_PROCESS_CPUTIME_ID) - start;
  return matrix;
}

ColumnTimes ColumnCompression::estimate(double cut, Index count) {
  std::vector<Desk> desks(at(jobs_));
  double flops = 0.0, entries = 0.0, all_flops = 0.0, all_entries = 0.0;
  for (Index tile = 0; tile < tiles(); ++tile) {
    all_flops += flops_of(tile);
    all_entries += double(tile_rows(tile).size()) * double(tile_columns(tile).size());
  }
  const auto chosen = [&](std::int64_t k) { return static_cast<Index>((2 * k + 1) * tiles() / (2 * count)); };
  for (Index k = 0; k < count; ++k) {
    flops += flops_of(chosen(k));
    entries += double(tile_rows(chosen(k)).size()) * double(tile_columns(chosen(k)).size());
  }
  parallel_for(count, jobs_, [&](std::int64_t k, int worker) { work_on(chosen(k), desks[at(worker)], cut); });
  ColumnTimes sum;
  for (const Desk& desk : desks) sum += desk.times;
  return {sum.solves * all_flops / flops, sum.leaves * all_entries / entries, 0.0};
}

}  // namespace palpate::test
