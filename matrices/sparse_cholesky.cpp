#include "matrices/sparse_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <numeric>
#include <type_traits>

namespace palpate {
namespace {

using Block = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

std::size_t at(int i) noexcept {
  return static_cast<std::size_t>(i);
}

std::size_t square(int n) noexcept {
  return at(n) * at(n);
}

/// [n] Columns before the diagonal in each row of P A P^T.
std::vector<std::vector<int>> columns_before(const Eigen::SparseMatrix<double>& A,
                                             const std::vector<int>& position) {
  std::vector<std::vector<int>> before(position.size());
  for (int column = 0; column < A.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(A, column); entry; ++entry) {
      if (entry.row() <= entry.col()) continue;
      const auto [first, last] =
          std::minmax(position[at(static_cast<int>(entry.row()))], position[at(column)]);
      before[at(last)].push_back(first);
    }
  }
  return before;
}

/// [n] Parents in the elimination tree (Liu 1986), -1 of roots.
std::vector<int> elimination_tree(const std::vector<std::vector<int>>& before) {
  std::vector<int> parent(before.size(), -1), ancestor(before.size(), -1);
  for (int row = 0; row < std::ssize(before); ++row) {
    for (int column : before[at(row)]) {
      while (column != -1 && column < row) {
        const int next = ancestor[at(column)];
        ancestor[at(column)] = row;
        if (next == -1) parent[at(column)] = row;
        column = next;
      }
    }
  }
  return parent;
}

/// [n] The nodes of a forest, children before parents and subtrees in one piece.
std::vector<int> postorder(const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  std::vector<int> child(parent.size(), -1), sibling(parent.size(), -1), order, open;
  for (int node = n; node-- > 0;) {
    if (parent[at(node)] < 0) continue;
    sibling[at(node)] = child[at(parent[at(node)])];
    child[at(parent[at(node)])] = node;
  }
  order.reserve(parent.size());
  for (int root = 0; root < n; ++root) {
    if (parent[at(root)] >= 0) continue;
    open.push_back(root);
    while (!open.empty()) {
      const int node = open.back();
      if (const int next = child[at(node)]; next >= 0) {
        child[at(node)] = sibling[at(next)];
        open.push_back(next);
      } else {
        order.push_back(node);
        open.pop_back();
      }
    }
  }
  return order;
}

/// True if a supernode of so many columns may have this fraction of zeros among its entries: dense blocks are
/// worth them while they are narrow.
bool may_have_zeros(int columns, double share) noexcept {
  return columns <= 6 || (columns <= 16 && share < 0.6) || (columns <= 48 && share < 0.15) || share < 0.05;
}

}  // namespace

/// Puts position_ and the rows' columns into postorder of the elimination tree; returns the tree.
std::vector<int> SparseCholesky::postordered_tree(std::vector<std::vector<int>>& before) {
  const std::vector<int> parent = elimination_tree(before), order = postorder(parent);
  std::vector<int> now(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) now[at(order[k])] = static_cast<int>(k);
  for (int& position : position_) position = now[at(position)];
  std::vector<std::vector<int>> moved(before.size());
  std::vector<int> moved_parent(parent.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    moved[k] = std::move(before[at(order[k])]);
    for (int& column : moved[k]) column = now[at(column)];
    const int of = parent[at(order[k])];
    moved_parent[k] = of < 0 ? -1 : now[at(of)];
  }
  before = std::move(moved);
  return moved_parent;
}

/// [n] Entries of each column of L, the diagonal included: the entries of each row form a subtree.
std::vector<int> SparseCholesky::column_counts(const std::vector<std::vector<int>>& before,
                                               const std::vector<int>& parent) {
  std::vector<int> counts(before.size(), 1), seen(before.size(), -1);
  for (int row = 0; row < std::ssize(before); ++row) {
    seen[at(row)] = row;
    for (int column : before[at(row)]) {
      for (; seen[at(column)] != row; column = parent[at(column)]) {
        ++counts[at(column)];
        seen[at(column)] = row;
      }
    }
  }
  return counts;
}

