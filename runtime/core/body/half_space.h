// The elastic half-space's compliance, and that of a body beside its sharp edges.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace palpate::half_space {

// Compliance of a node by its own force, times pi E / (1 - nu^2) and the radius of its disc: what is left of
// an even load on a lattice once the other nodes are point loads (2.20 for squares, 2.21 for triangles).
constexpr double of_lattice = 2.2;
constexpr double least_share = 3e-5;  // below it two normals have no mean

/// Share of the half-space that is left at a distance r: 1 at 0, 0 from the mean of two reaches on.
inline double left_at(double squared_r, double sum_of_reaches) noexcept {
  const double left = std::max(0.0, 1.0 - 4.0 * squared_r / (sum_of_reaches * sum_of_reaches));
  return left * left;
}

/// Share of the half-space between points with an angle between their normals, by its cosine: the cosine of
/// half of it, so 1 on a flat side, less round an edge, 0 on both sides of a plate.
inline double share_of_sides(double cosine) noexcept {
  return std::sqrt(std::max(0.0, 0.5 * (1.0 + cosine)));
}

/// Point as the half-space sees it, in plain numbers, so that loops over points use the vector units.
struct Numbers {
  double x, y, z, u, v, w;  // place, normal
  double reach, disc;
  double t, image, t_too, image_too;  // distances from two edges, and the images in them
};

/// Fading of the half-space.
enum class Fade : std::uint8_t { by_distance, none };
/// Points that have sharp edges beside them, or that have none.
enum class Beside : std::uint8_t { edges, nothing };

/// Compliance along each axis by the images of a force in sharp edges, times pi E / (1 + nu) [1/m]: at the
/// distance of the point's own mirror image, and of that in both edges of a corner.
template <Fade fade>
inline double images(const Numbers& a, const Numbers& b, double r2, double nu) noexcept {
  constexpr double tiny = 1e-30;  // points that are no edge's have no distance from one
  const double far = 4.0 * a.t * b.t, far_too = 4.0 * a.t_too * b.t_too;
  const double image = std::sqrt(a.image * b.image), image_too = std::sqrt(a.image_too * b.image_too);
  const auto at = [&](double squared) {
    return (fade == Fade::none ? 1.0 : left_at(squared, a.reach + b.reach)) / std::sqrt(squared + tiny);
  };
  return image * at(r2 + far) + image_too * at(r2 + far_too) +
         image * image_too / (1.0 - nu) * at(r2 + far + far_too);
}

/// B along all axes, by rows, times pi E / (1 + nu) [1/m]: displacement of the half-space's surface at `a` by
/// a force at `b` (Johnson, Contact Mechanics, 1985, 3.2 and 3.6); at `b` itself by the force on its own
/// part.
template <Fade fade, Beside beside>
inline std::array<double, 9> compliance(const Numbers& a, const Numbers& b, double nu) noexcept {
  const double dx = a.x - b.x, dy = a.y - b.y, dz = a.z - b.z;
  const double r2 = dx * dx + dy * dy + dz * dz;
  const double sides = share_of_sides(a.u * b.u + a.v * b.v + a.w * b.w);
  const double of_n = 0.5 / std::max(sides, least_share);
  const double nx = of_n * (a.u + b.u), ny = of_n * (a.v + b.v), nz = of_n * (a.w + b.w);
  const bool is_own = r2 == 0.0;
  const double of_r = is_own ? of_lattice / b.disc : 1.0 / std::sqrt(r2);
  const double left = fade == Fade::none ? 1.0 : left_at(r2, a.reach + b.reach);
  const double on_both = sides < least_share ? 0.0 : sides * left;
  const double factor = of_r * (is_own ? 1.0 : on_both);
  const double along = dx * nx + dy * ny + dz * nz;
  const double qx = is_own ? a.u : of_r * (dx - along * nx), qy = is_own ? a.v : of_r * (dy - along * ny),
               qz = is_own ? a.w : of_r * (dz - along * nz);
  const double by_images = beside == Beside::edges ? sides * images<fade>(a, b, r2, nu) : 0.0;
  const double even = factor * (is_own ? 1.0 - 0.5 * nu : 1.0 - nu) + by_images,
               by_q = factor * (is_own ? -0.5 * nu : nu),
               turned = is_own ? 0.0 : factor * 0.5 * (1.0 - 2.0 * nu);
  const double xy = by_q * qx * qy, xz = by_q * qx * qz, yz = by_q * qy * qz;
  const double turned_xy = turned * (qx * ny - nx * qy), turned_xz = turned * (qx * nz - nx * qz),
               turned_yz = turned * (qy * nz - ny * qz);
  return {even + by_q * qx * qx, xy + turned_xy, xz + turned_xz, xy - turned_xy,       even + by_q * qy * qy,
          yz + turned_yz,        xz - turned_xz, yz - turned_yz, even + by_q * qz * qz};
}

}  // namespace palpate::half_space
