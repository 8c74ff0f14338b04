#include "meshes/selection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <set>

#include "meshes/error.h"

namespace palpate {
namespace {

using Marks = std::vector<std::uint8_t>;

Eigen::AlignedBox3d bounds(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.nodes) box.extend(x);
  return box;
}

template <class Inside>
Marks mark_where(const Mesh& mesh, Inside inside) {
  Marks marks;
  marks.reserve(mesh.nodes.size());
  for (const Vec3& x : mesh.nodes) marks.push_back(inside(x) ? 1 : 0);
  return marks;
}

/// One selection rule over one mesh.
struct Select {
  const Mesh& mesh;
  const std::string& where;
  Eigen::AlignedBox3d box = bounds(mesh);
  double tolerance = 1e-9 * box.diagonal().norm();

  Marks operator()(const SelectBox& s) const {
    return mark_where(mesh, [&](const Vec3& x) {
      return ((x - s.min).array() >= -tolerance).all() && ((s.max - x).array() >= -tolerance).all();
    });
  }
  Marks operator()(const SelectHalfSpace& s) const {
    const Vec3 normal = s.normal.normalized();
    return mark_where(mesh, [&](const Vec3& x) { return (x - s.point).dot(normal) >= -tolerance; });
  }
  Marks operator()(const SelectSphere& s) const {
    return mark_where(mesh, [&](const Vec3& x) { return (x - s.center).norm() <= s.radius + tolerance; });
  }
  Marks operator()(const SelectLowest& s) const {
    const double limit = box.min()[s.axis] + s.fraction * box.sizes()[s.axis];
    return mark_where(mesh, [&](const Vec3& x) { return x[s.axis] <= limit + tolerance; });
  }
  Marks operator()(const SelectNodes& s) const {
    Marks marks(mesh.nodes.size(), 0);
    for (const Index node : s.nodes) {
      if (node < 0 || static_cast<std::size_t>(node) >= mesh.nodes.size()) {
        throw Error(
            fmt::format("node {} does not exist: the mesh has nodes 0 to {}", node, mesh.nodes.size() - 1),
            where, "Node numbers count from 0 in the order of the mesh.");
      }
      marks[static_cast<std::size_t>(node)] = 1;
    }
    return marks;
  }
  Marks operator()(const SelectTag& s) const {
    Marks marks(mesh.nodes.size(), 0);
    std::set<Index> tags;
    for (const TaggedTriangle& facet : mesh.tagged_boundary) {
      tags.insert(facet.tag);
      if (facet.tag != s.tag) continue;
      for (const Index node : facet.nodes) marks[static_cast<std::size_t>(node)] = 1;
    }
    if (!tags.contains(s.tag)) {
      throw Error(fmt::format("no boundary facet has the tag {}", s.tag), where,
                  tags.empty()
                      ? "The mesh file has no tagged boundary facets; select by box, half_space or sphere."
                      : fmt::format("The mesh has the tags {}.", fmt::join(tags, ", ")));
    }
    return marks;
  }
};

}  // namespace

std::vector<std::uint8_t> select_nodes(const Mesh& mesh, const Selection& selection,
                                       const std::string& where) {
  const Select select{mesh, where};
  Marks marks = std::visit(select, selection);
  if (std::find(marks.begin(), marks.end(), 1) == marks.end()) {
    const Vec3 low = select.box.min(), high = select.box.max();
    throw Error("the selection holds no node", where,
                fmt::format("The body reaches from ({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) m.",
                            low.x(), low.y(), low.z(), high.x(), high.y(), high.z()));
  }
  return marks;
}

}  // namespace palpate
