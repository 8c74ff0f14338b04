#include "meshes/selection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "base/error.h"
#include "meshes/edge_middles.h"
#include "meshes/element.h"

namespace palpate {
namespace {

using Marks = std::vector<std::uint8_t>;

Eigen::AlignedBox3d bounds(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.nodes) box.extend(x);
  return box;
}

template <class Inside>
Marks mark_where(const std::vector<Vec3>& points, Inside inside) {
  Marks marks;
  marks.reserve(points.size());
  for (const Vec3& x : points) marks.push_back(inside(x) ? 1 : 0);
  return marks;
}

/// Geometric selections of points of a body.
struct SelectPoints {
  const std::vector<Vec3>& points;
  Eigen::AlignedBox3d box;  // of the body
  double tolerance = 1e-9 * box.diagonal().norm();

  Marks operator()(const SelectBox& s) const {
    return mark_where(points, [&](const Vec3& x) {
      return ((x - s.min).array() >= -tolerance).all() && ((s.max - x).array() >= -tolerance).all();
    });
  }
  Marks operator()(const SelectHalfSpace& s) const {
    const Vec3 normal = s.normal.normalized();
    return mark_where(points, [&](const Vec3& x) { return (x - s.point).dot(normal) >= -tolerance; });
  }
  Marks operator()(const SelectSphere& s) const {
    return mark_where(points, [&](const Vec3& x) { return (x - s.center).norm() <= s.radius + tolerance; });
  }
  Marks operator()(const SelectLowest& s) const {
    const double limit = box.min()[s.axis] + s.fraction * box.sizes()[s.axis];
    return mark_where(points, [&](const Vec3& x) { return x[s.axis] <= limit + tolerance; });
  }
};

struct SelectMeshNodes : SelectPoints {
  const Mesh& mesh;
  const std::string& where;

  using SelectPoints::operator();
  Marks operator()(const SelectNodes& s) const {
    Marks marks(mesh.nodes.size(), 0);
    for (const Index node : s.nodes) {
      if (node < 0 || static_cast<std::size_t>(node) >= mesh.nodes.size()) {
        throw Error(
            fmt::format("node {} does not exist: the mesh has nodes 0 to {}", node, mesh.nodes.size() - 1),
            where, "Node numbers count from 0 in the order of the mesh");
      }
      marks[static_cast<std::size_t>(node)] = 1;
    }
    for (const Index middle : middles_between(mesh, s.nodes)) marks[static_cast<std::size_t>(middle)] = 1;
    return marks;
  }
  Marks operator()(const SelectTag& s) const {
    Marks marks(mesh.nodes.size(), 0);
    const std::set<Index> tags(mesh.facet_tags.begin(), mesh.facet_tags.end());
    for (std::size_t t = 0; t < mesh.facet_tags.size(); ++t) {
      if (mesh.facet_tags[t] != s.tag) continue;
      for (const Index node : mesh.tagged_facet(static_cast<Index>(t))) {
        marks[static_cast<std::size_t>(node)] = 1;
      }
    }
    if (!tags.contains(s.tag)) {
      throw Error(fmt::format("no boundary facet has the tag {}", s.tag), where,
                  tags.empty()
                      ? "The mesh file has no tagged boundary facets; select by box, half_space or sphere"
                      : fmt::format("The mesh has the tags {}.", fmt::join(tags, ", ")));
    }
    return marks;
  }
};

struct SelectMeshElements : SelectPoints {
  const std::string& where;

  using SelectPoints::operator();
  Marks operator()(const SelectNodes&) const { refuse("a list of nodes"); }
  Marks operator()(const SelectTag&) const { refuse("a tag of boundary facets"); }

 private:
  [[noreturn]] void refuse(const char* selection) const {
    throw Error(fmt::format("{} cannot select elements", selection), where,
                "Select by box, half_space, sphere or lowest, or by the mesh's regions");
  }
};

std::vector<Vec3> centroids(const Mesh& mesh) {
  std::vector<Vec3> result;
  for (Index e = 0; e < mesh.elements(); ++e) {
    const ElementNodes x = element_nodes(mesh, e);
    result.emplace_back(x.topRows(traits(mesh.element).corners).colwise().mean().transpose());
  }
  return result;
}

void check_not_empty(const Marks& marks, const char* kind, const Eigen::AlignedBox3d& box,
                     const std::string& where) {
  if (std::find(marks.begin(), marks.end(), 1) != marks.end()) return;
  const Vec3 &low = box.min(), &high = box.max();
  throw Error(fmt::format("the selection holds no {}", kind), where,
              fmt::format("The body reaches from ({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) m",
                          low.x(), low.y(), low.z(), high.x(), high.y(), high.z()));
}

}  // namespace

std::vector<std::uint8_t> select_nodes(const Mesh& mesh, const Selection& selection,
                                       const std::string& where) {
  const Eigen::AlignedBox3d box = bounds(mesh);
  Marks marks = std::visit(SelectMeshNodes{{mesh.nodes, box}, mesh, where}, selection);
  check_not_empty(marks, "node", box, where);
  return marks;
}

std::vector<std::uint8_t> select_elements(const Mesh& mesh, const Selection& selection,
                                          const std::string& where) {
  const Eigen::AlignedBox3d box = bounds(mesh);
  const std::vector<Vec3> centres = centroids(mesh);
  Marks marks = std::visit(SelectMeshElements{{centres, box}, where}, selection);
  check_not_empty(marks, "element's centre", box, where);
  return marks;
}

}  // namespace palpate
