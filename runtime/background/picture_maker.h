// The picture of the surface that follows from the forces on it.
#pragma once

#include <span>
#include <vector>

#include "formats/recording.h"
#include "runtime/background/surface_stress.h"
#include "runtime/body/body.h"
#include "runtime/body/free_motion.h"
#include "runtime/body/surface_load.h"

namespace palpate {

/// Whether all of a picture follows from contact forces alone: the body's Green's functions move it, without
/// dynamics, warp or overlay.
[[nodiscard]] bool pictures_follow_from_contacts(const Body& body) noexcept;

/// What a closed contact point presses a surface node with along its normal [N].
struct NodalPress {
  Index node = -1;
  double force = 0.0;
};

/// A force on the body at a surface node [N].
struct NodalForce {
  Index node = -1;
  Vec3 force = Vec3::Zero();
};

/// These in short: each node once.
[[nodiscard]] ContactLoads contact_loads(std::span<const NodalForce> forces,
                                         std::span<const NodalPress> presses);

/// Computes displacement, von Mises stress and contact pressure of all surface nodes.
class PictureMaker {
 public:
  /// `body` must live as long.
  explicit PictureMaker(const Body& body);

  /// What a frame shows of the forces of a tick, but for its time; `motion`: as of surface_displacement.
  void show(const SurfaceLoad& load, const MotionSnapshot* motion, std::span<const NodalForce> forces,
            std::span<const NodalPress> presses, SurfaceFrame& frame);
  /// [n] displacement of the stored nodes in the last picture [m].
  [[nodiscard]] std::span<const double> stored_displacement() const noexcept { return stored_; }

  /// The picture of a recording, of a body of which `pictures_follow_from_contacts`. Throws Error where a
  /// node is none of the surface.
  [[nodiscard]] SurfaceFrame picture(const ContactLoads& loads);

 private:
  void show_stress(std::span<const NodalForce> forces, const Patch* patch, SurfaceFrame& frame);
  void show_pressure(std::span<const NodalPress> presses, SurfaceFrame& frame) const;

  const Body& body_;
  std::vector<Vec3> rest_;      // [S] u0
  std::vector<double> stored_;  // [n]
  std::vector<Vec3> u_;         // [S] u, then u0 + u
  SurfaceStress stress_;
  std::vector<Vec3> force_;           // [S] of the contacts
  std::vector<Stress> nodal_stress_;  // [S]
};

}  // namespace palpate
