#include "runtime/core/solve/newton_krylov.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/core/solve/symmetric_product.h"
#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr Index width = 16;  // vectors are padded to whole registers

Index padded(Index rows) noexcept {
  return (rows + width - 1) / width * width;
}

/// y += the first `rows` rows of A times their factors, three of them in one pass.
void add_rows(const float* __restrict A, std::ptrdiff_t stride, int rows, const Vec3& factors,
              float* __restrict y, std::ptrdiff_t columns) noexcept {
  const Eigen::Vector3f by = factors.cast<float>();
  if (rows == 3) return add_three(A, stride, by.data(), y, columns);
  for (int i = 0; i < rows; ++i) {
    if (by[i] != 0.0F) add(A + i * stride, by[i], y, columns);
  }
}

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

SymmetricRows compliance(const ContactProblem& problem) noexcept {
  return {problem.single_row(0), problem.single_stride, problem.rows, problem.padded_rows()};
}

Vec3 tangential(const Vec3& v, const Vec3& n) noexcept {
  return v - n.dot(v) * n;
}

/// Progress of the rounds of sweeps and Newton steps.
struct Progress {
  double last = std::numeric_limits<double>::infinity();  // smallest residual after a round
  int failures = 0;                                       // steps with little gain
  bool newton = false;                                    // the first round has no Newton step

  [[nodiscard]] bool has_step() const noexcept { return newton && failures < tuning.many.most_failures; }

  /// Records the residual reached by a round.
  void note(double reached) noexcept {
    if (newton && reached > tuning.many.gain * last) ++failures;
    if (!(reached <= 4.0 * last)) failures = tuning.many.most_failures;
    last = std::min(last, reached);
    newton = true;
  }
};

}  // namespace

NewtonKrylov::NewtonKrylov(Index max_contacts, Index max_rows)
    : stride_(padded(max_rows)),
      contacts_(static_cast<std::size_t>(max_contacts)),
      f_(static_cast<std::size_t>(stride_)),
      best_f_(f_.size()),
      r_(f_.size()),
      best_r_(f_.size()),
      few_b_(f_.size()),
      few_guess_(f_.size()),
      change_(f_.size()),
      product_(f_.size()),
      reduced_(contacts_.size()),
      gmres_(most_changes, Gmres(stride_, tuning.many.most_steps)),
      x_(most_changes * f_.size()),
      v_(x_.size()),
      y_(x_.size()),
      step_(f_.size()),
      motions_(f_.size() * static_cast<std::size_t>(tuning.many.most_steps)) {}

bool NewtonKrylov::was_easy() const noexcept {
  return work_ <= tuning.many.easy_share * tuning.many.most_work;
}

/// Multiplications of a product with W, including its overhead.
double NewtonKrylov::product_work() const noexcept {
  return static_cast<double>(rows_) * static_cast<double>(rows_ + tuning.many.product_overhead);
}

void NewtonKrylov::count_product() noexcept {
  ++products_;
  work_ += product_work();
}

template <typename Real>
Vec3 NewtonKrylov::at(const std::vector<Real>& v, const Contact& contact) const noexcept {
  Vec3 value = Vec3::Zero();
  for (int i = 0; i < contact.rows; ++i) value[i] = v[contact.first + i];
  return value;
}

void NewtonKrylov::change_force(const Contact& contact, const Vec3& change) noexcept {
  for (int i = 0; i < contact.rows; ++i) f_[contact.first + i] += change[i];
}

/// Sets the forces to exactly zero, without rounding residue.
void NewtonKrylov::open(const Contact& contact) noexcept {
  std::fill_n(f_.begin() + contact.first, contact.rows, 0.0);
}

/// A row that belongs to a contact is absent with it.
bool NewtonKrylov::is_present(const Contact& contact) const noexcept {
  return contact.owner < 0 || !at(f_, contacts_[static_cast<std::size_t>(contact.owner)]).isZero(0.0);
}

/// Moves the guess into the cone, from which the normal may have rotated.
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

/// Moves all contacts into their cones; removes rows that belong to a contact without force.
void NewtonKrylov::enter_cones() noexcept {
  const std::span<const Contact> all = std::span(contacts_).first(static_cast<std::size_t>(count_));
  for (const Contact& contact : all) {
    if (contact.kind != Kind::absent) enter_cone(contact);
  }
  for (const Contact& contact : all) {
    if (contact.kind != Kind::absent && !is_present(contact)) open(contact);
  }
}

void NewtonKrylov::load(ContactProblem& problem) noexcept {
  count_ = problem.contacts;
  rows_ = problem.rows;
  padded_rows_ = problem.padded_rows();
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
  }
  enter_cones();
  std::fill(r_.begin() + rows_, r_.begin() + padded_rows_, 0.0F);
}

