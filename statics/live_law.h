// Stress and tangent at a point by the deformation gradient there (theory.md section 7).
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "meshes/material.h"
#include "meshes/mesh.h"

namespace palpate {

/// How a live body answers deformation.
enum class LiveLaw : std::uint8_t {
  linear,           ///< small strain: what Green's functions are of
  corotational,     ///< linear in the frame of the nearest rotation
  corotational_qr,  ///< linear in the frame of a QR decomposition, as in Sito's thesis; for comparison
  neo_hookean,  ///< compressible: mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2, as Abaqus and CalculiX have it
  mass_spring,  ///< springs along the elements' edges (springs.h)
};

/// The names that users give: linear, corotational, corotational-qr, neo-hookean, mass-spring.
const char* name_of(LiveLaw law) noexcept;

/// The elastic constants as the laws take them.
struct LawConstants {
  double mu = 0.0;      ///< shear modulus [Pa]
  double lambda = 0.0;  ///< Lame's first; in plane stress the one that leaves no stress across [Pa]
  double bulk = 0.0;    ///< kappa [Pa]
  bool is_plane = false;
  bool is_plane_stress = false;
};

LawConstants law_constants(const Material& material, Analysis analysis);

/// What a law says of a point.
struct PointStress {
  double energy = 0.0;    ///< a unit of volume at rest [J/m^3]
  Mat3 P = Mat3::Zero();  ///< first Piola-Kirchhoff stress, d energy / dF [Pa]
};

/// The derivative of P's columns, one below the other, by F's [9 x 9] [Pa].
using PointTangent = Eigen::Matrix<double, 9, 9>;

enum class TangentKind : std::uint8_t {
  exact,     ///< the derivative of P
  positive,  ///< one near it without negative eigenvalues: its steps go downhill
};

/// Energy and stress at F, in the plane with F_33 = 1. `relaxed` [3 x 3] is the strain, in the rotated frame,
/// at which there is no stress: initial and plastic; of linear and corotational laws. Finite for every finite
/// F: the neo-Hookean law goes on smoothly where the volume is below a tenth of what it was. Not for
/// mass_spring. Of the corotational law P is the exact derivative of the energy, also where relaxed strain is
/// turned against the stretch: then it has a part beside R sigma that keeps moments in balance.
PointStress stress_at(LiveLaw law, const LawConstants& constants, const Mat3& F,
                      const Mat3& relaxed) noexcept;

/// The tangent there. Of corotational_qr it leaves out how Q turns.
PointTangent tangent_at(LiveLaw law, const LawConstants& constants, const Mat3& F, const Mat3& relaxed,
                        TangentKind kind) noexcept;

/// The strain that yields, in the rotated frame: epsilon~ = (F~ + F~^T) / 2 - I.
Mat3 rotated_strain(LiveLaw law, const LawConstants& constants, const Mat3& F) noexcept;

}  // namespace palpate
