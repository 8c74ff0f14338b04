// A surface, an image or a picture that a person has, and what it takes to use it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "precompute/description/description.h"
#include "precompute/surfaces/surface_repair.h"

namespace palpate {

/// What a file describes a body by.
enum class ShapeKind : std::uint8_t {
  surface,
  image,    ///< labelled, in space
  picture,  ///< of a body in the plane
};

/// By the file's name; nothing for every other file.
std::optional<ShapeKind> shape_kind(const std::filesystem::path& file);

/// The file's name without folder and ending: "organ" of "in/organ.inr.gz".
std::string shape_name(const std::filesystem::path& file);

/// A shape as it was found.
struct Shape {
  ShapeKind kind = ShapeKind::surface;
  std::vector<std::string> repairs;  ///< surfaces: what was repaired, a sentence each
  std::vector<std::string> remarks;  ///< surfaces: what of the file is not used, likewise
  TriangleSurface repaired;          ///< the surface then; empty where the file is whole
  Vec3 size = Vec3::Zero();          ///< of the box around it [file units]
  double boundary = 0.0;             ///< its area; of pictures its length [file units^2, file units]
  bool remesh = true;                ///< surfaces: the edge length is to be that of the boundary too
  bool dark = false;                 ///< pictures: drawn dark on a light ground
  double unit = 0.0;                 ///< images: that the file counts in [mm]; 0: it does not say
};

/// How a shape is taken.
struct ShapeOptions {
  SurfaceParts parts = SurfaceParts::most;
  bool strict = false;                ///< repair nothing
  std::optional<ValueRange> range{};  ///< of an image that are body
  std::optional<int> nodes{};         ///< on the surface of the mesh that is to come; of pictures the outline

  [[nodiscard]] int nodes_of(ShapeKind kind) const noexcept {
    return nodes.value_or(kind == ShapeKind::picture ? 60 : 4000);
  }
};

/// Reads a surface and repairs it, or measures an image or a picture. The boundary of an image is that of the
/// voxels that are not 0, whose staircase is taken for 3/2 of the smooth area, the mean over all directions
/// of |n_x| + |n_y| + |n_z|, in millimetres where the file says its unit; that of a picture, of pixels, for
/// 4/pi of the smooth length. A picture is dark on light where more than half of its rim would be body else.
/// Throws Error for files that cannot be used; strict, also for surfaces that would need a repair.
Shape read_shape(const std::filesystem::path& file, const ShapeOptions& options);

}  // namespace palpate
