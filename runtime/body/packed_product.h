// y = A x of a symmetric matrix in packed storage, as fast as memory gives it.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include "formats/packed.h"

namespace palpate {

/// Multiplies a packed symmetric matrix by vectors, on several threads: each entry is read once and counts
/// for both triangles. Arithmetic is in double; the result does not depend on which thread was faster.
/// Helpers spin for some microseconds after a product, so that products in a row begin at once, and sleep
/// after that. For one caller at a time, not for the tick.
class PackedProduct {
 public:
  /// `jobs` threads, the caller among them. The matrix must live as long.
  PackedProduct(const PackedGreens& matrix, int jobs);
  ~PackedProduct();
  PackedProduct(const PackedProduct&) = delete;
  PackedProduct& operator=(const PackedProduct&) = delete;

  /// y [n] = A x [n].
  void multiply(std::span<const double> x, std::span<double> y) noexcept;

  [[nodiscard]] int jobs() const noexcept { return static_cast<int>(parts_.size()); }

 private:
  struct Part {
    std::int64_t first, last;  // columns
    std::vector<double> y;     // [n - first] rows from `first` on
  };

  void work(Part& part) noexcept;
  void help(Part& part, const std::stop_token& stop) noexcept;
  void add_up(std::span<double> y) const noexcept;
  void add_smooth(std::span<const double> x, std::span<double> y) noexcept;

  const PackedGreens& matrix_;
  std::vector<Part> parts_;
  std::vector<double> by_smooth_;  // [k] W^T x of split precision
  const double* x_ = nullptr;
  std::atomic<std::uint32_t> round_ = 0;    // of products
  std::atomic<std::uint32_t> working_ = 0;  // helpers that are not done with this round
  std::vector<std::jthread> helpers_;
};

}  // namespace palpate
