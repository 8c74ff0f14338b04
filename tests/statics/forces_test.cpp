// Internal forces of live bodies: against their energy, their tangent, rigid motion and small strain.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "base/error.h"
#include "meshes/element.h"
#include "tests/support/bodies/live_bodies.h"
#include "tests/support/second_routes/dense_algebra.h"

namespace palpate::live_forces_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Kind {
  ElementType element;
  LiveLaw law;
  Analysis analysis = Analysis::solid;
  double plastic = 0.0;
};

std::vector<Kind> all_kinds() {
  std::vector<Kind> kinds;
  for (const LiveLaw law : {LiveLaw::linear, LiveLaw::corotational, LiveLaw::neo_hookean}) {
    kinds.push_back({ElementType::tet4, law});
    kinds.push_back({ElementType::tri3, law, Analysis::plane_strain});
    kinds.push_back({ElementType::tri3, law, Analysis::plane_stress});
    for (const ElementType element : {ElementType::tet10, ElementType::hex8}) kinds.push_back({element, law});
    kinds.push_back({ElementType::quad4, law, Analysis::plane_strain});
  }
  for (const LiveLaw law : {LiveLaw::linear, LiveLaw::corotational}) {
    kinds.push_back({ElementType::tet4, law, Analysis::solid, 0.2});
    kinds.push_back({ElementType::tri3, law, Analysis::plane_stress, 0.2});
  }
  return kinds;
}

LiveBody body_of(const Kind& kind, LiveLaw law) {
  return LiveBody(test::live_block(kind.element, kind.analysis), {.law = law});
}

std::string text_of(const Kind& kind) {
  return std::string(name_of(kind.law)) + " " + traits(kind.element).name + " " +
         std::to_string(static_cast<int>(kind.analysis)) + (kind.plastic > 0.0 ? " plastic" : "");
}

MatrixXd full(const LiveMatrix& K) {
  return MatrixXd(LiveMatrix(K.selfadjointView<Eigen::Lower>()));
}

/// dE/dx along a direction, by five points.
double slope_of_energy(const LiveBody& body, const VectorXd& x, const std::vector<Mat3>& plastic,
                       const VectorXd& direction, double h) {
  VectorXd f;
  const auto energy = [&](double t) { return internal_forces(body, x + t * direction, plastic, f).energy; };
  return (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h))) / (12.0 * h);
}

TEST(LiveForces, AreTheDerivativeOfTheEnergy) {
  for (const Kind& kind : all_kinds()) {
    const LiveBody body = body_of(kind, kind.law);
    const std::vector<Mat3> plastic =
        kind.plastic > 0.0 ? test::random_strain(body, kind.plastic, 5) : std::vector<Mat3>{};
    const VectorXd x = test::shaken(body, 1.5e-3, 1);
    VectorXd f;
    internal_forces(body, x, plastic, f);
    for (unsigned seed = 2; seed < 7; ++seed) {
      const VectorXd direction = test::shaken(body, 1.0, seed) - body.rest();
      const double slope = slope_of_energy(body, x, plastic, direction, 2e-6);
      EXPECT_NEAR(-f.dot(direction) / slope, 1.0, 1e-8) << text_of(kind);
    }
  }
}

TEST(LiveForces, ExactTangentIsTheDerivativeOfTheForces) {
  for (const Kind& kind : all_kinds()) {
    const LiveBody body = body_of(kind, kind.law);
    const std::vector<Mat3> plastic =
        kind.plastic > 0.0 ? test::random_strain(body, kind.plastic, 5) : std::vector<Mat3>{};
    const VectorXd x = test::shaken(body, 1.5e-3, 1);
    LiveMatrix K;
    assemble_tangent(body, x, plastic, TangentKind::exact, K);
    for (unsigned seed = 2; seed < 5; ++seed) {
      const VectorXd direction = test::shaken(body, 1.0, seed) - body.rest();
      const double h = 2e-6;
      std::array<VectorXd, 4> f;
      const std::array<double, 4> at = {-2 * h, -h, h, 2 * h};
      for (std::size_t k = 0; k < 4; ++k) internal_forces(body, x + at[k] * direction, plastic, f[k]);
      const VectorXd change = (8.0 * (f[2] - f[1]) - (f[3] - f[0])) / (12.0 * h);
      EXPECT_LT((full(K) * direction + change).norm(), 1e-8 * change.norm()) << text_of(kind);
    }
  }
}

