#include "runtime/depth/two_levels.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/vectors.h"
#include "statics/polar.h"

namespace palpate {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index most_groups = 12;  // of loaded nodes that are held in place
constexpr double floor_of_group =
    1e-5;  // compliance of a group beside its own, as a share of a node's at rest
constexpr int most_halvings = 30;
constexpr double most_of_cell = 0.3;     // of its edge, by which a coarse node moves in a step at most
constexpr double rounding = 1e-9;        // of the largest q: a step that is not made
constexpr double least_stiffness = 0.2;  // of the coarse field in the tick, as a share of that at rest
constexpr double least_tangent = 0.9;    // of T that G leaves in the tick (docs/depth.md)
constexpr double least_of_turns = 1e-3;  // of G
constexpr double most_lag = 0.1;         // of the tangent of E in a search, as a share of it
constexpr double most_lag_of_compliance = 0.03;  // of the tangent of E in W

/// Groups of points: the group of each, the first ones being those farthest from all before.
std::vector<Index> grouped(const std::vector<Vec3>& points, Index most) {
  std::vector<Index> group(points.size(), 0);
  std::vector<double> distance(points.size(), std::numeric_limits<double>::infinity());
  std::size_t next = 0;
  for (Index g = 0; g < std::min<Index>(most, static_cast<Index>(points.size())); ++g) {
    const Vec3& centre = points[next];
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double there = (points[k] - centre).squaredNorm();
      if (there >= distance[k]) continue;
      distance[k] = there;
      group[k] = g;
    }
    next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  return group;
}

/// Cholesky's factor of A, or of A with as much of K as it needs to be positive definite.
Eigen::LLT<MatrixXd> positive_factor(const MatrixXd& A, const MatrixXd& K) {
  Eigen::LLT<MatrixXd> factor(A);
  for (double share = 1e-3; factor.info() != Eigen::Success && share < 1e6; share *= 4.0)
    factor.compute(A + share * K);
  return factor;
}

bool is_positive(const MatrixXd& A) {
  return Eigen::LLT<MatrixXd>(A).info() == Eigen::Success;
}

/// Inverse of T + G, the coarse body's tangent and what given forces add by turning the remainder. With T
/// goes as much of K as leaves no field softer than `least_stiffness` of that at rest where T is not positive
/// definite, since a tool holds a body where it would not stay by itself; and as little of G as leaves none
/// softer than `least_tangent` of T: forces are not given but found by each tick, and change.
MatrixXd stiff_inverse(MatrixXd T, const MatrixXd& G, const MatrixXd& K) {
  if (!is_positive(T)) {
    double share = 0.1;
    while (!is_positive(T + (share - least_stiffness) * K) && share < 1e3) share *= 1.5;
    T += share * K;
  }
  double of_turns = 1.0;
  while (!is_positive((1.0 - least_tangent) * T + of_turns * G) && of_turns > least_of_turns) of_turns *= 0.7;
  const Eigen::LLT<MatrixXd> factor(T + of_turns * G);
  const MatrixXd root = factor.matrixL().solve(MatrixXd::Identity(T.rows(), T.cols()));
  MatrixXd inverse = MatrixXd::Zero(T.rows(), T.cols());
  inverse.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose());
  return inverse.selfadjointView<Eigen::Lower>();
}

}  // namespace

/// Constant part of a search: positions, groups and the remainder's compliance of the loaded nodes.
struct TwoLevels::Contact {
  std::vector<Vec3> f, u;     // [k]
  std::vector<Index> group;   // [k]
  std::vector<double> share;  // [k] of its group
  Index groups = 0;
  std::vector<Index> dofs;          // of the coarse field that move the loaded nodes
  std::vector<Index> place_of_dof;  // [n_q] in `dofs`, -1: none
};

/// A state in a search.
struct TwoLevels::Look {
  double E = 0.0;          // energy of the coarse body
  VectorXd dE;             // [n_q]
  double energy = 0.0;     // Phi
  VectorXd gradient;       // [n_q]
  std::vector<Mat3> R, G;  // [k]
  MatrixXd V, MV;          // [3k x d groups] R^T A^T, and M times it
  MatrixXd S;              // [d groups, d groups] A R M R^T A^T
  VectorXd f, phi, s;      // [3k] forces, and in the frame of the nodes forces and remainder
};

