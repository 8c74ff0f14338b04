// What a tool feels that moves over an elastic body: contact over the whole surface, beside the tick's
// detection, near field, merging and solvers.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <map>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/core/touch/tool.h"
#include "tests/support/second_routes/coulomb_solver.h"

namespace palpate::test {

/// The statement, for a sphere or capsule that moves without turning and is stiff against the body: no point
/// of the deformed surface is in the tool; the forces are along the normals where the two touch and push.
/// With friction, what the tool slides over the surface in a tick is opposed by it (Coulomb, implicit), or it
/// does not slide. The surface is its triangles; but for a sphere of more than three edges of a triangle, of
/// that triangle only its nodes, as the runtime has it (tuning.detection.smooth_radius).
///
/// Each vertex, edge and face seen from outside has a contact point where the tool's core is nearest to it.
/// The compliance of all is that of Greens; forces and displacements are in double precision. Newton's method
/// about the displacement: normals turn and feet move by derivatives of the gaps that are taken by
/// differences.
class SurfaceTruth {
 public:
  SurfaceTruth(const Body& body, const Tool& tool, double friction,
               const Eigen::Quaterniond& orientation = Eigen::Quaterniond::Identity());

  /// A tick that takes the tool to `place` [m]. What it feels, about its origin.
  Wrench step(const Vec3& place);

  /// Processor time [s] in which the tick from here to `place` is solved by dense algebra that is made anew:
  /// W of the contact points that are shut or may come to be, and its factors; until `tolerance`.
  [[nodiscard]] double dense_seconds(const Vec3& place, double tolerance) const;

  [[nodiscard]] int closed() const;  ///< contact points that carry force
  [[nodiscard]] int candidates() const { return static_cast<int>(contacts_.size()); }
  [[nodiscard]] int passes() const { return passes_; }  ///< of the last step
  /// What the solver left over in the last step [largest force].
  [[nodiscard]] double residual() const { return residual_; }
  /// How far the last pass still moved a node [m].
  [[nodiscard]] double last_move() const { return last_move_; }
  /// How deep a node is in the tool, of the whole surface [m].
  [[nodiscard]] double penetration() const { return penetration_; }

 private:
  /// A vertex, edge or face by its nodes; of a face also which end of the core it meets.
  using Piece = std::array<Index, 4>;
  struct Contact {
    Piece piece{};
    std::array<double, 3> weights{};
    Vec3 normal = Vec3::Zero();
    Vec3 foot = Vec3::Zero();  // on the surface [m]
    double gap = 0.0;
    Vec3 force = Vec3::Zero();  // on the tool [N]
  };
  using Corners = std::array<Vec3, 3>;

  [[nodiscard]] std::array<Vec3, 2> core() const;
  [[nodiscard]] bool touch(const Piece& piece, const Corners& at, Contact& contact) const;
  void find_pieces();
  void add_pieces_of(std::size_t triangle, std::map<Piece, bool>& found) const;
  void number_near_nodes();
  Index slot_of(Index node);
  [[nodiscard]] Corners corners_of(const Piece& piece, const Eigen::VectorXd& u) const;
  void find_contacts();
  [[nodiscard]] Eigen::SparseMatrix<double> geometric_stiffness(double share) const;
  [[nodiscard]] Eigen::SparseMatrix<double, Eigen::RowMajor> rows() const;
  void state_problem(const Vec3& way);
  double solve_pass(const Vec3& way, double tolerance);
  void take_forces();
  void renew_surface();
  bool is_out_of_sight();
  void look();
  void stiffen(bool turning);
  void settle(const Vec3& way);
  [[nodiscard]] Wrench wrench(const Vec3& origin) const;

  const Body& body_;
  Tool tool_;
  Eigen::Quaterniond orientation_;
  double margin_;           // [m] what may come to touch in a tick
  bool is_linear_ = false;  // the problem is stated about where the tick began
  bool placed_ = false;
  Vec3 place_ = Vec3::Zero();
  std::vector<Vec3> at_;               // [S] the surface
  std::vector<Vec3> previous_;         // [S] where the tick began
  std::vector<Piece> pieces_;          // that may touch
  std::vector<Index> near_;            // their nodes
  std::map<Index, Index> near_place_;  // of a node
  std::map<Index, Index> slot_;        // of a node in C_
  std::vector<Index> stored_;          // [slots]
  Eigen::MatrixXd C_;                  // compliance of all nodes that have been near
  Eigen::MatrixXd C_near_, stiffened_;
  Eigen::VectorXd before_, u_;  // [3 near] displacement before the tick, and now
  std::vector<Contact> contacts_;
  std::map<Piece, Contact> last_;  // those with a force
  Eigen::SparseMatrix<double, Eigen::RowMajor> J_;
  Eigen::SparseMatrix<double> A_;
  CoulombSolver solver_;
  int passes_ = 0;
  double residual_ = 0.0, last_move_ = 0.0, penetration_ = 0.0;
};

}  // namespace palpate::test
