// Motions of a spherical tool over a body at rest, for benchmarks and studies of contact. Bodies in space
// only.
#pragma once

#include <cstdint>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/core/solve/surface_tree.h"
#include "runtime/core/touch/tool.h"

namespace palpate::test {

inline constexpr double tick = 1e-3;  ///< [s]

/// The body's surface at rest, to lay paths on.
class RestSurface {
 public:
  /// Throws Error for a body in the plane.
  explicit RestSurface(const Body& body);

  /// A place of the surface.
  struct Place {
    Vec3 position = Vec3::Zero();
    Vec3 normal = Vec3::Zero();  ///< outward, unit, interpolated between the nodes
    bool free = false;           ///< all nodes of its simplex are free
  };

  /// The place nearest to a point.
  [[nodiscard]] Place nearest(const Vec3& point) const;
  /// A node of the surface that is free, as a place.
  [[nodiscard]] Place free_node(std::uint64_t choice) const;
  /// How far a point is from the surface, negative inside the body [m].
  [[nodiscard]] double distance(const Vec3& point) const;
  /// Mean normal, unit, of the nodes within a distance of a point.
  [[nodiscard]] Vec3 mean_normal(const Vec3& point, double within) const;

 private:
  [[nodiscard]] Place place(const NearestSimplex& found) const;

  const Body& body_;
  SurfaceTree tree_;
  std::vector<Vec3> normals_;  // [S] area-weighted
};

/// Random palpation: a sphere wanders over the whole touchable surface as a hand might, presses, slides at
/// changing speeds, lifts off, and now and then grabs what it presses, moves with it and lets go. Smooth, and
/// the same for the same seed.
struct Palpation {
  double radius = 0.005;  ///< of the sphere [m]
  double most_depth =
      0.006;                ///< that it presses in [m]; 0.3 of it (or of the radius) more where it is hollow
  double most_speed = 0.2;  ///< of the device [m/s]
  double turning = 0.0;     ///< of the device, about an axis that changes [rad/s]
  bool steady = false;      ///< always at that depth and speed, without lifting or grabbing
  std::uint64_t seed = 1;
};

/// A device pose for each of `ticks` ticks. The first is clear of the body.
std::vector<ToolPose> palpation_poses(const Body& body, const Palpation& palpation, std::int64_t ticks);

/// A line over the surface at rest along which a sphere just touches it: equally spaced centres of the
/// sphere, and the direction in which it is pressed.
struct Track {
  std::vector<Vec3> centres;
  Vec3 inward = Vec3::Zero();  ///< unit
  double spacing = 0.0;        ///< along the straight line that the track follows [m]
};

/// `count` tracks of a length, spread over the free surface, each seen from its mean normal and nowhere
/// steeper than 45 degrees to it; fewer where the surface has not got them.
std::vector<Track> lay_tracks(const Body& body, double radius, double length, int count);

/// A sphere that comes to a track from 1 mm above, presses in by `depth` in a second, waits for a tenth,
/// speeds up in a tenth and slides along the track at `speed`. `first_slide`: the tick in which it begins to
/// move sideways.
struct Slide {
  std::vector<ToolPose> poses;
  std::size_t first_slide = 0;
};
Slide slide_along(const Track& track, double depth, double speed);

}  // namespace palpate::test
