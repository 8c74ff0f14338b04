// Large deformations that another program has solved too: CalculiX, by scripts/studies/live-truth.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "statics/balance.h"
#include "tests/support/bodies/live_bodies.h"

namespace palpate::test {

/// A body some of whose nodes are moved, and what is measured there.
struct LargeCase {
  std::string name;
  LiveInput input;              ///< held: those that are moved, and those that stay
  std::vector<Index> moved{};   ///< nodes
  std::uint8_t moved_axes = 7;  ///< along which they are
  std::vector<double> levels;   ///< of the motion: stretches, angles [degrees], shares of the thickness
  int parts = 8;                ///< in which each level is reached from the one before
  std::function<Vec3(const Vec3&, double)> place{};  ///< where a moved node goes at a level [m]
  /// The figure by forces on the moved nodes and where these are: a force [N] or a moment [N m].
  std::function<double(const std::vector<Vec3>& x, const std::vector<Vec3>& force, double level)> figure{};
};

inline std::vector<Index> nodes_where(const Mesh& mesh, const std::function<bool(const Vec3&)>& where) {
  std::vector<Index> nodes;
  for (std::size_t k = 0; k < mesh.nodes.size(); ++k) {
    if (where(mesh.nodes[k])) nodes.push_back(static_cast<Index>(k));
  }
  return nodes;
}

inline double sum_along(const std::vector<Vec3>& vectors, int axis) {
  double sum = 0.0;
  for (const Vec3& vector : vectors) sum += vector[axis];
  return sum;
}

inline Mesh box_of(ElementType type, const Vec3& size, const std::array<int, 3>& cells) {
  Mesh mesh = generate(BoxShape{Vec3::Zero(), size, cells});
  return type == ElementType::tet10 ? with_elements(std::move(mesh), type, "") : mesh;
}

inline const Material large_material{.youngs_modulus = 5e3, .poissons_ratio = 0.45, .density = 1000.0};

/// A bar of 40 x 10 x 10 mm, held at both ends, stretched and shortened.
inline LargeCase bar_case(ElementType type) {
  const double length = 0.04;
  LargeCase bar{.name = std::string("bar-") + traits(type).name,
                .input = live_input_of(box_of(type, {length, 0.01, 0.01}, {8, 2, 2}), large_material),
                .levels = {0.85, 1.25, 1.5, 2.0}};
  hold(
      bar.input, [=](const Vec3& x) { return x.x() < 1e-9 || x.x() > length - 1e-9; }, 7);
  bar.moved = nodes_where(bar.input.mesh, [=](const Vec3& x) { return x.x() > length - 1e-9; });
  bar.place = [=](const Vec3& x, double stretch) { return Vec3(stretch * length, x.y(), x.z()); };
  bar.figure = [](const auto&, const auto& force, double) { return sum_along(force, 0); };
  return bar;
}

/// A cantilever of 80 x 10 x 10 mm, bent to an arc: its end face is turned by the angle.
inline LargeCase bending_case(ElementType type) {
  const double length = 0.08;
  LargeCase beam{.name = std::string("bending-") + traits(type).name,
                 .input = live_input_of(box_of(type, {length, 0.01, 0.01}, {16, 2, 2}), large_material),
                 .levels = {5.0, 20.0, 45.0, 90.0}};
  hold(
      beam.input, [=](const Vec3& x) { return x.x() < 1e-9 || x.x() > length - 1e-9; }, 7);
  beam.moved = nodes_where(beam.input.mesh, [=](const Vec3& x) { return x.x() > length - 1e-9; });
  const auto tip = [=](double degrees) {
    const double angle = degrees * M_PI / 180.0;
    return Vec3(length * std::sin(angle) / angle, 0.005, 0.005 + length * (1.0 - std::cos(angle)) / angle);
  };
  beam.place = [=](const Vec3& x, double degrees) {
    const Mat3 R = Eigen::AngleAxisd(-degrees * M_PI / 180.0, Vec3::UnitY()).toRotationMatrix();
    return Vec3(tip(degrees) + R * (x - Vec3(length, 0.005, 0.005)));
  };
  beam.figure = [=](const auto& x, const auto& force, double degrees) {
    double moment = 0.0;
    for (std::size_t k = 0; k < x.size(); ++k) moment -= (x[k] - tip(degrees)).cross(force[k]).y();
    return moment;
  };
  return beam;
}

/// A block of 40 x 40 x 30 mm whose middle is pressed in by a flat patch without friction.
inline LargeCase indentation_case(ElementType type) {
  const double height = 0.03;
  LargeCase block{
      .name = std::string("indentation-") + traits(type).name,
      .input = live_input_of(box_of(type, {0.04, 0.04, height},
                                    type == ElementType::tet10 ? std::array{6, 6, 4} : std::array{10, 10, 8}),
                             large_material),
      .moved_axes = 4,
      .levels = {0.1, 0.2, 0.3}};
  const auto in_patch = [=](const Vec3& x) {
    return x.z() > height - 1e-9 &&
           (x.head<2>() - Eigen::Vector2d(0.02, 0.02)).cwiseAbs().maxCoeff() < 0.0085;
  };
  hold(
      block.input, [](const Vec3& x) { return x.z() < 1e-9; }, 7);
  hold(block.input, in_patch, 4);
  block.moved = nodes_where(block.input.mesh, in_patch);
  block.place = [=](const Vec3& x, double share) { return Vec3(x.x(), x.y(), x.z() - share * height); };
  block.figure = [](const auto&, const auto& force, double) { return -sum_along(force, 2); };
  return block;
}

inline std::vector<LargeCase> large_cases() {
  std::vector<LargeCase> cases = {bar_case(ElementType::tet4),         bar_case(ElementType::tet10),
                                  bending_case(ElementType::tet4),     bending_case(ElementType::tet10),
                                  indentation_case(ElementType::tet4), indentation_case(ElementType::tet10)};
  for (LargeCase& large : cases) {
    if (large.input.mesh.element == ElementType::tet10) large.parts = 24;
  }
  return cases;
}

/// The figures of all levels by a law. Each level is reached in parts, of which all but the last are no more
/// than where the next one begins.
inline std::vector<double> solve_large(const LargeCase& large, LiveLaw law) {
  const LiveBody body(large.input, {.law = law});
  Eigen::VectorXd x = body.start(), before, f;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(x.size());
  std::vector<double> figures;
  double reached = large.name.starts_with("bar") ? 1.0 : large.name.starts_with("bending") ? 1e-3 : 0.0;
  for (const double level : large.levels) {
    if (large.name.starts_with("bar") && level > 1.0 && reached < 1.0) {  // from rest again
      x = body.start();
      reached = 1.0;
    }
    for (int part = 1; part <= large.parts; ++part) {
      const double at = reached + (level - reached) * part / large.parts;
      const Eigen::VectorXd now = x;
      if (part > 1) x += now - before;  // as far again
      before = now;
      for (const Index node : large.moved) {
        const Vec3 to = large.place(large.input.mesh.nodes[static_cast<std::size_t>(node)], at);
        for (int axis = 0; axis < 3; ++axis) {
          if ((large.moved_axes >> axis) & 1) x[3 * node + axis] = to[axis];
        }
      }
      const double tolerance = part < large.parts ? 1e-4 : BalanceOptions{}.tolerance;
      if (!find_balance(body, none, {}, x, {.tolerance = tolerance, .most_steps = 200}).converged)
        return figures;
    }
    reached = level;
    internal_forces(body, x, {}, f);
    std::vector<Vec3> places, forces;
    for (const Index node : large.moved) {
      places.emplace_back(x.segment<3>(3 * node));
      forces.emplace_back(-f.segment<3>(3 * node));
    }
    figures.push_back(large.figure(places, forces, level));
  }
  return figures;
}

}  // namespace palpate::test
