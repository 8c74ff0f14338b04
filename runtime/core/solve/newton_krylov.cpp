#include "runtime/core/solve/newton_krylov.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

using Kind = ContactLaw::Kind;
using Mode = ContactLaw::Mode;

constexpr Index width = 16;  // vectors are padded to whole registers

Index padded(Index rows) noexcept {
  return (rows + width - 1) / width * width;
}

/// Capacity in rows of problems in double precision: those of few contacts, and of their tilts.
Index improved_rows(Index max_rows) noexcept {
  return padded(std::min(max_rows, 5 * tuning.many.few_contacts));
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
    : contacts_(static_cast<std::size_t>(max_contacts)),
      f_(static_cast<std::size_t>(padded(max_rows))),
      best_f_(f_.size()),
      r_(f_.size()),
      best_r_(f_.size()),
      change_(f_.size()),
      product_(f_.size()),
      improved_stride_(improved_rows(max_rows)),
      improved_(static_cast<std::size_t>(improved_stride_ * improved_stride_)),
      reduced_(max_contacts, padded(max_rows)) {}

void NewtonKrylov::count_products(int products) noexcept {
  products_ += products;
  work_ += products * product_work(W_.rows);
}

template <typename Real>
Vec3 NewtonKrylov::at(const std::vector<Real>& v, const ContactLaw& contact) const noexcept {
  Vec3 value = Vec3::Zero();
  for (int i = 0; i < contact.rows; ++i) value[i] = v[contact.first + i];
  return value;
}

void NewtonKrylov::change_force(const ContactLaw& contact, const Vec3& change) noexcept {
  for (int i = 0; i < contact.rows; ++i) f_[contact.first + i] += change[i];
}

/// Sets the forces to exactly zero, without rounding residue.
void NewtonKrylov::open(const ContactLaw& contact) noexcept {
  std::fill_n(f_.begin() + contact.first, contact.rows, 0.0);
}

/// True if it has rows, and the contact that these are there for is not gone.
bool NewtonKrylov::is_present(const ContactLaw& contact) const noexcept {
  return contact.kind != Kind::absent &&
         (contact.owner < 0 || !at(f_, contacts_[static_cast<std::size_t>(contact.owner)]).isZero(0.0));
}

/// All contacts enter their cones, in which the guess is except for normals that have turned since; rows that
/// are there for a contact without force go with it.
void NewtonKrylov::enter_cones() noexcept {
  for (const ContactLaw& contact : contacts()) {
    const Vec3 force = contact.within(at(f_, contact));
    for (int i = 0; i < contact.rows; ++i) f_[contact.first + i] = force[i];
  }
  for (const ContactLaw& contact : contacts()) {
    if (!is_present(contact)) open(contact);
  }
}

void NewtonKrylov::load(const ContactProblem& problem, const SymmetricRows& W) noexcept {
  W_ = W;
  count_ = static_cast<std::size_t>(problem.contacts);
  for (std::size_t k = 0; k < count_; ++k)
    contacts_[k] = ContactLaw(problem, static_cast<Index>(k), MatrixRows<const float>{W.entries, W.stride});
  std::copy_n(problem.lambda.begin(), problem.rows, f_.begin());
  enter_cones();
  std::fill(r_.begin() + W_.rows, r_.begin() + W_.columns, 0.0F);
  std::fill(change_.begin() + W_.rows, change_.begin() + W_.columns, 0.0F);
}

/// Updates r by the change of the forces. False if there is none.
bool NewtonKrylov::move_by_change() noexcept {
  if (std::all_of(change_.begin(), change_.begin() + W_.rows, [](float by) { return by == 0.0F; }))
    return false;
  multiply(W_, change_.data(), product_.data());
  count_products(1);
  for (std::size_t i = 0; i < static_cast<std::size_t>(W_.rows); ++i) r_[i] += product_[i];
  return true;
}

/// r = b + W (f - base).
void NewtonKrylov::find_motion(const ContactProblem& problem) noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(W_.rows); ++i) {
    r_[i] = static_cast<float>(problem.b[i]);
    change_[i] = static_cast<float>(f_[i] - problem.base[i]);
  }
  move_by_change();
}

