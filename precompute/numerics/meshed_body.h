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

/// A meshed body ready for assembly: positively oriented, connected, in metres, with a material for every
/// element, held against every rigid motion.
struct MeshedBody {
  Mesh mesh;
  Surface surface;
  std::vector<Index> material_of_element;  ///< [E] number in Description::materials
  std::vector<std::uint8_t> fixed;         ///< [N] bit `axis` is set if held along it
  std::vector<Vec3> prescribed;            ///< [N] displacement along the held axes [m]; zero along others
  std::vector<std::string> notes;          ///< information for the user: repairs, dropped voxels
  std::string warning;                     ///< probable mistake (the scale); empty if none
  std::vector<std::string> doubts;         ///< properties that are hardly intended
};

/// Callback for the current action ("reading liver.inr.gz", "meshing", ...).
using ProgressText = std::function<void(const std::string&)>;

/// Reads or generates the geometry, meshes it, scales to metres and checks it. Throws Error for any bad
/// input; with `keep` the file of intersecting triangles does not replace an existing file.
MeshedBody mesh_body(const Description& description, const ProgressText& progress, bool keep = false);

/// Input files of the body besides model.toml (two for a TetGen mesh, none for a generated body), for
/// detecting that a baked model is stale.
std::vector<std::filesystem::path> input_files(const Description& description);

}  // namespace palpate
