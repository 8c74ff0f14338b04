#include "statics/live_forces.h"

#include <Eigen/LU>
#include <algorithm>

#include "meshes/element.h"

namespace palpate {
namespace {

using NodeColumns = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, max_element_nodes>;

/// Positions of an element's nodes relative to its first, without loss of digits far from the origin.
NodeColumns relative_positions(const LiveBody& body, const Eigen::VectorXd& x, Index element) noexcept {
  const std::span<const Index> nodes = body.mesh().element_nodes(element);
  const Eigen::Index d = body.dimension();
  NodeColumns columns = NodeColumns::Zero(3, std::ssize(nodes));
  const auto first = x.segment(d * Eigen::Index{nodes[0]}, d);
  for (Eigen::Index k = 1; k < std::ssize(nodes); ++k)
    columns.col(k).head(d) = x.segment(d * Eigen::Index{nodes[k]}, d) - first;
  return columns;
}

Mat3 gradient_at(const LiveBody& body, const NodeColumns& columns, Index point) noexcept {
  Mat3 F = Mat3::Zero();
  const auto gradients = body.gradients(point);
  for (Eigen::Index k = 1; k < columns.cols(); ++k) F += columns.col(k) * gradients.col(k).transpose();
  if (body.dimension() == 2) F(2, 2) = 1.0;
  return F;
}

Mat3 relaxed_strain(const LiveBody& body, std::span<const Mat3> plastic, Index element,
                    Index point) noexcept {
  return plastic.empty() ? body.initial_strain(element) : Mat3(body.initial_strain(element) + plastic[point]);
}

void add_entries(std::span<const Index> places, const auto& K_cell, double* values) noexcept {
  std::size_t entry = 0;
  for (Eigen::Index p = 0; p < K_cell.rows(); ++p) {
    for (Eigen::Index q = 0; q <= p; ++q, ++entry) {
      if (places[entry] >= 0) values[places[entry]] += K_cell(p, q);
    }
  }
}

/// K_e += w grad N_a . C . grad N_b for b <= a.
void add_point(const PointTangent& C, const Eigen::Map<const Eigen::Matrix3Xd>& gradients, double weight,
               Eigen::Index d, ElementMatrix& K_e) noexcept {
  for (Eigen::Index a = 0; a < gradients.cols(); ++a) {
    Eigen::Matrix<double, 3, 9> T = gradients(0, a) * C.topRows<3>() + gradients(1, a) * C.middleRows<3>(3) +
                                    gradients(2, a) * C.bottomRows<3>();
    T *= weight;
    for (Eigen::Index b = 0; b <= a; ++b) {
      const Mat3 block = gradients(0, b) * T.leftCols<3>() + gradients(1, b) * T.middleCols<3>(3) +
                         gradients(2, b) * T.rightCols<3>();
      K_e.block(d * a, d * b, d, d) += block.topLeftCorner(d, d);
    }
  }
}

}  // namespace

Mat3 deformation_gradient(const LiveBody& body, const Eigen::VectorXd& x, Index point) noexcept {
  return gradient_at(body, relative_positions(body, x, point / body.points()), point);
}

ForceSums internal_forces(const LiveBody& body, const Eigen::VectorXd& x, std::span<const Mat3> plastic,
                          Eigen::VectorXd& f) {
  f.setZero(body.dofs());
  const Eigen::Index d = body.dimension();
  ForceSums sums;
  for (Index e = 0; e < body.mesh().elements(); ++e) {
    const NodeColumns columns = relative_positions(body, x, e);
    NodeColumns forces = NodeColumns::Zero(3, columns.cols());
    for (Index point = e * body.points(); point < (e + 1) * body.points(); ++point) {
      const Mat3 F = gradient_at(body, columns, point);
      if (!(F.determinant() > 0.0)) ++sums.inverted;
      const PointStress at =
          stress_at(body.options().law, body.constants(e), F, relaxed_strain(body, plastic, e, point));
      sums.energy += body.weight(point) * at.energy;
      forces.noalias() -= (body.weight(point) * at.P) * body.gradients(point);
    }
    const std::span<const Index> nodes = body.mesh().element_nodes(e);
    for (Eigen::Index k = 0; k < columns.cols(); ++k)
      f.segment(d * Eigen::Index{nodes[k]}, d) += forces.col(k).head(d);
  }
  return sums;
}

void assemble_tangent(const LiveBody& body, const Eigen::VectorXd& x, std::span<const Mat3> plastic,
                      TangentKind kind, LiveMatrix& K) {
  const TangentPattern& pattern = body.pattern();
  if (K.nonZeros() != pattern.zero().nonZeros()) K = pattern.zero();
  std::fill_n(K.valuePtr(), K.nonZeros(), 0.0);
  const Eigen::Index d = body.dimension();
  for (Index e = 0; e < body.mesh().elements(); ++e) {
    const NodeColumns columns = relative_positions(body, x, e);
    ElementMatrix K_e = ElementMatrix::Zero(d * columns.cols(), d * columns.cols());
    for (Index point = e * body.points(); point < (e + 1) * body.points(); ++point) {
      const PointTangent C =
          tangent_at(body.options().law, body.constants(e), gradient_at(body, columns, point),
                     relaxed_strain(body, plastic, e, point), kind);
      add_point(C, body.gradients(point), body.weight(point), d, K_e);
    }
    add_entries(pattern.places(e), K_e, K.valuePtr());
  }
}

}  // namespace palpate
