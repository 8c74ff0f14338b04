// Balance of a body on two levels: a coarse field with large rotation, and the linear remainder.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "runtime/core/body/two_level_greens.h"
#include "runtime/depth/coarse_parts.h"

namespace palpate {

/// Statistics of a search for balance.
struct TwoLevelReport {
  bool converged = false;
  int steps = 0;          ///< Newton's
  double residual = 0.0;  ///< last change of q relative to the largest q so far, in the norm of K_c
  /// Sum of the forces by which small strain would hold the nodes where they are along their forces [N].
  Vec3 small_strain = Vec3::Zero();
};

/// Displacement on two levels, u_i = P_i q + R_i s_i with s = (Xi - P K_c^-1 P^T) R^T f: q is a coarse field
/// of large rotation, R_i its rotation at node i, and s what small strain leaves (docs/depth.md). For
/// given positions of the loaded nodes it is a minimisation in q; without rotation it is u = Xi f.
class TwoLevels {
 public:
  /// `parts` must outlive it.
  TwoLevels(const CoarseParts& parts, std::shared_ptr<const Greens> greens);

  void rest();

  /// Goes on to the balance under forces f [dm] on m stored nodes that are held at displacements u [dm] on
  /// average: forces are changed in groups until groups of nodes are there, one node each while they are few.
  TwoLevelReport find(std::span<const Index> nodes, std::span<const double> f, std::span<const double> u,
                      double tolerance, int most_steps);

  /// Nodes loaded in the last balance, each once, and their forces [dm] [N].
  [[nodiscard]] std::span<const Index> loaded() const noexcept { return loaded_; }
  [[nodiscard]] const std::vector<double>& forces() const noexcept { return forces_; }
  /// The coarse field q at the balance [n_q] [m].
  [[nodiscard]] std::span<const double> field() const noexcept {
    return {q_.data(), static_cast<std::size_t>(q_.size())};
  }
  /// Displacement of all stored nodes at the balance [n] [m].
  [[nodiscard]] const std::vector<double>& displacement() const noexcept { return u_; }
  /// Rotation of each stored node, and what it does to the remainder [nodes].
  [[nodiscard]] const std::vector<CoarseTurn>& turns() const noexcept { return turns_; }
  /// Compliance at the balance: the change of displacements by forces. `near`: TwoLevelState::near.
  [[nodiscard]] TwoLevelState state(std::vector<Index> near);

 private:
  struct Contact;
  struct Look;

  /// The coarse field at a stored node: displacement, rotation, and spin by the skew part (spin_of_skew).
  struct AtNode {
    Vec3 moved = Vec3::Zero();
    Mat3 R = Mat3::Identity(), G = Mat3::Zero();
  };

  [[nodiscard]] AtNode at_node(Index node, const Eigen::VectorXd& q) const;
  void set_loaded(std::span<const Index> nodes);
  void renew_tangent(const Eigen::VectorXd& dE, double most);
  template <class Visit>
  void for_each_weight(Index node, const Visit& visit) const;
  [[nodiscard]] Vec3 small_strain(const Contact& contact, const Eigen::VectorXd& f) const;
  void find_remainder(const Look& at);
  void find_displacement();
  void make_contact(std::span<const Index> nodes, std::span<const double> f, std::span<const double> u,
                    Contact& contact) const;
  void look(const Contact& contact, const Eigen::VectorXd& q, Look& at) const;
  void add_moments(Look& at) const;
  [[nodiscard]] Eigen::MatrixXd held(const Contact& contact, const Look& at, const Eigen::MatrixXd& J) const;
  bool go_down(const Contact& contact, const Eigen::VectorXd& step, const Look& at, Look& tried);
  void keep_columns(const Contact& contact, const Look& at, const Eigen::MatrixXd& J);
  [[nodiscard]] Eigen::MatrixXd hessian(const Contact& contact, const Look& at, Eigen::MatrixXd* J) const;

  const CoarseParts* parts_;
  std::shared_ptr<const Greens> greens_;
  int dimension_;
  Eigen::VectorXd q_, q_tangent_, dE_tangent_;  // where `tangent_` is that of E, and its derivative there
  Eigen::MatrixXd tangent_;
  double largest_q_ = 0.0;  // so far, in the norm of K_c
  double E_ = 0.0;          // energy of the coarse body at q_, and its derivative
  Eigen::VectorXd dE_;
  bool rests_ = true;  // in balance without a load
  std::vector<Index> loaded_;
  std::vector<double> forces_;
  double largest_ = 0.0;  // compliance of a loaded node at rest [m/N]
  Eigen::MatrixXd Xi_;    // [3k x 3k] Green's functions of `loaded_`
  Eigen::MatrixXd M_;     // [3k x 3k] the remainder's
  Eigen::MatrixXd H_;     // of the last balance
  std::vector<CoarseColumn> columns_;
  std::vector<double> s_, u_;  // [n] remainder and displacement of all stored nodes
  std::vector<CoarseTurn> turns_;
};

}  // namespace palpate
