#include "runtime/solve/newton_krylov.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/solve/tick_tuning.h"

namespace palpate {
namespace {

constexpr Index width = 16;  // vectors end on whole registers

Index padded(Index rows) noexcept {
  return (rows + width - 1) / width * width;
}

float dot(const float* __restrict a, const float* __restrict b, std::ptrdiff_t count) noexcept {
  float sum = 0.0F;
#pragma omp simd reduction(+ : sum)
  for (std::ptrdiff_t i = 0; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

void add(const float* __restrict x, float factor, float* __restrict y, std::ptrdiff_t count) noexcept {
#pragma omp simd
  for (std::ptrdiff_t i = 0; i < count; ++i) y[i] += factor * x[i];
}

/// y = A x, four rows at a time.
void multiply(const float* __restrict A, std::ptrdiff_t stride, const float* __restrict x,
              float* __restrict y, std::ptrdiff_t rows, std::ptrdiff_t columns) noexcept {
  std::ptrdiff_t i = 0;
  for (; i + 4 <= rows; i += 4) {
    const float* __restrict a = A + i * stride;
    float s0 = 0.0F, s1 = 0.0F, s2 = 0.0F, s3 = 0.0F;
#pragma omp simd reduction(+ : s0, s1, s2, s3)
    for (std::ptrdiff_t k = 0; k < columns; ++k) {
      s0 += a[k] * x[k];
      s1 += a[stride + k] * x[k];
      s2 += a[2 * stride + k] * x[k];
      s3 += a[3 * stride + k] * x[k];
    }
    y[i] = s0;
    y[i + 1] = s1;
    y[i + 2] = s2;
    y[i + 3] = s3;
  }
  for (; i < rows; ++i) y[i] = dot(A + i * stride, x, columns);
}

/// Y = A X for three vectors, `apart` from each other: A is read once.
void multiply_three(const float* __restrict A, std::ptrdiff_t stride, const float* __restrict x,
                    float* __restrict y, std::ptrdiff_t apart, std::ptrdiff_t rows,
                    std::ptrdiff_t columns) noexcept {
  for (std::ptrdiff_t i = 0; i < rows; ++i) {
    const float* __restrict a = A + i * stride;
    float s0 = 0.0F, s1 = 0.0F, s2 = 0.0F;
#pragma omp simd reduction(+ : s0, s1, s2)
    for (std::ptrdiff_t k = 0; k < columns; ++k) {
      s0 += a[k] * x[k];
      s1 += a[k] * x[apart + k];
      s2 += a[k] * x[2 * apart + k];
    }
    y[i] = s0;
    y[apart + i] = s1;
    y[2 * apart + i] = s2;
  }
}

Vec3 tangential(const Vec3& v, const Vec3& n) noexcept {
  return v - n.dot(v) * n;
}

}  // namespace

NewtonKrylov::NewtonKrylov(Index max_contacts, Index max_rows)
    : stride_(padded(max_rows)),
      contacts_(static_cast<std::size_t>(max_contacts)),
      f_(static_cast<std::size_t>(stride_)),
      best_f_(f_.size()),
      r_(f_.size()),
      best_r_(f_.size()),
      change_(f_.size()),
      product_(f_.size()),
      krylov_(most_changes),
      x_(most_changes * f_.size()),
      v_(x_.size()),
      y_(f_.size()) {
  const auto steps = static_cast<std::size_t>(tuning.many.most_steps);
  for (Krylov& krylov : krylov_) {
    krylov.basis.resize((steps + 1) * f_.size());
    krylov.scaled.resize(steps * f_.size());
    krylov.H.resize((steps + 1) * steps);
    krylov.cosine.resize(steps);
    krylov.sine.resize(steps);
    krylov.g.resize(steps + 1);
  }
}

bool NewtonKrylov::was_easy() const noexcept {
  return products_ * std::pow(rows_, 2) <= tuning.many.easy_share * tuning.many.most_work;
}

template <typename Real>
Vec3 NewtonKrylov::at(const std::vector<Real>& v, const Contact& contact) const noexcept {
  Vec3 value = Vec3::Zero();
  for (int i = 0; i < contact.rows; ++i) value[i] = v[static_cast<std::size_t>(contact.first + i)];
  return value;
}

void NewtonKrylov::change_force(const Contact& contact, const Vec3& change) noexcept {
  for (int i = 0; i < contact.rows; ++i) f_[static_cast<std::size_t>(contact.first + i)] += change[i];
}

/// Its forces are zero, and not what rounding leaves of them.
void NewtonKrylov::open(const Contact& contact) noexcept {
  std::fill_n(f_.begin() + contact.first, contact.rows, 0.0);
}

/// Rows that are there for a contact are gone with it.
bool NewtonKrylov::is_present(const Contact& contact) const noexcept {
  return contact.owner < 0 || !at(f_, contacts_[static_cast<std::size_t>(contact.owner)]).isZero(0.0);
}

/// The guess is in the cone, but for a normal that has turned since.
void NewtonKrylov::enter_cone(const Contact& contact) noexcept {
  const Vec3 f = at(f_, contact);
  const double normal = contact.n.dot(f);
  if (contact.kind == Kind::held) return;
  if (!(normal > 0.0)) return open(contact);
  const Vec3 tangent = tangential(f, contact.n);
  const double length = tangent.norm();
  if (contact.kind == Kind::cone && length > contact.mu * normal)
    change_force(contact, (contact.mu * normal / length - 1.0) * tangent);
}

void NewtonKrylov::load(ContactProblem& problem) noexcept {
  count_ = problem.contacts;
  rows_ = problem.rows;
  padded_rows_ = padded(rows_);
  for (Index k = 0; k < count_; ++k) {
    Contact& contact = contacts_[static_cast<std::size_t>(k)];
    contact.first = problem.first_row(k);
    contact.rows = problem.rows_of(k);
    if (contact.rows == 0) {
      contact.kind = Kind::absent;
      continue;
    }
    contact.owner = problem.owner[static_cast<std::size_t>(k)];
    contact.mu = problem.friction[static_cast<std::size_t>(k)];
    contact.n = problem.normal[static_cast<std::size_t>(k)];
    const bool is_held = problem.held[static_cast<std::size_t>(k)] != 0;
    contact.kind = is_held ? Kind::held : contact.rows == 1 ? Kind::normal : Kind::cone;
    contact.D.setIdentity();
    double trace = 0.0;
    for (int i = 0; i < contact.rows; ++i) {
      for (int j = 0; j < contact.rows; ++j)
        contact.D(i, j) = problem.single_row(contact.first + i)[contact.first + j];
      trace += contact.D(i, i);
    }
    contact.w = trace / contact.rows;
    for (int i = contact.rows; i < 3; ++i) contact.D(i, i) = contact.w;
    contact.inverse = contact.D.inverse();
    std::copy_n(problem.lambda.begin() + contact.first, contact.rows, f_.begin() + contact.first);
    enter_cone(contact);
  }
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    if (!is_present(contact)) open(contact);
  }
  std::fill(r_.begin() + rows_, r_.begin() + padded_rows_, 0.0F);
}

/// r = b + W (f - guess). The guess is in the cones, but for normals that have turned since.
void NewtonKrylov::find_motion(const ContactProblem& problem) noexcept {
  bool moved = false;
  std::fill_n(change_.begin(), padded_rows_, 0.0F);
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) {
    r_[i] = static_cast<float>(problem.b[i]);
    change_[i] = static_cast<float>(f_[i] - problem.guess[i]);
    moved = moved || change_[i] != 0.0F;
  }
  if (moved) move_by_change(problem);
}

/// r by what the forces change by.
void NewtonKrylov::move_by_change(const ContactProblem& problem) noexcept {
  multiply(problem.single_row(0), problem.single_stride, change_.data(), product_.data(), rows_,
           padded_rows_);
  ++products_;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) r_[i] += product_[i];
}

