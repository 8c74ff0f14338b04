#include "precompute/surfaces/triangle_surface.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>

#include "precompute/surfaces/polygon_soup.h"

namespace palpate {
namespace {

using Kernel = PolygonSoup::Kernel;
using Point = PolygonSoup::Point;

}  // namespace

double area(const TriangleSurface& surface) {
  double sum = 0.0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3& x = surface.nodes[static_cast<std::size_t>(a)];
    sum += (surface.nodes[static_cast<std::size_t>(b)] - x)
               .cross(surface.nodes[static_cast<std::size_t>(c)] - x)
               .norm() /
           2.0;
  }
  return sum;
}

double enclosed_volume(const TriangleSurface& surface) {
  const Vec3 origin = surface.nodes.empty() ? Vec3(Vec3::Zero()) : surface.nodes.front();
  double sum = 0.0;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto from_origin = [&](Index i) -> Vec3 {
      return surface.nodes[static_cast<std::size_t>(i)] - origin;
    };
    sum += from_origin(a).cross(from_origin(b)).dot(from_origin(c)) / 6.0;
  }
  return sum;
}

double mean_edge_length(const TriangleSurface& surface) {
  double sum = 0.0;
  for (const Triangle& t : surface.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto from = static_cast<std::size_t>(t[i]), to = static_cast<std::size_t>(t[(i + 1) % 3]);
      sum += (surface.nodes[from] - surface.nodes[to]).norm();
    }
  }
  return sum / (3.0 * static_cast<double>(surface.triangles.size()));
}

std::function<double(const Vec3&)> distance_to(const TriangleSurface& surface) {
  struct Triangles {
    std::vector<Kernel::Triangle_3> list;
    using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>;
    CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree;
  };
  const auto triangles = std::make_shared<Triangles>();
  const auto point = [&](Index node) {
    const Vec3& x = surface.nodes[static_cast<std::size_t>(node)];
    return Point(x[0], x[1], x[2]);
  };
  for (const Triangle& t : surface.triangles) {
    triangles->list.emplace_back(point(t[0]), point(t[1]), point(t[2]));
  }
  triangles->tree.insert(triangles->list.begin(), triangles->list.end());
  triangles->tree.accelerate_distance_queries();
  return [triangles](const Vec3& x) {
    return std::sqrt(CGAL::to_double(triangles->tree.squared_distance(Point(x[0], x[1], x[2]))));
  };
}

}  // namespace palpate
