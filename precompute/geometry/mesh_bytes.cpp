#include "precompute/geometry/mesh_bytes.h"

namespace palpate {

Bytes pack(const Mesh& mesh) {
  Bytes bytes;
  append_array(bytes, std::span(&mesh.element, 1));
  append_array(bytes, std::span(mesh.nodes));
  append_array(bytes, std::span(mesh.connectivity));
  append_array(bytes, std::span(mesh.regions));
  append_array(bytes, std::span(mesh.tagged_facets));
  append_array(bytes, std::span(mesh.facet_tags));
  return bytes;
}

Mesh unpack_mesh(const Bytes& bytes) {
  std::span<const std::byte> rest = bytes;
  Mesh mesh;
  const std::vector<ElementType> element = take_array<ElementType>(rest);
  if (element.size() != 1) fail_on_answer();
  mesh.element = element[0];
  mesh.nodes = take_array<Vec3>(rest);
  mesh.connectivity = take_array<Index>(rest);
  mesh.regions = take_array<Index>(rest);
  mesh.tagged_facets = take_array<Index>(rest);
  mesh.facet_tags = take_array<Index>(rest);
  return mesh;
}

}  // namespace palpate
