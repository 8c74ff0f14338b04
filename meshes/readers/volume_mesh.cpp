#include "meshes/readers/volume_mesh.h"

#include <fmt/format.h>

#include <system_error>

#include "base/error.h"
#include "base/words.h"
#include "meshes/readers/volume_mesh_readers.h"

namespace palpate {
Mesh read_volume_mesh(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  if (extension == ".msh") return read_gmsh(file);
  if (extension == ".mesh") return read_medit(file);
  if (extension == ".vtk") return read_vtk_legacy(file);
  if (extension == ".node" || extension == ".ele")
    return read_tetgen(std::filesystem::path(file).replace_extension());
  std::error_code none;  // a name that is too long is no file
  if (std::filesystem::exists(with_ending(file, ".node"), none)) return read_tetgen(file);
  throw Error(
      fmt::format("the extension '{}' is not one of a volume mesh that can be read", shortened(extension)),
      file.string(),
      "Known are .msh (Gmsh 2.2 or 4.1), .mesh (Medit), .node and .ele (TetGen), .vtk (legacy), all "
      "as text");
}

}  // namespace palpate
