// From a description to a checked volume mesh.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "meshes/mesh.h"
#include "meshes/surface.h"
#include "precompute/description.h"

namespace palpate {

/// A meshed body ready for assembly: positively oriented, connected, in metres, held against every rigid
/// motion.
struct MeshedBody {
  Mesh mesh;
  Surface surface;
  std::vector<std::uint8_t> fixed;  ///< [N] 1 where clamped
  std::vector<std::string>
      notes;  ///< what a person should know: repairs, dropped voxels, warnings about the scale
};

/// Reports what is being done ("reading liver.inr.gz", "meshing", ...).
using ProgressText = std::function<void(const std::string&)>;

/// Reads or generates the geometry, meshes it, scales to metres and checks it. Throws Error for every kind of
/// bad input.
MeshedBody mesh_body(const Description& description, const ProgressText& progress);

/// The files besides model.toml that the body is made from (two for a TetGen mesh, none for a generated
/// body), for noticing that a baked model is stale.
std::vector<std::filesystem::path> input_files(const Description& description);

}  // namespace palpate
