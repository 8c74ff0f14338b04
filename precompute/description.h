// model.toml: what a person writes to describe a body. Keys are documented in the README.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "formats/model.h"
#include "meshes/generate.h"
#include "meshes/selection.h"

namespace palpate {

/// Closed triangle surface (OFF, OBJ, STL, PLY).
struct SurfaceGeometry {
  std::filesystem::path file;
};

/// Labelled image (INR and what else CGAL's image reader takes). Every non-zero label is body unless `labels`
/// lists those that are.
struct ImageGeometry {
  std::filesystem::path file;
  std::vector<int> labels;  ///< empty: all non-zero ones
};

/// Tetrahedral mesh made elsewhere (.msh, .mesh, .node/.ele, .vtk).
struct VolumeGeometry {
  std::filesystem::path file;
};

using Geometry =
    std::variant<SurfaceGeometry, ImageGeometry, VolumeGeometry, BoxShape, CylinderShape, SphereShape>;

/// How the volume is meshed. Lengths in metres after scaling.
struct MeshOptions {
  /// Target at the surface [m]. Required for images and with remesh; otherwise the mean edge of the surface.
  std::optional<double> edge_length;
  bool remesh = false;   ///< surfaces: isotropic remeshing to edge_length before meshing
  double grading = 0.5;  ///< growth of the target edge length per length below the surface [-]; 0 is uniform
  double radius_edge = 2.0;     ///< bound on circumradius / shortest edge [-]
  double min_dihedral = 10.0;   ///< surfaces: bound asked of TetGen [degree]
  double facet_distance = 0.0;  ///< images: surface approximation error [m]; 0 is the largest side of a voxel
};

/// The whole model.toml, checked.
struct Description {
  std::filesystem::path file;  ///< model.toml itself
  std::string text;            ///< its bytes
  std::string name;
  Geometry geometry;
  double scale = 1.0;  ///< metres per length unit of the geometry
  MeshOptions mesh;
  Material material;
  std::vector<Selection> fixed;  ///< union of these is clamped
  Scope scope = Scope::layers;
  Index layers = 1;
  Precision precision = Precision::single_precision;
};

/// Reads and checks model.toml. Relative files are taken from its folder. Throws Error with file, line and
/// column; an unknown key names the nearest known one.
Description read_description(const std::filesystem::path& file);

}  // namespace palpate
