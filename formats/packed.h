// Symmetric matrices in LAPACK's lower packed order, on disk and in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace palpate {

/// Stored scalar of the Green's functions. All arithmetic is done in double.
enum class Precision : std::uint8_t { single_precision, double_precision };

constexpr std::int64_t bytes_per_scalar(Precision p) {
  return p == Precision::single_precision ? 4 : 8;
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

/// The block of the Green's function matrix Xi = K^-1 [m/N] for the stored dofs. Read-only; usually a mapping
/// of the file. Copies share the data.
class PackedGreens {
 public:
  PackedGreens() = default;

  /// `data` holds packed_size(order) scalars of the given precision and is kept alive by the pointer.
  PackedGreens(std::shared_ptr<const void> data, std::int64_t order, Precision precision)
      : data_(std::move(data)), order_(order), precision_(precision) {}

  [[nodiscard]] std::int64_t order() const noexcept { return order_; }  ///< number of stored dofs n
  [[nodiscard]] Precision precision() const noexcept { return precision_; }
  [[nodiscard]] const void* data() const noexcept { return data_.get(); }
  /// The matrix is this times what is stored.
  [[nodiscard]] double scale() const noexcept { return scale_; }

  /// The matrix times `factor`, of the same data.
  [[nodiscard]] PackedGreens scaled(double factor) const {
    PackedGreens copy = *this;
    copy.scale_ *= factor;
    return copy;
  }

  /// All packed_size(order()) entries as they are stored; T (float or double) must be the stored scalar.
  template <class T>
  [[nodiscard]] std::span<const T> as() const noexcept {
    return {static_cast<const T*>(data_.get()), static_cast<std::size_t>(packed_size(order_))};
  }

  /// Entry (i, j) of the symmetric matrix [m/N], either triangle.
  [[nodiscard]] double operator()(std::int64_t i, std::int64_t j) const noexcept {
    const auto k = static_cast<std::size_t>(i >= j ? packed_index(i, j, order_) : packed_index(j, i, order_));
    return scale_ * (precision_ == Precision::single_precision ? static_cast<double>(as<float>()[k])
                                                               : as<double>()[k]);
  }

 private:
  std::shared_ptr<const void> data_;
  std::int64_t order_ = 0;
  Precision precision_ = Precision::double_precision;
  double scale_ = 1.0;
};

}  // namespace palpate
