// Two levels against the whole body solved with large strain, its contact nodes held in the same places.
#include "runtime/depth/two_levels.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <cmath>
#include <memory>
#include <numbers>

#include "meshes/generate.h"
#include "runtime/body/body.h"
#include "statics/balance.h"
#include "statics/live_forces.h"
#include "tests/support/bodies/bent_bodies.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::two_levels_test {
namespace {

constexpr double length = 0.2, width = 0.02;  // [m]

/// A bar along x, held at x = 0. E = 1 Pa, nu = 0.3.
Model bar(ElementType type = ElementType::tet4) {
  return test::bake(
      generate(BoxShape{Vec3::Zero(), Vec3(length, width, width), {20, 2, 2}}, type),
      [](const Vec3& x) { return x.x() < 1e-9; }, Scope::surface, Precision::double_precision);
}

Index stored_at(const Model& model, const Vec3& x) {
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k) {
    if ((model.mesh.nodes[static_cast<std::size_t>(model.stored_nodes[k])] - x).norm() < 1e-9)
      return static_cast<Index>(k);
  }
  ADD_FAILURE() << "there is no such node";
  return 0;
}

Vec3 sum(const std::vector<double>& f) {
  Vec3 total = Vec3::Zero();
  for (std::size_t k = 0; k < f.size(); k += 3) total += Vec3(f[k], f[k + 1], f[k + 2]);
  return total;
}

std::vector<double> same(const Vec3& u, std::size_t nodes) {
  std::vector<double> all;
  for (std::size_t k = 0; k < nodes; ++k) all.insert(all.end(), u.begin(), u.end());
  return all;
}

/// A body of large strain whose nodes are moved along all axes, in steps.
class Whole {
 public:
  Whole(const Model& model, const std::vector<Index>& nodes) : model_(model), nodes_(nodes) {
    LiveInput input = live_input(model);
    input.fixed.resize(input.mesh.nodes.size(), 0);
    for (const Index node : nodes) input.fixed[static_cast<std::size_t>(node)] = 7;
    body_ = std::make_unique<LiveBody>(input, LiveOptions{.law = LiveLaw::neo_hookean});
    x_ = body_->start();
  }

  /// Moves each node by its `to` [m] in all; the forces that this takes [N].
  std::vector<double> move(const std::vector<double>& to, int parts) {
    moved_.resize(to.size());
    for (int part = 1; part <= parts; ++part) {
      for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const Vec3 from = vector_at(moved_, 3, static_cast<Index>(k)),
                   there = vector_at(to, 3, static_cast<Index>(k));
        x_.segment(3 * Eigen::Index{nodes_[k]}, 3) = model_.mesh.nodes[static_cast<std::size_t>(nodes_[k])] +
                                                     from +
                                                     static_cast<double>(part) / parts * (there - from);
      }
      const BalanceReport report = find_balance(*body_, Eigen::VectorXd::Zero(body_->dofs()), {}, x_,
                                                {.tolerance = 1e-8, .most_steps = 300});
      EXPECT_LT(report.residual, 1e-6);
    }
    moved_ = to;
    Eigen::VectorXd f;
    internal_forces(*body_, x_, {}, f);
    std::vector<double> forces;
    for (const Index node : nodes_) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) forces.push_back(-f[3 * Eigen::Index{node} + axis]);
    }
    return forces;
  }
  [[nodiscard]] Vec3 displacement(Index node) const {
    return (x_ - body_->rest()).segment(3 * Eigen::Index{node}, 3);
  }

 private:
  const Model& model_;
  std::vector<Index> nodes_;
  std::unique_ptr<LiveBody> body_;
  Eigen::VectorXd x_;
  std::vector<double> moved_;
};

class TwoLevelBar : public testing::Test {
 protected:
  TwoLevelBar()
      : model(bar()),
        body(Model(model)),
        parts(test::coarse_parts(model, LiveLaw::neo_hookean, 300)),
        levels(parts, body.shared_greens()),
        tip(stored_at(model, Vec3(length, 0.5 * width, 0.5 * width))) {}

