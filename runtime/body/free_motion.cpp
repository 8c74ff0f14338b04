#include "runtime/body/free_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "meshes/node_vectors.h"
#include "runtime/solve/tick_tuning.h"
#include "runtime/solve/vector_loops.h"

namespace palpate {
namespace {

/// Ticks per step of the file's dynamics.
std::int64_t count_ticks(const Body& body, double tick) {
  const Model& model = body.model();
  if (model.dynamics.method == DynamicsMethod::none) return 1;
  const double step = model.dynamics.newmark.time_step;
  const double ticks = std::round(step / tick);
  if (body.contact_model() == ContactModel::warped)  // steps without a time of their own
    return static_cast<std::int64_t>(std::max(1.0, ticks));
  const bool dynamic = body.contact_model() == ContactModel::dynamic;
  const bool fits = ticks >= 1.0 && std::abs(ticks * tick - step) <= 1e-9 * step;
  if (body.live() != nullptr && !fits) {
    throw Error(fmt::format("the solver's step of {} s is not a whole number of ticks of {} s", step, tick),
                "--live-step", fmt::format("give {}", std::max(1.0, ticks) * tick));
  }
  if (!fits || (dynamic && ticks > 1.0)) {
    throw Error(fmt::format("the file's time step of {} s is not {} of {} s", step,
                            dynamic ? "that of dynamic contact, one tick" : "a whole number of ticks", tick),
                model.name,
                fmt::format("precompute with time_step = {} in [dynamics]",
                            dynamic ? tick : std::max(1.0, ticks) * tick));
  }
  return static_cast<std::int64_t>(ticks);
}

std::size_t size_if(bool wanted, std::int64_t size) {
  return wanted ? static_cast<std::size_t>(size) : 0;
}

/// Capacity for nodes with forces: 0 for a body without dynamics.
Index room(const Body& body, Index most_loads) {
  return body.model().dynamics.method != DynamicsMethod::none ? most_loads : 0;
}

LetGo make_let_go(int dimension, Index most_loads) {
  return {.force = NodalLoad(dimension, 4 * most_loads), .rate = NodalLoad(dimension, 4 * most_loads)};
}

void clear(LetGo& release) noexcept {
  release.force.clear();
  release.rate.clear();
  release.energy = 0.0;
}

void add(std::span<const double> x, double factor, std::span<double> y) noexcept {
  palpate::add(x.data(), factor, y.data(), std::ssize(y));
}

/// Strain energy [J] of a body under a load that displaces it by u [n].
double strain_energy(const NodalLoad& load, int dimension, std::span<const double> u) noexcept {
  const auto d = static_cast<std::size_t>(dimension);
  double sum = 0.0;
  for (std::size_t k = 0; k < load.forces().size(); ++k)
    sum += load.forces()[k] * u[d * static_cast<std::size_t>(load.nodes()[k / d]) + k % d];
  return 0.5 * sum;
}

void set_zero(std::span<double> x) noexcept {
  std::fill(x.begin(), x.end(), 0.0);
}

/// Adds the motion to the displacement of the stored nodes [n].
void add_motion(const Body& body, const MotionSnapshot& shown, std::span<double> u) noexcept {
  const int d = body.dimension();
  for (Index node = 0; node < body.greens().nodes(); ++node)
    set_vector(u, d, node, vector_at(u, d, node) + displacement(body, shown, node));
}

}  // namespace

double velocity_share(double kinetic_energy, double bound) noexcept {
  return kinetic_energy > bound ? std::sqrt(bound / kinetic_energy) : 1.0;
}

MotionSnapshot::MotionSnapshot(const Body& body)
    : q(body.modes() != nullptr ? static_cast<std::size_t>(body.modes()->count()) : 0),
      u(size_if(body.model().dynamics.method != DynamicsMethod::none, body.greens().order())) {}

Vec3 displacement(const Body& body, const MotionSnapshot& shown, Index stored) noexcept {
  const Vec3 u = vector_at(shown.u, body.dimension(), stored);
  return shown.q.empty() ? u : Vec3(u + body.modes()->displacement(stored, shown.q));
}

void surface_displacement(const Body& body, const SurfaceLoad& load, std::span<double> stored,
                          std::span<Vec3> u, const MotionSnapshot* motion) noexcept {
  const bool moves = motion != nullptr && motion->moves;
  const auto follow_body = [&](Index node, const auto& of_stored) {
    const SurfaceParts parts = body.surface_parts(node);
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < parts.stored.size(); ++k)
      sum += parts.weights[k] * of_stored(parts.stored[k]);
    return sum;
  };
  load.greens(body).displacement(load.nodes(), load.forces(), stored);
  if (moves) add_motion(body, *motion, stored);
  for (std::size_t node = 0; node < u.size(); ++node) {
    u[node] =
        follow_body(static_cast<Index>(node), [&](Index k) { return vector_at(stored, load.dimension, k); });
  }
  if (load.patch == nullptr) return;
  const std::span<const Index> nodes = load.patch->surface_nodes();
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    double values[3] = {};
    patch_displacement(load, static_cast<Index>(k), {values, static_cast<std::size_t>(load.dimension)});
    Vec3& at = u[nodes[k]];
    at = Vec3(values[0], values[1], values[2]);
    if (moves) at += follow_body(nodes[k], [&](Index j) { return displacement(body, *motion, j); });
  }
}

