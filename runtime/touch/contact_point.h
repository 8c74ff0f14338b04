// Where a tool and the deformed surface can touch.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "meshes/mesh.h"

namespace palpate {

/// A place of the surface where the tool touches or may touch within this tick. The material point of the
/// surface is fixed during the tick: sum of weights[k] times surface node nodes[k] (Body::simplices'
/// numbering).
struct ContactPoint {
  std::int64_t feature = 0;  ///< the vertex, edge or face of the surface and the place on the tool: what
                             ///< makes a contact the same one in the next tick
  Index tool = 0;            ///< number of the tool
  Index simplex = -1;
  std::array<Index, 3> nodes{-1, -1, -1};  ///< surface nodes; -1 where the weight is 0
  std::array<double, 3> weights{};
  Index aggregate = -1;  ///< the group of surface nodes (Body::aggregates) that it stands for, by one of its
                         ///< members; position, gap and the like are means, the force acts on all. -1: none
  Vec3 position = Vec3::Zero();  ///< of the surface there, at the beginning of the tick [m]
  Vec3 arm = Vec3::Zero();       ///< from the tool's origin to it [m]
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();  ///< columns: normal, out of the body; two tangents
  double gap = 0.0;       ///< between tool and surface along the normal, at the beginning of the tick [m]
  double free_gap = 0.0;  ///< that of the tick's device pose and the body at rest: below 0, how deep [m]
  double friction = 0.0;  ///< Coulomb's coefficient
  std::array<Vec3, 3> slope{Vec3::Zero(), Vec3::Zero(),
                            Vec3::Zero()};  ///< gradient of each weight along the edge or
                                            ///< face; zero for a vertex [1/m]
  bool held = false;                        ///< by a grab: bilateral, and it does not slide
  bool rolls = false;  ///< of a sphere without friction: its normal turns with the tool's motion (rolling.h),
                       ///< its force goes through the tool's origin
  bool rigid = false;  ///< the body gives way there by less than SurfaceState::least_compliance
  Vec3 tool_point =
      Vec3::Zero();           ///< held: the place in the tool's own frame that stays with the surface [m]
  Vec3 force = Vec3::Zero();  ///< on the tool, after the tick [N]
  Vec3 carry = Vec3::Zero();  ///< sticking: what the solver let it slide in the tick, and is to undo [m]
};

/// A place where a tool may press on the surface and for which there was no room: a contact point, or a
/// simplex that was not looked at. By the node of the surface that is nearest to it.
struct LeftOut {
  Index tool = -1;
  Index node = -1;              ///< of the surface
  Vec3 normal = Vec3::Zero();   ///< out of the body
  Vec3 apart = Vec3::Zero();    ///< the tool's place less the node's when it was found [m]
  double gap = 0.0;             ///< then [m]
  double contact_points = 1.0;  ///< that it stands for: a vertex has two triangles or one line
};

/// The most that the size of the force's error is taken from, which then are each n-th of those left out.
inline constexpr std::size_t most_sampled = 256;

}  // namespace palpate
