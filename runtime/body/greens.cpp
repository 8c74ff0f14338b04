#include "runtime/body/greens.h"

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
#include "meshes/node_vectors.h"
#include "runtime/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::int64_t cache_line = 64;
constexpr std::int64_t tile = 64;       // scalars; two tiles of doubles fit into the L1 cache
constexpr std::size_t nodes_ahead = 4;  // loaded nodes by which rows of a slice of u are prefetched
constexpr std::int64_t u_chunk = 2048;  // doubles of u that stay in the L1 cache while all rows are read
constexpr Index turned_forces = 128, turned_nodes = 64;  // part sizes of a turned product
constexpr std::int64_t ahead_bytes = 1024;               // prefetch distance within a row

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

/// Calls f with the scalars cast to their type.
template <class F>
void with_scalars(const void* scalars, Precision precision, const F& f) noexcept {
  if (has_float_entries(precision)) {
    f(static_cast<const float*>(scalars));
  } else {
    f(static_cast<const double*>(scalars));
  }
}

}  // namespace

Greens::Greens(PackedGreens packed, int dimension, const GreensOptions& options)
    : packed_(std::move(packed)),
      order_(packed_.order()),
      dimension_(dimension),
      nodes_(static_cast<Index>(order_ / dimension)),
      precision_(packed_.precision()),
      split_(packed_.smooth() != nullptr) {
  if (order_ <= 0 || order_ % dimension != 0) {
    throw Error("the Green's functions have " + std::to_string(order_) + " dofs, which is not " +
                    std::to_string(dimension) + " for each of some nodes",
                "Green's functions", "precompute the model again");
  }
  if (const SmoothPart* smooth = packed_.smooth().get(); smooth != nullptr) {
    terms_ = smooth->terms;
    const std::shared_ptr<double[]> rows(new double[smooth->rows.size()]);
    std::transform(smooth->rows.begin(), smooth->rows.end(), rows.get(),
                   [root = std::sqrt(packed_.scale())](double w) { return root * w; });
    left_ = right_ = rows;
  }
  const std::int64_t scalar_bytes = bytes_per_scalar(precision_);
  stride_ = padded_row(order_, scalar_bytes);
  const std::int64_t bytes = order_ * stride_ * scalar_bytes;
  const std::int64_t limit = options.max_square_bytes < 0 ? available_memory() / 2 : options.max_square_bytes;
  const std::shared_ptr<void> square = bytes <= limit ? map_memory(bytes) : nullptr;
  if (square == nullptr) return;

  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int jobs = options.jobs > 0 ? options.jobs : processors;
  if (has_float_entries(precision_)) {
    unfold(packed_.as<float>(), packed_.scale(), order_, static_cast<float*>(square.get()), stride_, jobs);
  } else {
    unfold(packed_.as<double>(), packed_.scale(), order_, static_cast<double*>(square.get()), stride_, jobs);
  }
  square_ = square;
  packed_ = {};
}

Greens::Greens(std::shared_ptr<const HierarchicalMatrix> compressed)
    : compressed_(std::move(compressed)),
      order_(compressed_->order()),
      dimension_(compressed_->dimension),
      nodes_(compressed_->tree.nodes),
      precision_(Precision::single_precision),
      split_(false) {}

Eigen::MatrixXd Greens::block(Index row, Index column) const {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> xi(dimension_, dimension_);
  gather(row, {&column, 1}, {xi.data(), static_cast<std::size_t>(xi.size())});
  return xi;
}

void Greens::gather_static(Index row, std::span<const Index> columns,
                           std::span<double> blocks) const noexcept {
  if (compressed()) return gather_blocks(*compressed_, row, columns, blocks);
  if (!unfolded()) {
    gather_from_packed(packed_, dimension_, row, columns, blocks.data());
    return;
  }
  with_scalars(square_.get(), precision_, [&](const auto* square) {
    if (dimension_ == 2) {
      gather_from_square<2>(square, stride_, row, columns, blocks.data());
    } else {
      gather_from_square<3>(square, stride_, row, columns, blocks.data());
    }
  });
}

void Greens::displacement(std::span<const Index> nodes, std::span<const double> f,
                          std::span<double> u) const noexcept {
  displacement(nodes, f, 0, u);
}

