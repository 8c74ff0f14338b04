#include "runtime/packed_product.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

namespace palpate {
namespace {

constexpr std::int64_t columns = 8;  // that share what is loaded of x and y
constexpr std::int64_t rows = 1024;  // of x and y that stay in the first-level cache
constexpr auto patience = std::chrono::microseconds(200);

/// y += A x and the dot products of the columns with x, over rows [first, first + count) below the diagonal
/// of a group of columns; `a` are their entries there.
template <class T>
void multiply_rows(const std::array<const T*, columns>& a, const std::array<double, columns>& by,
                   const double* __restrict x, double* __restrict y, std::array<double, columns>& sums,
                   std::int64_t count) noexcept {
  const T* __restrict a0 = a[0];
  const T* __restrict a1 = a[1];
  const T* __restrict a2 = a[2];
  const T* __restrict a3 = a[3];
  const T* __restrict a4 = a[4];
  const T* __restrict a5 = a[5];
  const T* __restrict a6 = a[6];
  const T* __restrict a7 = a[7];
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0, s5 = 0, s6 = 0, s7 = 0;
#pragma omp simd reduction(+ : s0, s1, s2, s3, s4, s5, s6, s7)
  for (std::int64_t i = 0; i < count; ++i) {
    const double e0 = a0[i], e1 = a1[i], e2 = a2[i], e3 = a3[i], e4 = a4[i], e5 = a5[i], e6 = a6[i],
                 e7 = a7[i];
    s0 += e0 * x[i];
    s1 += e1 * x[i];
    s2 += e2 * x[i];
    s3 += e3 * x[i];
    s4 += e4 * x[i];
    s5 += e5 * x[i];
    s6 += e6 * x[i];
    s7 += e7 * x[i];
    y[i] += ((e0 * by[0] + e1 * by[1]) + (e2 * by[2] + e3 * by[3])) +
            ((e4 * by[4] + e5 * by[5]) + (e6 * by[6] + e7 * by[7]));
  }
  sums[0] += s0;
  sums[1] += s1;
  sums[2] += s2;
  sums[3] += s3;
  sums[4] += s4;
  sums[5] += s5;
  sums[6] += s6;
  sums[7] += s7;
}

/// Columns [first, last) of the packed triangle: y [rows from first on].
template <class T>
void multiply_columns(std::span<const T> packed, std::int64_t order, const double* x, std::int64_t first,
                      std::int64_t last, std::span<double> y) noexcept {
  std::fill(y.begin(), y.end(), 0.0);
  const auto entry = [&](std::int64_t i, std::int64_t j) {
    return packed.data() + packed_index(i, j, order);
  };
  std::int64_t j = first;
  for (; j < last; j += columns) {
    const std::int64_t group = std::min(columns, last - j);
    // The triangle at the diagonal, and columns that do not fill a group.
    for (std::int64_t c = 0; c < group; ++c) {
      const T* a = entry(j + c, j + c);
      const std::int64_t end = group == columns ? j + columns : order;
      double sum = static_cast<double>(a[0]) * x[j + c];
      for (std::int64_t i = j + c + 1; i < end; ++i) {
        const auto e = static_cast<double>(a[i - j - c]);
        sum += e * x[i];
        y[static_cast<std::size_t>(i - first)] += e * x[j + c];
      }
      y[static_cast<std::size_t>(j + c - first)] += sum;
    }
    if (group < columns) return;
    std::array<double, columns> by;
    std::array<double, columns> sums{};
    std::copy_n(x + j, columns, by.begin());
    for (std::int64_t i = j + columns; i < order; i += rows) {
      std::array<const T*, columns> a;
      for (std::int64_t c = 0; c < columns; ++c) a[static_cast<std::size_t>(c)] = entry(i, j + c);
      multiply_rows<T>(a, by, x + i, y.data() + (i - first), sums, std::min(rows, order - i));
    }
    for (std::int64_t c = 0; c < columns; ++c)
      y[static_cast<std::size_t>(j + c - first)] += sums[static_cast<std::size_t>(c)];
  }
}

}  // namespace

PackedProduct::PackedProduct(const PackedGreens& matrix, int jobs) : matrix_(matrix) {
  // As many entries each: those of the columns from j on are (n - j)^2 / 2.
  const std::int64_t n = matrix.order();
  std::int64_t first = 0;
  for (int k = 1; k <= jobs; ++k) {
    const double left = static_cast<double>(n) * std::sqrt(static_cast<double>(jobs - k) / jobs);
    const std::int64_t last = std::max(first, n - static_cast<std::int64_t>(std::llround(left)));
    parts_.push_back({first, last, std::vector<double>(static_cast<std::size_t>(n - first))});
    first = last;
  }
  for (std::size_t k = 1; k < parts_.size(); ++k) {
    helpers_.emplace_back([this, k](const std::stop_token& stop) { help(parts_[k], stop); });
  }
}

PackedProduct::~PackedProduct() {
  for (std::jthread& helper : helpers_) helper.request_stop();
  ++round_;
  round_.notify_all();
}

void PackedProduct::multiply(std::span<const double> x, std::span<double> y) noexcept {
  x_ = x.data();
  working_ = static_cast<std::uint32_t>(helpers_.size());
  ++round_;
  round_.notify_all();
  work(parts_.front());
  while (working_ != 0) std::this_thread::yield();
  add_up(y);
}

void PackedProduct::work(Part& part) noexcept {
  if (matrix_.precision() == Precision::single_precision) {
    multiply_columns(matrix_.as<float>(), matrix_.order(), x_, part.first, part.last, part.y);
  } else {
    multiply_columns(matrix_.as<double>(), matrix_.order(), x_, part.first, part.last, part.y);
  }
}

void PackedProduct::help(Part& part, const std::stop_token& stop) noexcept {
  std::uint32_t seen = 0;
  while (true) {
    const auto begin = std::chrono::steady_clock::now();
    while (round_ == seen && std::chrono::steady_clock::now() - begin < patience) {
    }
    round_.wait(seen);
    seen = round_;
    if (stop.stop_requested()) return;
    work(part);
    --working_;
  }
}

void PackedProduct::add_up(std::span<double> y) const noexcept {
  std::copy(parts_.front().y.begin(), parts_.front().y.end(), y.begin());
  for (std::size_t k = 1; k < parts_.size(); ++k) {
    double* sum = y.data() + parts_[k].first;
    for (std::size_t i = 0; i < parts_[k].y.size(); ++i) sum[i] += parts_[k].y[i];
  }
}

}  // namespace palpate
