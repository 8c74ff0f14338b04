#include "statics/live_law.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "statics/polar.h"

namespace palpate {
namespace {

using Vector9 = Eigen::Matrix<double, 9, 1>;

constexpr double least_volume = 0.1;  // J below which the neo-Hookean law is replaced by its continuation

Eigen::Map<const Vector9> as_vector(const Mat3& A) noexcept {
  return Eigen::Map<const Vector9>(A.data());
}

Mat3 unit(int k) noexcept {
  Mat3 A = Mat3::Zero();
  A(k) = 1.0;
  return A;
}

Mat3 sym(const Mat3& A) noexcept {
  return 0.5 * (A + A.transpose());
}

Mat3 hooke(const LawConstants& c, const Mat3& strain) noexcept {
  return c.lambda * strain.trace() * Mat3::Identity() + 2.0 * c.mu * strain;
}

double hooke_energy(const LawConstants& c, const Mat3& strain) noexcept {
  const double trace = strain.trace();
  return c.mu * strain.squaredNorm() + 0.5 * c.lambda * trace * trace;
}

Mat3 rotation_of(LiveLaw law, const LawConstants& c, const Mat3& F) noexcept {
  if (law == LiveLaw::corotational_qr) return rotation_by_qr(F);
  return c.is_plane ? nearest_rotation_in_plane(F) : nearest_rotation(F);
}

/// tr(S) I - S: its inverse maps the axial part of a change of F to the rotation that it causes. Kept away
/// from singular.
Mat3 turning(const Mat3& S) noexcept {
  Mat3 G = S.trace() * Mat3::Identity() - S;
  const double size = S.norm();
  if (!(std::abs(G.determinant()) > 1e-9 * size * size * size)) G.diagonal().array() += 1e-3 * size + 1e-300;
  return G;
}

// --- corotational ---

struct Corotated {
  Mat3 R, S, sigma, inverse_turning;
  Vec3 couple;  // balances moments if the axes of sigma and S differ
};

Corotated corotate(const LawConstants& c, const Mat3& F, const Mat3& relaxed) noexcept {
  Corotated at;
  at.R = rotation_of(LiveLaw::corotational, c, F);
  at.S = sym(at.R.transpose() * F);
  at.sigma = hooke(c, at.S - Mat3::Identity() - relaxed);
  at.inverse_turning = turning(at.S).inverse();
  at.couple = at.inverse_turning * axial(at.S * at.sigma);
  return at;
}

PointTangent corotational_tangent(const LawConstants& c, const Mat3& F, const Mat3& relaxed) noexcept {
  const Corotated at = corotate(c, F, relaxed);
  const Mat3 inner = at.sigma + cross_matrix(at.couple);
  PointTangent C;
  for (int k = 0; k < 9; ++k) {
    const Mat3 A = at.R.transpose() * unit(k);
    const Vec3 turn = at.inverse_turning * axial(A);
    const Mat3 dS = sym(A - cross_matrix(turn) * at.S), dsigma = hooke(c, dS);
    const Vec3 dcouple = at.inverse_turning *
                         (axial(dS * at.sigma + at.S * dsigma) - (dS.trace() * at.couple - dS * at.couple));
    const Mat3 dP = at.R * (cross_matrix(turn) * inner + dsigma + cross_matrix(dcouple));
    C.col(k) = as_vector(dP);
  }
  return C;
}

/// The rotational part is clamped so that no change of F lowers the energy: 2 mu |dF|^2 is at least mu
/// |axial(R^T dF)|^2.
PointTangent positive_corotational_tangent(const LawConstants& c, const Mat3& F,
                                           const Mat3& relaxed) noexcept {
  const Mat3 R = rotation_of(LiveLaw::corotational, c, F), S = sym(R.transpose() * F);
  const double stress = 2.0 * c.mu - c.lambda * (S - Mat3::Identity() - relaxed).trace();
  // RowMajor because no other source has it: of two equal solver types, one of them compiled with fused
  // multiply-add, the linker would keep one for both.
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> eigen;
  eigen.computeDirect(S.trace() * Mat3::Identity() - S);
  const Vec3 share = eigen.eigenvalues().unaryExpr([&](double g) {
    if (stress <= 0.0) return g > 1e-6 ? std::max(stress / g, -1e3 * c.mu) : 0.0;
    return g > stress / c.mu ? stress / g : c.mu;
  });
  const Mat3 H = eigen.eigenvectors() * share.asDiagonal() * eigen.eigenvectors().transpose();
  Eigen::Matrix<double, 3, 9> turned;
  for (int k = 0; k < 9; ++k) turned.col(k) = axial(R.transpose() * unit(k));
  PointTangent C = c.lambda * as_vector(R) * as_vector(R).transpose() - turned.transpose() * H * turned;
  C.diagonal().array() += 2.0 * c.mu;
  return C;
}

/// Tangent of Q sigma for constant Q; Q = I is the linear law.
PointTangent tangent_in_frame(const LawConstants& c, const Mat3& Q) noexcept {
  PointTangent C;
  for (int k = 0; k < 9; ++k) {
    const Mat3 dP = Q * hooke(c, sym(Q.transpose() * unit(k)));
    C.col(k) = as_vector(dP);
  }
  return C;
}

// --- neo-Hookean ---

struct VolumeFunction {
  double value, first, second;  // g and its derivatives
};

/// J^(-2/3), continued by its parabola below `least_volume`.
VolumeFunction shape_factor(double J) noexcept {
  const double at = std::max(J, least_volume), by = std::min(J - least_volume, 0.0);
  const double root = std::cbrt(at), value = 1.0 / (root * root), first = -2.0 / 3.0 * value / at,
               second = -5.0 / 3.0 * first / at;
  return {value + by * (first + 0.5 * by * second), first + by * second, second};
}

Mat3 cofactors(const Mat3& F) noexcept {
  Mat3 C;
  C << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
  return C;
}

PointStress neo_hookean_stress(const LawConstants& c, const Mat3& F) noexcept {
  const Mat3 cof = cofactors(F);
  const double J = F.col(0).dot(cof.col(0)), trace_C = F.squaredNorm();
  const VolumeFunction g = shape_factor(J);
  return {.energy = 0.5 * c.mu * (g.value * trace_C - 3.0) + 0.5 * c.bulk * (J - 1.0) * (J - 1.0),
          .P = c.mu * g.value * F + (0.5 * c.mu * g.first * trace_C + c.bulk * (J - 1.0)) * cof};
}

PointTangent neo_hookean_tangent(const LawConstants& c, const Mat3& F) noexcept {
  const Mat3 cof = cofactors(F);
  const double J = F.col(0).dot(cof.col(0)), trace_C = F.squaredNorm();
  const VolumeFunction g = shape_factor(J);
  const Vector9 f = as_vector(F), n = as_vector(cof);
  PointTangent C = c.mu * g.first * (f * n.transpose() + n * f.transpose()) +
                   (0.5 * c.mu * g.second * trace_C + c.bulk) * n * n.transpose();
  C.diagonal().array() += c.mu * g.value;
  const double pressure = 0.5 * c.mu * g.first * trace_C + c.bulk * (J - 1.0);
  for (Eigen::Index k = 0; k < 9; ++k) {
    const Eigen::Index column = k / 3;
    const Vec3 changed = Vec3::Unit(k % 3);
    const Eigen::Index next = (column + 1) % 3,
                       last = (column + 2) % 3;  // cof: last = column x next, next = last x column
    C.block<3, 1>(3 * last, k) += pressure * changed.cross(F.col(next));
    C.block<3, 1>(3 * next, k) += pressure * F.col(last).cross(changed);
  }
  return C;
}

/// F with the transverse stretch that makes the transverse stress zero.
Mat3 without_stress_across(const LawConstants& c, Mat3 F) noexcept {
  F(2, 2) = 1.0;
  for (int k = 0; k < 30; ++k) {
    const double slope = std::max(neo_hookean_tangent(c, F)(8, 8), 0.1 * c.mu);
    const double change = -neo_hookean_stress(c, F).P(2, 2) / slope;
    F(2, 2) += std::clamp(change, -0.3, 0.3);
    if (std::abs(change) < 1e-15) break;
  }
  return F;
}

/// Condenses the transverse stretch out of the tangent, for plane stress.
void condense_across(PointTangent& C) noexcept {
  if (!(C(8, 8) > 0.0)) return;
  const Vector9 across = C.col(8);
  C -= across * across.transpose() / C(8, 8);
}

void make_positive(const LawConstants& c, PointTangent& C) noexcept {
  const PointTangent shifted = C + 1e-9 * c.mu * PointTangent::Identity();
  // of the upper half: GCC 14 sees the lower one's norm read past its end
  if (Eigen::LLT<PointTangent, Eigen::Upper>(shifted).info() == Eigen::Success) return;
  const Eigen::SelfAdjointEigenSolver<PointTangent> eigen(C);
  C = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
      eigen.eigenvectors().transpose();
}

}  // namespace

const char* name_of(LiveLaw law) noexcept {
  switch (law) {
    case LiveLaw::linear:
      return "linear";
    case LiveLaw::corotational:
      return "corotational";
    case LiveLaw::corotational_qr:
      return "corotational-qr";
    case LiveLaw::neo_hookean:
      return "neo-hookean";
  }
  return "";
}

LawConstants law_constants(const Material& material, Analysis analysis) {
  const double E = material.youngs_modulus, nu = material.poissons_ratio;
  LawConstants c{.mu = E / (2.0 * (1.0 + nu)),
                 .lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
                 .bulk = E / (3.0 * (1.0 - 2.0 * nu)),
                 .is_plane = analysis != Analysis::solid,
                 .is_plane_stress = analysis == Analysis::plane_stress};
  if (c.is_plane_stress) c.lambda = 2.0 * c.mu * c.lambda / (c.lambda + 2.0 * c.mu);
  return c;
}

PointStress stress_at(LiveLaw law, const LawConstants& c, const Mat3& F, const Mat3& relaxed) noexcept {
  if (law == LiveLaw::neo_hookean)
    return neo_hookean_stress(c, c.is_plane_stress ? without_stress_across(c, F) : F);
  if (law == LiveLaw::corotational) {
    const Corotated at = corotate(c, F, relaxed);
    return {.energy = hooke_energy(c, at.S - Mat3::Identity() - relaxed),
            .P = at.R * (at.sigma + cross_matrix(at.couple))};
  }
  const Mat3 Q = law == LiveLaw::linear ? Mat3(Mat3::Identity()) : rotation_of(law, c, F);
  const Mat3 strain = sym(Q.transpose() * F) - Mat3::Identity() - relaxed;
  return {.energy = hooke_energy(c, strain), .P = Q * hooke(c, strain)};
}

PointTangent tangent_at(LiveLaw law, const LawConstants& c, const Mat3& F, const Mat3& relaxed,
                        TangentKind kind) noexcept {
  if (law == LiveLaw::neo_hookean) {
    PointTangent C = neo_hookean_tangent(c, c.is_plane_stress ? without_stress_across(c, F) : F);
    if (c.is_plane_stress) condense_across(C);
    if (kind == TangentKind::positive) make_positive(c, C);
    return C;
  }
  if (law == LiveLaw::corotational)
    return kind == TangentKind::exact ? corotational_tangent(c, F, relaxed)
                                      : positive_corotational_tangent(c, F, relaxed);
  return tangent_in_frame(c, law == LiveLaw::linear ? Mat3(Mat3::Identity()) : rotation_of(law, c, F));
}

Mat3 rotated_strain(LiveLaw law, const LawConstants& c, const Mat3& F) noexcept {
  const Mat3 Q = law == LiveLaw::linear ? Mat3(Mat3::Identity()) : rotation_of(law, c, F);
  return sym(Q.transpose() * F) - Mat3::Identity();
}

}  // namespace palpate