void NewtonKrylov::sweep() noexcept {
  for (const ContactLaw& contact : contacts()) {
    const Vec3 f = at(f_, contact);
    const Vec3 r = at(r_, contact);
    if (contact.kind == Kind::absent) continue;
    if (contact.kind != Kind::held && f.isZero(0.0) && contact.n.dot(r) >= 0.0) continue;
    const Vec3 change = is_present(contact) ? contact.suiting_change(f, r) : Vec3(-f);
    change_force(contact, change);
    if (contact.kind != Kind::held && change == -f) open(contact);
    if (!change.isZero(0.0))
      add_rows(row(contact.first), W_.stride, contact.rows, change, r_.data(), W_.columns);
  }
  count_products(1);
}

/// Starts from the prediction if it is closer to the solution than the guess alone.
void NewtonKrylov::predict(std::span<const double> prediction) noexcept {
  for (std::size_t i = 0; i < prediction.size(); ++i) f_[i] += prediction[i];
  enter_cones();
  for (std::size_t i = 0; i < static_cast<std::size_t>(W_.rows); ++i)
    change_[i] = static_cast<float>(f_[i] - best_f_[i]);
  const double guessed = best_ * largest_force_;
  if (!move_by_change()) return;
  find_residual();
  if (residual_ * largest_force_ < guessed) return keep_best();
  take_best();
}

void NewtonKrylov::find_residual() noexcept {
  double worst = 0.0;
  double largest = std::numeric_limits<double>::min();
  for (const ContactLaw& contact : contacts()) {
    const Vec3 f = at(f_, contact);
    const Vec3 wrong = is_present(contact) ? contact.difference(f, at(r_, contact)) : f;
    worst = std::max(worst, wrong.squaredNorm());
    largest = std::max(largest, f.squaredNorm());
  }
  largest_force_ = std::sqrt(largest);
  residual_ = std::sqrt(worst) / largest_force_;
}

void NewtonKrylov::choose_modes() noexcept {
  for (ContactLaw& contact : contacts()) {
    contact.mode = Mode::open;
    if (is_present(contact)) contact.choose_mode(at(f_, contact), at(r_, contact));
  }
}

/// Removes the forces of open contacts, and moves those of slipping ones to the edge of the cone.
void NewtonKrylov::move_to_modes() noexcept {
  bool moved = false;
  for (const ContactLaw& contact : contacts()) {
    const Vec3 f = at(f_, contact);
    Vec3 to = f;
    if (contact.mode == Mode::open) to.setZero();
    if (contact.mode == Mode::slip)
      to = std::max(0.0, contact.n.dot(f)) * (contact.n + contact.mu * contact.e);
    if (to == f) continue;
    moved = true;
    change_force(contact, to - f);
    if (contact.mode == Mode::open) open(contact);
    add_rows(row(contact.first), W_.stride, contact.rows, to - f, r_.data(), W_.columns);
  }
  if (moved) count_products(1);
}

/// False, where there is nothing to change or the step is not finite.
bool NewtonKrylov::newton_step() noexcept {
  choose_modes();
  reduced_.reduce(contacts(), W_);
  if (reduced_.empty()) return false;
  move_to_modes();
  const bool stepped = reduced_.step(r_.data(), change_.data());
  count_products(reduced_.products());
  if (!stepped) return false;
  for (std::size_t i = 0; i < static_cast<std::size_t>(W_.rows); ++i) f_[i] += change_[i];
  return true;
}

void NewtonKrylov::keep_best() noexcept {
  best_ = residual_;
  std::copy_n(f_.begin(), W_.columns, best_f_.begin());
  std::copy_n(r_.begin(), W_.columns, best_r_.begin());
}

