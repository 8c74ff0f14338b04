#include "runtime/core/solve/reduced_contacts.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

/// out = A v for a row-major matrix, `size` by `size` of 3 by 3.
void multiply_small(const std::array<float, 9>& A, int size, const float* v, float* out) noexcept {
  if (size == 3) {
    const float v0 = v[0], v1 = v[1], v2 = v[2];
    out[0] = A[0] * v0 + A[1] * v1 + A[2] * v2;
    out[1] = A[3] * v0 + A[4] * v1 + A[5] * v2;
    out[2] = A[6] * v0 + A[7] * v1 + A[8] * v2;
  } else if (size == 2) {
    const float v0 = v[0], v1 = v[1];
    out[0] = A[0] * v0 + A[1] * v1;
    out[1] = A[3] * v0 + A[4] * v1;
  } else {
    out[0] = A[0] * v[0];
  }
}

std::array<float, 9> by_rows(const Eigen::Matrix3d& A) noexcept {
  std::array<float, 9> entries{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) entries[3 * i + j] = static_cast<float>(A(i, j));
  }
  return entries;
}

}  // namespace

double product_work(std::ptrdiff_t rows) noexcept {
  return static_cast<double>(rows) * static_cast<double>(rows + tuning.many.product_overhead);
}

ReducedContacts::ReducedContacts(Index max_contacts, std::ptrdiff_t stride)
    : stride_(stride),
      reduced_(static_cast<std::size_t>(max_contacts)),
      gmres_(most_changes, Gmres(stride, tuning.many.most_steps)),
      x_(most_changes * static_cast<std::size_t>(stride)),
      v_(x_.size()),
      y_(x_.size()),
      step_(static_cast<std::size_t>(stride)),
      motions_(step_.size() * static_cast<std::size_t>(tuning.many.most_steps)) {}
void ReducedContacts::reduce(std::span<const ContactLaw> contacts, const SymmetricRows& W) noexcept {
  W_ = W;
  active_ = 0;
  for (const ContactLaw& contact : contacts) {
    if (contact.mode == ContactLaw::Mode::open) continue;
    Reduced& reduced = reduced_[active_++];
    reduced.first = contact.first;
    reduced.rows = contact.rows;
    reduced.turning = 0.0F;
    if (contact.mode != ContactLaw::Mode::slip) {
      reduced.image = by_rows(Eigen::Matrix3d::Identity());
      reduced.test = reduced.image;
      reduced.inverse = by_rows(contact.inverse);
      continue;
    }
    Eigen::Matrix3d image = Eigen::Matrix3d::Zero();
    image.col(0) = contact.n + contact.mu * contact.e;
    image.col(1) = contact.across;
    Eigen::Matrix3d test = Eigen::Matrix3d::Zero();
    test.row(0) = contact.n;
    test.row(1) = contact.across;
    Eigen::Matrix2d local = (test * contact.D * image).topLeftCorner<2, 2>();
    local(1, 1) += contact.turning;
    Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
    inverse.topLeftCorner<2, 2>() = local.inverse();
    reduced.image = by_rows(image);
    reduced.test = by_rows(test);
    reduced.inverse = by_rows(inverse);
    reduced.turning = static_cast<float>(contact.turning);
  }
}

/// Computes forces x [rows] from the unknowns: for a slipping contact along the edge of the cone and across.
void ReducedContacts::fill_image(const float* y, float* x) const noexcept {
  std::fill_n(x, W_.columns, 0.0F);
  for (const Reduced& contact : active())
    multiply_small(contact.image, contact.rows, y + contact.first, x + contact.first);
}

/// Computes the left-hand sides of the equations from motions along the rows.
void ReducedContacts::test(const float* motion, float* out) const noexcept {
  std::fill_n(out, W_.columns, 0.0F);
  for (const Reduced& contact : active())
    multiply_small(contact.test, contact.rows, motion + contact.first, out + contact.first);
}

/// Computes v = W x for the first systems together, so that W is read once.
void ReducedContacts::multiply_by_compliance(int systems) noexcept {
  if (systems == 1) {
    multiply(W_, x_.data(), v_.data());
  } else {
    multiply_three(W_, x_.data(), v_.data(), stride_);
  }
  ++products_;
}

