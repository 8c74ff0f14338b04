#include "runtime/background/two_level_motion.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>

#include "base/vectors.h"

namespace palpate {
namespace {

constexpr double tolerance = 1e-5;      // change of q in Newton's last step, of q
constexpr int most_steps = 12;          // Newton's in a job
constexpr double most_residual = 1e-2;  // of a balance that is used
constexpr int most_failures = 5;        // until the search begins anew
constexpr double most_of_cell = 0.3;    // of its edge, that a node moves in a job
constexpr double most_behind = 0.03;    // [rad] by which W may lag
constexpr double most_wrong = 0.03;     // error of W, as a fraction of a step's displacement of loaded nodes
constexpr double felt_error = 0.05;     // of the force: hands discern 7 % (Jones 1989)
constexpr double least_error = 0.01;    // of the largest force so far: at first and last touch
constexpr std::size_t nodes_beside = 60;   // that a tool comes to meet until the next job
constexpr double least_wrong = tolerance;  // fraction of their displacement below which it is negligible

/// Sine of half the angle between rotations: |A - B| = 2 sqrt(2) sin(angle / 2).
double half_sine(const Mat3& A, const Mat3& B) {
  return (A - B).norm() / std::sqrt(8.0);
}

/// Sum of vectors of d components.
Vec3 sum_of(const std::vector<double>& vectors, int d) {
  Vec3 sum = Vec3::Zero();
  for (Index k = 0; k < std::ssize(vectors) / d; ++k) sum += vector_at(vectors, d, k);
  return sum;
}

}  // namespace

TwoLevelMotion::TwoLevelMotion(const Body& body)
    : body_(body),
      parts_(*body.coarse_parts()),
      field_at_rest_(two_levels(body.shared_greens(), at_rest(body.coarse()))),
      levels_(parts_, body.shared_greens()),
      R_renewed_(static_cast<std::size_t>(body.greens().nodes()), Mat3::Identity()),
      by_load_(static_cast<std::size_t>(body.motion_size())),
      x_(by_load_.size()),
      x_before_(by_load_.size()),
      without_(by_load_.size()) {}

void TwoLevelMotion::rest() noexcept {
  levels_.rest();
  std::fill(R_renewed_.begin(), R_renewed_.end(), Mat3::Identity());
  renewed_ = mesh_ = nullptr;
  failures_ = 0;
  force_error_ = largest_force_ = 0.0;
  for (std::vector<double>* all : {&x_, &x_before_, &without_}) std::fill(all->begin(), all->end(), 0.0);
  const std::lock_guard lock(mutex_);
  telling_ = {};
}

DepthTelling TwoLevelMotion::telling() const {
  const std::lock_guard lock(mutex_);
  return telling_;
}

void TwoLevelMotion::take_load(const MotionJob& job) {
  const int d = body_.dimension();
  const std::span<const Index> loaded = job.load.nodes();
  nodes_.assign(loaded.begin(), loaded.end());
  std::sort(nodes_.begin(), nodes_.end());
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  f_.assign(static_cast<std::size_t>(d) * nodes_.size(), 0.0);
  places_.assign(f_.size(), 0.0);
  if (nodes_.empty()) return;
  std::vector<double> without(f_.size());
  for (std::size_t k = 0; k < loaded.size(); ++k) {
    const auto at =
        static_cast<Index>(std::lower_bound(nodes_.begin(), nodes_.end(), loaded[k]) - nodes_.begin());
    set_vector(f_, d, at, vector_at(f_, d, at) + vector_at(job.load.forces(), d, static_cast<Index>(k)));
    set_vector(without, d, at, vector_at(job.without, d, static_cast<Index>(k)));
  }
  std::vector<NodeRange> ranges;
  for (const Index node : nodes_) ranges.push_back({node, node + 1});
  now().displacement(nodes_, f_, ranges, places_);
  // Places far from where the last balance had the nodes are beyond what the tick's linear model knows. All
  // go the same share of the way: if each went as far as it may, the nodes would be torn apart.
  const double most = most_of_cell * parts_.nodes->field.edge();
  std::vector<double> last;
  double farthest = 0.0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const auto at = static_cast<Index>(k);
    const Vec3 from = vector_at(levels_.displacement(), d, nodes_[k]);
    const Vec3 place = vector_at(places_, d, at) + vector_at(without, d, at);
    for (int axis = 0; axis < d; ++axis) last.push_back(from[axis]);
    set_vector(places_, d, at, place);
    farthest = std::max(farthest, (place - from).norm());
  }
  const double share = farthest > most ? most / farthest : 1.0;
  for (std::size_t i = 0; i < last.size(); ++i) places_[i] = last[i] + share * (places_[i] - last[i]);
}

