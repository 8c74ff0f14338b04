// Contact points between a tool and the deformed surface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "base/vectors.h"

namespace palpate {

/// Point of the surface at which the tool touches or may touch within this tick. Its material point is fixed
/// during the tick: the sum of weights[k] times surface node nodes[k] (numbering of ElasticBody::simplices).
struct ContactPoint {
  std::int64_t feature = 0;  ///< identifier (contact_feature.h), which is the same for the same contact in
                             ///< the next tick
  Index tool = 0;            ///< number of the tool
  Index simplex = -1;
  std::array<Index, 3> nodes{-1, -1, -1};  ///< surface nodes; -1 where the weight is 0
  std::array<double, 3> weights{};
  Index aggregate =
      -1;  ///< group of surface nodes (ElasticBody::aggregates) that it represents by one of its
           ///< members: position, gap and the like are means, the force acts on all. -1: none
  Vec3 position = Vec3::Zero();  ///< position of the surface point at the beginning of the tick [m]
  Vec3 arm = Vec3::Zero();       ///< from the tool's origin to the position [m]
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();  ///< columns: outward normal of the body, two tangents
  double gap = 0.0;       ///< distance of tool and surface along the normal at the beginning of the tick [m]
  double free_gap = 0.0;  ///< gap between the tick's device pose and the body at rest; negative: depth [m]
  double friction = 0.0;  ///< Coulomb coefficient
  std::array<Vec3, 3> slope{Vec3::Zero(), Vec3::Zero(),
                            Vec3::Zero()};  ///< gradient of each weight along the edge or face; zero for a
                                            ///< vertex [1/m]
  bool held = false;                        ///< held by a grab: bilateral, without sliding
  bool rolls = false;  ///< contact of a sphere without friction: its normal rotates with the tool's motion
                       ///< (rolling.h), its force passes through the tool's origin
  bool rigid = false;  ///< the compliance there is below SurfaceState::least_compliance
  Vec3 tool_point = Vec3::Zero();  ///< held: point in the tool's frame that moves with the surface [m]
  Vec3 force = Vec3::Zero();       ///< force on the tool after the tick [N]
  Vec3 carry = Vec3::Zero();       ///< sticking: slip allowed by the solver in the tick, to be undone [m]
};

/// Contact that exceeds the capacity: a contact point, or a simplex that was not examined. Given by the
/// nearest surface node.
struct LeftOut {
  Index tool = -1;
  Index node = -1;              ///< surface node
  Vec3 normal = Vec3::Zero();   ///< outward normal of the body
  Vec3 apart = Vec3::Zero();    ///< position of the tool's point minus that of the node when found [m]
  double gap = 0.0;             ///< gap when found [m]
  double contact_points = 1.0;  ///< contact points that it represents: a vertex has two triangles or one line
};

/// Largest number of left-out contacts from which the force error is estimated; of more, every n-th is used.
inline constexpr std::size_t most_sampled = 256;

}  // namespace palpate