  Model model;
  Body body;
  CoarseParts parts;
  TwoLevels levels;
  Index tip;
};

// The tip pushed in beyond buckling, and far down: small strain is off by a factor there.
TEST_F(TwoLevelBar, FeelsAsTheWholeBodyWhereItBucklesAndBends) {
  Whole whole(model, {model.stored_nodes[static_cast<std::size_t>(tip)]});
  const Eigen::Matrix3d Xi = body.greens().block(tip, tip);
  std::vector<double> f(3, 0.0);
  double worst = 0.0, worst_of_linear = 0.0;
  for (const Vec3& to :
       {Vec3(-0.004, 0.0, 0.0), Vec3(-0.004, 0.0, -0.02), Vec3(-0.01, 0.0, -0.04), Vec3(-0.03, 0.0, -0.1)}) {
    const Vec3 truth = sum(whole.move(same(to, 1), 20));
    const TwoLevelReport report = levels.find(std::vector<Index>{tip}, f, same(to, 1), 1e-8, 60);
    EXPECT_LT(report.residual, 1e-6);
    f = levels.forces();
    const double error = (sum(f) - truth).norm() / truth.norm(),
                 of_linear = (Xi.inverse() * to - truth).norm() / truth.norm();
    double off = 0.0;
    for (std::size_t k = 0; k < model.stored_nodes.size(); ++k) {
      off = std::max(off, (vector_at(levels.displacement(), 3, static_cast<Index>(k)) -
                           whole.displacement(model.stored_nodes[k]))
                              .norm());
    }
    std::printf("tip at (%g, %g) mm: %.4g N, two levels %.2f %% off, small strain %.0f %%; surface %.2f %%\n",
                1e3 * to.x(), 1e3 * to.z(), truth.norm(), 100.0 * error, 100.0 * of_linear,
                100.0 * off / to.norm());
    worst = std::max(worst, error);
    worst_of_linear = std::max(worst_of_linear, of_linear);
    EXPECT_LT(off, 0.05 * to.norm());
  }
  EXPECT_LT(worst, 0.05);
  EXPECT_GT(worst_of_linear, 5.0);
}

// A hand holds the end of the bar and turns it: about its axis, and across it. Small strain stretches what
// turns.
TEST_F(TwoLevelBar, FeelsAsTheWholeBodyWhereItsEndIsTurned) {
  const Vec3 centre(length, 0.5 * width, 0.5 * width);
  std::vector<Index> held, nodes;
  for (std::size_t k = 0; k < model.stored_nodes.size(); ++k) {
    const Index node = model.stored_nodes[k];
    if (model.mesh.nodes[static_cast<std::size_t>(node)].x() < length - 1e-9) continue;
    held.push_back(static_cast<Index>(k));
    nodes.push_back(node);
  }
  ASSERT_EQ(held.size(), 9U);
  Eigen::MatrixXd Xi(27, 27);
  for (Eigen::Index a = 0; a < 9; ++a) {
    for (Eigen::Index b = 0; b < 9; ++b)
      Xi.block<3, 3>(3 * a, 3 * b) =
          body.greens().block(held[static_cast<std::size_t>(a)], held[static_cast<std::size_t>(b)]);
  }
  const auto turned = [&](const Mat3& R) {
    std::vector<double> u;
    for (const Index node : nodes) {
      const Vec3 out = model.mesh.nodes[static_cast<std::size_t>(node)] - centre, moved = R * out - out;
      u.insert(u.end(), moved.begin(), moved.end());
    }
    return u;
  };
  const auto torque = [&](const std::vector<double>& f, const std::vector<double>& u) {
    Vec3 all = Vec3::Zero();
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const auto at = static_cast<Index>(k);
      const Vec3 arm = model.mesh.nodes[static_cast<std::size_t>(nodes[k])] + vector_at(u, 3, at) - centre;
      all += arm.cross(vector_at(f, 3, at));
    }
    return all;
  };
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0)}) {
    Whole whole(model, nodes);
    levels.rest();
    std::vector<double> f(27, 0.0);
    for (const int degrees : {5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60}) {
      const std::vector<double> u =
          turned(Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis).toRotationMatrix());
      const std::vector<double> truth = whole.move(u, 4);
      const TwoLevelReport report = levels.find(held, f, u, 1e-8, 60);
      EXPECT_LT(report.residual, 1e-6);
      f = levels.forces();
      if (degrees % 15 != 0 && degrees != 40) continue;
      const Eigen::VectorXd linear = Xi.ldlt().solve(Eigen::Map<const Eigen::VectorXd>(u.data(), 27));
      const auto error = [&](const std::vector<double>& found) {
        return ((torque(found, u) - torque(truth, u)).norm() + length * (sum(found) - sum(truth)).norm()) /
               (torque(truth, u).norm() + length * sum(truth).norm());
      };
      const double two_levels_off = error(f), linear_off = error({linear.begin(), linear.end()});
      std::printf("end turned by %d degrees: %.4g Nm, %.4g N, two levels %.2f %% off, small strain %.0f %%\n",
                  degrees, torque(truth, u).norm(), sum(truth).norm(), 100.0 * two_levels_off,
                  100.0 * linear_off);
      EXPECT_LT(two_levels_off, 0.05);
    }
  }
}

