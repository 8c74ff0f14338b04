#include "runtime/core/body/greens.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/memory.h"
#include "matrices/hierarchical.h"
#include "matrices/hierarchical_product.h"

namespace palpate {
namespace {

constexpr std::int64_t cache_line = 64;
constexpr std::int64_t tile = 64;           // scalars; two tiles of doubles fit into the L1 cache
constexpr std::size_t nodes_ahead = 4;      // loaded nodes by which rows of a slice of u are prefetched
constexpr std::int64_t u_chunk = 2048;      // doubles of u that stay in the L1 cache while all rows are read
constexpr std::int64_t ahead_bytes = 1024;  // prefetch distance within a row

/// Row length in whole cache lines, an odd number of them, so that equal columns of neighbouring rows do not
/// map to the same cache set.
std::int64_t padded_row(std::int64_t order, std::int64_t scalar_bytes) {
  const std::int64_t lines = (order * scalar_bytes + cache_line - 1) / cache_line;
  return (lines | 1) * cache_line / scalar_bytes;
}

/// Copies the columns [first, last) of the packed lower triangle, times `scale`, to both triangles of the
/// square, tile by tile.
template <class T>
void unfold_columns(std::span<const T> packed, double scale, std::int64_t order, T* square,
                    std::int64_t stride, std::int64_t first, std::int64_t last) {
  for (std::int64_t row = first; row < order; row += tile) {
    const std::int64_t row_end = std::min(row + tile, order);
    for (std::int64_t j = first; j < last; ++j) {
      const std::int64_t begin = std::max(row, j);
      const T* column = packed.data() + packed_index(begin, j, order);
      T* to = square + j * stride + begin;
      if (scale == 1.0) {
        std::memcpy(to, column, static_cast<std::size_t>(row_end - begin) * sizeof(T));
      } else {
        std::transform(column, column + (row_end - begin), to,
                       [scale](T value) { return static_cast<T>(scale * static_cast<double>(value)); });
      }
    }
    for (std::int64_t i = row; i < row_end; ++i) {
      T* lower = square + i * stride;
      for (std::int64_t j = first; j < std::min(last, i); ++j) lower[j] = square[j * stride + i];
    }
  }
}

template <class T>
void unfold(std::span<const T> packed, double scale, std::int64_t order, T* square, std::int64_t stride,
            int jobs) {
  std::atomic<std::int64_t> next = 0;
  const auto work = [&] {
    for (std::int64_t j = next.fetch_add(tile); j < order; j = next.fetch_add(tile)) {
      unfold_columns(packed, scale, order, square, stride, j, std::min(j + tile, order));
    }
  };
  std::vector<std::jthread> helpers;
  for (int k = 1; k < jobs; ++k) helpers.emplace_back(work);
  work();
}

template <int D, class T>
void gather_from_square(const T* square, std::int64_t stride, Index row, std::span<const Index> columns,
                        double* blocks) noexcept {
  const auto width = D * columns.size();
  for (std::int64_t axis = 0; axis < D; ++axis) {
    const T* xi = square + (D * std::int64_t{row} + axis) * stride;
    double* out = blocks + static_cast<std::size_t>(axis) * width;
    for (const Index column : columns) {
      for (std::int64_t k = 0; k < D; ++k) *out++ = static_cast<double>(xi[D * std::int64_t{column} + k]);
    }
  }
}

void gather_from_packed(const PackedGreens& packed, int dimension, Index row, std::span<const Index> columns,
                        double* blocks) noexcept {
  const std::int64_t d = dimension;
  for (std::int64_t axis = 0; axis < d; ++axis) {
    for (const Index column : columns) {
      for (std::int64_t k = 0; k < d; ++k) *blocks++ = packed.stored(d * row + axis, d * column + k);
    }
  }
}

/// u += f^T rows over `count` entries of the D rows of a node. Prefetches later entries of these rows or, at
/// their end, the same entries of `next_rows`, the rows of a node needed soon.
template <int D, class T>
void add_rows(const T* rows, std::int64_t stride, const double* f, double* __restrict u, std::int64_t count,
              const T* next_rows) noexcept {
  constexpr std::int64_t step = cache_line / static_cast<std::int64_t>(sizeof(T));
  constexpr std::int64_t ahead = ahead_bytes / static_cast<std::int64_t>(sizeof(T));
  std::array<const T*, D> row;
  std::array<double, D> force;
  for (std::size_t p = 0; p < D; ++p) {
    row[p] = rows + static_cast<std::int64_t>(p) * stride;
    force[p] = f[p];
  }
  const auto add = [&](std::int64_t i) {
    double sum = 0.0;
    for (std::size_t p = 0; p < D; ++p) sum += force[p] * static_cast<double>(row[p][i]);
    u[i] += sum;
  };
  std::int64_t i = 0;
  for (; i + step <= count; i += step) {
    for (std::size_t p = 0; p < D; ++p) {
      const T* later = i + ahead < count ? row[p] + ahead : next_rows + static_cast<std::int64_t>(p) * stride;
      __builtin_prefetch(later + i);
    }
#pragma omp simd
    for (std::int64_t k = i; k < i + step; ++k) add(k);
  }
  for (; i < count; ++i) add(i);
}

/// u = Xi E f from row `first` on; Xi is `scale` times the stored matrix.
template <int D, class T>
void displacement_from_square(const T* square, std::int64_t stride, std::span<const Index> nodes,
                              const double* f, std::int64_t first, std::span<double> u) noexcept {
  const auto size = static_cast<std::int64_t>(u.size());
  for (std::int64_t begin = 0; begin < size; begin += u_chunk) {
    const std::int64_t count = std::min(u_chunk, size - begin);
    double* chunk = u.data() + begin;
    std::fill_n(chunk, count, 0.0);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const auto rows = [&](std::size_t n) {
        return square + D * std::int64_t{nodes[std::min(n, nodes.size() - 1)]} * stride + first + begin;
      };
      add_rows<D>(rows(k), stride, f + D * k, chunk, count, rows(k + nodes_ahead));
    }
  }
}

/// u = Xi E f from row `first` on; Xi is `scale` times the stored matrix.
template <class T>
void displacement_from_packed(std::span<const T> packed, double scale, std::int64_t order, int dimension,
                              std::span<const Index> nodes, const double* f, std::int64_t first,
                              std::span<double> u) noexcept {
  const std::int64_t last = first + static_cast<std::int64_t>(u.size());
  const auto d = static_cast<std::size_t>(dimension);
  std::fill(u.begin(), u.end(), 0.0);
  for (std::size_t k = 0; k < d * nodes.size(); ++k) {
    const std::int64_t dof = std::int64_t{dimension} * nodes[k / d] + static_cast<std::int64_t>(k % d);
    const double force = scale * f[k];
    double* out = u.data();
    for (std::int64_t j = first; j < std::min(dof, last); ++j) {
      const auto entry = static_cast<std::size_t>(packed_index(dof, j, order));
      *out++ += force * static_cast<double>(packed[entry]);
    }
    const std::int64_t begin = std::max(dof, first);
    const T* column = packed.data() + packed_index(begin, dof, order);
    for (std::int64_t i = 0; i < last - begin; ++i) out[i] += force * static_cast<double>(column[i]);
  }
}

/// Calls visit(range, its part of u), d numbers per node.
template <class Visit>
void for_each_range(int d, std::span<const NodeRange> ranges, std::span<double> u,
                    const Visit& visit) noexcept {
  std::size_t done = 0;
  for (const NodeRange& range : ranges) {
    const auto count = static_cast<std::size_t>(d * (range.end - range.first));
    visit(range, u.subspan(done, count));
    done += count;
  }
}

/// As rows of a full square [n x stride].
template <int D, class T>
class SquareGreens final : public Greens {
 public:
  SquareGreens(const PackedGreens& packed, std::shared_ptr<void> square, std::int64_t stride, int jobs)
      : Greens(D, static_cast<Index>(packed.order() / D), packed.precision()),
        square_(std::move(square)),
        stride_(stride) {
    unfold(packed.as<T>(), packed.scale(), packed.order(), static_cast<T*>(square_.get()), stride_, jobs);
  }

