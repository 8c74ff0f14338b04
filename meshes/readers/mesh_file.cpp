#include "meshes/readers/mesh_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "meshes/topology.h"

namespace palpate {
namespace {

constexpr const char* kinds_read =
    "Bodies are of tet4, tet10 or hex8, in the plane of tri3 or quad4: mesh with one of these kinds alone";

FileElements& of_kind(MeshFile& file, ElementType type) {
  return file.elements[static_cast<std::size_t>(type)];
}

/// Kinds of this dimension with elements in the file.
std::vector<ElementType> kinds_of_dimension(const MeshFile& file, int dimension) {
  std::vector<ElementType> kinds;
  for (const ElementTraits& kind : element_traits) {
    const bool present = !file.elements[static_cast<std::size_t>(kind.type)].tags.empty();
    if (present && kind.dimension == dimension) kinds.push_back(kind.type);
  }
  return kinds;
}

/// Counts of elements: "12 tet4 and 3 hex8".
std::string counts(const MeshFile& file, const std::vector<ElementType>& kinds) {
  std::vector<std::string> parts;
  parts.reserve(kinds.size());
  for (const ElementType kind : kinds) {
    parts.push_back(
        fmt::format("{} {}", file.elements[static_cast<std::size_t>(kind)].tags.size(), traits(kind).name));
  }
  return fmt::format("{}", fmt::join(parts, " and "));
}

/// The kind of the elements of highest dimension.
ElementType body_kind(const MeshFile& file, const TextReader& reader) {
  for (const int dimension : {3, 2}) {
    const std::vector<ElementType> kinds = kinds_of_dimension(file, dimension);
    if (kinds.empty()) continue;
    if (kinds.size() > 1) {
      reader.fail(fmt::format("the file has {} elements of more than one kind: {}",
                              dimension == 3 ? "solid" : "plane", counts(file, kinds)),
                  kinds_read);
    }
    if (kinds.front() == ElementType::tri6) {
      fail_unknown_element(reader, counts(file, kinds) + " as its largest elements");
    }
    return kinds.front();
  }
  reader.fail("the file has no elements that a body could be of",
              "Save the elements of the body, not only its boundary");
}

/// Moves a plane mesh to z = 0.
void flatten(Mesh& mesh, const TextReader& reader) {
  Eigen::AlignedBox3d box;
  for (const Index node : mesh.connectivity) box.extend(mesh.nodes[static_cast<std::size_t>(node)]);
  if (box.sizes().z() > 1e-9 * box.diagonal().norm()) {
    reader.fail(
        fmt::format("the file holds a surface of {} {} (z from {:.4g} to {:.4g}), not a body",
                    mesh.elements(), traits(mesh.element).name, box.min().z(), box.max().z()),
        "Save its solid elements too; to have a closed surface meshed, give it as OFF, OBJ, STL or PLY under "
        "'surface ='. A body in the plane has the same z everywhere");
  }
  for (Vec3& x : mesh.nodes) x.z() = 0.0;
}

/// Facets given by their corners, completed by the elements' middle nodes.
std::vector<Index> find_middles(const Mesh& mesh, const std::vector<Index>& corners,
                                const TextReader& reader) {
  const std::vector<ElementSide> sides = sorted_sides(mesh);
  std::vector<Index> facets;
  for (std::size_t first = 0; first < corners.size(); first += 3) {
    std::array<Index, 4> wanted = {corners[first], corners[first + 1], corners[first + 2],
                                   std::numeric_limits<Index>::max()};
    std::sort(wanted.begin(), wanted.end());
    const auto side = std::lower_bound(
        sides.begin(), sides.end(), wanted,
        [](const ElementSide& s, const std::array<Index, 4>& other) { return s.corners < other; });
    if (side == sides.end() || side->corners != wanted) {
      reader.fail(fmt::format("the tagged triangle of the nodes {}, {}, {} (counted from 0) is not a side of "
                              "an element",
                              corners[first], corners[first + 1], corners[first + 2]),
                  "Save boundary and body from the same mesh");
    }
    const std::vector<Index> nodes = side_nodes(mesh, *side);
    facets.insert(facets.end(), nodes.begin(), nodes.end());
  }
  return facets;
}

/// Keeps tagged facets only, once for each of their tags.
void drop_untagged(FileElements& facets, ElementType kind) {
  const auto width = static_cast<std::size_t>(traits(kind).nodes);
  FileElements tagged;
  const auto add = [&](std::size_t f, Index tag) {
    const auto first = facets.nodes.begin() + static_cast<std::ptrdiff_t>(width * f);
    tagged.nodes.insert(tagged.nodes.end(), first, first + static_cast<std::ptrdiff_t>(width));
    tagged.tags.push_back(tag);
  };
  for (std::size_t f = 0; f < facets.tags.size(); ++f)
    if (facets.tags[f] != 0) add(f, facets.tags[f]);
  for (const auto& [f, tag] : facets.more_tags) add(f, tag);
  facets = std::move(tagged);
}

/// Moves the tagged elements of one dimension less into the mesh.
void take_facets(MeshFile& file, Mesh& mesh, const TextReader& reader) {
  const ElementType wanted = traits(mesh.element).facet;
  for (const ElementType kind : kinds_of_dimension(file, mesh.dimension() - 1)) {
    FileElements& facets = of_kind(file, kind);
    drop_untagged(facets, kind);
    if (facets.tags.empty()) continue;
    if (kind == ElementType::tri3 && wanted == ElementType::tri6) {
      facets.nodes = find_middles(mesh, facets.nodes, reader);
    } else if (kind != wanted) {
      reader.fail(fmt::format("the file tags {} facets, but the sides of its {} elements are {}",
                              counts(file, {kind}), traits(mesh.element).name, traits(wanted).name),
                  "Save boundary and body from the same mesh");
    }
    mesh.tagged_facets.insert(mesh.tagged_facets.end(), facets.nodes.begin(), facets.nodes.end());
    mesh.facet_tags.insert(mesh.facet_tags.end(), facets.tags.begin(), facets.tags.end());
  }
}

}  // namespace

void MeshFile::add(const FileElement& element, std::span<const Index> in_file, Index tag,
                   std::span<const Index> more_tags) {
  FileElements& kind = elements[static_cast<std::size_t>(element.type)];
  for (const Index more : more_tags) kind.more_tags.emplace_back(kind.tags.size(), more);
  for (std::size_t i = 0; i < in_file.size(); ++i) kind.nodes.push_back(in_file[element.place[i]]);
  kind.tags.push_back(tag);
}

std::pair<Mesh, MeshGroups> to_body(MeshFile file, const TextReader& reader) {
  if (file.nodes.empty()) reader.fail("the file has no nodes");
  std::pair<Mesh, MeshGroups> body;
  auto& [mesh, groups] = body;
  mesh.element = body_kind(file, reader);
  mesh.nodes = std::move(file.nodes);
  mesh.connectivity = std::move(of_kind(file, mesh.element).nodes);
  mesh.regions = std::move(of_kind(file, mesh.element).tags);
  groups.more = std::move(of_kind(file, mesh.element).more_tags);
  for (const auto& [name, number] : file.names)
    if (name.first == mesh.dimension()) groups.number_of.emplace(name.second, number);
  groups.hint = std::move(file.hint);
  if (mesh.dimension() == 2) flatten(mesh, reader);
  take_facets(file, mesh, reader);
  return body;
}

void fail_unknown_element(const TextReader& reader, const std::string& kind) {
  reader.fail(fmt::format("the file has {}, which are not read", kind), kinds_read);
}

}  // namespace palpate
