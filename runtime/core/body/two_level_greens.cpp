#include "runtime/core/body/two_level_greens.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "runtime/core/body/greens_on_top.h"

namespace palpate {
namespace {

using Column = std::array<double, most_coarse_dofs>;
using Columns = std::array<double, std::size_t{3} * most_coarse_dofs>;

/// Adds A f for a load on few of the dofs.
void add_response(const Eigen::MatrixXd& A, const Eigen::Ref<const Eigen::VectorXd>& f,
                  Eigen::Ref<Eigen::VectorXd> q) noexcept {
  for (Eigen::Index dof = 0; dof < f.size(); ++dof) {
    if (f[dof] != 0.0) q += f[dof] * A.col(dof);
  }
}

class TwoLevelGreens final : public GreensOnTop {
 public:
  TwoLevelGreens(std::shared_ptr<const Greens> turned, TwoLevelState state)
      : GreensOnTop(std::move(turned)),
        state_(std::move(state)),
        column_of_(state_.turns.size(), -1),
        prepared_of_(column_of_),
        near_of_(column_of_) {
    for (std::size_t k = 0; k < state_.columns.size(); ++k)
      column_of_[static_cast<std::size_t>(state_.columns[k].node)] = static_cast<Index>(k);
    prepare_answers();
    prepare_near();
  }

  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept override {
    below().gather(row, columns, blocks);
    const Eigen::Index d = dimension(), width = d * std::ssize(columns);
    const Index near_row = near_of_[static_cast<std::size_t>(row)];
    Columns a, b;
    std::optional<Answer> answer;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      double* out = blocks.data() + d * static_cast<Eigen::Index>(k);
      const Index near_column = near_of_[static_cast<std::size_t>(columns[k])];
      if (near_row >= 0 && near_column >= 0) {
        for (Eigen::Index i = 0; i < d; ++i) {
          for (Eigen::Index j = 0; j < d; ++j)
            out[i * width + j] += near_(d * near_column + j, d * near_row + i);
        }
        continue;
      }
      if (!answer) answer.emplace(respond(row, a, b));
      const Mat3 block = by_answer(columns[k], *answer);
      for (Eigen::Index i = 0; i < d; ++i) {
        for (Eigen::Index j = 0; j < d; ++j) out[i * width + j] += block(j, i);
      }
    }
  }

  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    below().displacement(nodes, f, ranges, u);
    Column a, b;
    const Eigen::Index n = state_.H_inverse.rows();
    Eigen::Map<Eigen::VectorXd> q_rest(a.data(), n), q(b.data(), n);
    find_fields(nodes, f, q_rest, q);
    if (q_rest.isZero(0.0) && q.isZero(0.0)) return;
    const std::span<const double> of_q(q.data(), static_cast<std::size_t>(n)),
        of_rest(q_rest.data(), static_cast<std::size_t>(n));
    std::array<double, std::size_t{8} * most_coarse_dofs / 3> both;
    for (Eigen::Index k = 0; 3 * k < n && dimension() == 3; ++k)
      Eigen::Map<Eigen::Matrix<double, 4, 2>>(both.data() + 8 * k) << q.segment<3>(3 * k),
          q_rest.segment<3>(3 * k), 0.0, 0.0;
    Index out = 0;
    for (const NodeRange& range : ranges) {
      for (Index node = range.first; node < range.end; ++node, ++out) {
        const auto stored = static_cast<std::size_t>(node);
        Vec3 moved_by;
        if (dimension() == 3 && column_of_[stored] < 0) {
          const auto [at, rest] = state_.nodes->field.both(state_.nodes->place[stored], both);
          moved_by = moved(node, at) - state_.turns[stored].R * free_part(node, rest);
        } else {
          moved_by = moved(node, of_q) - at_rest(node, of_rest);
        }
        set_vector(u, dimension(), out, vector_at(u, dimension(), out) + moved_by);
      }
    }
  }

  void coarse_displacement(std::span<const Index> nodes, std::span<const double> f,
                           std::span<double> q) const noexcept override {
    Column at_rest;
    const Eigen::Index n = state_.H_inverse.rows();
    find_fields(nodes, f, Eigen::Map<Eigen::VectorXd>(at_rest.data(), n),
                Eigen::Map<Eigen::VectorXd>(q.data(), n));
  }