  [[nodiscard]] bool unfolded() const noexcept override { return true; }

  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept override {
    gather_from_square<D>(rows(), stride_, row, columns, blocks.data());
  }

  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    for_each_range(D, ranges, u, [&](const NodeRange& range, std::span<double> of_range) {
      displacement_from_square<D>(rows(), stride_, nodes, f.data(), std::int64_t{D} * range.first, of_range);
    });
  }

 private:
  [[nodiscard]] const T* rows() const noexcept { return static_cast<const T*>(square_.get()); }

  std::shared_ptr<void> square_;
  std::int64_t stride_;  // scalars from one row to the next
};

/// As it is stored.
template <class T>
class FoldedGreens final : public Greens {
 public:
  FoldedGreens(PackedGreens packed, int dimension)
      : Greens(dimension, static_cast<Index>(packed.order() / dimension), packed.precision()),
        packed_(std::move(packed)) {}

  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept override {
    gather_from_packed(packed_, dimension(), row, columns, blocks.data());
  }

  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    for_each_range(dimension(), ranges, u, [&](const NodeRange& range, std::span<double> of_range) {
      displacement_from_packed(packed_.as<T>(), packed_.scale(), order(), dimension(), nodes, f.data(),
                               std::int64_t{dimension()} * range.first, of_range);
    });
  }

 private:
  PackedGreens packed_;
};

