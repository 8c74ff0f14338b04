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
using Eigen::MatrixX3d;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double parts_of_cell = 3.0;  // along each axis

/// y = K x of a symmetric K [n x n], whose lower triangle is stored column by column.
void multiply(const std::vector<double>& K, const double* x, std::ptrdiff_t n, double* y) {
  std::fill_n(y, n, 0.0);
  const double* column = K.data();
  for (std::ptrdiff_t j = 0; j < n; ++j) {
    const double x_j = x[j];
    double sum = column[0] * x_j;
#pragma omp simd reduction(+ : sum)
    for (std::ptrdiff_t i = 1; i < n - j; ++i) {
      y[j + i] += column[i] * x_j;
      sum += column[i] * x[j + i];
    }
    y[j] += sum;
    column += n - j;
  }
}

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

  /// Numbers the terms of a part with these quadrature points; `dofs` [3 terms] of the coarse field, axis
  /// after axis, -1: held, or not in the plane.
  void number(const std::vector<Index>& points, std::vector<Index>& dofs) {
    for (const std::size_t key : keys_) place_[key] = -1;
    keys_.clear();
    for (const Index point : points) {
      for (const Index node : fine_.mesh().element_nodes(point / fine_.points())) {
        for_each_key(node, [&](std::size_t key, double) {
          if (place_[key] >= 0) return;
          place_[key] = std::ssize(keys_);
          keys_.push_back(key);
        });
      }
    }
    for (Index axis = 0; axis < 3; ++axis) {
      for (const std::size_t key : keys_)
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
  MatrixX3d u;     // of its terms
  Mat3 F, R, G;    // mean deformation gradient, its rotation, (tr U I - U)^-1
  MatrixX3d q, y;  // displacement of its terms in the part's frame, and K times it
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
  part.G.setZero(terms, 3);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double weight = fine_.weight(points[k]), root = std::sqrt(weight);
    part.volume += weight;
    of_body.for_each_gradient(points[k], [&](Eigen::Index term, const Vec3& gradient) {
      part.G.row(term) += weight * gradient.transpose();
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        slopes(axis * std::ssize(points) + static_cast<Eigen::Index>(k), term) += root * gradient[axis];
    });
  }
  part.G /= part.volume;
  MatrixXd K = MatrixXd::Zero(3 * terms, 3 * terms);
  const PointTangent C = tangent_at(fine_.options().law, fine_.constants(part.element), Mat3::Identity(),
                                    fine_.initial_strain(part.element), TangentKind::exact);
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      const auto n = std::ssize(points);
      const MatrixXd spread = slopes.middleRows(i * n, n).transpose() * slopes.middleRows(j * n, n) -
                              part.volume * part.G.col(i) * part.G.col(j).transpose();
      for (Eigen::Index r = 0; r < 3; ++r) {
        for (Eigen::Index s = 0; s < 3; ++s) {
          const double factor = C(r + 3 * i, s + 3 * j);
          if (factor != 0.0) K.block(r * terms, s * terms, terms, terms) += factor * spread;
        }
      }
    }
  }
  part.K.reserve(static_cast<std::size_t>(3 * terms * (3 * terms + 1) / 2));
  for (Eigen::Index j = 0; j < 3 * terms; ++j)
    for (Eigen::Index i = j; i < 3 * terms; ++i) part.K.push_back(K(i, j));
}

CoarseBody::State CoarseBody::state(const Part& part, const VectorXd& q) const {
  State at;
  at.u.resize(part.G.rows(), 3);
  for (std::size_t k = 0; k < part.dofs.size(); ++k)
    at.u.data()[k] = part.dofs[k] < 0 ? 0.0 : q[part.dofs[k]];
  at.F = Mat3::Identity() + at.u.transpose() * part.G;
  at.R = fine_.dimension() == 3 ? nearest_rotation(at.F) : nearest_rotation_in_plane(at.F);
  at.q = at.u * at.R;
  at.y.resize(at.q.rows(), 3);
  multiply(part.K, at.q.data(), at.q.size(), at.y.data());
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
    const Mat3 moment = at.q.transpose() * at.y;
    const Vec3 torque(moment(1, 2) - moment(2, 1), moment(2, 0) - moment(0, 2), moment(0, 1) - moment(1, 0));
    const Mat3 turn = cross_matrix(at.G.transpose() * torque);
    const MatrixX3d force =
        part.G * (part.volume * stress.P - at.R * turn).transpose() + at.y * at.R.transpose();
    for (std::size_t k = 0; k < part.dofs.size(); ++k)
      if (part.dofs[k] >= 0) (*gradient)[part.dofs[k]] += force.data()[k];
  }
  return sum;
}

