// Symmetric matrices in LAPACK's lower packed order, on disk and in memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace palpate {

/// Storage of a packed matrix. All arithmetic is in double.
enum class Precision : std::uint8_t {
  single_precision,  ///< its entries as float
  split_precision,   ///< A = R + W W^T: a smooth part W in double, the entries of the remainder R as float
  double_precision,  ///< its entries as double
};

/// Name in model.toml.
constexpr const char* name_of(Precision p) {
  return p == Precision::single_precision ? "single" : p == Precision::split_precision ? "split" : "double";
}

/// True if the packed entries are float.
constexpr bool has_float_entries(Precision p) {
  return p != Precision::double_precision;
}

constexpr std::int64_t bytes_per_scalar(Precision p) {
  return has_float_entries(p) ? 4 : 8;
}

/// Number of stored entries of a symmetric matrix of the given order.
constexpr std::int64_t packed_size(std::int64_t order) {
  return order * (order + 1) / 2;
}

/// Position of entry (i, j), i >= j, in the column-major lower triangle (LAPACK `uplo = 'L'`, as dpptri
/// leaves it).
constexpr std::int64_t packed_index(std::int64_t i, std::int64_t j, std::int64_t order) {
  return i + j * (2 * order - j - 1) / 2;
}

/// First stored entry of column j (its diagonal); column j holds order - j entries.
constexpr std::int64_t packed_column(std::int64_t j, std::int64_t order) {
  return packed_index(j, j, order);
}

/// Largest number of terms of a smooth part, since a tick keeps that many numbers on its stack.
inline constexpr std::int64_t most_smooth_terms = 256;

/// W of a matrix A = R + W W^T whose remainder R is rounded to single: W holds the part that neighbouring
/// columns of A have in common, so that R and its rounding errors are small.
struct SmoothPart {
  std::int64_t terms = 0;    ///< k, columns of W
  std::vector<double> rows;  ///< [n x k] row-major

  /// [k] Row of W for a dof.
  [[nodiscard]] const double* row(std::int64_t dof) const noexcept { return rows.data() + dof * terms; }
  /// Entry (i, j) of W W^T.
  [[nodiscard]] double operator()(std::int64_t i, std::int64_t j) const noexcept {
    const double *a = row(i), *b = row(j);
    std::array<double, 8> lanes{};  // eight sums that the compiler can vectorise
    std::int64_t k = 0;
    for (; k + 8 <= terms; k += 8)
      for (std::size_t lane = 0; lane < 8; ++lane)
        lanes[lane] += a[k + std::int64_t(lane)] * b[k + std::int64_t(lane)];
    for (; k < terms; ++k) lanes[0] += a[k] * b[k];
    return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
  }
};

/// Block of the Green's function matrix Xi = K^-1 [m/N] for the stored dofs. Read-only; usually a mapping of
/// the file. Copies share the data.
class PackedGreens {
 public:
  PackedGreens() = default;

  /// `data` holds packed_size(order) scalars of the given precision and is kept alive by the pointer.
  /// `smooth` [order rows]: with split precision, else null.
  PackedGreens(std::shared_ptr<const void> data, std::int64_t order, Precision precision,
               std::shared_ptr<const SmoothPart> smooth = nullptr)
      : data_(std::move(data)), smooth_(std::move(smooth)), order_(order), precision_(precision) {}

  [[nodiscard]] std::int64_t order() const noexcept { return order_; }  ///< number of stored dofs n
  [[nodiscard]] Precision precision() const noexcept { return precision_; }
  [[nodiscard]] const void* data() const noexcept { return data_.get(); }
  /// W of split precision, null otherwise.
  [[nodiscard]] const std::shared_ptr<const SmoothPart>& smooth() const noexcept { return smooth_; }
  /// Factor on all stored entries, W W^T included.
  [[nodiscard]] double scale() const noexcept { return scale_; }

  /// The matrix times `factor`, with the same data.
  [[nodiscard]] PackedGreens scaled(double factor) const {
    PackedGreens copy = *this;
    copy.scale_ *= factor;
    return copy;
  }

  /// All packed_size(order()) entries as stored, without scale and smooth part; T (float or double) must be
  /// the stored scalar.
  template <class T>
  [[nodiscard]] std::span<const T> as() const noexcept {
    return {static_cast<const T*>(data_.get()), static_cast<std::size_t>(packed_size(order_))};
  }

  /// Stored entry (i, j) times scale, without the smooth part; either triangle.
  [[nodiscard]] double stored(std::int64_t i, std::int64_t j) const noexcept {
    const auto k = static_cast<std::size_t>(i >= j ? packed_index(i, j, order_) : packed_index(j, i, order_));
    return scale_ * (has_float_entries(precision_) ? static_cast<double>(as<float>()[k]) : as<double>()[k]);
  }

  /// Entry (i, j) of the symmetric matrix [m/N], either triangle.
  [[nodiscard]] double operator()(std::int64_t i, std::int64_t j) const noexcept {
    return smooth_ == nullptr ? stored(i, j) : stored(i, j) + scale_ * (*smooth_)(i, j);
  }

 private:
  std::shared_ptr<const void> data_;
  std::shared_ptr<const SmoothPart> smooth_;
  std::int64_t order_ = 0;
  Precision precision_ = Precision::double_precision;
  double scale_ = 1.0;
};

}  // namespace palpate
