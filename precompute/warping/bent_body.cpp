#include "precompute/warping/bent_body.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/vectors.h"
#include "statics/balance.h"
#include "statics/live_forces.h"
#include "statics/polar.h"
#include "statics/surface_change.h"

namespace palpate {
namespace {

constexpr BalanceOptions newton{.tolerance = 1e-8, .most_steps = 100};
constexpr WarpBalanceOptions mixing{.tolerance = 1e-7, .most_rounds = 200};

}  // namespace

BentBody::BentBody(const Model& model, std::vector<Index> nodes)
    : model_(model),
      dimension_(model.dimension()),
      nodes_(std::move(nodes)),
      surface_(number_surface(model.surface, model.mesh.nodes.size())),
      small_(live_input(model), {.law = LiveLaw::linear}),
      corotational_(live_input(model), {.law = LiveLaw::corotational}),
      factor_({}),
      rest_(corotational_.start()) {
  for (const Index node : nodes_) {
    const auto at = std::lower_bound(surface_.mesh_nodes.begin(), surface_.mesh_nodes.end(), node);
    loaded_.push_back(static_cast<std::size_t>(at - surface_.mesh_nodes.begin()));
  }
  if (!find_balance(corotational_, corotational_.load(), {}, rest_, newton).converged) {
    throw Error("the corotational body has no balance under the loads of model.toml", model.name,
                "make the loads smaller, or leave out [warp]");
  }
  x_ = rest_;
  solve_linear();
  make_warp();
}

void BentBody::solve_linear() {
  assemble_tangent(small_, small_.rest(), {}, TangentKind::exact, K_);
  if (!factor_.set(K_))
    throw Error("K is not positive definite", model_.name, "hold more of the body in [[fixed]]");
  const std::span<const Index> dofs = small_.dof_of_free();
  for (Eigen::Index axis = 0; axis < dimension_; ++axis) {
    const Eigen::VectorXd load = spread(Vec3::Unit(axis));
    Eigen::VectorXd f(small_.free_dofs()), u = Eigen::VectorXd::Zero(small_.dofs());
    for (Eigen::Index k = 0; k < f.size(); ++k) f[k] = load[dofs[static_cast<std::size_t>(k)]];
    const Eigen::VectorXd free = factor_.by_factor(f);
    for (Eigen::Index k = 0; k < f.size(); ++k) u[dofs[static_cast<std::size_t>(k)]] = free[k];
    for (const Index node : surface_.mesh_nodes)
      unit_[static_cast<std::size_t>(axis)].push_back(
          vector_at({u.data(), static_cast<std::size_t>(u.size())}, dimension_, node));
  }
}

Vec3 BentBody::rest_of(std::size_t surface_node) const {
  const auto node = static_cast<std::size_t>(surface_.mesh_nodes[surface_node]);
  return model_.mesh.nodes[node] + model_.rest_displacement[node];
}

void BentBody::make_warp() {
  const auto all_axes = static_cast<std::uint8_t>((1U << static_cast<unsigned>(dimension_)) - 1U);
  WarpSurface surface{
      .dimension = dimension_, .rest = {}, .simplices = surface_.simplices, .stored = {}, .held = {}};
  std::vector<Index> place;  // dof in K of each dof of the stored nodes; -1: held
  Index stored = 0;
  for (std::size_t k = 0; k < surface_.mesh_nodes.size(); ++k) {
    const auto node = static_cast<std::size_t>(surface_.mesh_nodes[k]);
    surface.rest.push_back(rest_of(k));
    surface.held.push_back(model_.fixed[node]);
    const bool moves = (model_.fixed[node] & all_axes) != all_axes;
    surface.stored.push_back(moves ? stored++ : -1);
    if (!moves) continue;
    const auto d = static_cast<std::size_t>(dimension_);
    for (std::size_t axis = 0; axis < d; ++axis) place.push_back(small_.free_of_dof()[d * node + axis]);
  }
  warp_ = std::make_unique<SurfaceWarp>(std::move(surface));
  balance_ = std::make_unique<WarpBalance>(
      *warp_, [this, place = std::move(place)](std::span<const double> f, std::span<double> u) {
        Eigen::VectorXd load = Eigen::VectorXd::Zero(small_.free_dofs());
        for (std::size_t k = 0; k < place.size(); ++k) {
          if (place[k] >= 0) load[place[k]] = f[k];
        }
        const Eigen::VectorXd moved = factor_.by_factor(load);
        for (std::size_t k = 0; k < place.size(); ++k) u[k] = place[k] >= 0 ? moved[place[k]] : 0.0;
      });
  balance_->rest();
}

Eigen::VectorXd BentBody::spread(const Vec3& force) const {
  Eigen::VectorXd f = Eigen::VectorXd::Zero(small_.dofs());
  for (const Index node : nodes_)
    f.segment(Eigen::Index{dimension_} * node, dimension_) =
        force.head(dimension_) / static_cast<double>(nodes_.size());
  return f;
}

SurfaceDisplacement BentBody::linear(const Vec3& force) const {
  SurfaceDisplacement u(surface_.mesh_nodes.size(), Vec3::Zero());
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(dimension_); ++axis) {
    for (std::size_t node = 0; node < u.size(); ++node)
      u[node] += force[static_cast<Eigen::Index>(axis)] * unit_[axis][node];
  }
  return u;
}

