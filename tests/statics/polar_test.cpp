// The rotation in a deformation gradient, against a singular value decomposition.
#include "statics/polar.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace palpate::polar_test {
namespace {

Mat3 random_matrix(std::mt19937& random, double size) {
  std::normal_distribution<double> entry(0.0, size);
  return Mat3::NullaryExpr([&] { return entry(random); });
}

/// U diag(1, 1, det(U V^T)) V^T.
Mat3 rotation_by_svd(const Mat3& F) {
  const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vec3 signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

void expect_rotation(const Mat3& R) {
  EXPECT_LT((R.transpose() * R - Mat3::Identity()).norm(), 1e-14);
  EXPECT_GT(R.determinant(), 0.0);
}

TEST(Polar, IsTheNearestRotationWhateverTheSizeAndTheSense) {
  std::mt19937 random(1);
  int mirrored = 0;
  for (int k = 0; k < 20000; ++k) {
    const Mat3 F = random_matrix(random, std::pow(10.0, k % 13 - 6));
    const Eigen::JacobiSVD<Mat3> svd(F);
    const Vec3 s = svd.singularValues();
    const bool is_mirrored = F.determinant() < 0.0;
    mirrored += is_mirrored;
    const double gap = s[1] + (is_mirrored ? -s[2] : s[2]);  // how well R is determined
    const Mat3 R = nearest_rotation(F);
    expect_rotation(R);
    EXPECT_LT((R - rotation_by_svd(F)).norm(), 1e-13 * s[0] / gap) << F;
  }
  EXPECT_GT(mirrored, 9000);
}

TEST(Polar, FlatAndCollapsedElementsHaveARotation) {
  std::mt19937 random(2);
  for (int k = 0; k < 1000; ++k) {
    Mat3 F = random_matrix(random, 1.0);
    F.col(2) = F.col(0) - 0.5 * F.col(1);  // flat
    const Mat3 R = nearest_rotation(F);
    expect_rotation(R);
    EXPECT_LT((R - rotation_by_svd(F)).norm(), 1e-6);
    F.col(1) = 2.0 * F.col(0);  // a line
    F.col(2).setZero();
    expect_rotation(nearest_rotation(F));
    expect_rotation(rotation_by_qr(F));
  }
  expect_rotation(nearest_rotation(Mat3::Zero()));
  expect_rotation(nearest_rotation(-Mat3::Identity()));
  expect_rotation(rotation_by_qr(Mat3::Zero()));
}

TEST(Polar, InThePlaneOnlyThePlaneTurns) {
  std::mt19937 random(3);
  for (int k = 0; k < 1000; ++k) {
    Mat3 F = random_matrix(random, 1.0);
    F.row(2) = F.col(2).transpose() = Vec3::UnitZ().transpose();
    const Mat3 R = nearest_rotation_in_plane(F);
    expect_rotation(R);
    EXPECT_EQ(R(2, 2), 1.0);
    const Mat3 S = R.transpose() * F;
    EXPECT_NEAR(S(0, 1), S(1, 0), 1e-14);
    EXPECT_GE(S(0, 0) + S(1, 1), 0.0);
  }
}

TEST(Polar, QrKeepsTheFirstAxis) {
  std::mt19937 random(4);
  for (int k = 0; k < 1000; ++k) {
    const Mat3 F = random_matrix(random, 1.0), Q = rotation_by_qr(F), A = Q.transpose() * F;
    expect_rotation(Q);
    EXPECT_LT(std::abs(A(1, 0)) + std::abs(A(2, 0)) + std::abs(A(2, 1)), 1e-13);
    EXPECT_GT(A(0, 0), 0.0);
    EXPECT_GT(A(1, 1), 0.0);
  }
}

TEST(Polar, AxialVectorIsTheAdjointOfTheCrossProduct) {
  std::mt19937 random(5);
  const Mat3 A = random_matrix(random, 1.0);
  const Vec3 v(0.3, -0.7, 1.1);
  EXPECT_NEAR(v.dot(axial(A)), cross_matrix(v).cwiseProduct(A).sum(), 1e-14);
  EXPECT_LT((cross_matrix(v) * A.col(0) - v.cross(A.col(0))).norm(), 1e-15);
}

}  // namespace
}  // namespace palpate::polar_test
