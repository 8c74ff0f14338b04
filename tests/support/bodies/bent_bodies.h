// Cantilevers bent far by small strain, on two levels and by a corotational solver of the same mesh.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "base/vectors.h"
#include "meshes/generate.h"
#include "runtime/body/body.h"
#include "runtime/depth/two_levels.h"
#include "runtime/live/live_model.h"
#include "statics/balance.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::test {

inline constexpr double bent_length = 0.08, bent_height = 0.01;  // [m]

/// A cantilever along x, clamped at x = 0, that bends up: along z, in the plane along y. E = 5 kPa, nu = 0.3.
inline Model bent_model(ElementType type, Scope scope = Scope::surface) {
  Mesh mesh;
  if (traits(type).dimension == 2) {
    mesh = generate(RectangleShape{Vec3::Zero(), {bent_length, bent_height, 0}, {32, 4}}, type);
  } else {
    mesh = generate(BoxShape{Vec3::Zero(), Vec3(bent_length, bent_height, bent_height), {16, 2, 2}},
                    type == ElementType::hex8 ? type : ElementType::tet4);
    if (type == ElementType::tet10) mesh = with_elements(std::move(mesh), type, "");
  }
  Model model = bake(
      std::move(mesh), [](const Vec3& x) { return x.x() < 1e-9; }, scope, Precision::double_precision);
  model.materials[0].youngs_modulus = 5e3;
  model.greens = model.greens.scaled(1.0 / 5e3);
  return model;
}

/// How a cantilever is loaded: a force along the end face as it has turned, as a smooth tool would press it,
/// or one that stays upright.
enum class BendingLoad { follows, upright };

/// A bent cantilever: the force at its end and what it came to.
struct Bent {
  double force = 0.0;       ///< [N]
  double angle = 0.0;       ///< by which the end face has turned [rad]
  Vec3 tip = Vec3::Zero();  ///< displacement of its middle [m]
};

/// Where a cantilever's nodes are by some way to compute it, under forces f [d N] on all mesh nodes.
using BendingLaw = std::function<std::vector<Vec3>(const std::vector<Vec3>& f)>;

/// The end face of a cantilever.
class EndFace {
 public:
  explicit EndFace(const Mesh& mesh) : mesh_(mesh), up_(mesh.dimension() == 2 ? 1 : 2) {
    for (std::size_t k = 0; k < mesh.nodes.size(); ++k) {
      if (mesh.nodes[k].x() > bent_length - 1e-9) nodes_.push_back(k);
    }
  }
  /// A force shared by its nodes.
  [[nodiscard]] std::vector<Vec3> spread(const Vec3& force) const {
    std::vector<Vec3> f(mesh_.nodes.size(), Vec3::Zero());
    for (const std::size_t node : nodes_) f[node] = force / static_cast<double>(nodes_.size());
    return f;
  }
  /// The direction along the face that pointed up [-].
  [[nodiscard]] Vec3 direction(const std::vector<Vec3>& x) const {
    Vec3 sum = Vec3::Zero();
    for (const std::size_t node : nodes_) sum += (mesh_.nodes[node][up_] - 0.5 * bent_height) * x[node];
    return sum.normalized();
  }
  [[nodiscard]] double angle(const std::vector<Vec3>& x) const {
    const Vec3 along = direction(x);
    return std::atan2(-along.x(), along[up_]);
  }
  [[nodiscard]] Vec3 moved(const std::vector<Vec3>& x) const {
    Vec3 sum = Vec3::Zero();
    for (const std::size_t node : nodes_) sum += x[node] - mesh_.nodes[node];
    return sum / static_cast<double>(nodes_.size());
  }
  [[nodiscard]] Vec3 up() const { return Vec3::Unit(up_); }

 private:
  const Mesh& mesh_;
  int up_;
  std::vector<std::size_t> nodes_;
};

