#include "runtime/depth/coarse_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "base/vectors.h"
#include "meshes/element.h"
#include "statics/polar.h"

namespace palpate {
namespace {

using Eigen::Map;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double parts_of_cell = 3.0;  // along each axis

}  // namespace

/// The terms of a body: what coarse nodes move along the axes along which a mesh node is free.
class CoarseBody::Terms {
 public:
  Terms(const LiveBody& fine, const CoarseField& field)
      : fine_(fine), field_(field), place_(static_cast<std::size_t>(8 * field.nodes()), -1) {
    const auto d = static_cast<std::size_t>(fine.dimension());
    for (std::size_t node = 0; node < fine.mesh().nodes.size(); ++node) {
      at_.push_back(field.place(fine.mesh().nodes[node]));
      unsigned free = 0;
      for (std::size_t axis = 0; axis < d; ++axis)
        if (fine.free_of_dof()[d * node + axis] >= 0) free |= 1U << axis;
      free_.push_back(free);
    }
  }

  /// Numbers the terms of a part with these quadrature points; `dofs` [3 terms] of the coarse field, by axis,
  /// -1: held, or not in the plane.
  void number(const std::vector<Index>& points, std::vector<Index>& dofs) {
    for (const std::size_t key : keys_) place_[key] = -1;
    keys_.clear();
    for (const Index point : points) {
      for (const Index node : fine_.mesh().element_nodes(point / fine_.points()))
        for_each_key(node, [&](std::size_t key, double) {
          if (place_[key] >= 0) return;
          place_[key] = std::ssize(keys_);
          keys_.push_back(key);
        });
    }
    for (const std::size_t key : keys_) {
      for (Index axis = 0; axis < 3; ++axis)
        dofs.push_back((key >> axis & 1U) != 0 ? fine_.dimension() * static_cast<Index>(key / 8) + axis : -1);
    }
  }
  [[nodiscard]] Eigen::Index count() const noexcept { return std::ssize(keys_); }
  /// Calls visit(term, gradient [1/m]) for a quadrature point, more than once for each.
  template <class Visit>
  void for_each_gradient(Index point, const Visit& visit) const {
    Eigen::Index k = 0;
    for (const Index node : fine_.mesh().element_nodes(point / fine_.points())) {
      const Vec3 N = fine_.gradients(point).col(k++);
      for_each_key(node, [&](std::size_t key, double weight) { visit(place_[key], Vec3(weight * N)); });
    }
  }

 private:
  template <class Visit>
  void for_each_key(Index node, const Visit& visit) const {
    const unsigned free = free_[static_cast<std::size_t>(node)];
    if (free == 0) return;
    field_.for_each_node(at_[static_cast<std::size_t>(node)], [&](Index coarse, double weight, const Vec3&) {
      visit(8 * static_cast<std::size_t>(coarse) + free, weight);
    });
  }