/// On the cone, with r_n = 0 and r_t opposed to the tangential force: its direction by Newton's method on the
/// angle.
Vec3 NewtonKrylov::slipping_force(const Contact& contact, const Vec3& f, const Vec3& r,
                                  const Vec3& sticking) const noexcept {
  const Vec3& n = contact.n;
  const Vec3 alone = r - contact.D * f;  // motion without the contact's own force
  Vec3 e = tangential(f, n) - tangential(r, n) / contact.w;
  if (!(e.squaredNorm() > 0.0)) e = tangential(sticking, n);
  if (!(e.squaredNorm() > 0.0)) return std::max(0.0, n.dot(f)) * n;
  e.normalize();
  Vec3 force = Vec3::Zero();
  for (int round = 0; round < tuning.many.local_rounds; ++round) {
    const Vec3 along = n + contact.mu * e;
    const Vec3 moved = contact.D * along;
    const double give = n.dot(moved);
    if (!(give > 0.0)) break;
    const double normal = -n.dot(alone) / give;
    force = normal * along;
    const Vec3 motion = alone + normal * moved;
    const Vec3 across = n.cross(e);
    const double wrong = across.dot(motion);
    const double scale = contact.w * contact.mu * normal;
    if (std::abs(wrong) <= tuning.many.local_tolerance * scale) {
      if (e.dot(motion) <= 0.0 || round > 0) break;
      e = -e;
      continue;
    }
    const Vec3 turned = contact.D * across;
    const double normal_change = -normal * contact.mu * n.dot(turned) / give;
    double slope =
        -e.dot(motion) + normal_change * across.dot(moved) + normal * contact.mu * across.dot(turned);
    if (!(slope > 0.0)) slope = scale;
    const double angle = std::clamp(-wrong / slope, -0.5, 0.5);
    e = (std::cos(angle) * e + std::sin(angle) * across).normalized();
  }
  return force;
}