void Greens::displace_statically(std::span<const Index> nodes, std::span<const double> f, Index first_node,
                                 std::span<double> u) const noexcept {
  const std::int64_t first = std::int64_t{dimension_} * first_node;
  if (!unfolded()) {
    with_scalars(packed_.data(), precision_, [&]<class T>(const T*) {
      displacement_from_packed(packed_.as<T>(), packed_.scale(), order_, dimension_, nodes, f.data(), first,
                               u);
    });
    return;
  }
  with_scalars(square_.get(), precision_, [&](const auto* square) {
    if (dimension_ == 2) {
      displacement_from_square<2>(square, stride_, nodes, f.data(), first, u);
    } else {
      displacement_from_square<3>(square, stride_, nodes, f.data(), first, u);
    }
  });
}

void Greens::displace_statically(std::span<const Index> nodes, std::span<const double> f,
                                 std::span<const NodeRange> ranges, std::span<double> u) const noexcept {
  if (compressed()) return displace(*compressed_, nodes, f, ranges, u);
  std::size_t done = 0;
  for (const NodeRange& range : ranges) {
    const auto count = static_cast<std::size_t>(dimension_ * (range.end - range.first));
    displace_statically(nodes, f, range.first, u.subspan(done, count));
    done += count;
  }
}

void Greens::add_modes(const Modes& modes, std::span<const double> weights) {
  const auto k = static_cast<std::int64_t>(modes.count()), terms = terms_ + k;
  const auto entries = static_cast<std::size_t>(order_ * terms);
  const std::shared_ptr<double[]> left(new double[entries]), right(new double[entries]);
  for (std::int64_t dof = 0; dof < order_; ++dof) {
    double *to_left = left.get() + dof * terms, *to_right = right.get() + dof * terms;
    std::copy_n(left_.get() + dof * terms_, terms_, to_left);
    std::copy_n(right_.get() + dof * terms_, terms_, to_right);
    const double* row = modes.row(dof);
    std::copy_n(row, k, to_right + terms_);
    for (std::int64_t i = 0; i < k; ++i) to_left[terms_ + i] = weights[i] * row[i];
  }
  terms_ = terms;
  left_ = left;
  right_ = right;
}

std::int64_t Greens::compressed_bytes() const noexcept {
  return compressed() ? compressed_->bytes() : 0;
}

double Greens::rounding() const noexcept {
  return has_float_entries(precision_) ? double{std::numeric_limits<float>::epsilon()}
                                       : std::numeric_limits<double>::epsilon();
}

Greens Greens::turned(std::vector<Mat3> rotations, const Eigen::MatrixXd& left,
                      const Eigen::MatrixXd& right) const {
  Greens other = *this;
  other.turning_ = std::make_shared<const Turning>(Turning{std::move(rotations), left, right});
  return other;
}

void Greens::gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept {
  gather_unturned(row, columns, blocks);
  if (turning_ != nullptr) turn_blocks(row, columns, blocks);
}

void Greens::turn_blocks(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept {
  const auto d = static_cast<Eigen::Index>(dimension_);
  const auto width = d * std::ssize(columns);
  const Mat3& R = turning_->rotations[static_cast<std::size_t>(row)];
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const Mat3& Q = turning_->rotations[static_cast<std::size_t>(columns[k])];
    double* block = blocks.data() + d * static_cast<Eigen::Index>(k);
    Mat3 B = Mat3::Zero();
    for (Eigen::Index i = 0; i < d; ++i) {
      for (Eigen::Index j = 0; j < d; ++j) B(i, j) = block[i * width + j];
    }
    B = R * B * Q.transpose();
    for (Eigen::Index i = 0; i < d && turning_->left.cols() > 0; ++i) {
      for (Eigen::Index j = 0; j < d; ++j)
        B(i, j) += dot(turning_->left.row(d * row + i).data(), turning_->right.row(d * columns[k] + j).data(),
                       turning_->left.cols());
    }
    for (Eigen::Index i = 0; i < d; ++i) {
      for (Eigen::Index j = 0; j < d; ++j) block[i * width + j] = B(i, j);
    }
  }
}

void Greens::gather_unturned(Index row, std::span<const Index> columns,
                             std::span<double> blocks) const noexcept {
  gather_static(row, columns, blocks);
  if (terms_ == 0) return;
  const std::int64_t d = dimension_;
  double* block = blocks.data();
  for (std::int64_t axis = 0; axis < d; ++axis) {
    const double* by = left_.get() + (d * row + axis) * terms_;
    for (const Index column : columns) {
      for (std::int64_t j = 0; j < d; ++j)
        *block++ += dot(by, right_.get() + (d * column + j) * terms_, terms_);
    }
  }
}