// Of small loads it is Xi f, with an error that falls with their square.
TEST_F(TwoLevelBar, IsSmallStrainOfSmallLoads) {
  const std::vector<Index> nodes = {tip};
  const Eigen::Matrix3d Xi = body.greens().block(tip, tip);
  std::vector<double> errors;
  for (const double size : {2e-5, 1e-5}) {
    levels.rest();
    const Vec3 to = size * Vec3(0.3, 0.5, -0.8);
    const Vec3 small_strain =
        levels.find(nodes, std::vector<double>(3, 0.0), same(to, 1), 1e-12, 60).small_strain;
    errors.push_back((Xi * sum(levels.forces()) - to).norm());
    const Vec3 along = sum(levels.forces()).normalized();
    EXPECT_NEAR(along.dot(Xi * small_strain), along.dot(to), 1e-4 * size);
    EXPECT_NEAR(small_strain.norm() / sum(levels.forces()).norm(), 1.0, 0.02);
  }
  EXPECT_LT(errors[0], 0.02 * 2e-5);
  EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.5);
}

// The tick's compliance is the derivative of the balance, in a state that is turned and bent by several
// nodes.
TEST_F(TwoLevelBar, ComplianceIsTheDerivative) {
  std::vector<Index> nodes = {tip};
  for (const Vec3& x : {Vec3(length, 0.0, width), Vec3(0.6 * length, 0.5 * width, width)})
    nodes.push_back(stored_at(model, x));
  std::vector<double> f(9, 0.0), u = same(Vec3(-0.001, 0.002, -0.03), 2);
  for (const double value : {-0.001, 0.001, -0.0128}) u.push_back(value);
  for (int part = 1; part <= 20; ++part) {
    std::vector<double> there = u;
    for (double& value : there) value *= std::min(1.0, part / 10.0);
    levels.find(nodes, f, there, 1e-10, 60);
    f = levels.forces();
  }
  const Index beside = stored_at(model, Vec3(0.5 * length, 0.0, 0.0));  // prepared, and not loaded
  const auto W = two_levels(body.shared_greens(), levels.state({tip, beside}));
  Eigen::MatrixXd C(9, 9);
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b)
      C.block<3, 3>(3 * a, 3 * b) =
          W->block(nodes[static_cast<std::size_t>(a)], nodes[static_cast<std::size_t>(b)]);
  }
  EXPECT_LT((C - C.transpose()).norm(), 1e-9 * C.norm());
  for (std::size_t dof = 0; dof < 9; ++dof) {
    TwoLevels other = levels;
    constexpr double h = 2e-6;
    std::vector<double> moved = u;
    moved[dof] += h;
    other.find(nodes, f, moved, 1e-12, 60);
    Eigen::VectorXd by_force(9), change(9);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = static_cast<Index>(k);
      by_force.segment<3>(3 * at) =
          (vector_at(other.forces(), 3, at) - vector_at(levels.forces(), 3, at)) / h;
      change.segment<3>(3 * at) =
          (vector_at(other.displacement(), 3, nodes[k]) - vector_at(levels.displacement(), 3, nodes[k])) / h;
    }
    EXPECT_GT(change.norm(), 0.5);
    EXPECT_LT((C * by_force - change).norm(), 0.02 * change.norm()) << dof;
  }
  // displacement() is gather() summed, for nodes that are prepared and those that are not, few and many
  for (const bool all_are_loaded : {false, true}) {
    while (all_are_loaded && std::ssize(nodes) < W->nodes()) {
      nodes.push_back(static_cast<Index>(std::ssize(nodes)));
      for (const double force : {1.0, -2.0, 0.5})
        f.push_back(1e-3 * force * std::cos(static_cast<double>(nodes.size())));
    }
    std::vector<double> all(static_cast<std::size_t>(W->order()));
    W->displacement(nodes, f, all);
    for (Index node = 0; node < W->nodes(); node += 7) {
      Vec3 by_blocks = Vec3::Zero();
      for (std::size_t k = 0; k < nodes.size(); ++k)
        by_blocks += W->block(node, nodes[k]) * vector_at(f, 3, static_cast<Index>(k));
      EXPECT_LT((by_blocks - vector_at(all, 3, node)).norm(), 1e-9 * by_blocks.norm());
    }
  }
  ASSERT_GT(nodes.size(), 128U);  // more than are turned at a time
}

