// Pictures of the surface computed from the forces on it.
#pragma once

#include <span>
#include <vector>

#include "formats/recording.h"
#include "runtime/background/surface_stress.h"
#include "runtime/body/body.h"
#include "runtime/core/body/free_motion.h"
#include "runtime/core/body/surface_load.h"

namespace palpate {

/// True if a picture follows from the contact forces alone, and on two levels from those and the coarse
/// field: the body is displaced by its Green's functions, without dynamics or the patches of an overlay.
[[nodiscard]] bool pictures_follow_from_contacts(const Body& body) noexcept;

/// Leaves what a recording has of a picture: the surface of the body's own mesh where tools meet a finer one
/// (LocalCompliance), else all.
void keep_recorded(const Body& body, SurfaceFrame& frame);

/// Normal force of a closed contact point on a surface node [N].
struct NodalPress {
  Index node = -1;
  double force = 0.0;
};

/// Force on the body at a surface node [N].
struct NodalForce {
  Index node = -1;
  Vec3 force = Vec3::Zero();
};

/// Combines them into loads without duplicate nodes.
[[nodiscard]] ContactLoads contact_loads(std::span<const NodalForce> forces,
                                         std::span<const NodalPress> presses);

/// Computes displacement, von Mises stress and contact pressure of all surface nodes.
class PictureMaker {
 public:
  /// `body` must outlive this.
  explicit PictureMaker(const Body& body);

  /// Computes a frame from the forces of a tick, except its time; `motion`: see surface_displacement. With a
  /// local compliance of the surface's nodes only those of the body's own mesh and of `fine_part` are right.
  void show(const SurfaceLoad& load, const MotionSnapshot* motion, std::span<const NodalForce> forces,
            std::span<const NodalPress> presses, SurfaceFrame& frame);
  /// [n] displacement of the stored nodes in the last picture [m].
  [[nodiscard]] std::span<const double> stored_displacement() const noexcept { return stored_; }

  /// The elements round the forces, which are to be drawn as finely as tools meet them where that is finer
  /// than the body and there is no patch; null: none.
  [[nodiscard]] std::shared_ptr<const Patch> fine_part(const SurfaceLoad& load);

  /// Returns a picture of a recording, for a body with `pictures_follow_from_contacts`. Throws Error if a
  /// node is not on the surface.
  [[nodiscard]] SurfaceFrame picture(const ContactLoads& loads);

 private:
  /// Has the body move by its coarse field [n_q], and the load's compliance turn with it.
  void follow_field(const std::vector<float>& field, SurfaceLoad& load, MotionSnapshot& motion) const;
  void show_stress(std::span<const NodalForce> forces, const Patch* patch, SurfaceFrame& frame);
  void show_pressure(std::span<const NodalPress> presses, SurfaceFrame& frame) const;

  const Body& body_;
  std::vector<Vec3> rest_;      // [S] u0
  std::vector<double> stored_;  // [n]
  std::vector<Vec3> u_;         // [S] u, then u0 + u
  SurfaceStress stress_;
  std::vector<Vec3> force_;            // [S] contact forces
  std::vector<Stress> nodal_stress_;   // [S]
  std::shared_ptr<const Patch> part_;  // of the last picture
  Eigen::AlignedBox3d box_of_part_;    // forces within it keep the part
};

}  // namespace palpate