FreeMotion::FreeMotion(const Body& body, double tick, Index most_loads)
    : dimension_(body.dimension()),
      tick_(tick),
      ticks_per_step_(count_ticks(body, tick)),
      decay_(std::exp(-tick * static_cast<double>(ticks_per_step_) / tuning.body.settling)),
      dynamic_contact_(body.contact_model() != ContactModel::quasi_static),
      active_(body.contact_model() == ContactModel::live || body.contact_model() == ContactModel::warped),
      phase_(ticks_per_step_),
      pending_(make_let_go(dimension_, room(body, most_loads))),
      job_{.release = make_let_go(dimension_, room(body, most_loads)),
           .load = NodalLoad(dimension_, room(body, most_loads))} {
  const StoredDynamics& dynamics = body.model().dynamics;
  const bool swings = dynamics.method != DynamicsMethod::none;
  const bool packed = dynamics.method == DynamicsMethod::packed;
  const std::int64_t n = body.greens().order();
  if (swings) loads_.assign(tuning.body.history, NodalLoad(dimension_, most_loads));
  strains_.resize(loads_.size());
  held_.resize(size_if(swings, n));
  pending_held_.resize(held_.size());
  u_before_.resize(size_if(packed, n));
  u_.resize(u_before_.size());
  untouched_.resize(size_if(body.live() != nullptr, n));
  if (const Modes* modes = body.modes()) {
    modal_.emplace(modes->omega(), dynamics.damping, dynamics.newmark);
    for (std::vector<double>* of_modes : {&q_before_, &q_held_, &shown_, &g_, &rate_})
      of_modes->resize(static_cast<std::size_t>(modes->count()));
  }
  const std::size_t nodes = size_if(swings, std::ssize(body.surface_rest_positions()));
  stamp_.assign(nodes, -2);
  value_.assign(nodes, Vec3::Zero());
  change_.assign(nodes, Vec3::Zero());
}

void FreeMotion::begin_tick(const Body& body) noexcept {
  ++ticks_;
  if (!active_) return;
  const bool begins_step = ends_step();
  phase_ = phase_ % ticks_per_step_ + 1;
  if (modal_) {
    if (begins_step) begin_modal_step(body);
    fade_held(body.modes()->first_dropped_omega());  // from the beginning of the step, as the modes
    const double share = static_cast<double>(phase_) / static_cast<double>(ticks_per_step_);
    const std::span<const double> q = dynamic_contact_ ? modal_->predicted() : modal_->q();
    for (std::size_t i = 0; i < shown_.size(); ++i)
      shown_[i] = q_before_[i] + share * (q[i] - q_before_[i]) - fade_ * q_held_[i];
  } else if (share_ < 1.0) {
    share_ = std::min(1.0, static_cast<double>(phase_ - sample_phase_) /
                               static_cast<double>(ticks_per_step_ - sample_phase_));
  }
}

void FreeMotion::fade_held(double omega) noexcept {
  if (fade_ == 0.0) return;
  since_let_go_ += tick_;
  const double angle = omega * since_let_go_;
  fade_ = (1.0 + angle) * std::exp(-angle);
  if (!(fade_ > tuning.body.least_fade)) fade_ = 0.0;
}

