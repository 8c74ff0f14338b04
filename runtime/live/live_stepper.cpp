#include "runtime/live/live_stepper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"

namespace palpate {
namespace {

constexpr int most_depth = 8;             // nested halvings
constexpr int rounds_at_rest = 300;       // iterations of the power method
constexpr int rounds_between = 4;         // iterations per check
constexpr std::int64_t look_each = 4;     // steps between checks
constexpr double rounding_share = 1e-12;  // of positions, by which rounding moves them in a step

double limit_at(const LiveBody& body, const StepperOptions& options, LargestFrequency& frequency) {
  if (is_implicit(options.scheme.integrator)) return std::numeric_limits<double>::infinity();
  return longest_step_at(body, frequency.estimate(body.start(), {}, rounds_at_rest));
}

}  // namespace

LiveStepper::LiveStepper(const LiveBody& body, const StepperOptions& options)
    : body_(body),
      options_(options),
      implicit_(body, options.scheme, options.walls),
      frequency_(body),
      limit_(limit_at(body, options, frequency_)),
      none_(Eigen::VectorXd::Zero(body.dofs())) {
  if (!(options.time_step > 0.0) || !std::isfinite(options.time_step))
    throw Error(fmt::format("the time step is {} s", options.time_step), "live body",
                "give a positive time, e.g. 0.001");
  if (options.time_step <= limit_) return;
  throw Error(fmt::format("steps of {:.4g} s by {} are unstable: the longest stable one is {:.4g} s",
                          options.time_step, name_of(options.scheme.integrator), limit_),
              "live body", "take shorter steps, a softer or coarser body, or an implicit integrator");
}

void LiveCounts::add(const LiveReport& report) noexcept {
  ++steps;
  if (report.parts > 1) ++halved;
  if (!report.whole) ++stopped;
  if (report.inverted > 0) ++inverted;
  most_inverted = std::max(most_inverted, report.inverted);
  plastic_work += report.flow.work;
}

LiveReport LiveStepper::step(LiveState& state, const Eigen::VectorXd& push) {
  LiveReport report;
  report.parts = 0;
  const double end = state.time + options_.time_step;
  if (!is_implicit(options_.scheme.integrator) && counts_.steps % look_each == 0)
    limit_ = longest_step_at(body_, frequency_.estimate(state.x, state.plastic, rounds_between));
  // A body that has become stiffer takes shorter steps.
  const double parts = std::min(std::ceil(options_.time_step / limit_), 64.0);
  const double h = options_.time_step / std::max(parts, 1.0);
  for (int k = 0; k < std::max(static_cast<int>(parts), 1) && report.whole; ++k)
    report.whole = advance(state, h, push.size() > 0 ? push : none_, 0, report);
  state.time = end;
  if (!state.plastic.empty()) {
    report.flow = flow(body_, state.x, options_.time_step, state.plastic);
  }
  counts_.add(report);
  return report;
}

/// Performs one step of h, or two halves of it. False if the shortest ones diverge too: the body is then
/// stopped.
bool LiveStepper::advance(LiveState& state, double h, const Eigen::VectorXd& push, int depth,
                          LiveReport& report) {
  const LiveState before = state;
  if (advance_once(state, h, push, report)) {
    ++report.parts;
    return true;
  }
  state = before;
  if (depth < most_depth) {
    return advance(state, 0.5 * h, push, depth + 1, report) &&
           advance(state, 0.5 * h, push, depth + 1, report);
  }
  state.v.setZero();
  ++report.parts;
  return false;
}

bool LiveStepper::advance_once(LiveState& state, double h, const Eigen::VectorXd& push, LiveReport& report) {
  bool whole = true;
  if (is_implicit(options_.scheme.integrator)) {
    const ImplicitReport implicit = implicit_.advance(state, h, push);
    report.contacts = implicit_.contacts().closed();
    report.inverted = std::max(report.inverted, implicit.inverted);
    whole = implicit.converged;
  } else {
    whole = advance_explicitly(state, h, push, report);
  }
  return whole && state.x.allFinite() && state.v.allFinite();
}

/// By semi-implicit Euler.
bool LiveStepper::advance_explicitly(LiveState& state, double h, const Eigen::VectorXd& push,
                                     LiveReport& report) {
  const Eigen::VectorXd from = state.x;
  // Forces are evaluated with the walls' constraints applied: inside walls, stiffness and damping would throw
  // back nodes that merely come to rest there, and friction would have no effect.
  Eigen::VectorXd x = from, v = state.v;
  if (!options_.walls.empty()) {
    Eigen::VectorXd any = v, end = from + h * v;
    meet_walls(from, h, x, any);
    meet_walls(from, h, end, v);
  }
  const ForceSums sums = internal_forces(body_, x, state.plastic, forces_);
  report.inverted = std::max(report.inverted, sums.inverted);
  forces_ += body_.load() + push;
  add_damping_forces(body_, x, v, state.plastic, forces_);
  const auto kinetic = [&] { return 0.5 * state.v.dot(body_.mass().cwiseProduct(state.v)); };
  const double kinetic_before = kinetic();
  for (const Index dof : body_.dof_of_free()) state.v[dof] += h * forces_[dof] / body_.mass()[dof];
  state.x += h * state.v;
  // A stable step does not create this much energy, but for that of its rounding: in each step positions are
  // wrong by a share of themselves. The energy of a body at rest may be negative by it.
  const double rounding = 0.5 * std::pow(rounding_share / h, 2) * x.dot(body_.mass().cwiseProduct(x));
  const double work =
      (body_.load() + push).cwiseAbs().dot((state.x - from).cwiseAbs() + h * state.v.cwiseAbs());
  const double most = 4.0 * (kinetic_before + std::max(sums.energy, 0.0) + work);
  if (!(kinetic() <= most + rounding)) return false;
  report.contacts = meet_walls(from, h, state.x, state.v);
  return true;
}

/// Applies the walls to all nodes in a step from `from`; returns the number of stopped nodes.
Index LiveStepper::meet_walls(const Eigen::VectorXd& from, double h, Eigen::VectorXd& x,
                              Eigen::VectorXd& v) const {
  if (options_.walls.empty()) return 0;
  const int d = body_.dimension();
  Index stopped = 0;
  for (Index node = 0; node < std::ssize(body_.mesh().nodes); ++node) {
    if (body_.free_of_dof()[static_cast<std::size_t>(d * node)] < 0) continue;
    Vec3 at = node_part(x, d, node), velocity = node_part(v, d, node);
    if (!stop_at_walls(options_.walls, node_part(from, d, node), h, at, velocity)) continue;
    ++stopped;
    x.segment(Eigen::Index{d} * node, d) = at.head(d);
    v.segment(Eigen::Index{d} * node, d) = velocity.head(d);
  }
  return stopped;
}

void add_damping_forces(const LiveBody& body, const Eigen::VectorXd& x, const Eigen::VectorXd& v,
                        std::span<const Mat3> plastic, Eigen::VectorXd& f) {
  const Rayleigh& damping = body.options().damping;
  if (damping.mass > 0.0) f -= damping.mass * body.mass().cwiseProduct(v);
  if (damping.stiffness == 0.0) return;
  LiveMatrix K;
  assemble_tangent(body, x, plastic, TangentKind::positive, K);
  Eigen::VectorXd free(body.free_dofs());
  for (Index k = 0; k < body.free_dofs(); ++k) free[k] = v[body.dof_of_free()[k]];
  const Eigen::VectorXd resisting = K.selfadjointView<Eigen::Lower>() * free;
  for (Index k = 0; k < body.free_dofs(); ++k) f[body.dof_of_free()[k]] -= damping.stiffness * resisting[k];
}

}  // namespace palpate
