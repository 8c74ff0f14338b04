#include "runtime/core/tick/compliance.h"

#include <algorithm>

namespace palpate {

BodyCompliance::BodyCompliance(Index max_rows, Index max_near_dofs)
    : stride_(max_rows),
      dof_(static_cast<std::size_t>(most_entries * max_rows), -1),
      place_(dof_.size()),
      factor_(dof_.size()),
      entries_(static_cast<std::size_t>(max_rows)),
      is_new_(entries_.size()),
      diagonal_(entries_.size()),
      response_(static_cast<std::size_t>(max_near_dofs)) {}

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

void BodyCompliance::assemble(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
                              ContactProblem& problem) noexcept {
  const Index count = problem.rows;
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
    float* w = problem.body_row(j);
    if (is_new_[static_cast<std::size_t>(j)] != 0) {
      ++renewed_;
      respond(near, j);
      project(0, first_tilt_row, entries, w);
      project(first_tilt_row, count, tilt_entries, w);
      for (Index i = 0; i < count; ++i) {
        if (is_new_[static_cast<std::size_t>(i)] == 0) problem.body_row(i)[j] = w[i];
      }
      diagonal_[static_cast<std::size_t>(j)] = w[j];
    } else {
      w[j] = diagonal_[static_cast<std::size_t>(j)];
    }
    std::fill(w + count, w + problem.padded_rows(), 0.0F);
  }
  kept_rows_ = count;
}

}  // namespace palpate
