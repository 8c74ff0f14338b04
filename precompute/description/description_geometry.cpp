#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

constexpr std::size_t longest_path = 4095;  // Linux

bool is_control(char c) {
  return static_cast<unsigned char>(c) < ' ' || c == '\x7f';
}

/// Throws Error if six elements per cell exceed 32-bit element numbers.
void check_cells(const TomlTable& shape, std::string_view key, double cells) {
  if (6.0 * cells > std::numeric_limits<Index>::max()) {
    shape.fail(key, shape.name_of(key) + " asks for too many cells: " + shown(cells),
               "at most 357913941 cells can be numbered");
  }
}

Vec3 read_origin(const TomlTable& shape, int dimension) {
  return shape.has("origin") ? read_vector(shape, "origin", dimension) : Vec3::Zero();
}

BoxShape read_box(const TomlTable& box) {
  const std::vector<Index> cells = box.integers("cells", 3, 1);
  check_cells(box, "cells", double{1} * cells[0] * cells[1] * cells[2]);
  return {read_origin(box, 3), box.positive_vector("size", 3), {cells[0], cells[1], cells[2]}};
}

RectangleShape read_rectangle(const TomlTable& rectangle) {
  const std::vector<Index> cells = rectangle.integers("cells", 2, 1);
  check_cells(rectangle, "cells", double{1} * cells[0] * cells[1]);
  return {read_origin(rectangle, 2), rectangle.positive_vector("size", 2), {cells[0], cells[1]}};
}

PolygonGeometry read_polygon(const TomlTable& polygon) {
  PolygonGeometry result{polygon.points("points"), {}};
  if (polygon.has("holes")) {
    result.holes = polygon.point_lists("holes");
  }
  return result;
}

/// Cells over the diameter of a body with `cells_along` cells along it; the same number if it is not given.
int read_cells_across(const TomlTable& shape, std::optional<int> cells_along = {}) {
  const int cells = shape.count("cells_across");
  check_cells(shape, "cells_across", double{1} * cells * cells * cells_along.value_or(cells));
  if (cells % 2 != 0) {
    shape.fail("cells_across", shape.name_of("cells_across") + " must be even, not " + std::to_string(cells),
               "use " + std::to_string(cells + 1));
  }
  return cells;
}

CylinderShape read_cylinder(const TomlTable& cylinder) {
  const int along = cylinder.count("cells_along");
  return {cylinder.positive("radius"), cylinder.positive("height"), read_cells_across(cylinder, along),
          along};
}

SphereShape read_sphere(const TomlTable& sphere) {
  return {sphere.positive("radius"), read_cells_across(sphere)};
}

ValueRange read_range(const TomlTable& geometry) {
  if (geometry.has("labels"))
    geometry.fail("range", "[geometry] has labels and range", "remove one of them: each says what is body");
  const std::vector<double> ends = geometry.numbers("range", 2);
  if (ends[0] > ends[1])
    geometry.fail("range", "[geometry] range goes down", "write the lower value first: [LOW, HIGH]");
  return {ends[0], ends[1]};
}

}  // namespace

bool is_plane(std::string_view geometry_kind) {
  return geometry_kind == "rectangle" || geometry_kind == "polygon" || geometry_kind == "picture";
}

Geometry read_geometry(const TomlTable& geometry, std::string_view kind,
                       const std::filesystem::path& folder) {
  const auto file = [&] {
    const std::string name = geometry.text(kind);
    if (name.size() > longest_path || std::any_of(name.begin(), name.end(), is_control)) {
      geometry.fail(kind, geometry.name_of(kind) + " is no name of a file: \"" + shortened(name) + "\"",
                    "give the path of a file, without control characters");
    }
    return (folder / name).lexically_normal();
  };
  if (kind != "image" && geometry.has("labels")) {
    geometry.fail("labels", "[geometry] labels apply to images only, this geometry is a " + std::string(kind),
                  "remove labels");
  }
  if (kind != "image" && geometry.has("range")) {
    geometry.fail("range", "[geometry] range applies to images only, this geometry is a " + std::string(kind),
                  "remove range");
  }
  if (kind != "picture" && geometry.has("dark")) {
    geometry.fail("dark", "[geometry] dark applies to pictures only, this geometry is a " + std::string(kind),
                  "remove dark");
  }
  if (kind == "surface") {
    return SurfaceGeometry{file()};
  }
  if (kind == "image") {
    ImageGeometry image{file(), {}};
    if (geometry.has("labels")) {
      image.labels = geometry.integers("labels");
    }
    if (geometry.has("range")) image.range = read_range(geometry);
    return image;
  }
  if (kind == "volume") {
    return VolumeGeometry{file()};
  }
  if (kind == "picture") {
    return PictureGeometry{file(), geometry.boolean("dark", false)};
  }
  if (kind == "polygon") {
    return read_polygon(geometry.table(kind, keys_of("[geometry] polygon")));
  }
  if (kind == "rectangle") {
    return read_rectangle(geometry.table(kind, keys_of("[geometry] rectangle")));
  }
  if (kind == "box") {
    return read_box(geometry.table(kind, keys_of("[geometry] box")));
  }
  if (kind == "cylinder") {
    return read_cylinder(geometry.table(kind, keys_of("[geometry] cylinder")));
  }
  return read_sphere(geometry.table(kind, keys_of("[geometry] sphere")));
}

}  // namespace palpate