std::optional<SurfaceDisplacement> BentBody::warped(const Vec3& force) {
  const std::vector<Index>& stored = warp_->surface().stored;
  std::vector<Index> nodes;
  std::vector<double> forces;
  for (const std::size_t node : loaded_) {
    nodes.push_back(stored[node]);
    for (Eigen::Index axis = 0; axis < dimension_; ++axis)
      forces.push_back(force[axis] / static_cast<double>(loaded_.size()));
  }
  if (!balance_->find(nodes, forces, mixing)) return std::nullopt;
  SurfaceDisplacement u = balance_->place().x;
  for (std::size_t node = 0; node < u.size(); ++node) u[node] -= rest_of(node);
  return u;
}

std::optional<SurfaceDisplacement> BentBody::corotational(const Vec3& force) {
  Eigen::VectorXd x = x_;
  const BalanceReport report =
      find_balance(corotational_, corotational_.load() + spread(force), {}, x, newton);
  if (!report.converged || report.inverted > 0) return std::nullopt;
  x_ = std::move(x);
  const Eigen::VectorXd all = x_ - rest_;
  SurfaceDisplacement u;
  for (const Index node : surface_.mesh_nodes)
    u.push_back(vector_at({all.data(), static_cast<std::size_t>(all.size())}, dimension_, node));
  return u;
}

Vec3 BentBody::moved(const SurfaceDisplacement& u) const {
  Vec3 sum = Vec3::Zero();
  for (const std::size_t node : loaded_) sum += u[node];
  return sum / static_cast<double>(loaded_.size());
}

Mat3 BentBody::turned(const SurfaceDisplacement& u) const {
  Vec3 middle = Vec3::Zero();
  for (const std::size_t node : loaded_) middle += rest_of(node) / static_cast<double>(loaded_.size());
  Mat3 A = Mat3::Zero();
  for (const std::size_t node : loaded_) {
    const Vec3 X = rest_of(node) - middle;
    A += (X + u[node]) * X.transpose();
  }
  return dimension_ == 2 ? nearest_rotation_in_plane(A) : nearest_rotation(A);
}

double BentBody::rotation(const SurfaceDisplacement& u) const {
  std::vector<Vec3> rest;
  for (std::size_t node = 0; node < u.size(); ++node) rest.push_back(rest_of(node));
  return surface_change(dimension_, surface_.simplices, rest, u).rotation;
}

Mat3 BentBody::softness() const {
  Mat3 softness = Mat3::Zero();
  for (Eigen::Index axis = 0; axis < dimension_; ++axis)
    softness.col(axis) = moved(unit_[static_cast<std::size_t>(axis)]);
  return softness;
}

}  // namespace palpate