TEST(LiveForces, PositiveTangentIsSoEvenWhereElementsAreInverted) {
  for (const Kind& kind : all_kinds()) {
    if (kind.element == ElementType::tet10 || kind.element == ElementType::hex8) continue;
    const LiveBody body = body_of(kind, kind.law);
    const VectorXd x = test::shaken(body, 2e-2, 3);  // twice an edge
    VectorXd f;
    EXPECT_GT(internal_forces(body, x, {}, f).inverted, 3) << text_of(kind);
    EXPECT_TRUE(f.allFinite());
    LiveMatrix K;
    assemble_tangent(body, x, {}, TangentKind::positive, K);
    const VectorXd eigenvalues = test::eigenvalues_of(full(K));
    EXPECT_GT(eigenvalues.minCoeff(), -1e-9 * eigenvalues.maxCoeff()) << text_of(kind);
  }
}

/// Turns and shifts positions.
VectorXd moved(const VectorXd& x, int d, double angle, const Vec3& by) {
  const Vec3 axis = d == 2 ? Vec3(0, 0, 1) : Vec3(1, -2, 0.5).normalized();
  const Mat3 R = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  VectorXd y = x;
  for (Eigen::Index k = 0; k < x.size(); k += d) {
    Vec3 at = Vec3::Zero();
    at.head(d) = x.segment(k, d);
    y.segment(k, d) = (R * at + by).head(d);
  }
  return y;
}

TEST(LiveForces, RigidMotionGivesNone) {
  for (const Kind& kind : all_kinds()) {
    for (const LiveLaw law : {kind.law, LiveLaw::corotational_qr}) {
      if (law == LiveLaw::linear || kind.plastic > 0.0) continue;
      const LiveBody body = body_of(kind, law);
      for (const double angle : {0.1, 1.0, 2.5, 3.14159}) {
        VectorXd f;
        const ForceSums sums =
            internal_forces(body, moved(body.rest(), body.dimension(), angle, Vec3(1, -2, 3)), {}, f);
        EXPECT_LT(f.lpNorm<Eigen::Infinity>(), 1e-12) << text_of(kind);  // [N]; a squeeze by 1 % takes 0.02 N
        EXPECT_LT(sums.energy, 1e-16);
        EXPECT_EQ(sums.inverted, 0);
      }
    }
  }
}

TEST(LiveForces, TurnWithTheBody) {
  for (const Kind& kind : all_kinds()) {
    if (kind.law == LiveLaw::linear) continue;
    const LiveBody body = body_of(kind, kind.law);
    const std::vector<Mat3> plastic =
        kind.plastic > 0.0 ? test::random_strain(body, kind.plastic, 5) : std::vector<Mat3>{};
    const VectorXd x = test::shaken(body, 3e-3, 8);
    VectorXd f, turned;
    internal_forces(body, x, plastic, f);
    internal_forces(body, moved(x, body.dimension(), 1.2, Vec3::Zero()), plastic, turned);
    EXPECT_LT((turned - moved(f, body.dimension(), 1.2, Vec3::Zero())).norm(), 1e-11 * f.norm())
        << text_of(kind);
  }
}

/// Sum of x cross f.
Vec3 moment(const VectorXd& x, const VectorXd& f, int d) {
  Vec3 sum = Vec3::Zero();
  for (Eigen::Index k = 0; k < x.size(); k += d) {
    Vec3 at = Vec3::Zero(), force = Vec3::Zero();
    at.head(d) = x.segment(k, d);
    force.head(d) = f.segment(k, d);
    sum += at.cross(force);
  }
  return sum;
}

TEST(LiveForces, HaveNoSumAndNoMoment) {
  for (const Kind& kind : all_kinds()) {
    if (kind.law == LiveLaw::linear) continue;
    const LiveBody body = body_of(kind, kind.law);
    const std::vector<Mat3> plastic =
        kind.plastic > 0.0 ? test::random_strain(body, kind.plastic, 5) : std::vector<Mat3>{};
    const VectorXd x = test::shaken(body, 8e-3, 8);  // some inverted
    VectorXd f;
    internal_forces(body, x, plastic, f);
    EXPECT_LT(moment(x, f, body.dimension()).norm(), 1e-13 * f.norm()) << text_of(kind);
    for (int axis = 0; axis < body.dimension(); ++axis) {
      const VectorXd along = f(Eigen::seq(axis, Eigen::last, body.dimension()));
      EXPECT_LT(std::abs(along.sum()), 1e-12 * f.norm());
    }
  }
}