/// Merges columns with the same rows, and then supernodes with their parents while zeros stay few.
void SparseCholesky::find_supernodes(const std::vector<int>& parent, const std::vector<int>& counts) {
  supernodes_.clear();
  const int n = static_cast<int>(parent.size()) - kept_;
  for (int column = 0; column < n; ++column) {
    const bool joins =
        column > 0 && parent[at(column - 1)] == column && counts[at(column - 1)] == counts[at(column)] + 1;
    if (!joins) supernodes_.push_back({.first = column, .columns = 0, .rows = counts[at(column)]});
    ++supernodes_.back().columns;
  }
  std::vector<Supernode> merged;  // from the last to the first
  std::vector<double> zeros;
  for (std::size_t s = supernodes_.size(); s-- > 0;) {
    const Supernode& one = supernodes_[s];
    const int last = one.first + one.columns - 1;
    if (!merged.empty() && parent[at(last)] == merged.back().first) {
      Supernode& next = merged.back();
      const int columns = one.columns + next.columns;
      const double more = zeros.back() + 1.0 * one.columns * (one.columns + next.rows - one.rows),
                   all = 0.5 * columns * (columns + 1) + 1.0 * columns * next.below();
      if (may_have_zeros(columns, more / all)) {
        next = {.first = one.first, .columns = columns, .rows = one.columns + next.rows};
        zeros.back() = more;
        continue;
      }
    }
    merged.push_back(one);
    zeros.push_back(0.0);
  }
  supernodes_.assign(merged.rbegin(), merged.rend());
  if (kept_ > 0) supernodes_.push_back({.first = n, .columns = kept_, .rows = kept_});
}

/// [n] Supernode of each column.
std::vector<int> SparseCholesky::supernode_of_column() const {
  std::vector<int> of_column(position_.size());
  for (std::size_t s = 0; s < supernodes_.size(); ++s)
    std::fill_n(of_column.begin() + supernodes_[s].first, supernodes_[s].columns, static_cast<int>(s));
  return of_column;
}

/// Finds the rows of each supernode: those of A and those of its children's updates.
void SparseCholesky::find_rows(const std::vector<std::vector<int>>& before) {
  const std::vector<int> of_column = supernode_of_column();
  std::vector<std::vector<int>> rows(supernodes_.size());
  for (int row = 0; row < std::ssize(before); ++row) {
    for (const int column : before[at(row)]) {
      std::vector<int>& of = rows[at(of_column[at(column)])];
      if (of.empty() || of.back() != row) of.push_back(row);
    }
  }
  rows_.clear();
  in_parent_.clear();
  std::size_t values = 0;
  for (std::size_t s = 0; s < supernodes_.size(); ++s) {
    Supernode& supernode = supernodes_[s];
    const int end = supernode.first + supernode.columns;
    std::vector<int>& own = rows[s];
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    own.erase(own.begin(), std::lower_bound(own.begin(), own.end(), end));
    supernode.rows_at = rows_.size();
    supernode.rows = supernode.columns + static_cast<int>(own.size());
    supernode.values_at = values;
    values += at(supernode.rows) * at(supernode.columns);
    rows_.resize(rows_.size() + at(supernode.columns));
    std::iota(rows_.end() - supernode.columns, rows_.end(), supernode.first);
    rows_.insert(rows_.end(), own.begin(), own.end());
    if (own.empty()) continue;
    supernode.parent = of_column[at(own.front())];
    std::vector<int>& parents = rows[at(supernode.parent)];
    parents.insert(parents.end(), own.begin(), own.end());
  }
  values_.resize(values);
  in_parent_.assign(rows_.size(), -1);
  for (const Supernode& child : supernodes_) {
    if (child.parent < 0) continue;
    const Supernode& parent = supernodes_[at(child.parent)];
    int place = 0;
    for (std::size_t k = child.rows_at + at(child.columns); k < child.rows_at + at(child.rows); ++k) {
      while (rows_[parent.rows_at + at(place)] != rows_[k]) ++place;
      in_parent_[k] = place;
    }
  }
}

