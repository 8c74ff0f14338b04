// The picture of the surface that follows from the forces of contacts.
#pragma once

#include <vector>

#include "formats/recording.h"
#include "runtime/background/surface_stress.h"
#include "runtime/body/body.h"

namespace palpate {

/// Whether all of the surface follows from contact forces alone: Green's functions move the body, without
/// dynamics, warp or overlay.
[[nodiscard]] bool pictures_follow_from_contacts(const Body& body) noexcept;

/// Computes displacement, von Mises stress and contact pressure of all surface nodes.
class PictureMaker {
 public:
  /// `body` must live as long, and `pictures_follow_from_contacts`.
  explicit PictureMaker(const Body& body);

  /// Throws Error where a node is none of the surface.
  [[nodiscard]] SurfaceFrame picture(const ContactLoads& loads);

 private:
  const Body& body_;
  std::vector<Vec3> rest_;      // [S] u0
  std::vector<double> stored_;  // [n] scratch
  std::vector<Vec3> u_;         // [S] u, then u0 + u
  SurfaceStress stress_;
  std::vector<Vec3> force_;           // [S] of the contacts
  std::vector<Stress> nodal_stress_;  // [S]
};

}  // namespace palpate