TwoLevels::TwoLevels(const CoarseParts& parts, std::shared_ptr<const Greens> greens)
    : parts_(&parts), greens_(std::move(greens)), dimension_(greens_->dimension()) {
  rest();
}

/// Calls visit(dof, weight, axis) for P of a stored node.
template <class Visit>
void TwoLevels::for_each_weight(Index node, const Visit& visit) const {
  const CoarseNodes& coarse = *parts_->nodes;
  const unsigned axes = coarse.axes[static_cast<std::size_t>(node)];
  coarse.field.for_each_node(coarse.place[static_cast<std::size_t>(node)],
                             [&](Index c, double weight, const Vec3&) {
                               for (Index axis = 0; axis < dimension_; ++axis)
                                 if (((axes >> axis) & 1U) != 0) visit(dimension_ * c + axis, weight, axis);
                             });
}

void TwoLevels::rest() {
  rests_ = true;
  q_ = VectorXd::Zero(parts_->K.rows());
  largest_q_ = 0.0;
  H_ = tangent_ = parts_->K;
  q_tangent_ = q_;
  dE_ = q_;
  E_ = parts_->body->energy(q_, &dE_);
  dE_tangent_ = dE_;
  loaded_.clear();
  forces_.clear();
  columns_.clear();
  const auto n = static_cast<std::size_t>(greens_->order());
  s_.assign(n, 0.0);
  u_.assign(n, 0.0);
  turns_.assign(static_cast<std::size_t>(greens_->nodes()), {});
}

TwoLevels::AtNode TwoLevels::at_node(Index node, const VectorXd& q) const {
  const CoarseAt at = coarse_at(*parts_->nodes, node, {q.data(), static_cast<std::size_t>(q.size())});
  return {at.moved, at.R, parts_->nodes->turns(node) ? spin_of_skew(at.R, at.F) : Mat3(Mat3::Zero())};
}

void TwoLevels::make_contact(std::span<const Index> nodes, std::span<const double> f,
                             std::span<const double> u, Contact& contact) const {
  std::vector<Vec3> rest;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    contact.f.push_back(vector_at(f, dimension_, static_cast<Index>(k)));
    contact.u.push_back(vector_at(u, dimension_, static_cast<Index>(k)));
    rest.push_back(parts_->nodes->place[static_cast<std::size_t>(nodes[k])].x);
  }
  contact.group = grouped(rest, most_groups);
  contact.groups = nodes.empty() ? 0 : 1 + *std::max_element(contact.group.begin(), contact.group.end());
  std::vector<double> sum(static_cast<std::size_t>(contact.groups), 0.0);
  double largest = 0.0;
  for (const Vec3& force : contact.f) largest = std::max(largest, force.norm());
  for (std::size_t k = 0; k < nodes.size(); ++k)
    sum[static_cast<std::size_t>(contact.group[k])] +=
        contact.share.emplace_back(largest > 0.0 ? contact.f[k].norm() + 1e-6 * largest : 1.0);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    contact.share[k] /= sum[static_cast<std::size_t>(contact.group[k])];
  contact.place_of_dof.assign(static_cast<std::size_t>(q_.size()), -1);
  const CoarseNodes& coarse = *parts_->nodes;
  for (const Index node : nodes) {
    coarse.field.for_each_node(coarse.place[static_cast<std::size_t>(node)],
                               [&](Index k, double, const Vec3&) {
                                 for (int axis = 0; axis < dimension_; ++axis) {
                                   const Index dof = dimension_ * k + axis;
                                   Index& place = contact.place_of_dof[static_cast<std::size_t>(dof)];
                                   if (place >= 0) continue;
                                   place = static_cast<Index>(contact.dofs.size());
                                   contact.dofs.push_back(dof);
                                 }
                               });
  }
}