/// A law's cantilever under growing forces, until it is bent by `most_angle` [rad].
inline std::vector<Bent> bend(const Mesh& mesh, const BendingLaw& law, BendingLoad load, double force_step,
                              double most_angle, int most_steps = 400) {
  const EndFace face(mesh);
  std::vector<Bent> curve = {{}};
  Vec3 direction = face.up();
  for (int k = 1; k <= most_steps; ++k) {
    std::vector<Vec3> x;
    for (int round = 0; round < 40; ++round) {
      x = law(face.spread(k * force_step * direction));
      const Vec3 next = load == BendingLoad::follows ? face.direction(x) : face.up();
      const double change = (next - direction).norm();
      direction = next;
      if (change < 1e-5) break;
    }
    curve.push_back({.force = k * force_step, .angle = face.angle(x), .tip = face.moved(x)});
    if (curve.back().angle > most_angle) break;
  }
  return curve;
}

/// Positions of all mesh nodes by a corotational body; each call goes on from the last.
inline BendingLaw corotational(const Model& model, LiveLaw law = LiveLaw::corotational) {
  auto body = std::make_shared<LiveBody>(live_input(model), LiveOptions{.law = law});
  auto x = std::make_shared<Eigen::VectorXd>(body->start());
  return [body, x](const std::vector<Vec3>& f) {
    const int d = body->dimension();
    Eigen::VectorXd load = Eigen::VectorXd::Zero(body->dofs());
    for (std::size_t k = 0; k < f.size(); ++k)
      load.segment(d * static_cast<Eigen::Index>(k), d) = f[k].head(d);
    find_balance(*body, load, {}, *x, {.tolerance = 1e-9, .most_steps = 200});
    std::vector<Vec3> places;
    for (std::size_t k = 0; k < f.size(); ++k) places.push_back(node_part(*x, d, static_cast<Index>(k)));
    return places;
  };
}

/// Forces on stored nodes, in their order [n].
inline std::vector<double> on_stored(const Body& body, const std::vector<Vec3>& f) {
  std::vector<double> forces;
  for (const Index node : body.model().stored_nodes) {
    for (int axis = 0; axis < body.dimension(); ++axis)
      forces.push_back(f[static_cast<std::size_t>(node)][axis]);
  }
  return forces;
}

inline std::vector<Vec3> places_of(const Body& body, std::span<const double> u) {
  std::vector<Vec3> places = body.model().mesh.nodes;
  const int d = body.dimension();
  for (std::size_t k = 0; k < body.model().stored_nodes.size(); ++k) {
    for (int axis = 0; axis < d; ++axis)
      places[static_cast<std::size_t>(body.model().stored_nodes[k])][axis] +=
          u[static_cast<std::size_t>(d) * k + static_cast<std::size_t>(axis)];
  }
  return places;
}

inline std::vector<Index> all_stored(const Body& body) {
  std::vector<Index> nodes(static_cast<std::size_t>(body.greens().nodes()));
  std::iota(nodes.begin(), nodes.end(), 0);
  return nodes;
}

inline BendingLaw small_strain(const Body& body) {
  return [&body](const std::vector<Vec3>& f) {
    std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
    body.greens().displacement(all_stored(body), on_stored(body, f), u);
    return places_of(body, u);
  };
}

/// A coarse body as `play --depth yes` makes it.
inline CoarseParts coarse_parts(const Model& model, LiveLaw law = LiveLaw::corotational,
                                Index most_dofs = most_coarse_dofs) {
  return make_coarse_parts(std::make_shared<const LiveBody>(live_input(model), LiveOptions{.law = law}),
                           model.stored_nodes, most_dofs);
}

