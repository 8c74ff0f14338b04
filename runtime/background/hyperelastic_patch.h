// An overlay patch whose interior is neo-Hookean, in a body that is linear outside of it.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "overlay/tangent_condensation.h"
#include "runtime/body/patch.h"
#include "statics/live_body.h"

namespace palpate {

struct PatchEffort {
  double tolerance = 1e-8;  ///< norm of the forces left, of the largest norm of forces in the way
  int most_steps = 3;       ///< of Newton's method
};

/// How the search for a patch's balance went.
struct PatchBalance {
  bool converged = false;
  int steps = 0;
  int cuts = 0;           ///< times that a step was cut in half, as the energy did not fall
  double residual = 0.0;  ///< as PatchEffort::tolerance has it
  Index inverted = 0;     ///< quadrature points whose volume is zero or less, at the end
};

/// Finds where forces on the surface take a body whose patch is neo-Hookean: the energy of the patch's fine
/// mesh, and of the linear body around it by its Green's functions, is least (docs/overlays.md). The
/// body's rest under its loads is kept: there the patch is deformed by u0, and in balance. For one thread at
/// a time.
class HyperelasticPatch {
 public:
  /// `body` must live as long. Throws Error where the material has initial strain, as the law has no place
  /// for it, or a node of the patch is not stored.
  HyperelasticPatch(const Body& body, PatchMesh mesh);

  /// Back to the body without forces.
  void rest();
  /// Goes from where it is towards the balance under forces [N] on surface nodes (Body::simplices); one node
  /// may come several times.
  PatchBalance find(std::span<const Index> surface_nodes, std::span<const Vec3> forces,
                    const PatchEffort& effort = {});
  /// The patch by the tangent where `find` has ended. Under the forces that it was given, the patch moves the
  /// surface there, or where the next step of Newton's method goes. Null where there is no positive tangent.
  [[nodiscard]] std::shared_ptr<const Patch> linearise();

  [[nodiscard]] const PatchMesh& mesh() const noexcept { return mesh_; }
  /// Displacement [d local nodes] of the fine mesh, on top of the rest [m].
  [[nodiscard]] Eigen::VectorXd local_displacement() const { return displacement(place_); }

 private:
  struct Place {
    Eigen::VectorXd u_Q;  // [d g] of the body's nodes
    Eigen::VectorXd u_L;  // [free local dofs] of the fine mesh beside them
  };
  /// The forces that are given, as the search wants them.
  struct Load {
    Eigen::VectorXd local;   // [d local nodes] on the patch's surface
    Eigen::VectorXd beside;  // [d g] displacement of Q by forces beside the patch, without it
  };
  /// What a place is like.
  struct Look {
    double energy = 0.0;
    double size = 0.0;         // of the forces in the way [N]
    Eigen::VectorXd internal;  // [d local nodes] beyond those at rest
    Eigen::VectorXd left_Q, left_L;
    Index inverted = 0;
  };

  [[nodiscard]] Load read(std::span<const Index> surface_nodes, std::span<const Vec3> forces) const;
  [[nodiscard]] Eigen::VectorXd displacement(const Place& place) const;
  [[nodiscard]] Look look(const Place& place, const Load& load) const;
  [[nodiscard]] Eigen::VectorXd free_part(const Eigen::VectorXd& local) const;
  [[nodiscard]] bool set_tangent(const Eigen::VectorXd& forces);
  [[nodiscard]] bool direction(const Look& look, Place& step);
  [[nodiscard]] double share_of(const Look& look, double largest) const;

  const Body& body_;
  PatchMesh mesh_;
  LiveBody live_;
  TangentCondensation condensation_;
  std::vector<Index> stored_;            // [g] Q
  std::vector<Index> local_of_surface_;  // [S] local node, -1 beside the patch
  Eigen::MatrixXd stiffness_;            // [d g x d g] Xi_QQ^-1: the linear body seen from Q
  Eigen::MatrixXd linear_;               // [d g x d g] the part that the patch's own elements have in it
  Eigen::VectorXd at_rest_;              // [d local nodes] positions under the body's loads
  Eigen::VectorXd rest_forces_;          // [d local nodes] and internal forces there
  double rounding_;                      // forces that are none [N]
  Place place_;
  LiveMatrix K_;
  Eigen::LLT<Eigen::MatrixXd> around_;  // of the whole body, condensed onto Q
};

}  // namespace palpate
