#include "precompute/surfaces/shells.h"

#include <CGAL/Side_of_triangle_mesh.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <list>
#include <numeric>
#include <optional>
#include <utility>

#include "precompute/surfaces/cgal_surface.h"

namespace palpate {
namespace {

using Kernel = PolygonSoup::Kernel;
using SurfaceMesh = CGAL::Surface_mesh<PolygonSoup::Point>;

std::size_t at(Index i) {
  return static_cast<std::size_t>(i);
}

/// Inside of a closed shell.
class Inside {
 public:
  explicit Inside(const TriangleSurface& shell) : mesh_(mesh_of(shell)), closed_(CGAL::is_closed(mesh_)) {
    if (closed_) side_.emplace(mesh_);
  }

  [[nodiscard]] bool is_closed() const { return closed_; }

  [[nodiscard]] bool holds(const TriangleSurface& other) const {
    return side_ && std::ranges::all_of(other.nodes, [&](const Vec3& x) {
             return (*side_)({x[0], x[1], x[2]}) == CGAL::ON_BOUNDED_SIDE;
           });
  }

 private:
  SurfaceMesh mesh_;
  bool closed_;
  std::optional<CGAL::Side_of_triangle_mesh<SurfaceMesh, Kernel>> side_;
};

double size_of(const TriangleSurface& shell) {
  return std::abs(enclosed_volume(shell));
}

}  // namespace

std::vector<TriangleSurface> shells_of(const TriangleSurface& surface) {
  std::vector<std::size_t> parent(surface.nodes.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&](Index node) {
    std::size_t i = at(node);
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& [a, b, c] : surface.triangles) {
    parent[root(b)] = root(a);
    parent[root(c)] = root(a);
  }
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> shell_of(surface.nodes.size(), none);  // of roots
  std::vector<Index> number(surface.nodes.size(), -1);            // of a node in its shell
  std::vector<TriangleSurface> shells;
  for (const Triangle& triangle : surface.triangles) {
    std::size_t& shell = shell_of[root(triangle[0])];
    if (shell == none) {
      shell = shells.size();
      shells.emplace_back();
    }
    Triangle& copy = shells[shell].triangles.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      Index& node = number[at(triangle[i])];
      if (node < 0) {
        node = static_cast<Index>(shells[shell].nodes.size());
        shells[shell].nodes.push_back(surface.nodes[at(triangle[i])]);
      }
      copy[i] = node;
    }
  }
  return shells;
}

TriangleSurface together(const std::vector<TriangleSurface>& shells) {
  TriangleSurface all;
  for (const TriangleSurface& shell : shells) {
    const auto first = static_cast<Index>(all.nodes.size());
    all.nodes.insert(all.nodes.end(), shell.nodes.begin(), shell.nodes.end());
    for (const auto& [a, b, c] : shell.triangles) all.triangles.push_back({a + first, b + first, c + first});
  }
  return all;
}

bool turn(TriangleSurface& shell, bool outwards) {
  if ((enclosed_volume(shell) > 0.0) == outwards) return false;
  for (Triangle& triangle : shell.triangles) std::swap(triangle[0], triangle[1]);
  return true;
}

std::vector<TriangleSurface> cavities_of(const TriangleSurface& surface) {
  std::vector<TriangleSurface> shells = shells_of(surface);
  if (shells.size() == 1) return {};
  std::erase_if(shells, [](const TriangleSurface& shell) { return enclosed_volume(shell) >= 0.0; });
  return shells;
}

Vec3 point_inside(const TriangleSurface& shell) {
  const auto corner = [&](const Triangle& t, std::size_t i) -> const Vec3& { return shell.nodes[at(t[i])]; };
  const auto normal = [&](const Triangle& t) -> Vec3 {
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  };
  const auto largest = std::ranges::max_element(shell.triangles, {},
                                                [&](const Triangle& t) { return normal(t).squaredNorm(); });
  const Vec3 from = (corner(*largest, 0) + corner(*largest, 1) + corner(*largest, 2)) / 3.0;
  const Vec3 inwards = normal(*largest).normalized() * (enclosed_volume(shell) > 0.0 ? -1.0 : 1.0);
  // Half of the way to the first other triangle; a little beyond its edges, so that none is missed.
  constexpr double beyond = 1e-9;
  double nearest = std::numeric_limits<double>::max();
  for (auto t = shell.triangles.begin(); t != shell.triangles.end(); ++t) {
    if (t == largest) continue;
    Eigen::Matrix3d sides;
    sides << corner(*t, 1) - corner(*t, 0), corner(*t, 2) - corner(*t, 0), -inwards;
    const Eigen::FullPivLU<Eigen::Matrix3d> lu(sides);
    if (!lu.isInvertible()) continue;
    const Vec3 hit = lu.solve(from - corner(*t, 0));  // two barycentric coordinates and the distance
    if (hit[0] >= -beyond && hit[1] >= -beyond && hit[0] + hit[1] <= 1.0 + beyond && hit[2] > 0.0)
      nearest = std::min(nearest, hit[2]);
  }
  return from + nearest / 2.0 * inwards;
}

BodyShells body_shells(std::vector<TriangleSurface> shells,
                       const std::function<TriangleSurface(TriangleSurface)>& mend) {
  auto outer = std::ranges::max_element(shells, {}, area);
  for (auto shell = shells.begin(); shell != shells.end(); ++shell) {
    if (size_of(*shell) > size_of(*outer) && Inside(*shell).holds(*outer)) outer = shell;
  }
  BodyShells result;
  result.kept.push_back(mend(std::move(*outer)));
  shells.erase(outer);
  std::ranges::stable_sort(shells, std::greater(), size_of);
  const Inside body(result.kept.front());
  if (body.is_closed()) result.turned = turn(result.kept.front(), true);
  std::list<Inside> cavities;
  for (TriangleSurface& shell : shells) {
    const bool is_empty = body.holds(shell) && size_of(shell) > least_filling * std::pow(area(shell), 1.5) &&
                          std::ranges::none_of(cavities, [&](const Inside& c) { return c.holds(shell); }) &&
                          cavities.emplace_back(shell).is_closed();
    turn(shell, !is_empty);
    (is_empty ? result.kept : result.others).push_back(std::move(shell));
  }
  return result;
}

}  // namespace palpate