class CompressedGreens final : public Greens {
 public:
  explicit CompressedGreens(std::shared_ptr<const HierarchicalMatrix> matrix)
      : Greens(matrix->dimension, matrix->tree.nodes, Precision::single_precision),
        matrix_(std::move(matrix)) {}

  [[nodiscard]] const HierarchicalMatrix* compressed_form() const noexcept override { return matrix_.get(); }

  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept override {
    gather_blocks(*matrix_, row, columns, blocks);
  }

  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    displace(*matrix_, nodes, f, ranges, u);
  }

 private:
  std::shared_ptr<const HierarchicalMatrix> matrix_;
};

template <int D, class T>
std::shared_ptr<const Greens> unfold_or_fold(PackedGreens packed, const GreensOptions& options) {
  constexpr std::int64_t scalar_bytes = sizeof(T);
  const std::int64_t stride = padded_row(packed.order(), scalar_bytes);
  const std::int64_t bytes = packed.order() * stride * scalar_bytes;
  const std::int64_t limit = options.max_square_bytes < 0 ? available_memory() / 2 : options.max_square_bytes;
  if (std::shared_ptr<void> square = bytes <= limit ? map_memory(bytes) : nullptr) {
    const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    const int jobs = options.jobs > 0 ? options.jobs : processors;
    return std::make_shared<const SquareGreens<D, T>>(packed, std::move(square), stride, jobs);
  }
  return std::make_shared<const FoldedGreens<T>>(std::move(packed), D);
}

}  // namespace

void Greens::coarse_displacement(std::span<const Index>, std::span<const double>,
                                 std::span<double>) const noexcept {}

const Mat3& Greens::rotation(Index) const noexcept {
  static const Mat3 none = Mat3::Identity();
  return none;
}

double Greens::rounding() const noexcept {
  return has_float_entries(precision_) ? double{std::numeric_limits<float>::epsilon()}
                                       : std::numeric_limits<double>::epsilon();
}

void Greens::displacement(std::span<const Index> nodes, std::span<const double> f, Index first_node,
                          std::span<double> u) const noexcept {
  const NodeRange range{first_node, first_node + static_cast<Index>(std::ssize(u) / dimension_)};
  displacement(nodes, f, {&range, 1}, u);
}

void Greens::displacement(std::span<const Index> nodes, std::span<const double> f,
                          std::span<double> u) const noexcept {
  displacement(nodes, f, 0, u);
}

Eigen::MatrixXd Greens::block(Index row, Index column) const {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> xi(dimension_, dimension_);
  gather(row, {&column, 1}, {xi.data(), static_cast<std::size_t>(xi.size())});
  return xi;
}

std::shared_ptr<const Greens> make_greens(PackedGreens packed, int dimension, const GreensOptions& options) {
  if (packed.order() <= 0 || packed.order() % dimension != 0) {
    throw Error("the Green's functions have " + std::to_string(packed.order()) + " dofs, which is not " +
                    std::to_string(dimension) + " for each of some nodes",
                "Green's functions", "precompute the model again");
  }
  const std::shared_ptr<const SmoothPart> smooth = packed.smooth();
  const double root = std::sqrt(packed.scale());
  const bool is_float = has_float_entries(packed.precision());
  std::shared_ptr<const Greens> greens;
  if (dimension == 2) {
    greens = is_float ? unfold_or_fold<2, float>(std::move(packed), options)
                      : unfold_or_fold<2, double>(std::move(packed), options);
  } else {
    greens = is_float ? unfold_or_fold<3, float>(std::move(packed), options)
                      : unfold_or_fold<3, double>(std::move(packed), options);
  }
  if (smooth == nullptr) return greens;
  const std::shared_ptr<double[]> rows(new double[smooth->rows.size()]);
  std::transform(smooth->rows.begin(), smooth->rows.end(), rows.get(), [root](double w) { return root * w; });
  return with_terms(std::move(greens), {smooth->terms, rows, rows});
}

std::shared_ptr<const Greens> make_greens(std::shared_ptr<const HierarchicalMatrix> compressed) {
  return std::make_shared<const CompressedGreens>(std::move(compressed));
}

}  // namespace palpate
