#include "runtime/core/touch/compliance.h"

#include <algorithm>
#include <cstring>

namespace palpate {
namespace {

Index padded(Index rows) noexcept {
  return (rows + 15) / 16 * 16;
}

/// Three numbers of a node, and a fourth one that is ignored.
using Four [[gnu::vector_size(4 * sizeof(double))]] = double;

void read(const double* numbers, Four& four) noexcept {
  std::memcpy(&four, numbers, sizeof(four));
}

}  // namespace

BodyCompliance::BodyCompliance(Index max_rows, Index max_single_rows, Index max_near_dofs)
    : loads_end_(static_cast<std::size_t>(max_rows) + 1),
      loads_(6 * static_cast<std::size_t>(max_rows)),
      stride_(max_single_rows),
      dof_(static_cast<std::size_t>(most_entries * max_single_rows), -1),
      place_(dof_.size()),
      factor_(dof_.size()),
      entries_(static_cast<std::size_t>(max_single_rows)),
      is_new_(entries_.size()),
      diagonal_(entries_.size()),
      response_(static_cast<std::size_t>(max_near_dofs)),
      kept_(static_cast<std::size_t>(padded(max_single_rows)) *
            static_cast<std::size_t>(padded(max_single_rows))) {}

/// Reads only what is needed of Xi: a column of Xi J^T after the other at the rows' nodes. D is the number of
/// dofs per node. The rows of a contact share its nodes.
template <int D>
void BodyCompliance::fill_between_nodes(const NearField& near, std::span<const ContactRow> rows,
                                        MatrixRows<double> W) noexcept {
  NodeLoad* const nodes = loads_.data() + 3 * rows.size();
  std::size_t count = 0;
  Index node_count = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool shares = i > 0 && rows[i].places == rows[i - 1].places;
    if (shares) node_count -= static_cast<Index>(count - loads_end_[i - 1]);
    for (std::size_t n = 0; n < 3; ++n) {
      if (rows[i].places[n] < 0) continue;
      const Vec3& f = rows[i].body[n];
      nodes[node_count].dof = D * rows[i].places[n];
      loads_[count++] = {node_count++, {f.x(), f.y(), D == 3 ? f.z() : 0.0, 0.0}};
    }
    loads_end_[i + 1] = count;
  }
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const std::size_t begin = loads_end_[j], end = loads_end_[j + 1];
    for (std::size_t by = begin; by < end; ++by) {
      const std::array<double, 4> f = loads_[by].force;
      std::array<const double*, D> c;
      for (int axis = 0; axis < D; ++axis) c[axis] = near.row(nodes[loads_[by].dof].dof + axis).data();
      for (Index a = loads_[begin].dof; a < node_count; ++a) {
        Four u{};
        if (by > begin) read(nodes[a].force.data(), u);
        for (std::size_t axis = 0; axis < D; ++axis) {
          Four column;
          read(c[axis] + nodes[a].dof, column);
          u += f[axis] * column;
        }
        std::memcpy(nodes[a].force.data(), &u, sizeof(u));
      }
    }
    for (std::size_t i = j; i < rows.size(); ++i) {
      Four w{};
      for (std::size_t at = loads_end_[i]; begin < end && at < loads_end_[i + 1]; ++at) {
        Four force, moved;
        read(loads_[at].force.data(), force);
        read(nodes[loads_[at].dof].force.data(), moved);
        w += force * moved;
      }
      const double sum = D == 3 ? w[0] + w[1] + w[2] : w[0] + w[1];
      W[static_cast<Index>(j)][i] = sum;
      W[static_cast<Index>(i)][j] = sum;
    }
  }
}

void BodyCompliance::fill(const NearField& near, std::span<const ContactRow> rows, Index /*first_tilt_row*/,
                          MatrixRows<double> W) noexcept {
  forget();
  near.dimension() == 3 ? fill_between_nodes<3>(near, rows, W) : fill_between_nodes<2>(near, rows, W);
}

