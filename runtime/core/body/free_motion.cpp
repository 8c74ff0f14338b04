#include "runtime/core/body/free_motion.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/number_text.h"
#include "base/vectors.h"
#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::int64_t most_steps_late = 8;  // over which a late sample's motion is spread

/// Ticks per step of the file's dynamics.
std::int64_t count_ticks(const ElasticBody& body, double tick) {
  if (!body.swings()) return 1;
  const double step = body.swing().newmark.time_step;
  const double ticks = std::round(step / tick);
  if (body.contact_model() == ContactModel::two_level)  // steps without a time of their own
    return static_cast<std::int64_t>(std::max(1.0, ticks));
  const bool dynamic = body.contact_model() == ContactModel::dynamic;
  const bool fits = ticks >= 1.0 && std::abs(ticks * tick - step) <= 1e-9 * step;
  const std::string whole = number_text(std::max(1.0, ticks) * tick);
  if (body.contact_model() == ContactModel::live && !fits) {
    throw Error("the solver's step of " + number_text(step) + " s is not a whole number of ticks of " +
                    number_text(tick) + " s",
                "--live-step", "give " + whole);
  }
  if (!fits || (dynamic && ticks > 1.0)) {
    throw Error("the file's time step of " + number_text(step) + " s is not " +
                    (dynamic ? "that of dynamic contact, one tick" : "a whole number of ticks") + " of " +
                    number_text(tick) + " s",
                body.name(),
                "precompute with time_step = " + (dynamic ? number_text(tick) : whole) + " in [dynamics]");
  }
  return static_cast<std::int64_t>(ticks);
}

std::size_t size_if(bool wanted, std::int64_t size) {
  return wanted ? static_cast<std::size_t>(size) : 0;
}

/// Capacity for nodes with forces: 0 for a body without dynamics.
Index room(const ElasticBody& body, Index most_loads) {
  return body.swings() ? most_loads : 0;
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
void add_motion(const ElasticBody& body, const MotionSnapshot& shown, std::span<double> u) noexcept {
  const int d = body.dimension();
  for (Index node = 0; node < body.greens().nodes(); ++node)
    set_vector(u, d, node, vector_at(u, d, node) + displacement(body, shown, node));
}

}  // namespace

double velocity_share(double kinetic_energy, double bound) noexcept {
  return kinetic_energy > bound ? std::sqrt(bound / kinetic_energy) : 1.0;
}

MotionSnapshot::MotionSnapshot(const ElasticBody& body)
    : q(body.modes() != nullptr ? static_cast<std::size_t>(body.modes()->count()) : 0),
      u(size_if(body.swings(), body.motion_size())) {}

Vec3 displacement(const ElasticBody& body, const MotionSnapshot& shown, Index stored) noexcept {
  const Vec3 u = vector_at(shown.u, body.dimension(), stored);
  return shown.q.empty() ? u : Vec3(u + body.modes()->displacement(stored, shown.q));
}