/// Goes on to the balance of two levels under given forces: places are imposed, and corrected until they need
/// these forces.
inline void balance_by_forces(TwoLevels& levels, const std::shared_ptr<const Greens>& Xi,
                              const std::vector<Index>& nodes, const std::vector<double>& f,
                              int most_rounds = 100) {
  const auto moved_by = [&](const Greens& W, const std::vector<double>& forces) {
    std::vector<double> all(static_cast<std::size_t>(W.order())), u;
    W.displacement(nodes, forces, all);
    for (const Index node : nodes) {
      for (int axis = 0; axis < W.dimension(); ++axis)
        u.push_back(all[static_cast<std::size_t>(W.dimension() * node + axis)]);
    }
    return u;
  };
  for (int round = 0; round < most_rounds; ++round) {
    std::vector<double> left = f;
    if (levels.forces().size() == f.size())
      for (std::size_t k = 0; k < f.size(); ++k) left[k] -= levels.forces()[k];
    const std::shared_ptr<const Greens> W = two_levels(Xi, levels.state({}));
    std::vector<double> u = moved_by(*W, left);
    double change = 0.0, size = 0.0;
    for (std::size_t k = 0; k < u.size(); ++k) {
      const std::size_t dof =
          static_cast<std::size_t>(Xi->dimension() * nodes[k / static_cast<std::size_t>(Xi->dimension())]) +
          k % static_cast<std::size_t>(Xi->dimension());
      change = std::max(change, std::abs(u[k]));
      u[k] += levels.displacement()[dof];
      size = std::max(size, std::abs(u[k]));
    }
    levels.find(nodes, f, u, 1e-9, 40);
    if (change < 1e-8 * size) break;
  }
}

inline BendingLaw on_two_levels(const Body& body) {
  auto parts = std::make_shared<const CoarseParts>(coarse_parts(body.model()));
  auto levels = std::make_shared<TwoLevels>(*parts, body.shared_greens());
  return [&body, parts, levels](const std::vector<Vec3>& f) {
    std::vector<Index> nodes;
    std::vector<double> forces;
    const std::vector<double> all = on_stored(body, f);
    const int d = body.dimension();
    for (const Index node : all_stored(body)) {
      if (vector_at(all, d, node).isZero(0.0)) continue;
      nodes.push_back(node);
      for (int axis = 0; axis < d; ++axis) forces.push_back(all[static_cast<std::size_t>(d * node + axis)]);
    }
    balance_by_forces(*levels, body.shared_greens(), nodes, forces);
    return places_of(body, levels->displacement());
  };
}

/// What a curve has for x between its points, whose `of` grow.
inline double at(const std::vector<Bent>& curve, double x, const std::function<double(const Bent&)>& of,
                 const std::function<double(const Bent&)>& value) {
  for (std::size_t k = 1; k < curve.size(); ++k) {
    if (of(curve[k]) < x) continue;
    const double a = of(curve[k - 1]), b = of(curve[k]);
    return value(curve[k - 1]) + (x - a) / (b - a) * (value(curve[k]) - value(curve[k - 1]));
  }
  return NAN;
}

inline double rise(const Bent& bent, int dimension) {
  return bent.tip[dimension - 1];
}

/// Errors of a law at an angle of the corotational cantilever.
struct BendingError {
  double force;         ///< of the force that lifts the tip as high [-]
  double displacement;  ///< of the tip's displacement under the same force, of that displacement [-]
};

inline BendingError bending_error(const std::vector<Bent>& truth, const std::vector<Bent>& curve,
                                  double angle, int dimension) {
  const auto by_angle = [](const Bent& bent) { return bent.angle; };
  const auto force = [](const Bent& bent) { return bent.force; };
  const auto height = [dimension](const Bent& bent) { return rise(bent, dimension); };
  const double F = at(truth, angle, by_angle, force), z = at(truth, angle, by_angle, height);
  Vec3 tip, off;
  for (int axis = 0; axis < 3; ++axis) {
    const auto part = [axis](const Bent& bent) { return bent.tip[axis]; };
    tip[axis] = at(truth, angle, by_angle, part);
    off[axis] = at(curve, F, force, part) - tip[axis];
  }
  return {.force = at(curve, z, height, force) / F - 1.0, .displacement = off.norm() / tip.norm()};
}

}  // namespace palpate::test
