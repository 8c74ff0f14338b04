#include "runtime/core/solve/gmres.h"

#include <algorithm>
#include <cmath>

#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

std::size_t at(int i) noexcept {
  return static_cast<std::size_t>(i);
}

}  // namespace

Gmres::Gmres(std::ptrdiff_t stride, int most_steps)
    : stride_(stride),
      most_steps_(most_steps),
      basis_(static_cast<std::size_t>(stride) * at(most_steps + 1)),
      images_(static_cast<std::size_t>(stride) * at(most_steps)),
      H_(at(most_steps) * at(most_steps)),
      cosine_(at(most_steps)),
      sine_(at(most_steps)),
      g_(at(most_steps + 1)),
      share_(at(most_steps)) {}

void Gmres::begin(std::ptrdiff_t rows, int steps, float tolerance) noexcept {
  rows_ = rows;
  limit_ = std::min(steps, most_steps_);
  steps_ = 0;
  tolerance_ = tolerance;
  const float size = std::sqrt(dot(basis_.data(), basis_.data(), rows_));
  done_ = !(size > tolerance) || !std::isfinite(size) || limit_ == 0;
  if (done_) return;
  g_[0] = size;
  for (std::ptrdiff_t i = 0; i < rows_; ++i) basis_[static_cast<std::size_t>(i)] /= size;
}

/// Reduces column `column` of the Hessenberg matrix, whose last entry is `below`, to triangular form.
void Gmres::rotate(int column, float below) noexcept {
  for (int j = 0; j < column; ++j) {
    const float a = h(j, column);
    const float b = h(j + 1, column);
    h(j, column) = cosine_[at(j)] * a + sine_[at(j)] * b;
    h(j + 1, column) = cosine_[at(j)] * b - sine_[at(j)] * a;
  }
  const float a = h(column, column);
  const float size = std::sqrt(a * a + below * below);
  if (!(size > 0.0F)) {
    done_ = true;
    return;
  }
  cosine_[at(column)] = a / size;
  sine_[at(column)] = below / size;
  h(column, column) = size;
  g_[at(column + 1)] = -sine_[at(column)] * g_[at(column)];
  g_[at(column)] *= cosine_[at(column)];
  ++steps_;
  done_ = steps_ == limit_ || !(std::abs(g_[at(column + 1)]) > tolerance_);
}

void Gmres::expand() noexcept {
  float* v = next();
  const int k = steps_;
  for (int j = 0; j <= k; ++j) {
    const float* q = basis_.data() + j * stride_;
    h(j, k) = dot(q, v, rows_);
    subtract(q, h(j, k), v, rows_);
  }
  const float length = std::sqrt(dot(v, v, rows_));
  if (length > 0.0F) {
    for (std::ptrdiff_t i = 0; i < rows_; ++i) v[i] /= length;
  }
  rotate(k, length);
}

void Gmres::solve(float* y) noexcept {
  std::fill_n(y, rows_, 0.0F);
  for (int j = steps_; j-- > 0;) {
    float sum = g_[at(j)];
    for (int t = j + 1; t < steps_; ++t) sum -= h(j, t) * share_[at(t)];
    share_[at(j)] = sum / h(j, j);
  }
  for (int j = 0; j < steps_; ++j) add(images_.data() + j * stride_, share_[at(j)], y, rows_);
}

}  // namespace palpate