/// What a contact's force changes by to solve its equations, the others being as they are.
Vec3 NewtonKrylov::suiting_change(const Contact& contact, const Vec3& f, const Vec3& r) const noexcept {
  const Vec3 to_stick = -(contact.inverse * r);
  if (contact.kind == Kind::held) return to_stick;
  if (contact.kind == Kind::normal) return {std::max(-f[0], -r[0] / contact.w), 0.0, 0.0};
  if (contact.n.dot(r - contact.D * f) >= 0.0) return -f;
  const Vec3 sticking = f + to_stick;
  const double normal = contact.n.dot(sticking);
  if (normal > 0.0 && tangential(sticking, contact.n).norm() <= contact.mu * normal) return to_stick;
  return slipping_force(contact, f, r, sticking) - f;
}

void NewtonKrylov::sweep(const ContactProblem& problem) noexcept {
  const std::ptrdiff_t columns = padded_rows_;
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Vec3 f = at(f_, contact);
    const Vec3 r = at(r_, contact);
    if (contact.kind == Kind::absent) continue;
    if (contact.kind != Kind::held && f.isZero(0.0) && contact.n.dot(r) >= 0.0) continue;
    const Vec3 change = is_present(contact) ? suiting_change(contact, f, r) : Vec3(-f);
    change_force(contact, change);
    if (contact.kind != Kind::held && change == -f) open(contact);
    for (int i = 0; i < contact.rows; ++i) {
      if (change[i] != 0.0)
        add(problem.single_row(contact.first + i), static_cast<float>(change[i]), r_.data(), columns);
    }
  }
  ++products_;
}

/// Difference of the two sides of the equations.
Vec3 NewtonKrylov::difference(const Contact& contact, const Vec3& f, const Vec3& r) const noexcept {
  if (contact.kind == Kind::absent || !is_present(contact)) return f;
  if (contact.kind == Kind::held) return r / contact.w;
  if (contact.kind == Kind::normal) return {f[0] - std::max(0.0, f[0] - r[0] / contact.w), 0.0, 0.0};
  const Vec3 z = f - r / contact.w;
  const double normal = std::max(0.0, contact.n.dot(z));
  Vec3 tangent = tangential(z, contact.n);
  const double length = tangent.norm();
  if (length > contact.mu * normal) tangent *= contact.mu * normal / length;
  return f - normal * contact.n - tangent;
}

double NewtonKrylov::find_residual() const noexcept {
  double worst = 0.0;
  double largest = std::numeric_limits<double>::min();
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Vec3 f = at(f_, contact);
    worst = std::max(worst, difference(contact, f, at(r_, contact)).squaredNorm());
    largest = std::max(largest, f.squaredNorm());
  }
  return std::sqrt(worst / largest);
}