namespace {

/// Row (axis, term) is the row of that axis of [v_term]_x.
MatrixX3d cross_rows(const MatrixX3d& v) {
  const Eigen::Index n = v.rows();
  MatrixX3d rows = MatrixX3d::Zero(3 * n, 3);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Index next = (axis + 1) % 3, last = (axis + 2) % 3;
    rows.col(next).segment(axis * n, n) = -v.col(last);
    rows.col(last).segment(axis * n, n) = v.col(next);
  }
  return rows;
}

/// Adds K, of which the lower triangle is stored.
void add_symmetric(const std::vector<double>& K, MatrixXd& to) {
  const double* entry = K.data();
  for (Eigen::Index j = 0; j < to.cols(); ++j) {
    to(j, j) += *entry++;
    for (Eigen::Index i = j + 1; i < to.rows(); ++i, ++entry) {
      to(i, j) += *entry;
      to(j, i) += *entry;
    }
  }
}

/// Adds the blocks (i >= j) of a symmetric matrix of terms, axis by axis, and their mirror images.
void scatter(const MatrixXd& blocks, const std::vector<Index>& dofs, MatrixXd& K) {
  const Eigen::Index terms = blocks.rows() / 3;
  for (Eigen::Index column = 0; column < blocks.cols(); ++column) {
    const Index to = dofs[static_cast<std::size_t>(column)];
    if (to < 0) continue;
    const Eigen::Index first = column / terms * terms;
    for (Eigen::Index row = first; row < blocks.rows(); ++row) {
      const Index from = dofs[static_cast<std::size_t>(row)];
      if (from < 0) continue;
      K(from, to) += blocks(row, column);
      if (row >= first + terms) K(to, from) += blocks(row, column);
    }
  }
}

}  // namespace

void CoarseBody::add_tangent(const Part& part, const VectorXd& q, MatrixXd& to) const {
  const State at = state(part, q);
  const Eigen::Index n = at.q.rows();
  const PointTangent C = part.volume * tangent_at(fine_.options().law, fine_.constants(part.element), at.F,
                                                  fine_.initial_strain(part.element), TangentKind::exact);
  // In the part's frame q changes by dq + [q]_x B dq, less the terms of first order; B its spin.
  const MatrixX3d spin = -cross_rows(part.G) * at.G.transpose();  // B^T
  const MatrixX3d by_turn = cross_rows(at.q);
  MatrixX3d K_turn(3 * n, 3);
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    multiply(part.K, by_turn.col(axis).data(), 3 * n, K_turn.col(axis).data());
  const Mat3 moment = at.y.transpose() * at.q;
  const Mat3 middle =
      0.5 * (moment + moment.transpose()) - moment.trace() * Mat3::Identity() + by_turn.transpose() * K_turn;
  MatrixXd left(3 * n, 6), right(6, 3 * n), in_frame(3 * n, 3 * n), half_turned(n, 3 * n);
  left.leftCols<3>() = K_turn - cross_rows(at.y) + 0.5 * spin * middle;
  left.rightCols<3>() = spin;
  right.topRows<3>() = spin.transpose();
  right.bottomRows<3>() = left.leftCols<3>().transpose();
  in_frame.noalias() = left * right;
  add_symmetric(part.K, in_frame);

  for (Eigen::Index i = 0; i < 3; ++i) {
    half_turned = at.R(i, 0) * in_frame.topRows(n) + at.R(i, 1) * in_frame.middleRows(n, n) +
                  at.R(i, 2) * in_frame.bottomRows(n);
    for (Eigen::Index j = 0; j <= i; ++j) {
      Mat3 C_ij;
      for (Eigen::Index k = 0; k < 3; ++k)
        for (Eigen::Index l = 0; l < 3; ++l) C_ij(k, l) = C(3 * k + i, 3 * l + j);
      auto block = to.block(i * n, j * n, n, n);
      block += at.R(j, 0) * half_turned.leftCols(n) + at.R(j, 1) * half_turned.middleCols(n, n) +
               at.R(j, 2) * half_turned.rightCols(n);
      block.noalias() += (part.G * C_ij).lazyProduct(part.G.transpose());
    }
  }
}

MatrixXd CoarseBody::tangent(const VectorXd& q) const {
  MatrixXd K = MatrixXd::Zero(dofs_, dofs_);
  for (auto part = parts_.begin(); part != parts_.end();) {
    const std::vector<Index>& dofs = part->dofs;  // many parts of a cell have the same
    const auto terms = std::ssize(dofs);
    MatrixXd sum = MatrixXd::Zero(terms, terms);
    for (; part != parts_.end() && part->dofs == dofs; ++part) add_tangent(*part, q, sum);
    scatter(sum, dofs, K);
  }
  return K;
}

}  // namespace palpate