/// `at` has E and dE.
void TwoLevels::look(const Contact& contact, const VectorXd& q, Look& at) const {
  const Eigen::Index d = dimension_;
  const auto k_all = std::ssize(loaded_);
  at.energy = at.E;
  at.gradient = at.dE;
  at.R.assign(loaded_.size(), Mat3::Identity());
  at.G.assign(loaded_.size(), Mat3::Zero());
  at.V.setZero(3 * k_all, d * contact.groups);
  VectorXd f0(3 * k_all), phi0(3 * k_all), along = VectorXd::Zero(3 * k_all),
                                           A_off = VectorXd::Zero(d * contact.groups);
  for (Eigen::Index k = 0; k < k_all; ++k) {
    const Index node = loaded_[static_cast<std::size_t>(k)];
    const auto [moved, R, G] = at_node(node, q);
    at.R[static_cast<std::size_t>(k)] = R;
    at.G[static_cast<std::size_t>(k)] = G;
    const Vec3& force = contact.f[static_cast<std::size_t>(k)];
    f0.segment<3>(3 * k) = force;
    phi0.segment<3>(3 * k) = R.transpose() * force;
    along.segment<3>(3 * k) = moved;
    const Eigen::Index g = contact.group[static_cast<std::size_t>(k)];
    const double share = contact.share[static_cast<std::size_t>(k)];
    at.V.block(3 * k, d * g, 3, d) = share * R.transpose().leftCols(d);
    A_off.segment(d * g, d) += share * (contact.u[static_cast<std::size_t>(k)] - moved).head(d);
  }
  at.MV.noalias() = M_ * at.V;
  const VectorXd s0 = M_ * phi0;
  at.S.noalias() = at.V.transpose() * at.MV;
  VectorXd lambda = VectorXd::Zero(d * contact.groups);
  double by_places = 0.0;
  if (k_all > 0) {
    at.S.diagonal().array() += floor_of_group * largest_;
    const VectorXd r = A_off - at.V.transpose() * s0;
    const Eigen::LDLT<MatrixXd> factor(at.S);
    lambda = factor.solve(r);
    by_places = 0.5 * r.dot(lambda);
  }
  at.energy += by_places - f0.dot(along) - 0.5 * phi0.dot(s0);
  at.s = s0 + at.MV * lambda;
  at.phi = phi0 + at.V * lambda;
  at.f = f0;
  for (Eigen::Index k = 0; k < k_all; ++k)
    at.f.segment<3>(3 * k).head(d) += contact.share[static_cast<std::size_t>(k)] *
                                      lambda.segment(d * contact.group[static_cast<std::size_t>(k)], d);
  add_moments(at);
}

/// Adds to the gradient what the forces do at the nodes, and their moment on the remainder.
void TwoLevels::add_moments(Look& at) const {
  const Eigen::Index d = dimension_;
  const CoarseNodes& coarse = *parts_->nodes;
  for (Eigen::Index k = 0; k < std::ssize(loaded_); ++k) {
    const Index node = loaded_[static_cast<std::size_t>(k)];
    const Vec3 force = at.f.segment<3>(3 * k);
    const Vec3 torque = at.s.segment<3>(3 * k).cross(at.phi.segment<3>(3 * k));
    const Vec3 v = at.G[static_cast<std::size_t>(k)].transpose() * torque;
    const Mat3& R = at.R[static_cast<std::size_t>(k)];
    const unsigned axes = coarse.axes[static_cast<std::size_t>(node)];
    coarse.field.for_each_node(
        coarse.place[static_cast<std::size_t>(node)], [&](Index c, double weight, const Vec3& gradient) {
          // B^T of the torque: ([g]_x R^T)^T G^T t = R (G^T t x g)
          const Vec3 spin = R * v.cross(gradient);
          for (Eigen::Index axis = 0; axis < d; ++axis) {
            const bool free = ((axes >> axis) & 1U) != 0;
            at.gradient[d * c + axis] -= (free ? weight * force[axis] : 0.0) + spin[axis];
          }
        });
  }
}