void NewtonKrylov::choose_modes() noexcept {
  active_ = false;
  for (Index k = 0; k < count_; ++k) {
    Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Vec3 f = at(f_, contact);
    const Vec3 r = at(r_, contact);
    contact.mode = Mode::stick;
    if (contact.kind == Kind::absent) {
      contact.mode = Mode::open;
    } else if (contact.kind == Kind::held) {
      if (!is_present(contact)) contact.mode = Mode::open;
    } else if (contact.n.dot(f) - contact.n.dot(r) / contact.w <= 0.0) {
      contact.mode = Mode::open;
    } else if (contact.kind == Kind::cone) {
      const Vec3 z = tangential(f, contact.n) - tangential(r, contact.n) / contact.w;
      const double normal =
          contact.n.dot(f) > 0.0 ? contact.n.dot(f) : contact.n.dot(f) - contact.n.dot(r) / contact.w;
      const double bound = contact.mu * normal;
      const double length = z.norm();
      if (length > bound) {
        contact.mode = Mode::slip;
        contact.e = z / length;
        contact.across = contact.n.cross(contact.e);
        const double share = bound / length;
        contact.turning = std::min((1.0 - share) * contact.w / (share + 1e-20), 1e4 * contact.w);
      }
    }
    active_ = active_ || contact.mode != Mode::open;
  }
}

/// Forces of open contacts go, those that slip go to the cone's edge.
void NewtonKrylov::move_to_modes(const ContactProblem& problem) noexcept {
  bool moved = false;
  std::fill_n(change_.begin(), padded_rows_, 0.0F);
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Vec3 f = at(f_, contact);
    Vec3 to = f;
    if (contact.mode == Mode::open) to.setZero();
    if (contact.mode == Mode::slip)
      to = std::max(0.0, contact.n.dot(f)) * (contact.n + contact.mu * contact.e);
    if (to == f) continue;
    moved = true;
    change_force(contact, to - f);
    if (contact.mode == Mode::open) open(contact);
    for (int i = 0; i < contact.rows; ++i)
      change_[static_cast<std::size_t>(contact.first + i)] = static_cast<float>(to[i] - f[i]);
  }
  if (!moved) return;
  move_by_change(problem);
}

/// Forces x of the active rows by the unknowns y: along the cone's edge and across where a contact slips.
void NewtonKrylov::lift(const float* y, float* x) const noexcept {
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const float* from = y + contact.first;
    float* to = x + contact.first;
    if (contact.mode == Mode::open) {
      std::fill_n(to, contact.rows, 0.0F);
    } else if (contact.mode == Mode::slip) {
      const Vec3 force = from[0] * (contact.n + contact.mu * contact.e) + from[1] * contact.across;
      for (int i = 0; i < contact.rows; ++i) to[i] = static_cast<float>(force[i]);
    } else {
      for (int i = 0; i < contact.rows; ++i) to[i] = from[i];
    }
  }
}

/// The equations' left sides by motions v of the active rows.
void NewtonKrylov::test(const float* v, const float* y, float* out) const noexcept {
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const float* from = v + contact.first;
    float* to = out + contact.first;
    if (contact.mode == Mode::open) {
      std::fill_n(to, contact.rows, 0.0F);
    } else if (contact.mode == Mode::slip) {
      Vec3 motion = Vec3::Zero();
      for (int i = 0; i < contact.rows; ++i) motion[i] = from[i];
      const double by_force = y != nullptr ? contact.turning * y[contact.first + 1] : 0.0;
      to[0] = static_cast<float>(contact.n.dot(motion));
      to[1] = static_cast<float>(contact.across.dot(motion) + by_force);
      if (contact.rows == 3) to[2] = 0.0F;
    } else {
      for (int i = 0; i < contact.rows; ++i) to[i] = from[i];
    }
  }
}

/// By what a contact gives way itself.
void NewtonKrylov::precondition(const float* v, float* y) const noexcept {
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const float* from = v + contact.first;
    float* to = y + contact.first;
    if (contact.mode == Mode::open) {
      std::fill_n(to, contact.rows, 0.0F);
    } else if (contact.mode == Mode::slip) {
      to[0] = static_cast<float>(from[0] / contact.w);
      to[1] = static_cast<float>(from[1] / (contact.w + contact.turning));
      if (contact.rows == 3) to[2] = 0.0F;
    } else {
      Vec3 value = Vec3::Zero();
      for (int i = 0; i < contact.rows; ++i) value[i] = from[i];
      const Vec3 scaled = contact.inverse * value;
      for (int i = 0; i < contact.rows; ++i) to[i] = static_cast<float>(scaled[i]);
    }
  }
}

