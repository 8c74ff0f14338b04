#include "precompute/numerics/krylov_space.h"

#include <algorithm>

namespace palpate {
namespace {

using Matrix = Eigen::MatrixXd;

// Sizes of an item. The bytes depend on these.
constexpr std::int64_t rows_together = 4096, columns_together = 4;

std::int64_t pieces(std::int64_t whole, std::int64_t together) {
  return (whole + together - 1) / together;
}

/// Rows of an item's block.
struct Rows {
  std::int64_t first, count;

  Rows(std::int64_t block, std::int64_t all)
      : first(block * rows_together), count(std::min(rows_together, all - first)) {}
};

auto rows_of(Matrix& A, const Rows& rows) {
  return A.middleRows(rows.first, rows.count);
}
auto rows_of(const Matrix& A, const Rows& rows) {
  return A.middleRows(rows.first, rows.count);
}

Matrix sum(const std::vector<Matrix>& parts) {
  Matrix result = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) result += parts[i];
  return result;
}

}  // namespace

SharedPencil::SharedPencil(const Factor& factor, const SparseMatrix& M, Sharing& sharing)
    : factor_(factor),
      sweeps_(factor),
      workspaces_(static_cast<std::size_t>(sharing.jobs())),
      M_(M.pruned()),
      sharing_(sharing) {}

void SharedPencil::share(std::int64_t items, const std::function<void(std::int64_t item, int worker)>& work) {
  if (!stopped_) stopped_ = !sharing_.for_each({items, work, {}});
}

Matrix SharedPencil::inverse_times(Matrix B) {
  if (factor_.spread_numbers() != nullptr) {  // all processes solve together
    const std::vector<double> x = factor_.solve({B.data(), static_cast<std::size_t>(B.size())}, B.cols());
    std::copy(x.begin(), x.end(), B.data());
    return B;
  }
  share(pieces(B.cols(), columns_together), [&](std::int64_t item, int worker) {
    const std::int64_t first = item * columns_together;
    auto some = B.middleCols(first, std::min(columns_together, B.cols() - first));
    sweeps_.solve(some.data(), some.cols(), workspaces_[static_cast<std::size_t>(worker)]);
  });
  return B;
}

Matrix SharedPencil::mass_times(const Matrix& W) {
  Matrix result(W.rows(), W.cols());
  share(pieces(W.cols(), columns_together), [&](std::int64_t item, int) {
    const std::int64_t first = item * columns_together, count = std::min(columns_together, W.cols() - first);
    result.middleCols(first, count).noalias() =
        M_.selfadjointView<Eigen::Lower>() * W.middleCols(first, count);
  });
  return result;
}

Matrix SharedPencil::product(const Matrix& A, const Matrix& B) {
  std::vector<Matrix> parts(static_cast<std::size_t>(pieces(order(), rows_together)));
  share(std::ssize(parts), [&](std::int64_t item, int) {
    const Rows rows(item, order());
    parts[static_cast<std::size_t>(item)].noalias() = rows_of(A, rows).transpose() * rows_of(B, rows);
  });
  return stopped_ ? Matrix::Zero(A.cols(), B.cols()) : sum(parts);
}

KrylovSpace::KrylovSpace(SharedPencil& pencil, std::int64_t capacity) : pencil_(pencil) {
  for (std::int64_t block = 0; block < pieces(pencil.order(), rows_together); ++block)
    blocks_.emplace_back(Rows(block, pencil.order()).count, capacity);
}

void KrylovSpace::append(const Matrix& Q) {
  pencil_.repeat(std::ssize(blocks_), [&](std::int64_t block) {
    blocks_[static_cast<std::size_t>(block)].middleCols(size_, Q.cols()) = rows_of(Q, Rows(block, Q.rows()));
  });
  size_ += Q.cols();
}

Matrix KrylovSpace::coefficients(const Matrix& M_W) {
  std::vector<Matrix> parts(blocks_.size());
  pencil_.share(std::ssize(blocks_), [&](std::int64_t block, int) {
    const auto b = static_cast<std::size_t>(block);
    parts[b].noalias() = blocks_[b].leftCols(size_).transpose() * rows_of(M_W, Rows(block, M_W.rows()));
  });
  return pencil_.stopped() ? Matrix::Zero(size_, M_W.cols()) : sum(parts);
}

void KrylovSpace::remove(const Matrix& coefficients, Matrix& W) {
  pencil_.share(std::ssize(blocks_), [&](std::int64_t block, int) {
    const Rows rows(block, W.rows());
    Matrix part = rows_of(W, rows);
    part.noalias() -= blocks_[static_cast<std::size_t>(block)].leftCols(size_) * coefficients;
    rows_of(W, rows) = part;
  });
}

Matrix KrylovSpace::combine(const Matrix& Y) {
  Matrix result(pencil_.order(), Y.cols());
  pencil_.repeat(std::ssize(blocks_), [&](std::int64_t block) {
    rows_of(result, Rows(block, result.rows())).noalias() =
        blocks_[static_cast<std::size_t>(block)].leftCols(size_) * Y;
  });
  return result;
}

void KrylovSpace::replace(const Matrix& Y) {
  pencil_.repeat(std::ssize(blocks_), [&](std::int64_t block) {
    Matrix& rows = blocks_[static_cast<std::size_t>(block)];
    rows.leftCols(Y.cols()) = Matrix(rows.leftCols(size_) * Y);
  });
  size_ = Y.cols();
}

}  // namespace palpate