/// Computes r = b + W (f - guess). The guess is inside the cones, except for normals that have rotated.
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

/// Updates r by the change of the forces.
void NewtonKrylov::move_by_change(const ContactProblem& problem) noexcept {
  multiply(compliance(problem), change_.data(), product_.data());
  count_product();
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) r_[i] += product_[i];
}

/// Returns the force on the cone with r_n = 0 and r_t opposite to the tangential force; its direction is
/// found by Newton's method on the angle.
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
    const double half = 0.5 * std::clamp(-wrong / slope, -0.5, 0.5);  // half the angle, by its tangent
    e = ((1.0 - half * half) * e + 2.0 * half * across) / (1.0 + half * half);
  }
  return force;
}

/// Returns the change of a contact's force that solves its equations, with the others fixed.
Vec3 NewtonKrylov::suiting_change(const Contact& contact, const Vec3& f, const Vec3& r) const noexcept {
  Vec3 to_stick = -(contact.inverse * r);
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
    if (!change.isZero(0.0))
      add_rows(problem.single_row(contact.first), problem.single_stride, contact.rows, change, r_.data(),
               columns);
  }
  count_product();
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

/// Starts from the prediction if it is closer to the solution than the guess alone.
void NewtonKrylov::predict(const ContactProblem& problem) noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) f_[i] += problem.prediction[i];
  enter_cones();
  bool moved = false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) {
    change_[i] = static_cast<float>(f_[i] - best_f_[i]);
    moved = moved || change_[i] != 0.0F;
  }
  if (!moved) return;
  const double guessed = best_ * largest_force_;
  move_by_change(problem);
  find_residual();
  if (residual_ * largest_force_ < guessed) return keep_best();
  take_best();
}

void NewtonKrylov::find_residual() noexcept {
  double worst = 0.0;
  double largest = std::numeric_limits<double>::min();
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Vec3 f = at(f_, contact);
    worst = std::max(worst, difference(contact, f, at(r_, contact)).squaredNorm());
    largest = std::max(largest, f.squaredNorm());
  }
  largest_force_ = std::sqrt(largest);
  residual_ = std::sqrt(worst) / largest_force_;
}

/// True if a contact is closed, or would be by its force and motion.
bool NewtonKrylov::may_press(const Contact& contact, const Vec3& f, const Vec3& r) const noexcept {
  if (contact.kind == Kind::absent) return false;
  if (contact.kind == Kind::held) return is_present(contact);
  return contact.n.dot(f) - contact.n.dot(r) / contact.w > 0.0;
}

void NewtonKrylov::choose_modes() noexcept {
  for (Index k = 0; k < count_; ++k) {
    Contact& contact = contacts_[static_cast<std::size_t>(k)];
    const Vec3 f = at(f_, contact);
    const Vec3 r = at(r_, contact);
    contact.mode = Mode::stick;
    if (!may_press(contact, f, r)) {
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
  }
}

/// Removes the forces of open contacts, and moves those of slipping ones to the edge of the cone.
void NewtonKrylov::move_to_modes(const ContactProblem& problem) noexcept {
  bool moved = false;
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
    add_rows(problem.single_row(contact.first), problem.single_stride, contact.rows, to - f, r_.data(),
             padded_rows_);
  }
  if (moved) count_product();
}