/// Runs GMRES on the reduced systems that have begun.
void ReducedContacts::solve(int systems) noexcept {
  const std::span<Gmres> all = std::span(gmres_).first(static_cast<std::size_t>(systems));
  const auto is_done = [](const Gmres& gmres) { return gmres.done(); };
  while (!std::all_of(all.begin(), all.end(), is_done)) {
    for (int s = 0; s < systems; ++s) {
      Gmres& gmres = gmres_[static_cast<std::size_t>(s)];
      float* x = x_.data() + s * stride_;
      if (gmres.done()) {
        std::fill_n(x, W_.columns, 0.0F);
        continue;
      }
      float* y = gmres.image();
      std::fill_n(y, W_.columns, 0.0F);
      for (const Reduced& contact : active())
        multiply_small(contact.inverse, contact.rows, gmres.newest() + contact.first, y + contact.first);
      fill_image(y, x);
    }
    multiply_by_compliance(systems);
    for (int s = 0; s < systems; ++s) {
      Gmres& gmres = gmres_[static_cast<std::size_t>(s)];
      if (gmres.done()) continue;
      if (systems == 1) std::copy_n(v_.data(), W_.columns, motions_.data() + gmres.steps() * stride_);
      float* next = gmres.next();
      test(v_.data() + s * stride_, next);
      for (const Reduced& contact : active()) {
        if (contact.rows > 1) next[contact.first + 1] += contact.turning * gmres.image()[contact.first + 1];
      }
      gmres.expand();
    }
  }
}

/// GMRES steps allowed by the budget.
int ReducedContacts::most_steps() const noexcept {
  return static_cast<int>(std::clamp<double>(tuning.many.step_work / product_work(W_.rows),
                                             tuning.many.fewest_steps, tuning.many.most_steps));
}

bool ReducedContacts::step(float* r, float* change) noexcept {
  products_ = 0;
  for (std::ptrdiff_t i = 0; i < W_.rows; ++i) x_[static_cast<std::size_t>(i)] = -r[i];
  Gmres& gmres = gmres_[0];
  test(x_.data(), gmres.first());
  const float size = std::sqrt(dot(gmres.first(), gmres.first(), W_.columns));
  gmres.begin(W_.columns, most_steps(), tuning.many.linear_tolerance * size);
  solve(1);
  gmres.solve(step_.data());
  fill_image(step_.data(), change);
  if (!std::all_of(change, change + W_.rows, [](float by) { return std::isfinite(by); })) return false;
  for (int j = 0; j < gmres.steps(); ++j) add(motions_.data() + j * stride_, gmres.share(j), r, W_.rows);
  return true;
}

/// Computes the unknowns y of each change from the guess in dlambda. False if all are zero.
bool ReducedContacts::fill_guess(std::span<const double> dlambda, int changes) noexcept {
  bool found = false;
  for (int s = 0; s < changes; ++s) {
    float* y = y_.data() + s * stride_;
    std::fill_n(y, W_.columns, 0.0F);
    for (const Reduced& contact : active()) {
      std::array<float, 3> guess{};
      for (int i = 0; i < contact.rows; ++i)
        guess[static_cast<std::size_t>(i)] = static_cast<float>(dlambda[s * W_.rows + contact.first + i]);
      multiply_small(contact.test, contact.rows, guess.data(), y + contact.first);
      for (int i = 0; i < contact.rows; ++i) found = found || y[contact.first + i] != 0.0F;
    }
  }
  return found;
}

void ReducedContacts::derivative(int changes, std::span<const double> db,
                                 std::span<double> dlambda) noexcept {
  const std::ptrdiff_t rows = W_.rows;
  const bool guessed = fill_guess(dlambda, changes);
  std::fill_n(dlambda.begin(), changes * rows, 0.0);
  if (active_ == 0) return;
  if (guessed) {
    for (int s = 0; s < changes; ++s) fill_image(y_.data() + s * stride_, x_.data() + s * stride_);
    multiply_by_compliance(changes);
  }
  for (int s = 0; s < changes; ++s) {
    Gmres& gmres = gmres_[static_cast<std::size_t>(s)];
    const float* y = y_.data() + s * stride_;
    const float* v = v_.data() + s * stride_;
    float* wanted = x_.data() + s * stride_;
    const double* change = db.data() + s * rows;
    std::transform(change, change + rows, wanted, [](double value) { return static_cast<float>(-value); });
    float* first = gmres.first();
    test(wanted, first);
    const float size = std::sqrt(dot(first, first, W_.columns));
    if (guessed) {
      for (std::ptrdiff_t i = 0; i < rows; ++i) wanted[i] -= v[i];
      test(wanted, first);
      for (const Reduced& contact : active()) {
        if (contact.rows > 1) first[contact.first + 1] -= contact.turning * y[contact.first + 1];
      }
    }
    gmres.begin(W_.columns, most_steps(), tuning.many.linear_tolerance * size);
  }
  solve(changes);
  for (int s = 0; s < changes; ++s) {
    float* y = y_.data() + s * stride_;
    gmres_[static_cast<std::size_t>(s)].solve(step_.data());
    for (std::ptrdiff_t i = 0; i < rows; ++i) y[i] += step_[static_cast<std::size_t>(i)];
    fill_image(y, x_.data());
    std::copy_n(x_.begin(), rows, dlambda.begin() + s * rows);
  }
}

}  // namespace palpate