void Greens::displacement(std::span<const Index> nodes, std::span<const double> f, Index first_node,
                          std::span<double> u) const noexcept {
  const NodeRange range{first_node, first_node + static_cast<Index>(std::ssize(u) / dimension_)};
  displacement(nodes, f, {&range, 1}, u);
}

void Greens::displacement(std::span<const Index> nodes, std::span<const double> f,
                          std::span<const NodeRange> ranges, std::span<double> u) const noexcept {
  if (turning_ != nullptr) return displace_turned(nodes, f, ranges, u);
  displace_unturned(nodes, f, ranges, u);
}

/// Processes parts of the forces and nodes that fit on the stack.
void Greens::displace_turned(std::span<const Index> nodes, std::span<const double> f,
                             std::span<const NodeRange> ranges, std::span<double> u) const noexcept {
  const auto d = static_cast<std::size_t>(dimension_);
  std::array<double, 3 * turned_forces> turned_force;
  std::array<double, 3 * turned_nodes> moved;
  std::array<double, most_turned_terms> sum{};  // right^T f
  const Eigen::Index terms = turning_->left.cols();
  for (std::size_t k = 0; k < f.size() && terms > 0; ++k) {
    const auto dof = static_cast<Eigen::Index>(d) * nodes[k / d] + static_cast<Eigen::Index>(k % d);
    add(turning_->right.row(dof).data(), f[k], sum.data(), terms);
  }
  double* out = u.data();
  for (const NodeRange& range : ranges) {
    for (Index first = range.first; first < range.end; first += turned_nodes) {
      const NodeRange part{first, std::min<Index>(first + turned_nodes, range.end)};
      const std::size_t dofs = d * static_cast<std::size_t>(part.end - part.first);
      std::fill_n(out, dofs, 0.0);
      for (std::size_t begin = 0; begin < nodes.size(); begin += turned_forces) {
        const std::size_t count = std::min<std::size_t>(turned_forces, nodes.size() - begin);
        for (std::size_t k = 0; k < count; ++k) {
          const Mat3& R = turning_->rotations[static_cast<std::size_t>(nodes[begin + k])];
          const Eigen::Vector3d force =
              R.transpose() * vector_at(f, dimension_, static_cast<Index>(begin + k));
          set_vector(turned_force, dimension_, static_cast<Index>(k), force);
        }
        displace_unturned(nodes.subspan(begin, count), {turned_force.data(), d * count}, {&part, 1},
                          {moved.data(), dofs});
        for (std::size_t k = 0; k < dofs; ++k) out[k] += moved[k];
      }
      const std::span<double> slice(out, dofs);
      for (Index k = 0; k < part.end - part.first; ++k) {
        const Mat3& R = turning_->rotations[static_cast<std::size_t>(first + k)];
        set_vector(slice, dimension_, k, R * vector_at(slice, dimension_, k));
      }
      for (std::size_t k = 0; k < dofs && terms > 0; ++k)
        out[k] += dot(
            turning_->left.row(static_cast<Eigen::Index>(d) * first + static_cast<Eigen::Index>(k)).data(),
            sum.data(), terms);
      out += dofs;
    }
  }
}

void Greens::displace_unturned(std::span<const Index> nodes, std::span<const double> f,
                               std::span<const NodeRange> ranges, std::span<double> u) const noexcept {
  displace_statically(nodes, f, ranges, u);
  if (terms_ > 0) add_exact_terms(nodes, f, ranges, u);
}

void Greens::add_exact_terms(std::span<const Index> nodes, std::span<const double> f,
                             std::span<const NodeRange> ranges, std::span<double> u) const noexcept {
  const std::int64_t d = dimension_;
  std::array<double, most_exact_terms> sum;
  std::fill_n(sum.begin(), terms_, 0.0);
  for (std::size_t i = 0; i < f.size(); ++i) {
    const std::int64_t dof = d * nodes[i / static_cast<std::size_t>(d)] + static_cast<std::int64_t>(i) % d;
    add(left_.get() + dof * terms_, f[i], sum.data(), terms_);
  }
  auto ui = u.begin();
  for (const NodeRange& range : ranges) {
    const double* row = right_.get() + d * range.first * terms_;
    for (std::int64_t dof = d * range.first; dof < d * range.end; ++dof) {
      *ui++ += dot(row, sum.data(), terms_);
      row += terms_;
    }
  }
}

}  // namespace palpate