MatrixXd TwoLevels::hessian(const Contact& contact, const Look& at, MatrixXd* J) const {
  const Eigen::Index d = dimension_;
  MatrixXd H = tangent_;
  const auto k_all = std::ssize(loaded_);
  if (k_all == 0) return H;
  const auto n = std::ssize(contact.dofs);
  MatrixXd P = MatrixXd::Zero(3 * k_all, n), B = P, FB = P, s_B = P;
  const CoarseNodes& coarse = *parts_->nodes;
  for (Eigen::Index k = 0; k < k_all; ++k) {
    const Index node = loaded_[static_cast<std::size_t>(k)];
    const Mat3& R = at.R[static_cast<std::size_t>(k)];
    const Mat3& G = at.G[static_cast<std::size_t>(k)];
    const unsigned axes = coarse.axes[static_cast<std::size_t>(node)];
    coarse.field.for_each_node(
        coarse.place[static_cast<std::size_t>(node)], [&](Index c, double weight, const Vec3& gradient) {
          const Mat3 by = G * cross_matrix(gradient) * R.transpose();
          for (Eigen::Index axis = 0; axis < d; ++axis) {
            const Eigen::Index column = contact.place_of_dof[static_cast<std::size_t>(d * c + axis)];
            if (((axes >> axis) & 1U) != 0) P(3 * k + axis, column) += weight;
            B.col(column).segment<3>(3 * k) += by.col(axis);
          }
        });
    const Mat3 phi_x = cross_matrix(at.phi.segment<3>(3 * k)), s_x = cross_matrix(at.s.segment<3>(3 * k));
    FB.middleRows<3>(3 * k) = phi_x * B.middleRows<3>(3 * k);
    s_B.middleRows<3>(3 * k) = s_x * B.middleRows<3>(3 * k);
  }
  const MatrixXd M_FB = M_ * FB;
  MatrixXd geometric = FB.transpose() * M_FB;
  for (Eigen::Index k = 0; k < k_all; ++k) {
    const Vec3 s = at.s.segment<3>(3 * k), phi = at.phi.segment<3>(3 * k);
    const Mat3 middle = 0.5 * (s * phi.transpose() + phi * s.transpose()) - s.dot(phi) * Mat3::Identity();
    geometric += B.middleRows<3>(3 * k).transpose() * middle * B.middleRows<3>(3 * k);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j)
      H(contact.dofs[static_cast<std::size_t>(i)], contact.dofs[static_cast<std::size_t>(j)]) -=
          geometric(i, j);
  }
  if (J != nullptr) {  // R^T J of the loaded nodes
    *J = M_FB - s_B;
    for (Eigen::Index k = 0; k < k_all; ++k)
      J->middleRows<3>(3 * k) += at.R[static_cast<std::size_t>(k)].transpose() * P.middleRows<3>(3 * k);
  }
  return H;
}

/// Has the tangent of E at q, where dE is E's derivative, unless the present one is off by `most` of it or
/// less.
void TwoLevels::renew_tangent(const VectorXd& dE, double most) {
  const VectorXd foreseen = tangent_ * (q_ - q_tangent_), missed = dE - dE_tangent_ - foreseen;
  // The secant is off by half of what the tangent is off by.
  if (4.0 * missed.dot(parts_->nodes->compliance * missed) <=
      most * most * foreseen.dot(parts_->nodes->compliance * foreseen))
    return;
  tangent_ = parts_->body->tangent(q_);
  q_tangent_ = q_;
  dE_tangent_ = dE;
}

/// Takes nodes as loaded, with the remainder's compliance between them.
void TwoLevels::set_loaded(std::span<const Index> nodes) {
  if (std::equal(nodes.begin(), nodes.end(), loaded_.begin(), loaded_.end())) return;
  loaded_.assign(nodes.begin(), nodes.end());
  const Eigen::Index d = dimension_, k_all = std::ssize(loaded_);
  M_.setZero(3 * k_all, 3 * k_all);
  std::vector<double> row(static_cast<std::size_t>(d * d * k_all));
  MatrixXd P = MatrixXd::Zero(q_.size(), d * k_all);
  for (Eigen::Index k = 0; k < k_all; ++k) {
    const Index node = loaded_[static_cast<std::size_t>(k)];
    greens_->gather(node, loaded_, row);
    for (Eigen::Index i = 0; i < d; ++i) {
      for (Eigen::Index c = 0; c < d * k_all; ++c)
        M_(3 * k + i, 3 * (c / d) + c % d) = row[static_cast<std::size_t>(i * d * k_all + c)];
    }
    for_each_weight(node,
                    [&](Index dof, double weight, Eigen::Index axis) { P(dof, d * k + axis) = weight; });
  }
  largest_ = k_all > 0 ? M_.diagonal().maxCoeff() : 0.0;
  Xi_ = M_;
  const Eigen::SparseMatrix<double> sparse = P.sparseView();
  const MatrixXd by_field = sparse.transpose() * (parts_->nodes->compliance * sparse);
  for (Eigen::Index a = 0; a < d * k_all; ++a) {
    for (Eigen::Index b = 0; b < d * k_all; ++b)
      M_(3 * (a / d) + a % d, 3 * (b / d) + b % d) -= by_field(a, b);
  }
}