void FreeMotion::begin_modal_step(const Body& body) noexcept {
  if (!pending_.force.empty()) {
    set_zero(g_);
    set_zero(rate_);
    body.modes()->add_projection(pending_.force.nodes(), pending_.force.forces(), 1.0, g_);
    body.modes()->add_projection(pending_.rate.nodes(), pending_.rate.forces(), 1.0, rate_);
    const std::span<const double> omega = body.modes()->omega();
    double kinetic = 0.0;
    for (std::size_t i = 0; i < rate_.size(); ++i)
      kinetic += 0.5 * std::pow(rate_[i] / (omega[i] * omega[i]), 2);
    const double share = velocity_share(kinetic, pending_.energy);
    for (double& rate : rate_) rate *= share;
    modal_->let_go(g_, rate_);
    for (std::size_t i = 0; i < g_.size(); ++i)
      q_held_[i] = fade_ * q_held_[i] + g_[i] / (omega[i] * omega[i]);
    for (std::size_t i = 0; i < held_.size(); ++i) held_[i] = fade_ * held_[i] + pending_held_[i];
    set_zero(pending_held_);
    clear(pending_);
    fade_ = 1.0;
    since_let_go_ = 0.0;
  }
  std::copy(modal_->q().begin(), modal_->q().end(), q_before_.begin());
  modal_->predict();
  if (!dynamic_contact_) modal_->advance();
}

Vec3 FreeMotion::displacement(const Body& body, Index stored) const noexcept {
  Vec3 u = modal_ ? body.modes()->displacement(stored, shown_)
                  : Vec3((1.0 - share_) * vector_at(u_before_, dimension_, stored) +
                         share_ * vector_at(u_, dimension_, stored));
  if (fade_ > 0.0) u += fade_ * vector_at(held_, dimension_, stored);
  if (!pending_.force.empty()) u += vector_at(pending_held_, dimension_, stored);
  return u;
}

Vec3 FreeMotion::untouched(const Body& body, Index surface_node) const noexcept {
  Vec3 u = Vec3::Zero();
  if (untouched_.empty()) return u;
  const SurfaceParts parts = body.surface_parts(surface_node);
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    u += parts.weights[k] * vector_at(untouched_, dimension_, parts.stored[k]);
  return u;
}

Vec3 FreeMotion::find_at(const Body& body, Index surface_node) noexcept {
  const auto node = static_cast<std::size_t>(surface_node);
  if (stamp_[node] == ticks_) return value_[node];
  const SurfaceParts parts = body.surface_parts(surface_node);
  Vec3 u = Vec3::Zero();
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    u += parts.weights[k] * displacement(body, parts.stored[k]);
  change_[node] = stamp_[node] == ticks_ - 1 ? Vec3(u - value_[node]) : Vec3::Zero();
  value_[node] = u;
  stamp_[node] = ticks_;
  return u;
}

void FreeMotion::snapshot(MotionSnapshot& shown) const noexcept {
  shown.moves = active_;
  if (!active_) return;
  std::copy(shown_.begin(), shown_.end(), shown.q.begin());
  for (std::size_t i = 0; i < shown.u.size(); ++i) shown.u[i] = fade_ * held_[i] + pending_held_[i];
  for (std::size_t i = 0; i < u_.size(); ++i) shown.u[i] += u_before_[i] + share_ * (u_[i] - u_before_[i]);
}

void FreeMotion::end_tick(const Body& body, const SurfaceLoad& load) noexcept {
  if (loads_.empty()) return;
  NodalLoad& now = loads_[static_cast<std::size_t>(ticks_) % tuning.body.history];
  now.clear();
  now.add(load.nodes(), load.forces(), 1.0);
  active_ = active_ || (dynamic_contact_ && !now.empty());
  if (!active_ || !ends_step()) return;
  const bool stills = !dynamic_contact_ && !now.empty();
  if (modal_) {
    if (stills) modal_->damp(decay_);
    if (!dynamic_contact_) return;
    set_zero(g_);
    body.modes()->add_projection(now.nodes(), now.forces(), 1.0, g_);
    modal_->advance(g_);
    return;
  }
  ++job_.step;
  job_.left = stills ? decay_ : 1.0;
  job_.load.clear();
  if (dynamic_contact_) job_.load.add(now.nodes(), now.forces(), 1.0);
  if (pending_.force.empty() || held_in_flight_) return;
  std::swap(job_.release, pending_);
  clear(pending_);
  ++job_.let_go;
  std::swap(held_, pending_held_);
  set_zero(pending_held_);
  fade_ = 1.0;
  held_in_flight_ = true;
}

