// The body's own compliance close to a contact, in place of its mesh's.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "base/vectors.h"
#include "runtime/core/body/greens.h"

namespace palpate {

class ElasticBody;
class LocalPoints;

/// Compliance between points of the surface whose near part is that of the elastic half-space (Boussinesq
/// 1885, Cerruti 1882) and not the mesh's, which is stiffer the smaller the contact:
///
///   W_ij = N_i (Xi - D) N_j^T + B(x_i - x_j).
///
/// B is the half-space's compliance, with the images of the force in sharp edges of the body, faded out
/// within four edges. D is what Xi has in its place: the same B between nodes, and at a node and beside it
/// all but the mean of Xi - B at the ring of nodes around these, where the mesh is right. So W no longer
/// depends on the mesh, nor on the place within it (docs/theory-contact.md). Const once made; any number of
/// threads may use it.
class LocalCompliance {
 public:
  /// For a body in space of Young's modulus E [Pa] and Poisson's ratio nu, whose own triangles are `mesh` [3
  /// x number], surface nodes; `body` is needed until this is made.
  LocalCompliance(const ElasticBody& body, std::span<const Index> mesh, double E, double nu);
  ~LocalCompliance();
  LocalCompliance(const LocalCompliance&) = delete;
  LocalCompliance& operator=(const LocalCompliance&) = delete;

  /// Xi - D.
  [[nodiscard]] const Greens& smooth() const noexcept { return *smooth_; }
  /// A node of the surface at rest.
  struct Point {
    Vec3 x = Vec3::Zero(), normal = Vec3::Zero();
    Vec3 share = Vec3::Zero();  ///< of each axis that is free: 1, on held nodes 0
    double reach = 0.0;         ///< [m] four edges
    double part = 1.0;  ///< of B and D that count: less near nodes that are held along some axes, 0 there
    double disc = 0.0;  ///< radius of the disc as large as its part of the surface [m]
    Index follows = 0;  ///< stored node with the largest share of its displacement
    /// Sharp edge of the body beside it.
    struct Edge {
      double distance = 0.0;  ///< [m]
      double image = 0.0;     ///< of a force there, in (1 + nu) / (pi E r); 0: no edge
    };
    std::array<Edge, 2> edges;
    double crease = 0.0;  ///< [rad] largest angle between the normal and those of the faces around
  };
  [[nodiscard]] const Point& point(Index node) const noexcept {
    return points_[static_cast<std::size_t>(node)];
  }
  /// B: displacement of a point by a force on another, or by one on itself [m/N].
  [[nodiscard]] Mat3 between(const Point& a, const Point& loaded) const noexcept;
  /// Adds the same to the three rows [3 x 3 count] of a point, for forces on each of the first points.
  void add_row(const Point& a, const LocalPoints& loaded, Index count, double* rows) const noexcept;
  /// Within this distance B is not zero [m].
  [[nodiscard]] double reach() const noexcept { return reach_; }

 private:
  void measure(const ElasticBody& body);
  void find_edges(const ElasticBody& body);
  double set_reach_by_edges(std::size_t of_body, std::span<const Index> mesh);
  void follow(const ElasticBody& body, std::span<const Index> mesh);
  void fade_at_planes(const ElasticBody& body, const std::vector<Vec3>& free);

  double c_, nu_;              // (1 + nu) / (pi E) [1/Pa]
  std::vector<Point> points_;  // [S]
  double reach_ = 0.0;
  std::unique_ptr<const Greens> smooth_;
};

/// Points by their components, for loops over all of them.
class LocalPoints {
 public:
  static constexpr Index components = 15;  ///< x, normal, share times part, reach, disc, edges

  explicit LocalPoints(Index room) : room_(room), of_(static_cast<std::size_t>(components * room)) {}

  void set(Index place, const LocalCompliance::Point& point) noexcept;
  void move(Index from, Index to) noexcept;
  /// One component of all points.
  [[nodiscard]] const double* operator[](Index component) const noexcept {
    return of_.data() + std::ptrdiff_t{component} * room_;
  }

 private:
  Index room_;
  std::vector<double> of_;
};

}  // namespace palpate
