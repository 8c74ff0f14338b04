#include "runtime/background/live_compliance.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "statics/polar.h"

namespace palpate {
namespace {

constexpr std::int64_t most_dofs = 3000;  // a larger W takes hundreds of megabytes, and seconds
constexpr Index slice = 24;               // columns per step: about the work of a factorisation
constexpr Index plane_slice = 96;         // in the plane, where factors are small and all nodes are stored
constexpr int least_steps = 10;           // steps between renewals
constexpr double most_change = 0.02;      // root mean square change of deformation gradients
constexpr double least_change = 0.002;    // below it, W is wrong for other reasons
constexpr double most_error = 0.02;       // fraction of the force
constexpr double most_turn = 0.05;        // [rad]

bool can_renew(const Body& body) {
  const LiveParts& live = *body.live();
  return live.body.options().law != LiveLaw::linear && is_implicit(live.stepper.scheme.integrator) &&
         body.greens().order() <= most_dofs;
}

double angle_between(const Mat3& A, const Mat3& B) {
  return std::acos(std::clamp(0.5 * ((A.transpose() * B).trace() - 1.0), -1.0, 1.0));
}

}  // namespace

LiveState state_at_rest(const Body& body) {
  const LiveBody& live = body.live()->body;
  LiveState state(live);
  const Model& model = body.model();
  for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node) {
    state.x.segment(Eigen::Index{live.dimension()} * static_cast<Eigen::Index>(node), live.dimension()) =
        (model.mesh.nodes[node] + model.rest_displacement[node]).head(live.dimension());
  }
  return state;
}

LiveCompliance::LiveCompliance(const Body& body, bool renews)
    : body_(body),
      live_(body.live()->body),
      renews_(renews && can_renew(body)),
      turns_with_body_(live_.free_dofs() == live_.dofs()),
      maker_(live_, body.live()->stepper, body.model().stored_nodes) {
  rest();
}

void LiveCompliance::rest() noexcept {
  is_making_ = false;
  steps_since_ = least_steps;
  look(state_at_rest(body_), at_);
  W_ = {};
  R_delivered_ = Mat3::Identity();
  renewed_ = nullptr;
}

void LiveCompliance::look(const LiveState& state, Shape& shape) const {
  shape.F.resize(static_cast<std::size_t>(live_.all_points()));
  shape.time = state.time;
  Mat3 mean = Mat3::Zero();
  for (Index point = 0; point < live_.all_points(); ++point) {
    shape.F[point] = deformation_gradient(live_, state.x, point);
    mean += live_.weight(point) * shape.F[point];
  }
  shape.R = Mat3::Identity();
  if (!turns_with_body_) return;
  shape.R = live_.dimension() == 2 ? nearest_rotation_in_plane(mean) : nearest_rotation(mean);
}

/// Root mean square of F' - Q F, with Q the rotation of W between the two.
double LiveCompliance::change(const Shape& from, const Shape& to) const {
  const Mat3 Q = to.R * from.R.transpose();
  double sum = 0.0, volume = 0.0;
  for (Index point = 0; point < live_.all_points(); ++point) {
    sum += live_.weight(point) * (to.F[point] - Q * from.F[point]).squaredNorm();
    volume += live_.weight(point);
  }
  return std::sqrt(sum / volume);
}

bool LiveCompliance::is_due(double error) const {
  if (steps_since_ < least_steps) return false;
  const double changed = change(at_, now_);
  const bool must_turn = W_.order() == 0 && angle_between(at_.R, now_.R) > most_turn;
  return changed > most_change || must_turn || (error > most_error && changed > least_change);
}

bool LiveCompliance::follow(const LiveState& state, double error) noexcept {
  if (!renews_) return false;
  try {
    return go_on(state, error);
  } catch (const std::exception&) {
    renews_ = false;  // out of memory: W is kept
    return false;
  }
}

bool LiveCompliance::go_on(const LiveState& state, double error) {
  look(state, now_);
  ++steps_since_;
  if (is_making_) {
    if (maker_.go_on(live_.dimension() == 2 ? plane_slice : slice)) {
      is_making_ = false;
      steps_since_ = 0;
      W_ = maker_.take();
      at_ = next_;
      ++renewals_;
      deliver(W_, now_.R * at_.R.transpose());
      return true;
    }
  } else if (is_due(error)) {
    is_making_ = maker_.begin(state.x, state.plastic);
    next_ = now_;
  }
  if (W_.order() == 0 || angle_between(R_delivered_, now_.R) <= most_turn) return false;
  ++turns_;
  deliver(W_, now_.R * at_.R.transpose());
  return true;
}

void LiveCompliance::deliver(const PackedGreens& W, const Mat3& Q) {
  const int d = live_.dimension();
  R_delivered_ = now_.R;
  renewed_ = make_greens(turns_with_body_ ? turned(W, Q, d) : W, d,
                         GreensOptions{.jobs = 1, .max_square_bytes = -1});
  std::erase_if(kept_, [](const auto& old) { return old.use_count() == 1; });
  kept_.push_back(renewed_);
}

}  // namespace palpate