/// Adds the rate of the forces in the last ticks of contact, except its first ones, when forces rise from
/// zero at once. If the body moved back meanwhile, a lifting tool leaves it at most the strain energy that it
/// released recently, however fast the tool was: a tool cannot pull.
void FreeMotion::add_rate(const NodalLoad& last, bool grabs) noexcept {
  const auto before = [&](std::size_t ticks) -> const NodalLoad& {
    return loads_[(static_cast<std::size_t>(ticks_) + tuning.body.history - ticks) % tuning.body.history];
  };
  std::size_t count = 1;
  while (count < tuning.body.history && !before(count + 1).empty()) ++count;
  if (count < tuning.body.least_history) return;
  const auto strain = [&](std::size_t ticks) {
    return strains_[(static_cast<std::size_t>(ticks_) + tuning.body.history - ticks) % tuning.body.history];
  };
  pending_.energy +=
      !grabs && strain(1) < strain(count) ? returned_ : std::numeric_limits<double>::infinity();
  const double per_second = 1.0 / (static_cast<double>(count - 1) * tick_);
  if (pending_.rate.add(last.nodes(), last.forces(), per_second))
    pending_.rate.add(before(count).nodes(), before(count).forces(), -per_second);
}

void FreeMotion::note_strain(std::span<const double> displacement) noexcept {
  if (loads_.empty() || dynamic_contact_) return;
  const std::size_t last = static_cast<std::size_t>(ticks_ - 1) % tuning.body.history;
  const double before =
      strains_[static_cast<std::size_t>(ticks_ - 2 + std::ssize(loads_)) % tuning.body.history];
  strains_[last] = strain_energy(loads_[last], dimension_, displacement);
  // Motion under a contact is damped, including that of the return.
  returned_ = std::max(0.0, std::exp(-tick_ / tuning.body.settling) * returned_ + before - strains_[last]);
}

void FreeMotion::let_go(const Body& body, const SurfaceLoad& load, std::span<double> displacement,
                        bool grabs) noexcept {
  if (loads_.empty() || (dynamic_contact_ && !modal_)) return;
  const NodalLoad& last = loads_[static_cast<std::size_t>(ticks_ - 1) % tuning.body.history];
  if (last.empty()) return;
  if (dynamic_contact_) {
    set_zero(g_);
    body.modes()->add_projection(last.nodes(), last.forces(), 1.0, g_);
    body.modes()->add_projection(load.nodes(), load.forces(), -1.0, g_);
    const std::span<const double> k_bar = modal_->effective_stiffness();
    for (std::size_t i = 0; i < g_.size(); ++i) q_held_[i] = fade_ * q_held_[i] + g_[i] / k_bar[i];
    for (double& u : held_) u *= fade_;
    add(displacement, 1.0, held_);
    fade_ = 1.0;
    since_let_go_ = 0.0;
  } else {
    // No capacity for another release: its energy is lost.
    if (!pending_.force.add(last.nodes(), last.forces(), 1.0)) return;
    pending_.force.add(load.nodes(), load.forces(), -1.0);
    add_rate(last, grabs);
    add(displacement, 1.0, pending_held_);
  }
  for (NodalLoad& before : loads_) {  // removed forces must not count in the next release
    before.clear();
    before.add(load.nodes(), load.forces(), 1.0);
  }
  returned_ = 0.0;
  set_zero(strains_);
  active_ = true;
  std::fill(stamp_.begin(), stamp_.end(), -2);  // the values returned by `at` are invalid
  if (load.count == 0) {
    set_zero(displacement);
    return;
  }
  body.greens().displacement(load.nodes(), load.forces(), displacement);
  add(displacement, -1.0, dynamic_contact_ ? held_ : pending_held_);
  std::fill(strains_.begin(), strains_.end(), strain_energy(loads_.front(), dimension_, displacement));
}

bool FreeMotion::receive(const MotionSample& sample) noexcept {
  if (sample.step <= sample_step_ || sample.step > job_.step) return false;
  const bool has_held = held_in_flight_ && sample.let_go == job_.let_go;
  for (std::size_t i = 0; i < u_.size(); ++i) {
    u_before_[i] += share_ * (u_[i] - u_before_[i]);
    if (has_held) u_before_[i] += held_[i];
  }
  std::copy(sample.u.begin(), sample.u.end(), u_.begin());
  std::copy(sample.untouched.begin(), sample.untouched.end(), untouched_.begin());
  if (has_held) {
    fade_ = 0.0;
    held_in_flight_ = false;
  }
  sample_step_ = sample.step;
  is_near_limit_ = sample.is_near_limit;
  sample_phase_ = phase_ % ticks_per_step_;
  share_ = 0.0;
  return true;
}

void FreeMotion::take_over(const Body& body, std::span<const double> u, double sign) noexcept {
  add(u, sign, u_before_);
  for (std::size_t node = 0; node < value_.size(); ++node) {
    const SurfaceParts parts = body.surface_parts(static_cast<Index>(node));
    for (std::size_t k = 0; k < parts.stored.size(); ++k)
      value_[node] += sign * parts.weights[k] * vector_at(u, dimension_, parts.stored[k]);
  }
}

}  // namespace palpate
