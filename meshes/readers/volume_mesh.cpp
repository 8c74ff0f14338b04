#include "meshes/readers/volume_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <system_error>

#include "base/error.h"
#include "base/words.h"
#include "meshes/readers/volume_mesh_readers.h"

namespace palpate {
namespace {

std::string extension_of(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  return extension;
}

/// Common stem of .node and .ele; empty for other files.
std::filesystem::path tetgen_stem(const std::filesystem::path& file) {
  const std::string extension = extension_of(file);
  if (extension == ".node" || extension == ".ele") return std::filesystem::path(file).replace_extension();
  std::error_code none;  // a name that is too long is no file
  return std::filesystem::exists(with_ending(file, ".node"), none) ? file : std::filesystem::path();
}

std::pair<Mesh, MeshGroups> read(const std::filesystem::path& file) {
  const std::string extension = extension_of(file);
  if (extension == ".msh") return read_gmsh(file);
  if (extension == ".mesh") return read_medit(file);
  if (extension == ".vtk") return read_vtk_legacy(file);
  if (const std::filesystem::path stem = tetgen_stem(file); !stem.empty()) return read_tetgen(stem);
  throw Error(
      fmt::format("the extension '{}' is not one of a volume mesh that can be read", shortened(extension)),
      file.string(),
      "Known are .msh (Gmsh 2.2 or 4.1), .mesh (Medit), .node and .ele (TetGen), .vtk (legacy), all "
      "as text");
}

}  // namespace

Mesh read_volume_mesh(const std::filesystem::path& file, MeshGroups* groups) {
  auto [mesh, found] = read(file);
  if (groups != nullptr) *groups = std::move(found);
  return std::move(mesh);
}

std::vector<std::filesystem::path> volume_mesh_files(const std::filesystem::path& file) {
  const std::filesystem::path stem = tetgen_stem(file);
  if (stem.empty()) return {file};
  return {with_ending(stem, ".node"), with_ending(stem, ".ele")};
}

}  // namespace palpate