/// H with the stiffness of the groups that are held.
MatrixXd TwoLevels::held(const Contact& contact, const Look& at, const MatrixXd& J) const {
  MatrixXd A = H_;
  if (loaded_.empty()) return A;
  const MatrixXd AJ = at.V.transpose() * J;
  const MatrixXd by_groups = AJ.transpose() * Eigen::LDLT<MatrixXd>(at.S).solve(AJ);
  for (Eigen::Index i = 0; i < by_groups.rows(); ++i) {
    for (Eigen::Index j = 0; j < by_groups.cols(); ++j)
      A(contact.dofs[static_cast<std::size_t>(i)], contact.dofs[static_cast<std::size_t>(j)]) +=
          by_groups(i, j);
  }
  return A;
}

/// Goes along a step, or a part of it, to where Phi is lower: `tried`.
/// \returns false where there is no such place
bool TwoLevels::go_down(const Contact& contact, const VectorXd& step, const Look& at, Look& tried) {
  const double slope = at.gradient.dot(step);
  double share = 1.0;
  for (int k = 0; k < most_halvings; ++k, share *= 0.5) {
    const VectorXd q = q_ + share * step;
    tried.dE = VectorXd::Zero(q.size());
    tried.E = parts_->body->energy(q, &tried.dE);
    look(contact, q, tried);
    if (tried.energy <= at.energy + 1e-4 * share * slope ||
        (std::isfinite(tried.energy) && tried.gradient.norm() < 0.5 * at.gradient.norm())) {
      q_ = q;
      return true;
    }
  }
  return false;
}

TwoLevelReport TwoLevels::find(std::span<const Index> nodes, std::span<const double> f,
                               std::span<const double> u, double tolerance, int most_steps) {
  if (nodes.empty() && rests_) return {.converged = true};
  const Eigen::Index d = dimension_;
  set_loaded(nodes);
  Contact contact;
  make_contact(nodes, f, u, contact);
  TwoLevelReport report;
  Look at, tried;
  at.E = E_;
  at.dE = dE_;
  look(contact, q_, at);
  MatrixXd J;
  const double smallest = std::numeric_limits<double>::min();
  for (;; ++report.steps) {
    renew_tangent(at.dE, most_lag);
    H_ = hessian(contact, at, &J);
    VectorXd step = positive_factor(held(contact, at, J), parts_->K).solve(-at.gradient);
    const double longest = step.cwiseAbs().maxCoeff(), most = most_of_cell * parts_->nodes->field.edge();
    if (longest > most) step *= most / longest;
    const double size = std::sqrt(std::max(step.dot(parts_->K * step), 0.0));
    largest_q_ = std::max(largest_q_, std::sqrt(std::max(q_.dot(parts_->K * q_), 0.0)));
    report.residual = size / std::max(largest_q_, smallest);
    report.converged = report.residual <= tolerance;
    if (report.residual <= rounding || report.steps == most_steps) break;
    if (!go_down(contact, step, at, tried)) break;
    std::swap(at, tried);
    if (report.converged) break;
  }
  rests_ = loaded_.empty() && report.converged;
  E_ = at.E;
  dE_ = at.dE;
  forces_.clear();
  for (Eigen::Index k = 0; k < std::ssize(loaded_); ++k) {
    for (Eigen::Index axis = 0; axis < d; ++axis) forces_.push_back(at.f[3 * k + axis]);
  }
  report.small_strain = small_strain(contact, at.f);
  find_remainder(at);
  find_displacement();
  keep_columns(contact, at, J);
  return report;
}