// The energy of a field that turns the body as a whole is 0, and its tangent is the gradient's derivative.
TEST(CoarseBody, HasNoEnergyOfATurnAndTheRightDerivatives) {
  LiveInput input = live_input(bar(ElementType::hex8));
  input.fixed.assign(input.fixed.size(), 0);
  const auto fine = std::make_shared<const LiveBody>(input, LiveOptions{.law = LiveLaw::neo_hookean});
  const CoarseField field = coarse_field(3, input.mesh.nodes, 200);
  const CoarseBody coarse(*fine, field);
  const Mat3 R = Eigen::AngleAxisd(2.0, Vec3(1, 2, -2) / 3.0).toRotationMatrix();
  // q of u = R x - x by least squares over the mesh's nodes
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(std::ssize(input.mesh.nodes), field.nodes());
  Eigen::MatrixXd u(std::ssize(input.mesh.nodes), 3);
  for (Eigen::Index k = 0; k < u.rows(); ++k) {
    const Vec3& x = input.mesh.nodes[static_cast<std::size_t>(k)];
    field.for_each_node(field.place(x), [&](Index node, double weight, const Vec3&) { P(k, node) = weight; });
    u.row(k) = (R * x - x).transpose();
  }
  const Eigen::MatrixXd by_node = P.colPivHouseholderQr().solve(u);
  Eigen::VectorXd q(field.dofs());
  for (Eigen::Index k = 0; k < field.nodes(); ++k) q.segment<3>(3 * k) = by_node.row(k).transpose();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(q.size());
  EXPECT_LT(coarse.energy(q, &gradient), 1e-15);
  EXPECT_LT(gradient.norm(), 1e-10);

  for (Eigen::Index k = 0; k < q.size(); ++k) q[k] += 2e-3 * std::sin(3.0 * static_cast<double>(k));
  const Eigen::MatrixXd K = coarse.tangent(q);
  gradient.setZero();
  coarse.energy(q, &gradient);
  Eigen::VectorXd step(q.size());
  for (Eigen::Index k = 0; k < q.size(); ++k) step[k] = 1e-7 * std::cos(5.0 * static_cast<double>(k));
  Eigen::VectorXd there = Eigen::VectorXd::Zero(q.size()), back = there;
  const double rise = coarse.energy(q + step, &there) - coarse.energy(q - step, &back);
  EXPECT_NEAR(rise / (2.0 * gradient.dot(step)), 1.0, 1e-5);
  EXPECT_LT((0.5 * (there - back) - K * step).norm(), 5e-3 * (K * step).norm());  // rotations turn on
}

}  // namespace
}  // namespace palpate::two_levels_test
