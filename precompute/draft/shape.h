// A surface, an image or a picture, and its measures for a draft.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "precompute/description/description.h"
#include "precompute/surfaces/surface_repair.h"

namespace palpate {

/// Kind of file that describes a body.
enum class ShapeKind : std::uint8_t {
  surface,
  image,    ///< labelled, in space
  picture,  ///< of a body in the plane
};

/// Kind by the file's name; nullopt for any other file.
std::optional<ShapeKind> shape_kind(const std::filesystem::path& file);

/// Name of a file without folder and ending: "organ" of "in/organ.inr.gz".
std::string shape_name(const std::filesystem::path& file);

/// A shape as found.
struct Shape {
  ShapeKind kind = ShapeKind::surface;
  std::vector<std::string> repairs;  ///< surfaces: repairs, a sentence each
  std::vector<std::string> remarks;  ///< surfaces: parts of the file that are not used, a sentence each
  TriangleSurface repaired;          ///< repaired surface; empty if the file needs no repair
  Vec3 size = Vec3::Zero();          ///< size of its bounding box [file units]
  double boundary = 0.0;             ///< its area; of pictures its length [file units^2, file units]
  bool remesh = true;                ///< surfaces: the edge length also applies to the boundary
  bool dark = false;                 ///< pictures: drawn dark on a light ground
  double unit = 0.0;                 ///< images: unit of the file's lengths [mm]; 0: not given
};

/// Options for reading a shape.
struct ShapeOptions {
  SurfaceParts parts = SurfaceParts::most;
  bool strict = false;                ///< repair nothing
  std::optional<ValueRange> range{};  ///< values of an image that are body
  std::optional<int> nodes{};         ///< number on the surface of the future mesh; for pictures on the
                                      ///< outline

  [[nodiscard]] int nodes_of(ShapeKind kind) const noexcept {
    return nodes.value_or(kind == ShapeKind::picture ? 60 : 4000);
  }
};

/// Reads a surface and repairs it, or measures an image or a picture. The boundary of an image is that of the
/// voxels that are not 0; its staircase area is taken as 3/2 of the smooth area (the mean of
/// |n_x| + |n_y| + |n_z| over all directions), in millimetres if the file has a unit. The outline of a
/// picture's pixels is taken as 4/pi of the smooth length. A picture is dark on light if otherwise more than
/// half of its rim would be body. Throws Error for files that cannot be used; if strict, also for surfaces
/// that need repair.
Shape read_shape(const std::filesystem::path& file, const ShapeOptions& options);

}  // namespace palpate
