#include "precompute/draft/shape.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "formats/file_kinds.h"
#include "precompute/geometry/picture_reader.h"
#include "precompute/images/labelled_image.h"

namespace palpate {
namespace {

constexpr double staircase = 1.5, plane_staircase = 4.0 / std::numbers::pi;

void measure(const TriangleSurface& surface, Shape& shape) {
  Vec3 low = surface.nodes.front(), high = low;
  for (const Vec3& x : surface.nodes) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  shape.size = high - low;
  shape.boundary = area(surface);
}

Shape read_whole_surface(const std::filesystem::path& file) {
  std::vector<std::string> notes;
  Shape shape;
  measure(read_surface(file, notes), shape);
  if (!notes.empty())
    throw Error("the surface needs a repair: " + notes.front(), file.string(),
                "leave out --strict to have it repaired, or repair it in a mesh editor");
  return shape;
}

Shape read_repaired_surface(const std::filesystem::path& file, const ShapeOptions& options) {
  RepairedSurface repaired = repair_surface(file, options.parts, options.nodes_of(ShapeKind::surface));
  Shape shape;
  measure(repaired.surface, shape);
  shape.repairs = std::move(repaired.repairs);
  shape.remarks = std::move(repaired.remarks);
  if (!shape.repairs.empty()) shape.repaired = std::move(repaired.surface);
  return shape;
}

/// Area of voxel sides between body and background.
double boundary_area(const VoxelBody& body) {
  const std::array<std::size_t, 3> step = {body.at(1, 0, 0), body.at(0, 1, 0), body.at(0, 0, 1)};
  double sum = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::size_t sides = 0;
    for (std::size_t v = step.at(axis); v < body.inside.size(); ++v)
      sides += body.inside[v] != body.inside[v - step.at(axis)] ? 1 : 0;
    sum += static_cast<double>(sides) * body.spacing.prod() / body.spacing[static_cast<int>(axis)];
  }
  return sum / staircase;
}

Shape read_image(const std::filesystem::path& file, const std::optional<ValueRange>& range) {
  Shape shape;
  shape.kind = ShapeKind::image;
  const VoxelBody body =
      read_labelled_image({file, {}, false, range}, std::numeric_limits<double>::max(), shape.repairs);
  shape.unit = body.file_unit;
  for (int axis = 0; axis < 3; ++axis)  // less the empty rim of two voxels on each side
    shape.size[axis] = body.spacing[axis] * (body.size.at(static_cast<std::size_t>(axis)) - 4);
  shape.boundary = boundary_area(body);
  shape.repairs.clear();  // the bake reports them
  return shape;
}

/// True if more than half of the pixels along the picture's edges are body, as paper is.
bool is_paper(const PixelBody& body) {
  Index rim = 0, inside = 0;
  for (Index j = 0; j < body.height; ++j) {
    for (Index i = 0; i < body.width; ++i) {
      if (i > 0 && j > 0 && i + 1 < body.width && j + 1 < body.height) continue;
      ++rim;
      inside += body.is_body(i, j) ? 1 : 0;
    }
  }
  return 2 * inside > rim;
}

bool is_empty(const PixelBody& body) {
  return std::ranges::none_of(body.inside, [](std::uint8_t pixel) { return pixel != 0; });
}

Shape read_picture_shape(const std::filesystem::path& file) {
  Shape shape;
  shape.kind = ShapeKind::picture;
  PixelBody body = read_picture({file});
  shape.dark = is_empty(body) || is_paper(body);  // dark on a transparent ground has nothing light
  if (shape.dark) body = read_picture({file, true});
  std::vector<std::string> notes;  // the bake reports them
  keep_one_body(body, file.string(), notes);
  Eigen::AlignedBox2i box;
  for (const std::vector<LatticePoint>& outline : trace_outlines(body)) {
    for (const LatticePoint& corner : outline) box.extend(Eigen::Vector2i(corner[0], corner[1]));
    shape.boundary += static_cast<double>(outline.size()) / plane_staircase;
  }
  shape.size.head<2>() = box.sizes().cast<double>();
  return shape;
}

}  // namespace

std::optional<ShapeKind> shape_kind(const std::filesystem::path& file) {
  const FileKind* const kind = kind_by_name(file);
  if (kind == nullptr) return std::nullopt;
  if (kind->geometry == "surface") return ShapeKind::surface;
  if (kind->geometry == "image") return ShapeKind::image;
  return kind->geometry == "picture" ? std::optional(ShapeKind::picture) : std::nullopt;
}

std::string shape_name(const std::filesystem::path& file) {
  return name_without_ending(file);
}

Shape read_shape(const std::filesystem::path& file, const ShapeOptions& options) {
  check_is_read(file);
  const std::optional<ShapeKind> kind = shape_kind(file);
  if (kind == ShapeKind::image) return read_image(file, options.range);
  if (kind == ShapeKind::picture) return read_picture_shape(file);
  return options.strict ? read_whole_surface(file) : read_repaired_surface(file, options);
}

}  // namespace palpate
