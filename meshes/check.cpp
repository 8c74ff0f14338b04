#include "meshes/check.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <numeric>

#include "meshes/error.h"
#include "meshes/tet4.h"

namespace palpate {
namespace {

std::string text(const Vec3& x) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", x.x(), x.y(), x.z());
}

void check_numbers(const Mesh& mesh, const std::string& where) {
  if (mesh.tets.empty())
    throw Error("the mesh has no tetrahedra", where, "Save the volume elements, not only the surface.");
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (mesh.nodes[node].allFinite()) continue;
    throw Error(fmt::format("node {} has a coordinate that is not a finite number", node), where,
                "Repair or remake the mesh.");
  }
  for (std::size_t element = 0; element < mesh.tets.size(); ++element) {
    for (const Index node : mesh.tets[element]) {
      if (node >= 0 && static_cast<std::size_t>(node) < mesh.nodes.size()) continue;
      throw Error(fmt::format("element {} uses node {}, but there are only nodes 0 to {}", element, node,
                              static_cast<std::int64_t>(mesh.nodes.size()) - 1),
                  where, "Repair or remake the mesh.");
    }
  }
}

/// Root of a node or element in a union-find forest, with path halving.
std::size_t find_root(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

std::size_t orient_elements(Mesh& mesh, const std::string& where) {
  check_numbers(mesh, where);
  std::size_t inverted = 0, an_inverted_one = 0;
  for (std::size_t element = 0; element < mesh.tets.size(); ++element) {
    const tet4::Corners x = tet4::corners(mesh, mesh.tets[element]);
    double longest = 0.0;
    for (Eigen::Index i = 1; i < 4; ++i) longest = std::max(longest, (x.col(i) - x.col(0)).norm());
    const double volume = tet4::volume(x);
    if (std::abs(volume) <= 1e-12 * longest * longest * longest) {
      throw Error(fmt::format("element {} near {} has zero volume", element, text(x.rowwise().mean())), where,
                  "Remove it or remake the mesh with a quality bound.");
    }
    if (volume > 0.0) continue;
    ++inverted;
    an_inverted_one = element;
  }
  if (inverted == 0) return 0;
  if (inverted < mesh.tets.size()) {
    const Vec3 centre = tet4::corners(mesh, mesh.tets[an_inverted_one]).rowwise().mean();
    throw Error(fmt::format("{} of {} elements are inverted, e.g. element {} near {}", inverted,
                            mesh.tets.size(), an_inverted_one, text(centre)),
                where, "The mesh is folded there; remake it.");
  }
  for (Tet& tet : mesh.tets) std::swap(tet[2], tet[3]);
  return inverted;
}

std::size_t remove_unused_nodes(Mesh& mesh) {
  std::vector<Index> number(mesh.nodes.size(), -1);
  for (const Tet& tet : mesh.tets) {
    for (const Index node : tet) number[static_cast<std::size_t>(node)] = 0;
  }
  std::vector<Vec3> used;
  for (std::size_t node = 0; node < mesh.nodes.size(); ++node) {
    if (number[node] < 0) continue;
    number[node] = static_cast<Index>(used.size());
    used.push_back(mesh.nodes[node]);
  }
  for (Tet& tet : mesh.tets) {
    for (Index& node : tet) node = number[static_cast<std::size_t>(node)];
  }
  std::erase_if(mesh.tagged_boundary, [&](const TaggedTriangle& facet) {
    return std::any_of(facet.nodes.begin(), facet.nodes.end(),
                       [&](Index node) { return number[static_cast<std::size_t>(node)] < 0; });
  });
  for (TaggedTriangle& facet : mesh.tagged_boundary) {
    for (Index& node : facet.nodes) node = number[static_cast<std::size_t>(node)];
  }
  const std::size_t removed = mesh.nodes.size() - used.size();
  mesh.nodes = std::move(used);
  return removed;
}

void check_connected(const Mesh& mesh, const std::string& where) {
  std::vector<std::size_t> parent(mesh.tets.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  std::vector<std::pair<Triangle, std::size_t>> faces;
  faces.reserve(4 * mesh.tets.size());
  for (std::size_t element = 0; element < mesh.tets.size(); ++element) {
    const Tet& t = mesh.tets[element];
    for (Triangle face : {Triangle{t[1], t[2], t[3]}, Triangle{t[0], t[2], t[3]}, Triangle{t[0], t[1], t[3]},
                          Triangle{t[0], t[1], t[2]}}) {
      std::sort(face.begin(), face.end());
      faces.emplace_back(face, element);
    }
  }
  std::sort(faces.begin(), faces.end());
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].first != faces[i - 1].first) continue;
    parent[find_root(parent, faces[i].second)] = find_root(parent, faces[i - 1].second);
  }
  std::map<std::size_t, std::size_t> part_sizes;  // by the element that stands for the part
  for (std::size_t element = 0; element < mesh.tets.size(); ++element)
    ++part_sizes[find_root(parent, element)];
  if (part_sizes.size() == 1) return;
  std::string parts;
  for (const auto& [root, size] : part_sizes) {
    if (parts.size() > 200) {
      parts += ", ...";
      break;
    }
    const Vec3 centre = tet4::corners(mesh, mesh.tets[root]).rowwise().mean();
    parts += fmt::format("{}{} elements at {}", parts.empty() ? "" : ", ", size, text(centre));
  }
  throw Error(fmt::format("the body is in {} disconnected parts: {}", part_sizes.size(), parts), where,
              "Keep one part, or join them by shared faces.");
}

void check_held(const Mesh& mesh, const std::vector<std::uint8_t>& fixed, const std::string& where) {
  const auto count = std::count(fixed.begin(), fixed.end(), 1);
  const std::string hint = "Add a [[fixed]] region that holds at least three nodes that are not on one line.";
  if (count == 0) throw Error("nothing is fixed: the body can move freely", where, hint);
  if (static_cast<std::size_t>(count) == mesh.nodes.size()) {
    throw Error("every node is fixed: nothing is left to move", where, "Make the [[fixed]] regions smaller.");
  }
  // The body can still turn about a line when all fixed nodes are on it: look at the fixed nodes' spread
  // about their mean.
  Vec3 mean = Vec3::Zero();
  for (std::size_t node = 0; node < fixed.size(); ++node) {
    if (fixed[node]) mean += mesh.nodes[node] / static_cast<double>(count);
  }
  Mat3 spread = Mat3::Zero();
  for (std::size_t node = 0; node < fixed.size(); ++node) {
    if (fixed[node]) spread += (mesh.nodes[node] - mean) * (mesh.nodes[node] - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
  double size = 0.0;
  for (const Vec3& x : mesh.nodes) size = std::max(size, (x - mean).norm());
  const double small = 1e-12 * size * size;  // squared distances: 1e-6 of the body's size
  if (axes.eigenvalues()[1] > small) return;
  if (axes.eigenvalues()[2] <= small) {
    throw Error(
        fmt::format(
            "a rigid motion is left: only one point, {} m, is fixed, and the body can rotate about it",
            text(mean)),
        where, hint);
  }
  throw Error(
      fmt::format(
          "a rigid motion is left: all fixed nodes are on the line through {} m along {}, and the body can "
          "rotate about it",
          text(mean), text(axes.eigenvectors().col(2))),
      where, hint);
}

std::string scale_warning(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.nodes) box.extend(x);
  const double size = box.sizes().maxCoeff();
  if (size <= 10.0 && size >= 1e-3) return {};
  return fmt::format("the body is {:.3g} m long; is geometry.scale (metres per unit of the file) right?",
                     size);
}

}  // namespace palpate