/// Stores a row of J; returns true if it differs from the previous one.
bool BodyCompliance::enter(const NearField& near, const ContactRow& row, Index i) noexcept {
  int count = 0;
  bool changed = false;
  const auto put = [&](Index dof, Index place, double factor) {
    const Index at = count++ * stride_ + i;
    const auto single = static_cast<float>(factor);
    changed = changed || dof_[at] != dof || factor_[at] != single;
    dof_[at] = dof;
    place_[at] = place;
    factor_[at] = single;
  };
  const Index d = near.dimension();
  for (std::size_t n = 0; n < 3; ++n) {
    for (int axis = 0; axis < d && row.places[n] >= 0; ++axis) {
      if (row.body[n][axis] != 0.0)
        put(d * near.node(row.places[n]) + axis, d * row.places[n] + axis, row.body[n][axis]);
    }
  }
  entries_[static_cast<std::size_t>(i)] = count;
  while (count < most_entries) put(-1, 0, 0.0);
  return changed;
}

/// Computes a column of Xi J^T.
void BodyCompliance::respond(const NearField& near, Index row) noexcept {
  float* __restrict y = response_.data();
  const std::ptrdiff_t width = std::ptrdiff_t{near.dimension()} * near.count();
  std::fill_n(y, width, 0.0F);
  for (int t = 0; t < entries_[static_cast<std::size_t>(row)]; ++t) {
    const Index at = t * stride_ + row;
    const float factor = factor_[at];
    const double* __restrict c = near.row(place_[at]).data();
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < width; ++k) y[k] += factor * static_cast<float>(c[k]);
  }
}

/// Computes rows [begin, end) of J times that column.
void BodyCompliance::project(Index begin, Index end, int entries, float* __restrict w) const noexcept {
  const float* __restrict y = response_.data();
  std::fill(w + begin, w + end, 0.0F);
  for (int t = 0; t < entries; ++t) {
    const Index* __restrict place = place_.data() + std::ptrdiff_t{t} * stride_;
    const float* __restrict factor = factor_.data() + std::ptrdiff_t{t} * stride_;
#pragma omp simd
    for (Index i = begin; i < end; ++i) w[i] += factor[i] * y[place[i]];
  }
}

void BodyCompliance::fill(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
                          MatrixRows<float> W) noexcept {
  const auto count = static_cast<Index>(rows.size());
  if (revision_ != near.revision()) forget();
  revision_ = near.revision();
  const auto most_of = [&](Index begin, Index end) {
    return begin == end ? 0 : *std::max_element(entries_.begin() + begin, entries_.begin() + end);
  };
  for (Index i = 0; i < count; ++i) {
    const bool changed = enter(near, rows[static_cast<std::size_t>(i)], i);
    is_new_[static_cast<std::size_t>(i)] = changed || i >= kept_rows_ ? 1 : 0;
  }
  const int entries = most_of(0, first_tilt_row);
  const int tilt_entries = most_of(first_tilt_row, count);
  renewed_ = 0;
  for (Index j = 0; j < count; ++j) {
    float* w = W[j];
    if (is_new_[static_cast<std::size_t>(j)] != 0) {
      ++renewed_;
      respond(near, j);
      project(0, first_tilt_row, entries, w);
      project(first_tilt_row, count, tilt_entries, w);
      for (Index i = 0; i < count; ++i) {
        if (is_new_[static_cast<std::size_t>(i)] == 0) W[i][j] = w[i];
      }
      diagonal_[static_cast<std::size_t>(j)] = w[j];
    } else {
      w[j] = diagonal_[static_cast<std::size_t>(j)];
    }
    std::fill(w + count, w + padded(count), 0.0F);
  }
  kept_rows_ = count;
}

void BodyCompliance::assemble(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
                              bool apart, ContactProblem& problem) noexcept {
  if (apart != apart_) forget();
  apart_ = apart;
  problem.with_w([&](auto W) {
    fill(near, rows.first(static_cast<std::size_t>(problem.rows)), first_tilt_row, body(W));
  });
}

}  // namespace palpate