void surface_displacement(const ElasticBody& body, const SurfaceLoad& load, std::span<double> stored,
                          std::span<Vec3> u, const MotionSnapshot* motion,
                          std::optional<std::span<const Index>> only) noexcept {
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
  const auto find = [&](Index node) {
    u[static_cast<std::size_t>(node)] =
        follow_body(node, [&](Index k) { return vector_at(stored, load.dimension, k); }) +
        load.local_displacement(node);
  };
  if (only) {
    std::for_each(only->begin(), only->end(), find);
  } else {
    for (Index node = 0; node < std::ssize(u); ++node) find(node);
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

FreeMotion::FreeMotion(const ElasticBody& body, double tick, Index most_loads)
    : dimension_(body.dimension()),
      tick_(tick),
      ticks_per_step_(count_ticks(body, tick)),
      decay_(std::exp(-tick * static_cast<double>(ticks_per_step_) / tuning.body.settling)),
      dynamic_contact_(body.contact_model() != ContactModel::quasi_static),
      is_on_two_levels_(body.contact_model() == ContactModel::two_level),
      active_(body.contact_model() == ContactModel::live || body.contact_model() == ContactModel::two_level),
      phase_(ticks_per_step_),
      history_{.loads{}, .strains{}, .pending = make_let_go(dimension_, room(body, most_loads))},
      sampled_{.job{.release = make_let_go(dimension_, room(body, most_loads)),
                    .load = NodalLoad(dimension_, room(body, most_loads)),
                    .without = std::vector<double>(
                        size_if(is_on_two_levels_, std::int64_t{dimension_} * most_loads))},
               .before{},
               .u{},
               .untouched{}} {
  const Swing& swing = body.swing();
  const bool packed = swing.method == DynamicsMethod::packed;
  const std::int64_t n = body.motion_size();
  if (body.swings()) history_.loads.assign(tuning.body.history, NodalLoad(dimension_, most_loads));
  history_.strains.resize(history_.loads.size());
  held_.u.resize(size_if(body.swings(), n));
  held_.pending.resize(held_.u.size());
  sampled_.before.resize(size_if(packed, n));
  sampled_.u.resize(sampled_.before.size());
  sampled_.untouched.resize(size_if(body.contact_model() == ContactModel::live, n));
  if (const Modes* modes = body.modes()) {
    modal_.newmark.emplace(modes->omega(), swing.damping, swing.newmark);
    for (std::vector<double>* of_modes :
         {&modal_.q_before, &modal_.q_held, &modal_.shown, &modal_.g, &modal_.rate})
      of_modes->resize(static_cast<std::size_t>(modes->count()));
  }
  nodes_.resize(size_if(body.swings(), std::ssize(body.surface_rest_positions())));
}

void FreeMotion::begin_tick(const ElasticBody& body) noexcept {
  ++ticks_;
  if (!active_) return;
  const bool begins_step = ends_step();
  phase_ = phase_ % ticks_per_step_ + 1;
  sampled_.last_share = sampled_.share;
  if (modal_.newmark) {
    if (begins_step) begin_modal_step(body);
    fade_held(body.modes()->first_dropped_omega());  // from the beginning of the step, as the modes
    const double share = static_cast<double>(phase_) / static_cast<double>(ticks_per_step_);
    const std::span<const double> q = dynamic_contact_ ? modal_.newmark->predicted() : modal_.newmark->q();
    for (std::size_t i = 0; i < modal_.shown.size(); ++i)
      modal_.shown[i] =
          modal_.q_before[i] + share * (q[i] - modal_.q_before[i]) - held_.fade * modal_.q_held[i];
  } else if (sampled_.share < 1.0) {
    if (sampled_.most_change < 0.0) {
      sampled_.most_change = 0.0;
      for (std::size_t i = 0; i < sampled_.u.size(); ++i)
        sampled_.most_change = std::max(sampled_.most_change, std::abs(sampled_.u[i] - sampled_.before[i]));
    }
    sampled_.share =
        std::min(1.0, static_cast<double>(ticks_ - sampled_.begun) / static_cast<double>(sampled_.length));
  }
}

double FreeMotion::most_change() const noexcept {
  if (!active_) return 0.0;
  if (modal_.newmark || held_.fade > 0.0 || !history_.pending.force.empty())
    return std::numeric_limits<double>::infinity();
  return std::sqrt(static_cast<double>(dimension_)) * sampled_.most_change *
         (sampled_.share - sampled_.last_share);
}

void FreeMotion::fade_held(double omega) noexcept {
  if (held_.fade == 0.0) return;
  held_.since_let_go += tick_;
  const double angle = omega * held_.since_let_go;
  held_.fade = (1.0 + angle) * std::exp(-angle);
  if (!(held_.fade > tuning.body.least_fade)) held_.fade = 0.0;
}

void FreeMotion::begin_modal_step(const ElasticBody& body) noexcept {
  if (!history_.pending.force.empty()) {
    set_zero(modal_.g);
    set_zero(modal_.rate);
    body.modes()->add_projection(history_.pending.force.nodes(), history_.pending.force.forces(), 1.0,
                                 modal_.g);
    body.modes()->add_projection(history_.pending.rate.nodes(), history_.pending.rate.forces(), 1.0,
                                 modal_.rate);
    const std::span<const double> omega = body.modes()->omega();
    double kinetic = 0.0;
    for (std::size_t i = 0; i < modal_.rate.size(); ++i)
      kinetic += 0.5 * std::pow(modal_.rate[i] / (omega[i] * omega[i]), 2);
    const double share = velocity_share(kinetic, history_.pending.energy);
    for (double& rate : modal_.rate) rate *= share;
    modal_.newmark->let_go(modal_.g, modal_.rate);
    for (std::size_t i = 0; i < modal_.g.size(); ++i)
      modal_.q_held[i] = held_.fade * modal_.q_held[i] + modal_.g[i] / (omega[i] * omega[i]);
    for (std::size_t i = 0; i < held_.u.size(); ++i) held_.u[i] = held_.fade * held_.u[i] + held_.pending[i];
    set_zero(held_.pending);
    clear(history_.pending);
    held_.fade = 1.0;
    held_.since_let_go = 0.0;
  }
  std::copy(modal_.newmark->q().begin(), modal_.newmark->q().end(), modal_.q_before.begin());
  modal_.newmark->predict();
  if (!dynamic_contact_) modal_.newmark->advance();
}

Vec3 FreeMotion::displacement(const ElasticBody& body, Index stored) const noexcept {
  Vec3 u = modal_.newmark ? body.modes()->displacement(stored, modal_.shown)
                          : Vec3((1.0 - sampled_.share) * vector_at(sampled_.before, dimension_, stored) +
                                 sampled_.share * vector_at(sampled_.u, dimension_, stored));
  if (held_.fade > 0.0) u += held_.fade * vector_at(held_.u, dimension_, stored);
  if (!history_.pending.force.empty()) u += vector_at(held_.pending, dimension_, stored);
  return u;
}

Vec3 FreeMotion::untouched(const ElasticBody& body, Index surface_node) const noexcept {
  Vec3 u = Vec3::Zero();
  if (sampled_.untouched.empty()) return u;
  const SurfaceParts parts = body.surface_parts(surface_node);
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    u += parts.weights[k] * vector_at(sampled_.untouched, dimension_, parts.stored[k]);
  return u;
}

Vec3 FreeMotion::find_at(const ElasticBody& body, Index surface_node) noexcept {
  const auto node = static_cast<std::size_t>(surface_node);
  if (nodes_[node].stamp == ticks_) return nodes_[node].value;
  const SurfaceParts parts = body.surface_parts(surface_node);
  Vec3 u = Vec3::Zero();
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    u += parts.weights[k] * displacement(body, parts.stored[k]);
  nodes_[node].change = nodes_[node].stamp == ticks_ - 1 ? Vec3(u - nodes_[node].value) : Vec3::Zero();
  nodes_[node].value = u;
  nodes_[node].stamp = ticks_;
  return u;
}

void FreeMotion::snapshot(MotionSnapshot& shown) const noexcept {
  shown.moves = active_;
  if (!active_) return;
  std::copy(modal_.shown.begin(), modal_.shown.end(), shown.q.begin());
  for (std::size_t i = 0; i < shown.u.size(); ++i) shown.u[i] = held_.fade * held_.u[i] + held_.pending[i];
  for (std::size_t i = 0; i < sampled_.u.size(); ++i)
    shown.u[i] += sampled_.before[i] + sampled_.share * (sampled_.u[i] - sampled_.before[i]);
}

void FreeMotion::end_tick(const ElasticBody& body, const SurfaceLoad& load) noexcept {
  if (history_.loads.empty()) return;
  NodalLoad& now = history_.loads[static_cast<std::size_t>(ticks_) % tuning.body.history];
  now.clear();
  now.add(load.nodes(), load.forces(), 1.0);
  active_ = active_ || (dynamic_contact_ && !now.empty());
  if (!active_ || !ends_step()) return;
  const bool stills = !dynamic_contact_ && !now.empty();
  if (modal_.newmark) {
    if (stills) modal_.newmark->damp(decay_);
    if (!dynamic_contact_) return;
    set_zero(modal_.g);
    body.modes()->add_projection(now.nodes(), now.forces(), 1.0, modal_.g);
    modal_.newmark->advance(modal_.g);
    return;
  }
  ++sampled_.job.step;
  sampled_.job.seen = sampled_.step;
  sampled_.job.left = stills ? decay_ : 1.0;
  sampled_.job.load.clear();
  if (dynamic_contact_) sampled_.job.load.add(now.nodes(), now.forces(), 1.0);
  for (std::size_t k = 0; is_on_two_levels_ && k < sampled_.job.load.nodes().size(); ++k)
    set_vector(sampled_.job.without, dimension_, static_cast<Index>(k),
               displacement(body, sampled_.job.load.nodes()[k]));
  if (history_.pending.force.empty() || sampled_.held_in_flight) return;
  std::swap(sampled_.job.release, history_.pending);
  clear(history_.pending);
  ++sampled_.job.let_go;
  std::swap(held_.u, held_.pending);
  set_zero(held_.pending);
  held_.fade = 1.0;
  sampled_.held_in_flight = true;
}

/// Adds the rate of the forces in the last ticks of contact, except its first ones, when forces rise from
/// zero at once. If the body moved back meanwhile, a lifting tool leaves it at most the strain energy that it
/// released recently, however fast the tool was: a tool cannot pull.
void FreeMotion::add_rate(const NodalLoad& last, bool grabs) noexcept {
  const auto before = [&](std::size_t ticks) -> const NodalLoad& {
    return history_
        .loads[(static_cast<std::size_t>(ticks_) + tuning.body.history - ticks) % tuning.body.history];
  };
  std::size_t count = 1;
  while (count < tuning.body.history && !before(count + 1).empty()) ++count;
  if (count < tuning.body.least_history) return;
  const auto strain = [&](std::size_t ticks) {
    return history_
        .strains[(static_cast<std::size_t>(ticks_) + tuning.body.history - ticks) % tuning.body.history];
  };
  history_.pending.energy +=
      !grabs && strain(1) < strain(count) ? history_.returned : std::numeric_limits<double>::infinity();
  const double per_second = 1.0 / (static_cast<double>(count - 1) * tick_);
  if (history_.pending.rate.add(last.nodes(), last.forces(), per_second))
    history_.pending.rate.add(before(count).nodes(), before(count).forces(), -per_second);
}

void FreeMotion::note_strain(std::span<const double> displacement) noexcept {
  if (history_.loads.empty() || dynamic_contact_) return;
  const std::size_t last = static_cast<std::size_t>(ticks_ - 1) % tuning.body.history;
  const double before =
      history_
          .strains[static_cast<std::size_t>(ticks_ - 2 + std::ssize(history_.loads)) % tuning.body.history];
  history_.strains[last] = strain_energy(history_.loads[last], dimension_, displacement);
  // Motion under a contact is damped, including that of the return.
  history_.returned = std::max(
      0.0, std::exp(-tick_ / tuning.body.settling) * history_.returned + before - history_.strains[last]);
}

void FreeMotion::let_go(const ElasticBody& body, const SurfaceLoad& load, std::span<double> displacement,
                        bool grabs) noexcept {
  if (history_.loads.empty() || (dynamic_contact_ && !modal_.newmark)) return;
  const NodalLoad& last = history_.loads[static_cast<std::size_t>(ticks_ - 1) % tuning.body.history];
  if (last.empty()) return;
  if (dynamic_contact_) {
    set_zero(modal_.g);
    body.modes()->add_projection(last.nodes(), last.forces(), 1.0, modal_.g);
    body.modes()->add_projection(load.nodes(), load.forces(), -1.0, modal_.g);
    const std::span<const double> k_bar = modal_.newmark->effective_stiffness();
    for (std::size_t i = 0; i < modal_.g.size(); ++i)
      modal_.q_held[i] = held_.fade * modal_.q_held[i] + modal_.g[i] / k_bar[i];
    for (double& u : held_.u) u *= held_.fade;
    add(displacement, 1.0, held_.u);
    held_.fade = 1.0;
    held_.since_let_go = 0.0;
  } else {
    // No capacity for another release: its energy is lost.
    if (!history_.pending.force.add(last.nodes(), last.forces(), 1.0)) return;
    history_.pending.force.add(load.nodes(), load.forces(), -1.0);
    add_rate(last, grabs);
    add(displacement, 1.0, held_.pending);
  }
  for (NodalLoad& before : history_.loads) {  // removed forces must not count in the next release
    before.clear();
    before.add(load.nodes(), load.forces(), 1.0);
  }
  history_.returned = 0.0;
  set_zero(history_.strains);
  active_ = true;
  for (SurfaceNode& node : nodes_) node.stamp = -2;  // the values returned by `at` are invalid
  if (load.count == 0) {
    set_zero(displacement);
    return;
  }
  body.greens().displacement(load.nodes(), load.forces(), displacement);
  add(displacement, -1.0, dynamic_contact_ ? held_.u : held_.pending);
  std::fill(history_.strains.begin(), history_.strains.end(),
            strain_energy(history_.loads.front(), dimension_, displacement));
}

bool FreeMotion::receive(const MotionSample& sample) noexcept {
  if (sample.step <= sampled_.step || sample.step > sampled_.job.step) return false;
  const bool has_held = sampled_.held_in_flight && sample.let_go == sampled_.job.let_go;
  for (std::size_t i = 0; i < sampled_.u.size(); ++i) {
    sampled_.before[i] += sampled_.share * (sampled_.u[i] - sampled_.before[i]);
    if (has_held) sampled_.before[i] += held_.u[i];
  }
  std::copy(sample.u.begin(), sample.u.end(), sampled_.u.begin());
  std::copy(sample.untouched.begin(), sample.untouched.end(), sampled_.untouched.begin());
  if (has_held) {
    held_.fade = 0.0;
    sampled_.held_in_flight = false;
  }
  sampled_.step = sample.step;
  sampled_.force_error = sample.force_error;
  sampled_.small_strain = sample.small_strain;
  if (!is_on_two_levels_)
    sampled_.job.seen = sample.step;  // on two levels its forces are of the sample before
  // A step that has a time of its own ends with it. Others, however late, move the surface no faster than
  // they come.
  sampled_.length = is_on_two_levels_ ? std::clamp(ticks_ - sampled_.begun, ticks_per_step_,
                                                   most_steps_late * ticks_per_step_)
                                      : ticks_per_step_ - phase_ % ticks_per_step_;
  sampled_.begun = ticks_;
  sampled_.share = 0.0;
  sampled_.most_change = -1.0;
  return true;
}

void FreeMotion::take_over(const ElasticBody& body, std::span<const double> u, double sign) noexcept {
  add(u, sign, std::span(sampled_.before).first(u.size()));
  sampled_.most_change = -1.0;
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    const SurfaceParts parts = body.surface_parts(static_cast<Index>(node));
    for (std::size_t k = 0; k < parts.stored.size(); ++k)
      nodes_[node].value += sign * parts.weights[k] * vector_at(u, dimension_, parts.stored[k]);
  }
}

}  // namespace palpate