/// Takes the newest vector of the basis in (Arnoldi, by modified Gram & Schmidt), and turns the Hessenberg
/// matrix into a triangular one.
void NewtonKrylov::expand(Krylov& krylov) noexcept {
  const int most = tuning.many.most_steps;
  const int k = krylov.steps;
  float* next = krylov.basis.data() + (k + 1) * stride_;
  const auto h = [&](int i, int j) -> float& { return krylov.H[static_cast<std::size_t>(i * most + j)]; };
  for (int j = 0; j <= k; ++j) {
    const float* q = krylov.basis.data() + j * stride_;
    h(j, k) = dot(q, next, padded_rows_);
    add(q, -h(j, k), next, padded_rows_);
  }
  const float length = std::sqrt(dot(next, next, padded_rows_));
  if (length > 0.0F) {
    for (std::ptrdiff_t i = 0; i < padded_rows_; ++i) next[i] /= length;
  }
  for (int j = 0; j < k; ++j) {
    const float a = h(j, k);
    const float b = h(j + 1, k);
    const auto at = static_cast<std::size_t>(j);
    h(j, k) = krylov.cosine[at] * a + krylov.sine[at] * b;
    h(j + 1, k) = -krylov.sine[at] * a + krylov.cosine[at] * b;
  }
  const float a = h(k, k);
  const float size = std::sqrt(a * a + length * length);
  const auto at = static_cast<std::size_t>(k);
  if (!(size > 0.0F)) {
    krylov.done = true;
    return;
  }
  krylov.cosine[at] = a / size;
  krylov.sine[at] = length / size;
  h(k, k) = size;
  krylov.g[at + 1] = -krylov.sine[at] * krylov.g[at];
  krylov.g[at] *= krylov.cosine[at];
  ++krylov.steps;
  krylov.done =
      krylov.steps == steps_ || std::abs(krylov.g[at + 1]) <= tuning.many.linear_tolerance * krylov.size;
}

/// GMRES on the reduced systems whose right-hand sides stand first in krylov_[k].basis, in step, so that W is
/// read once for all of them.
void NewtonKrylov::solve_reduced(const ContactProblem& problem, int systems) noexcept {
  const double product = std::pow(rows_, 2);
  steps_ = static_cast<int>(
      std::clamp<double>(tuning.many.step_work / product, tuning.many.fewest_steps, tuning.many.most_steps));
  for (int s = 0; s < systems; ++s) {
    Krylov& krylov = krylov_[static_cast<std::size_t>(s)];
    float* first = krylov.basis.data();
    std::fill(first + rows_, first + padded_rows_, 0.0F);
    krylov.steps = 0;
    krylov.size = std::sqrt(dot(first, first, padded_rows_));
    krylov.done = !(krylov.size > 0.0F) || !std::isfinite(krylov.size);
    if (krylov.done) continue;
    for (std::ptrdiff_t i = 0; i < padded_rows_; ++i) first[i] /= krylov.size;
    krylov.g[0] = krylov.size;
  }
  const auto is_done = [&] {
    return std::all_of(krylov_.begin(), krylov_.begin() + systems,
                       [](const Krylov& krylov) { return krylov.done; });
  };
  while (!is_done()) {
    for (int s = 0; s < systems; ++s) {
      const Krylov& krylov = krylov_[static_cast<std::size_t>(s)];
      float* x = x_.data() + s * stride_;
      std::fill_n(x, padded_rows_, 0.0F);
      if (krylov.done) continue;
      float* scaled = krylov_[static_cast<std::size_t>(s)].scaled.data() + krylov.steps * stride_;
      precondition(krylov.basis.data() + krylov.steps * stride_, scaled);
      lift(scaled, x);
    }
    if (systems == 1) {
      multiply(problem.single_row(0), problem.single_stride, x_.data(), v_.data(), rows_, padded_rows_);
    } else {
      multiply_three(problem.single_row(0), problem.single_stride, x_.data(), v_.data(), stride_, rows_,
                     padded_rows_);
    }
    ++products_;
    for (int s = 0; s < systems; ++s) {
      Krylov& krylov = krylov_[static_cast<std::size_t>(s)];
      if (krylov.done) continue;
      float* next = krylov.basis.data() + (krylov.steps + 1) * stride_;
      std::fill(next + rows_, next + padded_rows_, 0.0F);
      test(v_.data() + s * stride_, krylov.scaled.data() + krylov.steps * stride_, next);
      expand(krylov);
    }
  }
}