void NewtonKrylov::take_best() noexcept {
  residual_ = best_;
  std::copy_n(best_f_.begin(), W_.columns, f_.begin());
  std::copy_n(best_r_.begin(), W_.columns, r_.begin());
}

/// Least cost of another round, with or without a Newton step [multiplications].
double NewtonKrylov::round_work(bool with_step) const noexcept {
  return (with_step ? tuning.many.fewest_steps : tuning.many.sweeps) * product_work(W_.rows);
}

bool NewtonKrylov::solve(ContactProblem& problem) noexcept {
  products_ = 0;
  work_ = 0.0;
  load(problem, {problem.single_row(0), problem.single_stride, problem.rows, problem.padded_rows()});
  find_motion(problem);
  return iterate(problem, std::span(problem.prediction).first(static_cast<std::size_t>(problem.rows)));
}

bool NewtonKrylov::improve(ContactProblem& problem) noexcept {
  if (problem.rows > improved_stride_ || std::ssize(contacts_) < problem.contacts) return false;
  for (Index i = 0; i < problem.rows; ++i) {
    float* single = improved_.data() + improved_stride_ * i;
    std::copy_n(problem.row(i), problem.rows, single);
    std::fill(single + problem.rows, single + problem.padded_rows(), 0.0F);
    r_[static_cast<std::size_t>(i)] = static_cast<float>(
        problem.b[static_cast<std::size_t>(i)] + dot(problem.row(i), problem.lambda.data(), problem.rows));
  }
  products_ = 0;
  work_ = 0.0;
  load(problem, {improved_.data(), improved_stride_, problem.rows, problem.padded_rows()});
  for (std::size_t i = 0; i < static_cast<std::size_t>(W_.rows); ++i)
    change_[i] = static_cast<float>(f_[i] - problem.lambda[i]);
  move_by_change();
  return iterate(problem, {});
}

/// From f and r.
bool NewtonKrylov::iterate(ContactProblem& problem, std::span<const double> prediction) noexcept {
  rounds_ = 0;
  find_residual();
  keep_best();
  const double precision =
      problem.frictionless ? 1.0 : problem.precision;  // what sticks slides by the residual
  const double most = precision * tuning.many.tolerance;
  const double wanted = std::clamp(tuning.many.reduction * best_, tuning.many.least_residual, most);
  if (best_ > wanted) predict(prediction);
  Progress progress;
  // Rest is reached over several ticks, each starting from the last one: no step is too late for that.
  const bool moves = problem.moves || wanted == most;
  const auto is_done = [&] {
    if (best_ <= wanted || rounds_ >= tuning.many.most_rounds || work_ >= tuning.many.most_work) return true;
    const double next = work_ + round_work(progress.has_step());
    if (moves && best_ <= precision * tuning.many.late_tolerance && next >= tuning.many.late_work)
      return true;
    return best_ <= precision * tuning.many.rough_tolerance &&
           (work_ >= tuning.many.smooth_work || progress.failures >= tuning.many.rough_failures);
  };
  while (!is_done()) {
    ++rounds_;
    if (progress.has_step() && !newton_step()) {
      progress.failures = tuning.many.most_failures;
      take_best();
    }
    for (int k = 0; k < tuning.many.sweeps; ++k) sweep();
    find_residual();
    const double reached = residual_;
    if (reached < best_) keep_best();
    progress.note(reached);
    if (progress.failures == tuning.many.most_failures && reached > best_) take_best();
  }
  if (residual_ > best_) take_best();
  std::copy_n(f_.begin(), W_.rows, problem.lambda.begin());
  return best_ <= tuning.many.accepted;
}

void NewtonKrylov::derivative(const ContactProblem& problem, int changes, std::span<const double> db,
                              std::span<double> dlambda) noexcept {
  W_.entries = problem.single_row(0);  // which may be that of a copy
  choose_modes();
  reduced_.reduce(contacts(), W_);
  reduced_.derivative(changes, db, dlambda);
}

}  // namespace palpate
