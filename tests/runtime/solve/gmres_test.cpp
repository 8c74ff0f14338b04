// GMRES against Eigen's dense solvers.
#include "runtime/core/solve/gmres.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace palpate::gmres_test {
namespace {

constexpr int size = 40;
constexpr std::ptrdiff_t stride = 48;

/// Not symmetric, and its eigenvalues are spread.
struct System {
  System() : A(size, size), P(size, size), b(size) {
    std::mt19937 random(5);
    std::normal_distribution<float> entry;
    A = Eigen::MatrixXf::NullaryExpr(size, size, [&] { return 0.1F * entry(random); });
    for (int i = 0; i < size; ++i) A(i, i) += 1.0F + 0.2F * static_cast<float>(i);
    P = A.diagonal().cwiseInverse().asDiagonal();
    b = Eigen::VectorXf::NullaryExpr(size, [&] { return entry(random); });
  }

  /// The y of at most `steps` steps, and how many there were.
  Eigen::VectorXf solve(Gmres& gmres, int steps, float tolerance) {
    Eigen::Map<Eigen::VectorXf>(gmres.first(), size) = b;
    gmres.begin(size, steps, tolerance);
    while (!gmres.done()) {
      Eigen::Map<Eigen::VectorXf> image(gmres.image(), size);
      image = P * Eigen::Map<const Eigen::VectorXf>(gmres.newest(), size);
      Eigen::Map<Eigen::VectorXf>(gmres.next(), size) = A * image;
      gmres.expand();
    }
    Eigen::VectorXf y(size);
    gmres.solve(y.data());
    return y;
  }

  [[nodiscard]] float residual(const Eigen::VectorXf& y) const { return (b - A * y).norm(); }

  Eigen::MatrixXf A, P;
  Eigen::VectorXf b;
};

TEST(Gmres, SolvesASystem) {
  System system;
  Gmres gmres(stride, size);
  const Eigen::VectorXf y = system.solve(gmres, size, 1e-5F * system.b.norm());
  const Eigen::VectorXf exact = system.A.lu().solve(system.b);
  EXPECT_LT((y - exact).norm(), 1e-4F * exact.norm());
}

TEST(Gmres, HasTheSmallestResidualOfItsSpace) {
  System system;
  Gmres gmres(stride, size);
  Eigen::MatrixXd space(size, 0);
  Eigen::VectorXd next = system.b.cast<double>();
  const Eigen::MatrixXd A = system.A.cast<double>(), P = system.P.cast<double>();
  for (int steps = 1; steps <= 6; ++steps) {
    space.conservativeResize(Eigen::NoChange, steps);
    space.col(steps - 1) = P * next.normalized();
    next = A * space.col(steps - 1);
    const Eigen::MatrixXd images = A * space;
    const Eigen::VectorXd best = space * images.colPivHouseholderQr().solve(system.b.cast<double>());
    const double least = (system.b.cast<double>() - A * best).norm();
    const Eigen::VectorXf y = system.solve(gmres, steps, 0.0F);
    EXPECT_EQ(gmres.steps(), steps);
    EXPECT_NEAR(system.residual(y), least, 1e-6 * system.b.norm()) << steps;  // rounding in single precision
  }
}

TEST(Gmres, EndsAtItsTolerance) {
  System system;
  Gmres gmres(stride, size);
  const float tolerance = 0.01F * system.b.norm();
  EXPECT_LE(system.residual(system.solve(gmres, size, tolerance)), 1.001F * tolerance);
  const int steps = gmres.steps();
  EXPECT_LT(steps, size / 2);
  EXPECT_GT(system.residual(system.solve(gmres, steps - 1, 0.0F)), tolerance) << "not a step too many";
}

TEST(Gmres, EndsWhereNothingIsLeft) {
  System system;
  system.A.setIdentity();
  system.P.setIdentity();
  Gmres gmres(stride, size);
  EXPECT_LT((system.solve(gmres, size, 1e-6F * system.b.norm()) - system.b).norm(), 1e-6F * system.b.norm());
  EXPECT_EQ(gmres.steps(), 1);
  system.b.setZero();
  EXPECT_TRUE(system.solve(gmres, size, 1e-6F).isZero(0.0F));
  EXPECT_EQ(gmres.steps(), 0);
}

}  // namespace
}  // namespace palpate::gmres_test