/// Forces [active rows] of a system that was solved.
void NewtonKrylov::solution(const Krylov& krylov, float* x) noexcept {
  const int most = tuning.many.most_steps;
  std::fill_n(y_.begin(), padded_rows_, 0.0F);
  std::array<float, static_cast<std::size_t>(tuning.many.most_steps)> c{};
  for (int j = krylov.steps; j-- > 0;) {
    float sum = krylov.g[static_cast<std::size_t>(j)];
    for (int t = j + 1; t < krylov.steps; ++t)
      sum -= krylov.H[static_cast<std::size_t>(j * most + t)] * c[static_cast<std::size_t>(t)];
    c[static_cast<std::size_t>(j)] = sum / krylov.H[static_cast<std::size_t>(j * most + j)];
  }
  for (int j = 0; j < krylov.steps; ++j)
    add(krylov.scaled.data() + j * stride_, c[static_cast<std::size_t>(j)], y_.data(), padded_rows_);
  lift(y_.data(), x);
}

bool NewtonKrylov::newton_step(const ContactProblem& problem) noexcept {
  choose_modes();
  if (!active_) return false;
  move_to_modes(problem);
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) x_[i] = -r_[i];
  test(x_.data(), nullptr, krylov_[0].basis.data());
  solve_reduced(problem, 1);
  std::fill_n(change_.begin(), padded_rows_, 0.0F);
  solution(krylov_[0], change_.data());
  if (!std::all_of(change_.begin(), change_.begin() + rows_, [](float by) { return std::isfinite(by); }))
    return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) f_[i] += change_[i];
  move_by_change(problem);
  return true;
}

void NewtonKrylov::take_best() noexcept {
  std::copy_n(best_f_.begin(), padded_rows_, f_.begin());
  std::copy_n(best_r_.begin(), padded_rows_, r_.begin());
}

bool NewtonKrylov::solve(ContactProblem& problem) noexcept {
  products_ = 0;
  rounds_ = 0;
  std::copy_n(problem.lambda.begin(), problem.rows, problem.guess.begin());
  load(problem);
  find_motion(problem);
  residual_ = find_residual();
  double best = residual_;
  double last = std::numeric_limits<double>::infinity();
  int failures = 0;
  const auto keep = [&] {
    best = residual_;
    std::copy_n(f_.begin(), padded_rows_, best_f_.begin());
    std::copy_n(r_.begin(), padded_rows_, best_r_.begin());
  };
  keep();
  bool newton = false;
  const auto work = [&] { return products_ * std::pow(rows_, 2); };
  const double wanted =
      std::clamp(tuning.many.reduction * best, tuning.many.least_residual, tuning.many.tolerance);
  const auto is_done = [&] {
    if (best <= wanted || rounds_ >= tuning.many.most_rounds || work() >= tuning.many.most_work) return true;
    return best <= tuning.many.rough_tolerance && work() >= tuning.many.smooth_work;
  };
  while (!is_done()) {
    ++rounds_;
    if (newton && failures < tuning.many.most_failures && !newton_step(problem)) {
      failures = tuning.many.most_failures;
      take_best();
    }
    for (int k = 0; k < tuning.many.sweeps; ++k) sweep(problem);
    residual_ = find_residual();
    if (residual_ < best) keep();
    if (newton && residual_ > tuning.many.gain * last) ++failures;
    if (!(residual_ <= 4.0 * last)) failures = tuning.many.most_failures;
    if (failures == tuning.many.most_failures && residual_ > best) take_best();
    last = std::min(last, residual_);
    newton = true;
  }
  if (residual_ > best) take_best();
  residual_ = best;
  for (Index i = 0; i < rows_; ++i)
    problem.lambda[static_cast<std::size_t>(i)] = f_[static_cast<std::size_t>(i)];
  return best <= tuning.many.accepted;
}

void NewtonKrylov::derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                              std::span<double> dlambda) noexcept {
  std::fill_n(dlambda.begin(), changes * rows_, 0.0);
  const int products = products_;
  choose_modes();
  if (!active_) return;
  for (int s = 0; s < changes; ++s) {
    const double* change = db.data() + s * rows_;
    std::transform(change, change + rows_, x_.begin(),
                   [](double value) { return static_cast<float>(-value); });
    test(x_.data(), nullptr, krylov_[static_cast<std::size_t>(s)].basis.data());
  }
  solve_reduced(problem, changes);
  for (int s = 0; s < changes; ++s) {
    solution(krylov_[static_cast<std::size_t>(s)], x_.data());
    std::copy_n(x_.begin(), rows_, dlambda.begin() + s * rows_);
  }
  products_ = products;
}

}  // namespace palpate
