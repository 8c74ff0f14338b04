// From a description to a checked volume mesh.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "meshes/surface.h"
#include "precompute/description/description.h"

namespace palpate {

/// A meshed body ready for assembly: positively oriented, connected, in metres, every element with a
/// material, held against every rigid motion.
struct MeshedBody {
  Mesh mesh;
  Surface surface;
  std::vector<Index> material_of_element;  ///< [E] number in Description::materials
  std::vector<std::uint8_t> fixed;         ///< [N] bit `axis` is set where held along it
  std::vector<Vec3> prescribed;            ///< [N] displacement along the held axes [m]; zero along others
  std::vector<std::string> notes;          ///< what a person should know: repairs, dropped voxels
  std::string warning;                     ///< what is probably a mistake (the scale), empty: nothing
  std::vector<std::string> doubts;         ///< what a person would hardly have wanted of it
};

/// Reports what is being done ("reading liver.inr.gz", "meshing", ...).
using ProgressText = std::function<void(const std::string&)>;

/// Reads or generates the geometry, meshes it, scales to metres and checks it. Throws Error for every kind of
/// bad input; with `keep` triangles that intersect are not written over a file that is there.
MeshedBody mesh_body(const Description& description, const ProgressText& progress, bool keep = false);

/// The files besides model.toml that the body is made from (two for a TetGen mesh, none for a generated
/// body), for noticing that a baked model is stale.
std::vector<std::filesystem::path> input_files(const Description& description);

}  // namespace palpate