/// Goes on to the balance. Where it is not found, the last one holds; after some failures the search begins
/// from rest.
TwoLevelReport TwoLevelMotion::find() {
  if (failures_ == most_failures) levels_.rest();
  TwoLevels last = levels_;
  TwoLevelReport report = levels_.find(nodes_, f_, places_, tolerance, most_steps);
  const auto all_finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
  };
  if (all_finite(levels_.forces()) && all_finite(levels_.displacement()) && report.residual < most_residual) {
    failures_ = 0;
  } else {
    failures_ = failures_ < most_failures ? failures_ + 1 : 1;
    levels_ = std::move(last);
  }
  return report;
}

/// Difference of the tick's force from the balance's for the same places, as a fraction, if a hand feels it.
double TwoLevelMotion::find_force_error() {
  const int d = body_.dimension();
  const Vec3 in_tick = sum_of(f_, d), in_balance = sum_of(levels_.forces(), d);
  const double error = (in_tick - in_balance).norm(), force = in_tick.norm();
  largest_force_ = std::max(largest_force_, in_balance.norm());
  const bool is_felt = error > felt_error * force && error > least_error * largest_force_;
  return is_felt ? std::min(1.0, error / force) : 0.0;
}

void TwoLevelMotion::do_job(const MotionJob& job, bool, std::span<double> u) noexcept {
  std::swap(x_, x_before_);
  try {
    take_load(job);
    const TwoLevelReport report = find();
    force_error_ = find_force_error();
    const auto of_field = std::copy(levels_.displacement().begin(), levels_.displacement().end(), x_.begin());
    std::copy(levels_.field().begin(), levels_.field().end(), of_field);
    shift_.clear();
    if (must_renew()) renew();
    tell(report);
    find_by_load(now(), by_load_);
  } catch (const std::exception&) {  // out of memory: the body stays as it was
    std::copy(without_.begin(), without_.end(), u.begin());
    return;
  }
  for (std::size_t k = 0; k < u.size(); ++k) without_[k] = x_[k] - by_load_[k];
  std::copy(without_.begin(), without_.end(), u.begin());
}

bool TwoLevelMotion::must_renew() const {
  double behind = 0.0;
  for (std::size_t node = 0; node < R_renewed_.size(); ++node)
    behind = std::max(behind, half_sine(levels_.turns()[node].R, R_renewed_[node]));
  if (behind > 0.5 * most_behind) return true;
  if (nodes_.empty()) return false;
  // Where the tick would have had the loaded nodes.
  std::vector<NodeRange> ranges;
  for (const Index node : nodes_) ranges.push_back({node, node + 1});
  std::vector<double> by_load(f_.size());
  now().displacement(levels_.loaded(), levels_.forces(), ranges, by_load);
  const int d = body_.dimension();
  double off = 0.0, moved = 0.0, size = 0.0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Vec3 x = vector_at(x_, d, nodes_[k]);
    off +=
        (x - vector_at(without_, d, nodes_[k]) - vector_at(by_load, d, static_cast<Index>(k))).squaredNorm();
    moved += (x - vector_at(x_before_, d, nodes_[k])).squaredNorm();
    size += x.squaredNorm();
  }
  return off > most_wrong * most_wrong * moved && off > least_wrong * least_wrong * size;
}

