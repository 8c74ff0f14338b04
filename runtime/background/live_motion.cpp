#include "runtime/background/live_motion.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <numeric>
#include <span>
#include <utility>

#include "base/vectors.h"
#include "runtime/live/live_model.h"
#include "statics/polar.h"

namespace palpate {

double measured_step(const Body& body) {
  const LiveBody& live = body.live()->body;
  LiveStepper stepper(live, body.live()->stepper);
  LiveState state = state_at_rest(body);
  const int d = live.dimension();
  const Index node = body.greens().nodes() / 2;
  std::array<double, 9> block{};
  body.greens().gather(node, {&node, 1}, std::span(block).first(static_cast<std::size_t>(d * d)));
  Eigen::VectorXd push = Eigen::VectorXd::Zero(live.dofs());
  push[Eigen::Index{d} * body.mesh_node(node)] = 0.01 * body.mean_surface_edge() / block[0];
  stepper.step(state, push);  // also computes the elimination order
  const auto begin = std::chrono::steady_clock::now();
  stepper.step(state, push);  // with the forces of the tick
  stepper.step(state, push);  // predicts the next step
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

LiveMotion::LiveMotion(const Body& body, bool renews_compliance)
    : body_(body),
      live_(body.live()->body),
      stepper_(live_, body.live()->stepper),
      compliance_(body, renews_compliance),
      rest_(state_at_rest(body)),
      state_(rest_),
      predicted_(rest_),
      push_(Eigen::VectorXd::Zero(live_.dofs())),
      by_load_(static_cast<std::size_t>(body.greens().order())),
      by_last_load_(by_load_.size()),
      found_(state_.x),
      untouched_(state_.x),
      far_(static_cast<std::size_t>(live_.dofs() / live_.dimension())) {
  predict();
}

/// Predicts the next step, under the forces of the last one.
void LiveMotion::predict() {
  LiveState next = state_;
  predicted_report_ = stepper_.step(next, push_);
  predicted_ = std::move(next);
}

void LiveMotion::rest() noexcept {
  state_ = predicted_ = rest_;
  push_.setZero();
  compliance_.rest();
  std::fill(by_last_load_.begin(), by_last_load_.end(), 0.0);
  try {
    predict();
  } catch (const std::exception&) {  // out of memory: the body stands still for a step
  }
  found_ = untouched_ = state_.x;
  const std::lock_guard lock(mutex_);
  telling_ = {};
}

LiveTelling LiveMotion::telling() const {
  const std::lock_guard lock(mutex_);
  return telling_;
}

void LiveMotion::put_on(const NodalLoad& load, Eigen::VectorXd& push) const noexcept {
  const int d = live_.dimension();
  push.setZero();
  for (std::size_t k = 0; k < load.nodes().size(); ++k) {
    const Vec3 f = vector_at(load.forces(), d, static_cast<Index>(k));
    push.segment(Eigen::Index{d} * body_.mesh_node(load.nodes()[k]), d) += f.head(d);
  }
}

void LiveMotion::do_job(const MotionJob& job, bool, std::span<double> u) noexcept {
  try {
    step(job);
  } catch (const std::exception&) {  // out of memory: the body stands still for a step
  }
  const int d = live_.dimension();
  for (Index stored = 0; stored < body_.greens().nodes(); ++stored) {
    const Vec3 moved = node_part(predicted_.x, d, body_.mesh_node(stored)) - body_.rest_position(stored);
    set_vector(u, d, stored, moved - vector_at(by_last_load_, d, stored));
  }
}

void LiveMotion::step(const MotionJob& job) {
  Eigen::VectorXd push(live_.dofs());
  put_on(job.load, push);
  displace(job.load, by_load_);
  const bool is_predicted = push == push_;
  LiveState next = is_predicted ? predicted_ : state_;
  const LiveReport report = is_predicted ? predicted_report_ : stepper_.step(next, push);
  state_ = std::move(next);
  const double error = compare(job, report);
  push_ = std::move(push);
  predict();
  follow_untouched();
  if (compliance_.follow(state_, error)) displace(job.load, by_load_);
  std::swap(by_load_, by_last_load_);
}

/// Computes the positions of the nodes without the tool: as they were before it touched, held ones at their
/// prescribed position. For a body without supports, its motion since then is included as the rigid motion
/// (Horn 1987) closest to that of the half of its nodes that is farthest from the tool.
void LiveMotion::follow_untouched() noexcept {
  if (push_.isZero(0.0)) {
    found_ = state_.x;
    untouched_ = predicted_.x;
    return;
  }
  untouched_ = found_;
  if (live_.free_dofs() < live_.dofs()) return;
  const int d = live_.dimension();
  Vec3 pressed = Vec3::Zero();
  double sum = 0.0;
  for (Index node = 0; node < std::ssize(far_); ++node) {
    const double force = node_part(push_, d, node).norm();
    pressed += force * node_part(found_, d, node);
    sum += force;
  }
  pressed /= sum;
  const auto away = [&](Index node) { return (node_part(found_, d, node) - pressed).squaredNorm(); };
  std::iota(far_.begin(), far_.end(), 0);
  const auto half = far_.begin() + std::ssize(far_) / 2;
  std::nth_element(far_.begin(), half, far_.end(), [&](Index a, Index b) { return away(a) < away(b); });
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();
  const std::span<const Index> far(half, far_.end());
  for (const Index node : far) {
    from += node_part(found_, d, node) / static_cast<double>(far.size());
    to += node_part(predicted_.x, d, node) / static_cast<double>(far.size());
  }
  Mat3 turn = Mat3::Zero();
  for (const Index node : far)
    turn += (node_part(predicted_.x, d, node) - to) * (node_part(found_, d, node) - from).transpose();
  const Mat3 R = d == 2 ? nearest_rotation_in_plane(turn) : nearest_rotation(turn);
  for (Index node = 0; node < std::ssize(far_); ++node)
    untouched_.segment(Eigen::Index{d} * node, d) = (to + R * (node_part(found_, d, node) - from)).head(d);
}

void LiveMotion::tell_untouched(std::vector<double>& u) const noexcept {
  const int d = live_.dimension();
  u.resize(static_cast<std::size_t>(body_.greens().order()));
  for (Index stored = 0; stored < body_.greens().nodes(); ++stored)
    set_vector(u, d, stored, node_part(untouched_, d, body_.mesh_node(stored)) - body_.rest_position(stored));
}

/// u [n] = W f.
void LiveMotion::displace(const NodalLoad& load, std::vector<double>& u) const noexcept {
  std::fill(u.begin(), u.end(), 0.0);
  if (!load.empty()) compliance_.now().displacement(load.nodes(), load.forces(), u);
}

/// Compares the positions of the loaded nodes in the tick with the actual ones. Returns the error of the
/// force, as a fraction of it.
double LiveMotion::compare(const MotionJob& job, const LiveReport& report) noexcept {
  const int d = live_.dimension();
  double along = 0.0, by_compliance = 0.0, largest = 0.0;
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < job.load.nodes().size(); ++k) {
    const Index stored = job.load.nodes()[k], node = body_.mesh_node(stored);
    const Vec3 expected = node_part(predicted_.x, d, node) + vector_at(by_load_, d, stored) -
                          vector_at(by_last_load_, d, stored);
    const Vec3 off = node_part(state_.x, d, node) - expected,
               f = vector_at(job.load.forces(), d, static_cast<Index>(k));
    largest = std::max(largest, off.norm());
    along += f.dot(off);
    by_compliance += f.dot(vector_at(by_load_, d, stored));
    sum += f;
  }
  const std::lock_guard lock(mutex_);
  telling_.counts.add(report);
  telling_.compliance_age = state_.time - compliance_.factored();
  telling_.renewals = compliance_.renewals();
  telling_.turns = compliance_.turns();
  telling_.last_error = largest;
  telling_.last_force_error = by_compliance > 0.0 ? sum.norm() * std::abs(along) / by_compliance : 0.0;
  telling_.largest_error = std::max(telling_.largest_error, largest);
  telling_.largest_force_error = std::max(telling_.largest_force_error, telling_.last_force_error);
  telling_.largest_force = std::max(telling_.largest_force, sum.norm());
  return sum.norm() > 0.0 ? telling_.last_force_error / sum.norm() : 0.0;
}

}  // namespace palpate