/// Finds the place of each entry of A.
void SparseCholesky::find_places(const Eigen::SparseMatrix<double>& A) {
  const std::vector<int> of_column = supernode_of_column();
  places_.clear();
  places_.reserve(static_cast<std::size_t>(A.nonZeros()));
  for (int k = 0; k < A.outerSize(); ++k) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(A, k); entry; ++entry) {
      if (entry.row() < entry.col()) {
        places_.push_back(-1);
        continue;
      }
      const auto [column, row] = std::minmax(position_[at(static_cast<int>(entry.row()))], position_[at(k)]);
      const Supernode& supernode = supernodes_[at(of_column[at(column)])];
      const auto begin = rows_.begin() + static_cast<std::ptrdiff_t>(supernode.rows_at);
      const std::ptrdiff_t place = std::lower_bound(begin, begin + supernode.rows, row) - begin;
      places_.push_back(static_cast<std::ptrdiff_t>(supernode.values_at) +
                        std::ptrdiff_t{supernode.rows} * (column - supernode.first) + place);
    }
  }
}

/// Reserves the memory for the updates that wait for their parents at any moment.
void SparseCholesky::find_room() {
  std::vector<std::size_t> left(supernodes_.size(), 0);  // by the children of a supernode
  std::size_t now = 0, most = 0;
  for (std::size_t s = 0; s < supernodes_.size(); ++s) {
    const std::size_t own = square(supernodes_[s].below());
    most = std::max(most, now + own);
    now += own - left[s];
    if (supernodes_[s].parent >= 0) left[at(supernodes_[s].parent)] += own;
  }
  stack_.resize(most);
}

void SparseCholesky::analyse(const Eigen::SparseMatrix<double>& A, int kept) {
  kept_ = kept;
  const int n = static_cast<int>(A.rows()), first_kept = n - kept;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  const Eigen::SparseMatrix<double> A_ee = A.topLeftCorner(first_kept, first_kept);
  if (first_kept > 0) Eigen::AMDOrdering<int>()(A_ee.selfadjointView<Eigen::Lower>(), order);
  position_.resize(at(n));
  std::iota(position_.begin(), position_.end(), 0);
  for (int k = 0; k < first_kept; ++k) position_[at(order.indices()[k])] = k;
  std::vector<std::vector<int>> before = columns_before(A, position_);
  for (int row = first_kept + 1; row < n; ++row) before[at(row)].push_back(row - 1);  // they stay together
  const std::vector<int> parent = postordered_tree(before);
  find_supernodes(parent, column_counts(before, parent));
  find_rows(before);
  find_places(A);
  find_room();
}

/// Adds a child's update to the columns of its parent and to the parent's update.
void SparseCholesky::take(const Supernode& child, const double* left, Supernode& into,
                          double* update) noexcept {
  const int n = child.below();
  const int* place = in_parent_.data() + child.rows_at + child.columns;
  double* panel = values_.data() + into.values_at;
  for (int j = 0; j < n; ++j, left += n) {
    const bool own = place[j] < into.columns;
    const int skipped = own ? 0 : into.columns;
    double* column = own ? panel + std::ptrdiff_t{into.rows} * place[j]
                         : update + std::ptrdiff_t{into.below()} * (place[j] - into.columns);
    for (int i = j; i < n; ++i) column[place[i] - skipped] += left[i];
  }
}

/// Factorises the columns of a supernode and subtracts their contribution from `update`.
bool SparseCholesky::eliminate(const Supernode& supernode, double* update) {
  double* panel = values_.data() + supernode.values_at;
  const int rows = supernode.rows, columns = supernode.columns, below = supernode.below();
  Block diagonal(panel, columns, columns, Eigen::OuterStride<>(rows));
  Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>> in_place(diagonal);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd, 0, Eigen::OuterStride<>>> llt(in_place);
  if (llt.info() != Eigen::Success || !(diagonal.diagonal().array() > 0.0).all()) return false;
  if (below == 0) return true;
  Block lower(panel + columns, below, columns, Eigen::OuterStride<>(rows));
  diagonal.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(lower);
  Block(update, below, below, Eigen::OuterStride<>(below))
      .selfadjointView<Eigen::Lower>()
      .rankUpdate(lower, -1.0);
  return true;
}