/// Loaded nodes, and those closest to them.
std::vector<Index> TwoLevelMotion::near_nodes() const {
  std::vector<std::pair<double, Index>> by_distance;
  for (Index node = 0; node < body_.greens().nodes() && !nodes_.empty(); ++node) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Index loaded : nodes_)
      nearest = std::min(nearest, (body_.rest_position(node) - body_.rest_position(loaded)).squaredNorm());
    by_distance.emplace_back(nearest, node);
  }
  const std::size_t count = std::min(by_distance.size(), 2 * nodes_.size() + nodes_beside);
  std::nth_element(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(count),
                   by_distance.end());
  std::vector<Index> near;
  for (std::size_t k = 0; k < count; ++k) near.push_back(by_distance[k].second);
  return near;
}

void TwoLevelMotion::find_by_load(const Greens& W, std::vector<double>& u) const {
  u.assign(x_.size(), 0.0);
  if (nodes_.empty()) return;
  const std::span all(u);
  const auto n = static_cast<std::size_t>(W.order());
  W.displacement(levels_.loaded(), levels_.forces(), all.first(n));
  const Greens& with_field = renewed_ != nullptr ? W : *field_at_rest_;
  with_field.coarse_displacement(levels_.loaded(), levels_.forces(), all.subspan(n));
}

void TwoLevelMotion::renew() {
  const Greens& at_rest = body_.local() != nullptr ? body_.local()->smooth() : body_.greens();
  find_by_load(renewed_ != nullptr ? *renewed_ : at_rest, shift_);
  TwoLevelState state = levels_.state(near_nodes());
  for (std::size_t node = 0; node < R_renewed_.size(); ++node) R_renewed_[node] = state.turns[node].R;
  if (const LocalCompliance* local = body_.local().get(); local != nullptr) {
    TwoLevelState of_mesh = state;
    of_mesh.near.clear();  // no tick gathers from it
    mesh_ = two_levels(body_.shared_greens(), std::move(of_mesh));
    renewed_ = two_levels({body_.local(), &local->smooth()}, std::move(state));
  } else {
    renewed_ = mesh_ = two_levels(body_.shared_greens(), std::move(state));
  }
  find_by_load(*renewed_, by_load_);
  for (std::size_t dof = 0; dof < shift_.size(); ++dof) shift_[dof] -= by_load_[dof];
  std::erase_if(kept_, [](const auto& old) { return old.use_count() == 1; });
  kept_.push_back(renewed_);
  const std::lock_guard lock(mutex_);
  ++telling_.turns;
}

void TwoLevelMotion::tell(const TwoLevelReport& report) {
  double turn = 0.0;
  for (const CoarseTurn& node : levels_.turns())
    turn = std::max(turn, 2.0 * std::asin(std::min(1.0, half_sine(node.R, Mat3::Identity()))));
  const std::lock_guard lock(mutex_);
  telling_.last_rotation = turn;
  telling_.largest_rotation = std::max(telling_.largest_rotation, turn);
  telling_.last_residual = report.residual;
  telling_.unbalanced += report.converged ? 0 : 1;
  telling_.last_small_strain = 0.0;
  if (!report.converged || force_error_ > 0.0 || levels_.loaded().empty()) return;
  const double force = sum_of(levels_.forces(), body_.dimension()).norm();
  if (force < least_error * telling_.largest_force || force == 0.0) return;
  telling_.last_small_strain = report.small_strain.norm() / force - 1.0;
  if (force <= telling_.largest_force) return;
  telling_.largest_force = force;
  telling_.small_strain_at_largest = telling_.last_small_strain;
}

}  // namespace palpate
