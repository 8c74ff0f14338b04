// Product y = A x of a packed symmetric matrix, at the speed of the memory.
#pragma once

#include <atomic>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include "matrices/packed.h"

namespace palpate {

/// Multiplies a packed symmetric matrix by vectors, on several threads. Each entry is read once and used for
/// both triangles. Arithmetic is in double; the result does not depend on the threads' timing. Helper threads
/// spin for some microseconds after a product, so that consecutive products start at once, and then sleep.
/// For one caller at a time, not for the tick.
class PackedProduct {
 public:
  /// `jobs` threads, including the caller. The matrix must outlive this.
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
  std::atomic<std::uint32_t> round_ = 0;    // number of products
  std::atomic<std::uint32_t> working_ = 0;  // helpers still working on this product
  std::vector<std::jthread> helpers_;
};

}  // namespace palpate