/// K of the elements of meshes/.
MatrixXd linear_stiffness(const LiveInput& input) {
  const int d = input.mesh.dimension();
  MatrixXd K = MatrixXd::Zero(d * std::ssize(input.mesh.nodes), d * std::ssize(input.mesh.nodes));
  for (Index e = 0; e < input.mesh.elements(); ++e) {
    const ElementMatrix K_e =
        element_stiffness(input.mesh.element, element_nodes(input.mesh, e),
                          elasticity_matrix(input.materials[0], input.analysis), input.thickness);
    const auto nodes = input.mesh.element_nodes(e);
    for (Eigen::Index a = 0; a < std::ssize(nodes); ++a) {
      for (Eigen::Index b = 0; b < std::ssize(nodes); ++b)
        K.block(d * nodes[a], d * nodes[b], d, d) += K_e.block(d * a, d * b, d, d);
    }
  }
  return K;
}

TEST(LiveForces, AllLawsAreHookesAtSmallStrain) {
  for (const Kind& kind : all_kinds()) {
    const LiveInput input = test::live_block(kind.element, kind.analysis);
    const MatrixXd K = linear_stiffness(input);
    const LiveBody body(input, {.law = kind.law});
    LiveMatrix tangent;
    for (const TangentKind which : {TangentKind::exact, TangentKind::positive}) {
      assemble_tangent(body, body.rest(), {}, which, tangent);
      EXPECT_LT((full(tangent) - K).norm(), 1e-9 * K.norm()) << text_of(kind);
    }
  }
}

TEST(LiveForces, HeldDofsAreLeftOut) {
  LiveInput input = test::live_block(ElementType::tet4);
  test::hold(
      input, [](const Vec3& x) { return x.x() < 1e-9; }, 7);
  test::hold(
      input, [](const Vec3& x) { return x.y() < 1e-9; }, 2);
  const MatrixXd K = linear_stiffness(input);
  const LiveBody body(input, {.law = LiveLaw::corotational});
  LiveMatrix tangent;
  assemble_tangent(body, body.rest(), {}, TangentKind::exact, tangent);
  ASSERT_LT(body.free_dofs(), body.dofs());
  const std::vector<Eigen::Index> free(body.dof_of_free().begin(), body.dof_of_free().end());
  EXPECT_LT((full(tangent) - K(free, free)).norm(), 1e-9 * K.norm());
}

TEST(LiveForces, InitialStrainIsWhereStressEnds) {
  LiveInput input = test::live_block(ElementType::tet4);
  input.materials[0].initial_strain = {0.01, 0.02, -0.01, 0.01, 0.0, 0.02};
  const Mat3 stretch =
      Mat3::Identity() + (Mat3() << 0.01, 0.005, 0.01, 0.005, 0.02, 0.0, 0.01, 0.0, -0.01).finished();
  for (const LiveLaw law : {LiveLaw::linear, LiveLaw::corotational}) {
    const LiveBody body(input, {.law = law});
    VectorXd x = body.rest(), f;
    for (Eigen::Index k = 0; k < x.size(); k += 3) x.segment(k, 3) = stretch * body.rest().segment(k, 3);
    internal_forces(body, x, {}, f);
    EXPECT_LT(f.norm(), 1e-13);
  }
  EXPECT_THROW(LiveBody(input, {.law = LiveLaw::neo_hookean}), Error);
}

TEST(LiveForces, SillyOptionsAreRefused) {
  const LiveInput block = test::live_block(ElementType::tet4);
  EXPECT_THROW(LiveBody(block, {.plasticity = {.yield = -0.1, .creep = 1.0}}), Error);
  EXPECT_THROW(LiveBody(block, {.plasticity = {.yield = 0.1, .creep = -1.0}}), Error);
  EXPECT_THROW(LiveBody(block, {.law = LiveLaw::neo_hookean, .plasticity = {.yield = 0.1, .creep = 1.0}}),
               Error);
  EXPECT_THROW(LiveBody(block, {.damping = {.mass = -1.0}}), Error);
  EXPECT_THROW(LiveBody(block, {.gravity = Vec3(0, 0, std::nan(""))}), Error);
}

}  // namespace
}  // namespace palpate::live_forces_test