SparseCholesky::ConstBlock SparseCholesky::diagonal_of(const Supernode& supernode) const {
  return {values_.data() + supernode.values_at, supernode.columns, supernode.columns,
          Eigen::OuterStride<>(supernode.rows)};
}

SparseCholesky::ConstBlock SparseCholesky::lower_of(const Supernode& supernode) const {
  return {values_.data() + supernode.values_at + supernode.columns, supernode.below(), supernode.columns,
          Eigen::OuterStride<>(supernode.rows)};
}

bool SparseCholesky::factorise(const Eigen::SparseMatrix<double>& A) {
  std::fill(values_.begin(), values_.end(), 0.0);
  for (std::size_t k = 0; k < places_.size(); ++k) {
    if (places_[k] >= 0) values_[static_cast<std::size_t>(places_[k])] += A.valuePtr()[k];
  }
  double* top = stack_.data();
  std::vector<int> waiting;  // supernodes whose parents have not come yet
  for (int s = 0; s < std::ssize(supernodes_); ++s) {
    Supernode& supernode = supernodes_[at(s)];
    double* update = top;
    std::fill_n(update, square(supernode.below()), 0.0);
    while (!waiting.empty() && supernodes_[at(waiting.back())].parent == s) {
      const Supernode& child = supernodes_[at(waiting.back())];
      top -= square(child.below());
      take(child, top, supernode, update);
      waiting.pop_back();
    }
    if (at(s) < eliminated() && !eliminate(supernode, update)) return false;
    if (supernode.parent < 0) continue;
    std::copy_n(update, square(supernode.below()), top);
    top += square(supernode.below());
    waiting.push_back(s);
  }
  return true;
}

/// Solves L_ee^T x = y - L_ke^T x_k in place, where y already has x_k.
void SparseCholesky::substitute_back(auto& y) const {
  for (std::size_t s = eliminated(); s-- > 0;) {
    const Supernode& supernode = supernodes_[s];
    const int* rows = rows_.data() + supernode.rows_at + supernode.columns;
    std::decay_t<decltype(y)> part(supernode.below(), y.cols());
    for (int i = 0; i < supernode.below(); ++i) part.row(i) = y.row(rows[i]);
    auto own = y.middleRows(supernode.first, supernode.columns);
    own.noalias() -= lower_of(supernode).transpose() * part;
    diagonal_of(supernode).transpose().template triangularView<Eigen::Upper>().solveInPlace(own);
  }
}

template <class Columns>
Columns SparseCholesky::solve_columns(const Columns& b) const {
  Columns x(b.rows(), b.cols()), y = Columns::Zero(b.rows(), b.cols());
  for (int k = 0; k < b.rows(); ++k) y.row(position_[at(k)]) = b.row(k);
  for (const Supernode& supernode : supernodes_) {
    const int* rows = rows_.data() + supernode.rows_at + supernode.columns;
    auto own = y.middleRows(supernode.first, supernode.columns);
    if ((own.array() == 0.0).all()) continue;  // few columns of b reach all of L
    diagonal_of(supernode).template triangularView<Eigen::Lower>().solveInPlace(own);
    const Columns part = lower_of(supernode) * own;
    for (int i = 0; i < supernode.below(); ++i) y.row(rows[i]) -= part.row(i);
  }
  substitute_back(y);
  for (int k = 0; k < b.rows(); ++k) x.row(k) = y.row(position_[at(k)]);
  return x;
}

Eigen::Map<const Eigen::MatrixXd> SparseCholesky::schur() const {
  return {values_.data() + (kept_ > 0 ? supernodes_.back().values_at : 0), kept_, kept_};
}

Eigen::VectorXd SparseCholesky::extended(const Eigen::VectorXd& x) const {
  const Eigen::Index n = std::ssize(position_) - kept_;
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n + kept_), result(n);
  y.tail(kept_) = x;
  substitute_back(y);
  for (Eigen::Index k = 0; k < n; ++k) result[k] = y[position_[static_cast<std::size_t>(k)]];
  return result;
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::MatrixXd& b) const {
  return solve_columns(b);
}

Eigen::VectorXd SparseCholesky::solve(const Eigen::VectorXd& b) const {
  return solve_columns(b);
}

}  // namespace palpate
