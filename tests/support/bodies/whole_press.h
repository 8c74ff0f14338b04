// A body of large strain pressed where a tick has its contact points: Newton's method on the whole mesh.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/core/tick/state.h"
#include "runtime/core/tick/step.h"
#include "statics/live_body.h"
#include "statics/live_forces.h"
#include "statics/tangent_solver.h"

namespace palpate::test {

/// A point of the surface, and how far it is along a normal.
struct PressedPoint {
  std::array<Index, 3> nodes;  ///< of the mesh; -1: none
  std::array<double, 3> weights;
  Vec3 normal;
  double depth;  ///< displacement along the normal [m]
};

/// The points that carry a tick's force, each where the tick has it. For surfaces that are the mesh's own.
inline std::vector<PressedPoint> pressed_points(const Body& body, const State& state) {
  std::vector<Vec3> u(body.surface_rest_positions().size());
  std::vector<double> stored(static_cast<std::size_t>(body.greens().order()));
  MotionSnapshot motion(body);
  state.surface.motion.snapshot(motion);
  surface_displacement(body, state.surface.near.load(), stored, u, &motion);
  std::vector<PressedPoint> points;
  for (const ContactPoint& contact : state.contacts()) {
    PressedPoint point{{-1, -1, -1}, contact.weights, contact.frame.col(0), 0.0};
    if (!(contact.force.norm() > 0.0)) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      if (contact.nodes[k] < 0) continue;
      point.nodes[k] = body.surface_mesh_nodes()[static_cast<std::size_t>(contact.nodes[k])];
      point.depth += contact.weights[k] * point.normal.dot(u[static_cast<std::size_t>(contact.nodes[k])]);
    }
    points.push_back(point);
  }
  return points;
}

/// The force [N] that moves points of a body this far along their normals, by multipliers with a penalty;
/// other directions are free. `x` [d N] is where it begins and ends. Empty if no balance is found.
inline std::optional<Vec3> press_whole(const LiveBody& body, const std::vector<PressedPoint>& points,
                                       Eigen::VectorXd& x, int parts = 8) {
  using Eigen::VectorXd;
  LiveMatrix K = body.pattern().zero();
  assemble_tangent(body, body.rest(), {}, TangentKind::exact, K);
  double stiffest = 0.0;
  for (const Index place : body.pattern().diagonal()) stiffest = std::max(stiffest, K.valuePtr()[place]);
  const double penalty = 100.0 * stiffest;
  std::vector<double> force(points.size(), 0.0);
  VectorXd f, left(body.free_dofs()), step(body.free_dofs());
  const auto along = [&](const PressedPoint& point, const VectorXd& at) {
    double sum = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (point.nodes[k] >= 0)
        sum += point.weights[k] *
               point.normal.dot((at - body.rest()).segment<3>(3 * Eigen::Index{point.nodes[k]}));
    }
    return sum;
  };
  const auto energy = [&](const VectorXd& at, double share, VectorXd& residual) {
    double sum = internal_forces(body, at, {}, f).energy;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double off = along(points[k], at) - share * points[k].depth;
      sum += 0.5 * penalty * off * off - force[k] * off;
      for (std::size_t j = 0; j < 3; ++j) {
        if (points[k].nodes[j] >= 0)
          f.segment<3>(3 * Eigen::Index{points[k].nodes[j]}) +=
              (force[k] - penalty * off) * points[k].weights[j] * points[k].normal;
      }
    }
    for (Index free = 0; free < body.free_dofs(); ++free) residual[free] = f[body.dof_of_free()[free]];
    return sum;
  };
  for (int part = 1; part <= parts; ++part) {
    const double share = static_cast<double>(part) / parts;
    for (int round = 0; round < 12; ++round) {  // of multipliers
      double before = energy(x, share, left);
      for (int newton = 0; newton < 60; ++newton) {
        TangentSolver solver({});
        bool is_solved = false;
        for (const TangentKind kind : {TangentKind::exact, TangentKind::positive}) {
          assemble_tangent(body, x, {}, kind, K);
          for (const PressedPoint& point : points) {
            for (std::size_t a = 0; a < 3; ++a) {
              for (std::size_t b = 0; b < 3; ++b) {
                if (point.nodes[a] < 0 || point.nodes[b] < 0) continue;
                for (Index i = 0; i < 3; ++i) {
                  for (Index j = 0; j < 3; ++j) {
                    const Index row = body.free_of_dof()[static_cast<std::size_t>(3 * point.nodes[a] + i)],
                                column = body.free_of_dof()[static_cast<std::size_t>(3 * point.nodes[b] + j)];
                    if (row >= column && column >= 0)
                      K.coeffRef(row, column) +=
                          penalty * point.weights[a] * point.weights[b] * point.normal[i] * point.normal[j];
                  }
                }
              }
            }
          }
          is_solved = solver.set(K) && solver.solve(left, step);
          if (is_solved) break;
        }
        if (!is_solved) return std::nullopt;
        const double slope = left.dot(step);
        VectorXd tried, there(left.size());
        double way = 1.0, now = 0.0;
        for (int half = 0; half < 30; ++half, way *= 0.5) {
          tried = x;
          for (Index free = 0; free < body.free_dofs(); ++free)
            tried[body.dof_of_free()[free]] += way * step[free];
          now = energy(tried, share, there);
          if (now <= before - 1e-4 * way * slope || there.norm() < 0.5 * left.norm()) break;
        }
        x = tried;
        left = there;
        before = now;
        if (std::abs(slope) < 1e-14 * penalty * 1e-6 || step.norm() < 1e-9 * (x - body.rest()).norm()) break;
      }
      double worst = 0.0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const double off = along(points[k], x) - share * points[k].depth;
        force[k] -= penalty * off;
        worst = std::max(worst, std::abs(off / points[k].depth));
      }
      if (worst < 1e-6) break;
    }
  }
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) sum -= force[k] * points[k].normal;
  return sum;
}

}  // namespace palpate::test
