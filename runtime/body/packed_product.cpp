#include "runtime/body/packed_product.h"

#ifdef __AVX512F__
#include <immintrin.h>
#endif

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>

#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::int64_t columns = 8;  // columns that reuse the loaded x and y
constexpr std::int64_t ahead = 512;  // bytes prefetched in a column, which crosses pages
constexpr auto patience = std::chrono::microseconds(200);

#ifdef __AVX512F__
constexpr std::int64_t lanes = 8;
#elif defined(__AVX__)
constexpr std::int64_t lanes = 4;
#else
constexpr std::int64_t lanes = 2;
#endif
template <class T>
using Lanes [[gnu::vector_size(lanes * sizeof(T))]] = T;

Lanes<double> load(const double* from) noexcept {
  Lanes<double> value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

Lanes<double> load(const float* from) noexcept {
#ifdef __AVX512F__  // GCC 12 converts the halves one after the other
  return _mm512_cvtps_pd(_mm256_loadu_ps(from));
#else
  Lanes<float> value;
  std::memcpy(&value, from, sizeof value);
  return __builtin_convertvector(value, Lanes<double>);
#endif
}

/// y += A x and the dot products of the columns with x, over rows [first, first + count) below the diagonal
/// of a group of columns; `a` points to their entries there.
template <class T>
void multiply_rows(const std::array<const T*, columns>& a, const std::array<double, columns>& by,
                   const double* __restrict x, double* __restrict y, std::array<double, columns>& sums,
                   std::int64_t count) noexcept {
  constexpr std::int64_t line = 64 / sizeof(T);  // entries per cache line
  std::array<Lanes<double>, columns> in_lanes{};
  std::int64_t i = 0;
  for (; i + line <= count; i += line) {
    for (const T* column : a) __builtin_prefetch(column + i + ahead / std::int64_t{sizeof(T)});
    for (std::int64_t k = i; k < i + line; k += lanes) {
      const Lanes<double> xk = load(x + k);
      Lanes<double> even = load(y + k), odd{};
      for (std::size_t c = 0; c < columns; c += 2) {
        const Lanes<double> e = load(a[c] + k);
        const Lanes<double> f = load(a[c + 1] + k);
        in_lanes[c] += e * xk;
        in_lanes[c + 1] += f * xk;
        even += e * by[c];
        odd += f * by[c + 1];
      }
      even += odd;
      std::memcpy(y + k, &even, sizeof even);
    }
  }
  for (std::size_t c = 0; c < columns; ++c) {
    for (int lane = 0; lane < lanes; ++lane) sums[c] += in_lanes[c][lane];
    for (std::int64_t k = i; k < count; ++k) {
      sums[c] += static_cast<double>(a[c][k]) * x[k];
      y[k] += static_cast<double>(a[c][k]) * by[c];
    }
  }
}

/// Multiplies the columns [first, last) of the packed triangle; y has the rows from `first` on.
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
        y[i - first] += e * x[j + c];
      }
      y[j + c - first] += sum;
    }
    if (group < columns) return;
    std::array<double, columns> by;
    std::array<double, columns> sums{};
    std::copy_n(x + j, columns, by.begin());
    const std::int64_t below = j + columns;
    std::array<const T*, columns> a;
    for (std::int64_t c = 0; c < columns; ++c) a[c] = entry(below, j + c);
    multiply_rows<T>(a, by, x + below, y.data() + (below - first), sums, order - below);
    for (std::int64_t c = 0; c < columns; ++c) y[j + c - first] += sums[c];
  }
}

}  // namespace

PackedProduct::PackedProduct(const PackedGreens& matrix, int jobs)
    : matrix_(matrix),
      by_smooth_(matrix.smooth() == nullptr ? 0 : static_cast<std::size_t>(matrix.smooth()->terms)) {
  // Parts with equal numbers of entries: the columns from j on have (n - j)^2 / 2.
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
  if (!by_smooth_.empty()) add_smooth(x, y);
}

/// y += W W^T x.
void PackedProduct::add_smooth(std::span<const double> x, std::span<double> y) noexcept {
  const SmoothPart& smooth = *matrix_.smooth();
  std::fill(by_smooth_.begin(), by_smooth_.end(), 0.0);
  for (std::size_t i = 0; i < x.size(); ++i)
    add(smooth.row(static_cast<std::int64_t>(i)), x[i], by_smooth_.data(), smooth.terms);
  for (std::size_t i = 0; i < y.size(); ++i)
    y[i] += dot(smooth.row(static_cast<std::int64_t>(i)), by_smooth_.data(), smooth.terms);
}

void PackedProduct::work(Part& part) noexcept {
  if (has_float_entries(matrix_.precision())) {
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
      std::this_thread::yield();  // if processors are scarce, gives way to the awaited thread
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