  const LiveBody& fine_;
  const CoarseField& field_;
  std::vector<CoarsePlace> at_;      // [mesh nodes]
  std::vector<unsigned> free_;       // [mesh nodes] bit `axis`: free along it
  std::vector<Eigen::Index> place_;  // [8 coarse nodes] of each key, a coarse node and the axes, in keys_; -1
  std::vector<std::size_t> keys_;    // of the part's terms
};

/// A part at some q.
struct CoarseBody::State {
  Matrix3Xd u;     // of its terms
  Mat3 F, R, G;    // mean deformation gradient, its rotation, (tr U I - U)^-1
  Matrix3Xd q, y;  // displacement of its terms in the part's frame, and K times it
};

CoarseBody::CoarseBody(const LiveBody& fine, const CoarseField& field) : fine_(fine), dofs_(field.dofs()) {
  const Mesh& mesh = fine.mesh();
  const std::span<const QuadraturePoint> rule = quadrature(mesh.element);
  std::map<std::array<Index, 5>, std::vector<Index>> points;  // by cell, place in the cell, and law
  for (Index point = 0; point < fine.all_points(); ++point) {
    const Index element = point / fine.points();
    const ShapeValues values =
        shape_functions(mesh.element, rule[static_cast<std::size_t>(point % fine.points())].xi);
    Vec3 x = Vec3::Zero();
    Eigen::Index k = 0;
    for (const Index node : mesh.element_nodes(element))
      x += values[k++] * mesh.nodes[static_cast<std::size_t>(node)];
    const CoarsePlace at = field.place(x);
    std::array<Index, 5> key = {at.cell, 0, 0, 0,
                                static_cast<Index>(&fine.constants(element) - &fine.constants(0))};
    for (int axis = 0; axis < fine.dimension(); ++axis)
      key[static_cast<std::size_t>(1 + axis)] =
          static_cast<Index>(std::clamp(0.5 * (at.in_cell[axis] + 1.0), 0.0, 0.999) * parts_of_cell);
    points[key].push_back(point);
  }
  Terms terms(fine, field);
  for (const auto& [key, of_part] : points) measure(terms, of_part, parts_.emplace_back());
}

void CoarseBody::measure(Terms& of_body, const std::vector<Index>& points, Part& part) const {
  of_body.number(points, part.dofs);
  const Eigen::Index terms = of_body.count();
  part.element = points.front() / fine_.points();
  MatrixXd slopes = MatrixXd::Zero(3 * std::ssize(points), terms);  // times the root of the weight
  part.G.setZero(3, terms);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double weight = fine_.weight(points[k]), root = std::sqrt(weight);
    part.volume += weight;
    of_body.for_each_gradient(points[k], [&](Eigen::Index term, const Vec3& gradient) {
      part.G.col(term) += weight * gradient;
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        slopes(axis * std::ssize(points) + static_cast<Eigen::Index>(k), term) += root * gradient[axis];
    });
  }
  part.G /= part.volume;
  part.K.setZero(3 * terms, 3 * terms);
  const PointTangent C = tangent_at(fine_.options().law, fine_.constants(part.element), Mat3::Identity(),
                                    fine_.initial_strain(part.element), TangentKind::exact);
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      const auto n = std::ssize(points);
      const MatrixXd spread = slopes.middleRows(i * n, n).transpose() * slopes.middleRows(j * n, n) -
                              part.volume * part.G.row(i).transpose() * part.G.row(j);
      for (Eigen::Index r = 0; r < 3; ++r) {
        for (Eigen::Index s = 0; s < 3; ++s) {
          const double factor = C(r + 3 * i, s + 3 * j);
          if (factor == 0.0) continue;
          for (Eigen::Index a = 0; a < terms; ++a) {
            for (Eigen::Index b = 0; b < terms; ++b) part.K(3 * a + r, 3 * b + s) += factor * spread(a, b);
          }
        }
      }
    }
  }
}

CoarseBody::State CoarseBody::state(const Part& part, const VectorXd& q) const {
  State at;
  at.u.resize(3, part.G.cols());
  for (std::size_t k = 0; k < part.dofs.size(); ++k)
    at.u.data()[k] = part.dofs[k] < 0 ? 0.0 : q[part.dofs[k]];
  at.F = Mat3::Identity() + at.u * part.G.transpose();
  at.R = fine_.dimension() == 3 ? nearest_rotation(at.F) : nearest_rotation_in_plane(at.F);
  at.q = at.R.transpose() * at.u;
  at.y.resize(3, at.q.cols());
  Map<VectorXd>(at.y.data(), at.y.size()).noalias() =
      part.K.selfadjointView<Eigen::Lower>() * Map<const VectorXd>(at.q.data(), at.q.size());
  at.G = spin_of_skew(at.R, at.F);
  return at;
}