/// Collects the contacts that are not open, each with its own compliance as preconditioner.
void NewtonKrylov::reduce() noexcept {
  active_ = 0;
  for (Index k = 0; k < count_; ++k) {
    const Contact& contact = contacts_[static_cast<std::size_t>(k)];
    if (contact.mode == Mode::open) continue;
    Reduced& reduced = reduced_[active_++];
    reduced.first = contact.first;
    reduced.rows = contact.rows;
    reduced.turning = 0.0F;
    if (contact.mode != Mode::slip) {
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
void NewtonKrylov::fill_image(const float* y, float* x) const noexcept {
  std::fill_n(x, padded_rows_, 0.0F);
  for (const Reduced& contact : std::span(reduced_).first(active_))
    multiply_small(contact.image, contact.rows, y + contact.first, x + contact.first);
}

/// Computes the left-hand sides of the equations from motions along the rows.
void NewtonKrylov::test(const float* motion, float* out) const noexcept {
  std::fill_n(out, padded_rows_, 0.0F);
  for (const Reduced& contact : std::span(reduced_).first(active_))
    multiply_small(contact.test, contact.rows, motion + contact.first, out + contact.first);
}

/// Computes v = W x for the first systems together, so that W is read once.
void NewtonKrylov::multiply_by_compliance(const ContactProblem& problem, int systems) noexcept {
  if (systems == 1) {
    multiply(compliance(problem), x_.data(), v_.data());
  } else {
    multiply_three(compliance(problem), x_.data(), v_.data(), stride_);
  }
  count_product();
}

/// Runs GMRES on the reduced systems that have begun.
void NewtonKrylov::solve_reduced(const ContactProblem& problem, int systems) noexcept {
  const std::span<Gmres> all = std::span(gmres_).first(static_cast<std::size_t>(systems));
  const auto is_done = [](const Gmres& gmres) { return gmres.done(); };
  while (!std::all_of(all.begin(), all.end(), is_done)) {
    for (int s = 0; s < systems; ++s) {
      Gmres& gmres = gmres_[static_cast<std::size_t>(s)];
      float* x = x_.data() + s * stride_;
      if (gmres.done()) {
        std::fill_n(x, padded_rows_, 0.0F);
        continue;
      }
      float* y = gmres.image();
      std::fill_n(y, padded_rows_, 0.0F);
      for (const Reduced& contact : std::span(reduced_).first(active_))
        multiply_small(contact.inverse, contact.rows, gmres.newest() + contact.first, y + contact.first);
      fill_image(y, x);
    }
    multiply_by_compliance(problem, systems);
    for (int s = 0; s < systems; ++s) {
      Gmres& gmres = gmres_[static_cast<std::size_t>(s)];
      if (gmres.done()) continue;
      if (systems == 1) std::copy_n(v_.data(), padded_rows_, motions_.data() + gmres.steps() * stride_);
      float* next = gmres.next();
      test(v_.data() + s * stride_, next);
      for (const Reduced& contact : std::span(reduced_).first(active_)) {
        if (contact.rows > 1) next[contact.first + 1] += contact.turning * gmres.image()[contact.first + 1];
      }
      gmres.expand();
    }
  }
}

/// GMRES steps allowed by the budget.
int NewtonKrylov::most_steps() const noexcept {
  return static_cast<int>(std::clamp<double>(tuning.many.step_work / product_work(), tuning.many.fewest_steps,
                                             tuning.many.most_steps));
}

bool NewtonKrylov::newton_step(const ContactProblem& problem) noexcept {
  choose_modes();
  reduce();
  if (active_ == 0) return false;
  move_to_modes(problem);
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) x_[i] = -r_[i];
  Gmres& gmres = gmres_[0];
  test(x_.data(), gmres.first());
  const float size = std::sqrt(dot(gmres.first(), gmres.first(), padded_rows_));
  gmres.begin(padded_rows_, most_steps(), tuning.many.linear_tolerance * size);
  solve_reduced(problem, 1);
  gmres.solve(step_.data());
  fill_image(step_.data(), change_.data());
  if (!std::all_of(change_.begin(), change_.begin() + rows_, [](float by) { return std::isfinite(by); }))
    return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(rows_); ++i) f_[i] += change_[i];
  for (int j = 0; j < gmres.steps(); ++j)
    add(motions_.data() + j * stride_, gmres.share(j), r_.data(), rows_);
  return true;
}

void NewtonKrylov::keep_best() noexcept {
  best_ = residual_;
  std::copy_n(f_.begin(), padded_rows_, best_f_.begin());
  std::copy_n(r_.begin(), padded_rows_, best_r_.begin());
}

void NewtonKrylov::take_best() noexcept {
  residual_ = best_;
  std::copy_n(best_f_.begin(), padded_rows_, f_.begin());
  std::copy_n(best_r_.begin(), padded_rows_, r_.begin());
}

/// Least cost of another round, with or without a Newton step [multiplications].
double NewtonKrylov::round_work(bool with_step) const noexcept {
  return (with_step ? tuning.many.fewest_steps : tuning.many.sweeps) * product_work();
}

bool NewtonKrylov::solve(ContactProblem& problem) noexcept {
  products_ = 0;
  work_ = 0.0;
  rounds_ = 0;
  std::copy_n(problem.lambda.begin(), problem.rows, problem.guess.begin());
  load(problem);
  find_motion(problem);
  find_residual();
  keep_best();
  const double wanted =
      std::clamp(tuning.many.reduction * best_, tuning.many.least_residual, tuning.many.tolerance);
  if (best_ > wanted) predict(problem);
  Progress progress;
  // Rest is reached over several ticks, each starting from the last one: no step is too late for that.
  const bool moves = problem.moves || wanted == tuning.many.tolerance;
  const auto is_done = [&] {
    if (best_ <= wanted || rounds_ >= tuning.many.most_rounds || work_ >= tuning.many.most_work) return true;
    const double next = work_ + round_work(progress.has_step());
    if (moves && best_ <= tuning.many.late_tolerance && next >= tuning.many.late_work) return true;
    return best_ <= tuning.many.rough_tolerance &&
           (work_ >= tuning.many.smooth_work || progress.failures >= tuning.many.rough_failures);
  };
  while (!is_done()) {
    ++rounds_;
    if (progress.has_step() && !newton_step(problem)) {
      progress.failures = tuning.many.most_failures;
      take_best();
    }
    for (int k = 0; k < tuning.many.sweeps; ++k) sweep(problem);
    find_residual();
    const double reached = residual_;
    if (reached < best_) keep_best();
    progress.note(reached);
    if (progress.failures == tuning.many.most_failures && reached > best_) take_best();
  }
  if (residual_ > best_) take_best();
  for (Index i = 0; i < rows_; ++i)
    problem.lambda[static_cast<std::size_t>(i)] = f_[static_cast<std::size_t>(i)];
  return best_ <= tuning.many.accepted;
}

bool NewtonKrylov::improve_few(ContactProblem& problem) noexcept {
  const auto rows = static_cast<std::ptrdiff_t>(problem.rows);
  if (rows > problem.single_stride || std::ssize(contacts_) < problem.contacts) return false;
  std::copy_n(problem.b.begin(), rows, few_b_.begin());
  std::copy_n(problem.guess.begin(), rows, few_guess_.begin());
  std::fill_n(problem.prediction.begin(), rows, 0.0);
  problem.many = true;
  problem.coupled = false;
  for (Index i = 0; i < problem.rows; ++i) {
    float* single = problem.single_row(i);
    std::transform(problem.row(i), problem.row(i) + rows, single,
                   [](double value) { return static_cast<float>(value); });
    std::fill(single + rows, single + problem.padded_rows(), 0.0F);
    problem.b[i] += dot(problem.row(i), problem.lambda.data(), rows);
  }
  const bool solved = solve(problem);
  problem.many = false;
  std::copy_n(few_b_.begin(), rows, problem.b.begin());
  std::copy_n(few_guess_.begin(), rows, problem.guess.begin());
  return solved;
}

/// Computes the unknowns y of each change from the guess in dlambda. False if all are zero.
bool NewtonKrylov::fill_guess(std::span<const double> dlambda, int changes) noexcept {
  bool found = false;
  for (int s = 0; s < changes; ++s) {
    float* y = y_.data() + s * stride_;
    std::fill_n(y, padded_rows_, 0.0F);
    for (const Reduced& contact : std::span(reduced_).first(active_)) {
      std::array<float, 3> guess{};
      for (int i = 0; i < contact.rows; ++i)
        guess[static_cast<std::size_t>(i)] = static_cast<float>(dlambda[s * rows_ + contact.first + i]);
      multiply_small(contact.test, contact.rows, guess.data(), y + contact.first);
      for (int i = 0; i < contact.rows; ++i) found = found || y[contact.first + i] != 0.0F;
    }
  }
  return found;
}

void NewtonKrylov::derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                              std::span<double> dlambda) noexcept {
  const int products = products_;
  const double work = work_;
  choose_modes();
  reduce();
  const bool guessed = fill_guess(dlambda, changes);
  std::fill_n(dlambda.begin(), changes * rows_, 0.0);
  if (active_ == 0) return;
  if (guessed) {
    for (int s = 0; s < changes; ++s) fill_image(y_.data() + s * stride_, x_.data() + s * stride_);
    multiply_by_compliance(problem, changes);
  }
  for (int s = 0; s < changes; ++s) {
    Gmres& gmres = gmres_[static_cast<std::size_t>(s)];
    const float* y = y_.data() + s * stride_;
    const float* v = v_.data() + s * stride_;
    float* wanted = x_.data() + s * stride_;
    const double* change = db.data() + std::ptrdiff_t{s} * rows_;
    std::transform(change, change + rows_, wanted, [](double value) { return static_cast<float>(-value); });
    float* first = gmres.first();
    test(wanted, first);
    const float size = std::sqrt(dot(first, first, padded_rows_));
    if (guessed) {
      for (Index i = 0; i < rows_; ++i) wanted[i] -= v[i];
      test(wanted, first);
      for (const Reduced& contact : std::span(reduced_).first(active_)) {
        if (contact.rows > 1) first[contact.first + 1] -= contact.turning * y[contact.first + 1];
      }
    }
    gmres.begin(padded_rows_, most_steps(), tuning.many.linear_tolerance * size);
  }
  solve_reduced(problem, changes);
  for (int s = 0; s < changes; ++s) {
    float* y = y_.data() + s * stride_;
    gmres_[static_cast<std::size_t>(s)].solve(step_.data());
    for (Index i = 0; i < rows_; ++i) y[i] += step_[static_cast<std::size_t>(i)];
    fill_image(y, x_.data());
    std::copy_n(x_.begin(), rows_, dlambda.begin() + std::ptrdiff_t{s} * rows_);
  }
  products_ = products;
  work_ = work;
}

}  // namespace palpate
