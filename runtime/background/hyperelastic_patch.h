// Overlay patch with a neo-Hookean interior, in a body that is linear outside.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "overlay/condensation.h"
#include "runtime/body/make_patch.h"
#include "statics/live_body.h"

namespace palpate {

struct PatchEffort {
  double tolerance = 1e-8;  ///< norm of the residual forces, relative to the largest norm of forces so far
  int most_steps = 3;       ///< Newton steps
};

/// Result of the search for a patch's balance.
struct PatchBalance {
  bool converged = false;
  int steps = 0;
  int cuts = 0;           ///< number of times that a step was halved because the energy did not decrease
  double residual = 0.0;  ///< relative residual, see PatchEffort::tolerance
  Index inverted = 0;     ///< quadrature points with a volume of zero or less, at the end
};

/// Finds the displacement by surface forces of a body whose patch is neo-Hookean: the minimum of the energy
/// of the patch's fine mesh and of the linear body around it, represented by its Green's functions
/// (docs/overlays.md). The rest state under the body's loads is kept: there the patch is deformed by u0 and
/// in balance. For one thread at a time.
class HyperelasticPatch {
 public:
  /// `body` must outlive this. Throws Error if the material has initial strain, which the law does not
  /// include, or a node of the patch is not stored.
  HyperelasticPatch(const Body& body, PatchMesh mesh);

  /// Moves from the present state towards the balance under forces [N] on surface nodes (Body::simplices); a
  /// node may occur several times.
  PatchBalance find(std::span<const Index> surface_nodes, std::span<const Vec3> forces,
                    const PatchEffort& effort = {});
  /// Returns the patch from the tangent at the state where `find` ended. Under the forces given there, it
  /// displaces the surface to that state, or to the next Newton iterate. Null if there is no positive
  /// tangent.
  [[nodiscard]] std::shared_ptr<const Patch> linearise();

  [[nodiscard]] const PatchMesh& mesh() const noexcept { return mesh_; }
  /// Displacement [d local nodes] of the fine mesh relative to rest [m].
  [[nodiscard]] Eigen::VectorXd local_displacement() const { return displacement(place_); }

 private:
  struct Place {
    Eigen::VectorXd u_Q;  // [d g] displacement of the body's nodes
    Eigen::VectorXd u_L;  // [free local dofs] additional displacement of the fine mesh
  };
  /// The given forces in the form used by the search.
  struct Load {
    Eigen::VectorXd local;   // [d local nodes] on the patch's surface
    Eigen::VectorXd beside;  // [d g] displacement of Q by forces outside the patch, without the patch
  };
  /// Energy and forces at a state.
  struct Look {
    double energy = 0.0;
    double size = 0.0;         // size of the forces so far [N]
    Eigen::VectorXd internal;  // [d local nodes] internal forces minus those at rest
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
  CondensationMemory memory_;
  Condensation condensation_;
  std::vector<Index> stored_;            // [g] Q
  std::vector<Index> local_of_surface_;  // [S] local node, -1 outside the patch
  Eigen::MatrixXd stiffness_;            // [d g x d g] Xi_QQ^-1: the linear body condensed onto Q
  Eigen::MatrixXd linear_;               // [d g x d g] part of it from the patch's own elements
  Eigen::VectorXd at_rest_;              // [d local nodes] positions under the body's loads
  Eigen::VectorXd rest_forces_;          // [d local nodes] internal forces there
  double rounding_;                      // forces below this are rounding [N]
  Place place_;
  LiveMatrix K_;
  Eigen::LLT<Eigen::MatrixXd> around_;  // factor of the whole body, condensed onto Q
};

}  // namespace palpate