double CoarseBody::energy(const VectorXd& q, VectorXd* gradient) const {
  double sum = 0.0;
  for (const Part& part : parts_) {
    const State at = state(part, q);
    const PointStress stress = stress_at(fine_.options().law, fine_.constants(part.element), at.F,
                                         fine_.initial_strain(part.element));
    sum += part.volume * stress.energy + 0.5 * at.q.cwiseProduct(at.y).sum();
    if (gradient == nullptr) continue;
    Vec3 torque = Vec3::Zero();
    for (Eigen::Index term = 0; term < at.q.cols(); ++term) torque += at.q.col(term).cross(at.y.col(term));
    const Vec3 turn = at.G.transpose() * torque;
    for (Eigen::Index term = 0; term < at.q.cols(); ++term) {
      const Vec3 slope = part.G.col(term);
      const Vec3 force = part.volume * stress.P * slope + at.R * (at.y.col(term) - turn.cross(slope));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Index dof = part.dofs[3 * static_cast<std::size_t>(term) + axis];
        if (dof >= 0) (*gradient)[dof] += force[static_cast<Eigen::Index>(axis)];
      }
    }
  }
  return sum;
}

MatrixXd CoarseBody::tangent(const VectorXd& q) const {
  MatrixXd K = MatrixXd::Zero(dofs_, dofs_);
  MatrixXd local, spin, by_turn;
  for (const Part& part : parts_) {
    const State at = state(part, q);
    const Eigen::Index terms = at.q.cols();
    const PointTangent C = part.volume * tangent_at(fine_.options().law, fine_.constants(part.element), at.F,
                                                    fine_.initial_strain(part.element), TangentKind::exact);
    // In the part's frame: the field's change less the turning, and the terms of its first order.
    spin.resize(3, 3 * terms);      // B
    by_turn.resize(3 * terms, 3);   // [q]_x, so that the frame's q changes by dq + [q]_x B dq
    MatrixXd couple(3, 3 * terms);  // [y]_x
    Mat3 middle = Mat3::Zero();
    for (Eigen::Index term = 0; term < terms; ++term) {
      spin.middleCols<3>(3 * term) = at.G * cross_matrix(part.G.col(term));
      by_turn.middleRows<3>(3 * term) = cross_matrix(at.q.col(term));
      couple.middleCols<3>(3 * term) = cross_matrix(at.y.col(term));
      middle +=
          0.5 * (at.y.col(term) * at.q.col(term).transpose() + at.q.col(term) * at.y.col(term).transpose()) -
          at.y.col(term).dot(at.q.col(term)) * Mat3::Identity();
    }
    const MatrixXd K_turn = part.K.selfadjointView<Eigen::Lower>() * by_turn;
    const MatrixXd cross = (K_turn.transpose() + couple).transpose() * spin;
    middle += by_turn.transpose() * K_turn;
    local = part.K + cross + cross.transpose();
    local.noalias() += spin.transpose() * (middle * spin);
    for (Eigen::Index a = 0; a < terms; ++a) {
      const Vec3 g = part.G.col(a);
      const Eigen::Matrix<double, 3, 9> T =
          g.x() * C.topRows<3>() + g.y() * C.middleRows<3>(3) + g.z() * C.bottomRows<3>();
      for (Eigen::Index b = 0; b <= a; ++b) {
        const Vec3 h = part.G.col(b);
        const Mat3 block = at.R * local.block<3, 3>(3 * a, 3 * b) * at.R.transpose() +
                           h.x() * T.leftCols<3>() + h.y() * T.middleCols<3>(3) + h.z() * T.rightCols<3>();
        for (std::size_t i = 0; i < 3; ++i) {
          for (std::size_t j = 0; j < 3; ++j) {
            const Index row = part.dofs[3 * static_cast<std::size_t>(a) + i],
                        column = part.dofs[3 * static_cast<std::size_t>(b) + j];
            if (row < 0 || column < 0) continue;
            const double value = block(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
            K(row, column) += value;
            if (a != b) K(column, row) += value;
          }
        }
      }
    }
  }
  return K;
}

}  // namespace palpate