 private:
  /// K_c^-1 P^T R^T f and H^-1 J^T f.
  void find_fields(std::span<const Index> nodes, std::span<const double> f,
                   Eigen::Ref<Eigen::VectorXd> q_rest, Eigen::Ref<Eigen::VectorXd> q) const noexcept {
    Column load_at_rest, load;
    const Eigen::Index n = state_.H_inverse.rows();
    Eigen::Map<Eigen::VectorXd> P_f(load_at_rest.data(), n), J_f(load.data(), n);
    P_f.setZero();
    J_f.setZero();
    q_rest.setZero();
    q.setZero();
    const bool are_few = dimension() * std::ssize(nodes) < n / 2;  // else their answers are more than H^-1
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const Vec3 force = vector_at(f, dimension(), static_cast<Index>(k));
      if (const Index p = prepared_of_[static_cast<std::size_t>(nodes[k])]; p >= 0 && are_few) {
        for (Eigen::Index axis = 0; axis < dimension(); ++axis) {
          q_rest += force[axis] * by_rest_.col(Eigen::Index{dimension()} * p + axis);
          q += force[axis] * by_tangent_.col(Eigen::Index{dimension()} * p + axis);
        }
        continue;
      }
      for_each_block(nodes[k], [&](Index node, double weight, const Vec3& gradient) {
        add_forces(nodes[k], node, weight, gradient, force, P_f, J_f);
      });
      if (const Index c = column_of_[static_cast<std::size_t>(nodes[k])]; c >= 0) {
        for (Eigen::Index axis = 0; axis < dimension(); ++axis)
          J_f += force[axis] * state_.columns[static_cast<std::size_t>(c)].J.col(axis);
      }
    }
    add_response(state_.nodes->compliance, P_f, q_rest);
    add_response(state_.H_inverse, J_f, q);
  }

  /// K_c^-1 P^T R^T and H^-1 J^T of a node [n_q x d].
  struct Answer {
    Eigen::Map<const Eigen::MatrixXd> by_rest, by_tangent;
  };

  /// Answers of the columns' nodes and of those near.
  void prepare_answers() {
    std::vector<Index> prepared;
    for (const CoarseColumn& column : state_.columns) prepared.push_back(column.node);
    for (const Index node : state_.near)
      if (column_of_[static_cast<std::size_t>(node)] < 0) prepared.push_back(node);
    const Eigen::Index d = dimension(), n = state_.H_inverse.rows();
    by_rest_.setZero(n, d * std::ssize(prepared));
    by_tangent_.setZero(n, d * std::ssize(prepared));
    for (std::size_t k = 0; k < prepared.size(); ++k) {
      const Eigen::Index first = d * static_cast<Eigen::Index>(k);
      add_answer(prepared[k], by_rest_.middleCols(first, d), by_tangent_.middleCols(first, d));
      if (k < state_.columns.size())
        by_tangent_.middleCols(first, d).noalias() = state_.H_inverse * state_.columns[k].J;
      prepared_of_[static_cast<std::size_t>(prepared[k])] = static_cast<Index>(k);
    }
  }

  void prepare_near() {
    const Eigen::Index d = dimension();
    const std::vector<Index>& near = state_.near;
    for (std::size_t k = 0; k < near.size(); ++k)
      near_of_[static_cast<std::size_t>(near[k])] = static_cast<Index>(k);
    near_.resize(d * std::ssize(near), d * std::ssize(near));
    Columns a, b;
    for (Eigen::Index k = 0; k < std::ssize(near); ++k) {
      const Answer answer = respond(near[static_cast<std::size_t>(k)], a, b);
      for (Eigen::Index i = 0; i <= k; ++i) {
        const Mat3 block = by_answer(near[static_cast<std::size_t>(i)], answer);
        near_.block(d * i, d * k, d, d) = block.topLeftCorner(d, d);
        near_.block(d * k, d * i, d, d) = block.topLeftCorner(d, d).transpose();
      }
    }
  }

  /// Displacement of a node by unit forces along each axis on the node of an answer.
  [[nodiscard]] Mat3 by_answer(Index stored, const Answer& answer) const noexcept {
    Mat3 block = Mat3::Zero();
    const auto n = static_cast<std::size_t>(state_.H_inverse.rows());
    for (Eigen::Index column = 0; column < dimension(); ++column) {
      block.col(column) = moved(stored, {answer.by_tangent.col(column).data(), n}) -
                          at_rest(stored, {answer.by_rest.col(column).data(), n});
    }
    return block;
  }
  template <class Visit>
  void for_each_block(Index stored, const Visit& visit) const noexcept {
    state_.nodes->field.for_each_node(state_.nodes->place[static_cast<std::size_t>(stored)], visit);
  }
  /// A vector of a stored node along the axes along which it is free.
  [[nodiscard]] Vec3 free_part(Index stored, const Vec3& v) const noexcept {
    const unsigned axes = state_.nodes->axes[static_cast<std::size_t>(stored)];
    return {(axes & 1U) != 0 ? v.x() : 0.0, (axes & 2U) != 0 ? v.y() : 0.0, (axes & 4U) != 0 ? v.z() : 0.0};
  }

  /// Adds P^T R^T f and, without the node's column, J^T f of a coarse node.
  void add_forces(Index stored, Index node, double weight, const Vec3& gradient, const Vec3& force,
                  Eigen::Ref<Eigen::VectorXd> P_f, Eigen::Ref<Eigen::VectorXd> J_f) const noexcept {
    const CoarseTurn& turn = state_.turns[static_cast<std::size_t>(stored)];
    const Eigen::Index d = dimension();
    P_f.segment(d * node, d) += weight * free_part(stored, turn.R.transpose() * force).head(d);
    if (column_of_[static_cast<std::size_t>(stored)] >= 0) return;
    const Vec3 by_turn = turn.R * gradient.cross(turn.T.transpose() * force);
    J_f.segment(d * node, d) += (weight * free_part(stored, force) + by_turn).head(d);
  }

  /// Adds the answer of a node without a column.
  void add_answer(Index stored, Eigen::Ref<Eigen::MatrixXd> by_rest,
                  Eigen::Ref<Eigen::MatrixXd> by_tangent) const noexcept {
    const Eigen::Index d = dimension();
    const CoarseTurn& turn = state_.turns[static_cast<std::size_t>(stored)];
    for_each_block(stored, [&](Index node, double weight, const Vec3& gradient) {
      for (Eigen::Index axis = 0; axis < d; ++axis) {
        const Vec3 unit = Vec3::Unit(axis);
        const Vec3 p = weight * free_part(stored, turn.R.transpose() * unit);
        const Vec3 j = weight * free_part(stored, unit) + turn.R * gradient.cross(turn.T.transpose() * unit);
        for (Eigen::Index i = 0; i < d; ++i) {
          by_rest.col(axis) += p[i] * state_.nodes->compliance.col(d * node + i);
          by_tangent.col(axis) += j[i] * state_.H_inverse.col(d * node + i);
        }
      }
    });
  }

  /// Answer of any node; a and b keep one that is not prepared.
  [[nodiscard]] Answer respond(Index row, Columns& a, Columns& b) const noexcept {
    const Eigen::Index d = dimension(), n = state_.H_inverse.rows();
    if (const Index k = prepared_of_[static_cast<std::size_t>(row)]; k >= 0)
      return {{by_rest_.col(d * k).data(), n, d}, {by_tangent_.col(d * k).data(), n, d}};
    Eigen::Map<Eigen::MatrixXd> by_rest(a.data(), n, d), by_tangent(b.data(), n, d);
    by_rest.setZero();
    by_tangent.setZero();
    add_answer(row, by_rest, by_tangent);
    return {{a.data(), n, d}, {b.data(), n, d}};
  }

  /// R P q of a node.
  [[nodiscard]] Vec3 at_rest(Index stored, std::span<const double> q) const noexcept {
    const Vec3 u = state_.nodes->field.value(state_.nodes->place[static_cast<std::size_t>(stored)], q).u;
    return state_.turns[static_cast<std::size_t>(stored)].R * free_part(stored, u);
  }

  /// J q of a node.
  [[nodiscard]] Vec3 moved(Index stored, std::span<const double> q) const noexcept {
    if (const Index c = column_of_[static_cast<std::size_t>(stored)]; c >= 0) {
      const Eigen::MatrixXd& J = state_.columns[static_cast<std::size_t>(c)].J;
      const Eigen::Map<const Eigen::VectorXd> all(q.data(), std::ssize(q));
      Vec3 sum = Vec3::Zero();
      for (Eigen::Index i = 0; i < dimension(); ++i) sum[i] = J.col(i).dot(all);
      return sum;
    }
    return moved(stored, state_.nodes->field.value(state_.nodes->place[static_cast<std::size_t>(stored)], q));
  }

  /// J q of a node without a column.
  [[nodiscard]] Vec3 moved(Index stored, const CoarseValue& at) const noexcept {
    const CoarseTurn& turn = state_.turns[static_cast<std::size_t>(stored)];
    const Mat3 A = turn.R.transpose() * at.gradient;
    const Vec3 curl(A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1));
    return free_part(stored, at.u) - turn.T * curl;
  }

  TwoLevelState state_;
  std::vector<Index> column_of_, prepared_of_, near_of_;  // [nodes] in state_.columns, those below; -1: none
  Eigen::MatrixXd by_rest_, by_tangent_;                  // [n_q x d prepared] answers
  Eigen::MatrixXd near_;                                  // [d near, d near] the coarse field's part
};

}  // namespace

TwoLevelState at_rest(const std::shared_ptr<const CoarseNodes>& nodes) {
  return {
      .nodes = nodes, .turns = std::vector<CoarseTurn>(nodes->place.size()), .H_inverse = nodes->compliance};
}

std::shared_ptr<const Greens> two_levels(std::shared_ptr<const Greens> Xi, TwoLevelState state) {
  std::vector<Mat3> R;
  for (const CoarseTurn& turn : state.turns) R.push_back(turn.R);
  return std::make_shared<const TwoLevelGreens>(turned(std::move(Xi), std::move(R)), std::move(state));
}

}  // namespace palpate
