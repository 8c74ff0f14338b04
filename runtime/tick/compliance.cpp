#include "runtime/tick/compliance.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr int most_entries = 9;  // of a row of J

/// Enters a row of J; how many entries it has.
int enter(const ContactRow& row, int dimension, Index i, CompliancePattern& pattern) noexcept {
  int entries = 0;
  const auto put = [&](Index dof, double factor) {
    const auto at = static_cast<std::size_t>(entries++ * pattern.stride + i);
    pattern.place[at] = dof;
    pattern.factor[at] = static_cast<float>(factor);
  };
  for (std::size_t n = 0; n < 3; ++n) {
    for (int axis = 0; axis < dimension; ++axis) {
      if (row.places[n] >= 0 && row.body[n][axis] != 0.0)
        put(dimension * row.places[n] + axis, row.body[n][axis]);
    }
  }
  const int used = entries;
  while (entries < most_entries) put(0, 0.0);
  return used;
}

/// A column of Xi J^T.
void respond(const NearField& near, Index row, int entries, CompliancePattern& pattern) noexcept {
  float* __restrict y = pattern.response.data();
  const std::ptrdiff_t width = std::ptrdiff_t{near.dimension()} * near.count();
  std::fill_n(y, width, 0.0F);
  for (int t = 0; t < entries; ++t) {
    const auto at = static_cast<std::size_t>(t * pattern.stride + row);
    const float factor = pattern.factor[at];
    if (factor == 0.0F) continue;
    const double* __restrict c = near.row(pattern.place[at]).data();
#pragma omp simd
    for (std::ptrdiff_t k = 0; k < width; ++k) y[k] += factor * static_cast<float>(c[k]);
  }
}

/// What rows [begin, end) have of the column.
void project(const CompliancePattern& pattern, Index begin, Index end, int entries,
             float* __restrict w) noexcept {
  const float* __restrict y = pattern.response.data();
  std::fill(w + begin, w + end, 0.0F);
  for (int t = 0; t < entries; ++t) {
    const Index* __restrict place = pattern.place.data() + t * pattern.stride;
    const float* __restrict factor = pattern.factor.data() + t * pattern.stride;
#pragma omp simd
    for (Index i = begin; i < end; ++i) w[i] += factor[i] * y[place[i]];
  }
}

}  // namespace

CompliancePattern::CompliancePattern(Index max_rows, Index max_near_dofs)
    : stride(max_rows),
      place(static_cast<std::size_t>(most_entries * max_rows)),
      factor(place.size()),
      response(static_cast<std::size_t>(max_near_dofs)) {}

void assemble_single_compliance(const NearField& near, std::span<const ContactRow> rows, Index first_tilt_row,
                                CompliancePattern& pattern, ContactProblem& problem) noexcept {
  int entries = 0;
  int tilt_entries = 0;
  for (Index i = 0; i < problem.rows; ++i) {
    const int used = enter(rows[static_cast<std::size_t>(i)], near.dimension(), i, pattern);
    int& most = i < first_tilt_row ? entries : tilt_entries;
    most = std::max(most, used);
  }
  for (Index j = 0; j < problem.rows; ++j) {
    respond(near, j, j < first_tilt_row ? entries : tilt_entries, pattern);
    float* w = problem.single_row(j);
    project(pattern, 0, first_tilt_row, entries, w);
    project(pattern, first_tilt_row, problem.rows, tilt_entries, w);
    std::fill(w + problem.rows, w + (problem.rows + 15) / 16 * 16, 0.0F);
  }
}

}  // namespace palpate