/// Keeps J of the loaded nodes, of which `J` has the dofs that move them, in their frames.
void TwoLevels::keep_columns(const Contact& contact, const Look& at, const MatrixXd& J) {
  columns_.clear();
  for (Eigen::Index k = 0; k < std::ssize(loaded_); ++k) {
    CoarseColumn column{loaded_[static_cast<std::size_t>(k)], MatrixXd::Zero(q_.size(), dimension_)};
    const MatrixXd turned = at.R[static_cast<std::size_t>(k)] * J.middleRows<3>(3 * k);
    for (std::size_t i = 0; i < contact.dofs.size(); ++i)
      column.J.row(contact.dofs[i]) = turned.col(static_cast<Eigen::Index>(i)).head(dimension_).transpose();
    columns_.push_back(std::move(column));
  }
}

/// Sum of forces f + A^T lambda that by small strain hold the groups where they are along their forces, and
/// are free to move across: A Xi (f + A^T lambda) = A u.
Vec3 TwoLevels::small_strain(const Contact& contact, const VectorXd& f) const {
  const auto k_all = std::ssize(loaded_);
  if (k_all == 0) return Vec3::Zero();
  Eigen::Matrix3Xd along = Eigen::Matrix3Xd::Zero(3, contact.groups);
  for (Eigen::Index k = 0; k < k_all; ++k)
    along.col(contact.group[static_cast<std::size_t>(k)]) += f.segment<3>(3 * k);
  along.colwise().normalize();
  MatrixXd A = MatrixXd::Zero(contact.groups, 3 * k_all);
  VectorXd u(3 * k_all);
  for (Eigen::Index k = 0; k < k_all; ++k) {
    const auto at = static_cast<std::size_t>(k);
    u.segment<3>(3 * k) = contact.u[at];
    A.block<1, 3>(contact.group[at], 3 * k) = contact.share[at] * along.col(contact.group[at]).transpose();
  }
  const MatrixXd A_Xi = A * Xi_;
  MatrixXd S = A_Xi * A.transpose();
  S.diagonal().array() += floor_of_group * largest_;
  const VectorXd lambda = Eigen::LDLT<MatrixXd>(S).solve(A * u - A_Xi * f);
  return f.reshaped(3, k_all).rowwise().sum() + along * lambda;
}

/// s of all stored nodes: (Xi - P K_c^-1 P^T) R^T f.
void TwoLevels::find_remainder(const Look& at) {
  const CoarseNodes& coarse = *parts_->nodes;
  std::fill(s_.begin(), s_.end(), 0.0);
  if (loaded_.empty()) return;
  const Eigen::Index d = dimension_;
  std::vector<double> phi(forces_.size());
  VectorXd P_f = VectorXd::Zero(q_.size());
  for (std::size_t k = 0; k < loaded_.size(); ++k) {
    const Vec3 force = at.phi.segment<3>(3 * static_cast<Eigen::Index>(k));
    set_vector(phi, dimension_, static_cast<Index>(k), force);
    for_each_weight(loaded_[k],
                    [&](Index dof, double weight, Eigen::Index axis) { P_f[dof] += weight * force[axis]; });
  }
  greens_->displacement(loaded_, phi, s_);
  const VectorXd q = coarse.compliance * P_f;
  for (Index node = 0; node < greens_->nodes(); ++node) {
    double* s = s_.data() + d * node;
    for_each_weight(node, [&](Index dof, double weight, Eigen::Index axis) { s[axis] -= weight * q[dof]; });
  }
}

void TwoLevels::find_displacement() {
  for (Index node = 0; node < greens_->nodes(); ++node) {
    const Vec3 s = vector_at(s_, dimension_, node);
    const auto [moved, R, G] = at_node(node, q_);
    turns_[static_cast<std::size_t>(node)] = {.R = R, .T = R * cross_matrix(s) * G};
    set_vector(u_, dimension_, node, moved + R * s);
  }
}

TwoLevelState TwoLevels::state(std::vector<Index> near) {
  const MatrixXd of_turns = H_ - tangent_;
  renew_tangent(dE_, most_lag_of_compliance);
  return {.nodes = parts_->nodes,
          .turns = turns_,
          .H_inverse = stiff_inverse(tangent_, of_turns, parts_->K),
          .columns = columns_,
          .near = std::move(near)};
}

}  // namespace palpate
