#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

SelectBox read_box(const TomlTable& box, int dimension) {
  SelectBox result{read_vector(box, "min", dimension), read_vector(box, "max", dimension)};
  if ((result.min.array() > result.max.array()).any()) {
    box.fail("min", box.name_of("min") + " is greater than max", "exchange them where min > max");
  }
  return result;
}

SelectHalfSpace read_half_space(const TomlTable& half_space, int dimension) {
  SelectHalfSpace result{read_vector(half_space, "point", dimension),
                         read_vector(half_space, "normal", dimension)};
  if (result.normal.isZero(0.0)) {
    half_space.fail("normal", half_space.name_of("normal") + " is the zero vector",
                    "the half space is where (x - point) . normal >= 0");
  }
  return result;
}

SelectLowest read_lowest(const TomlTable& lowest, int dimension) {
  const std::string axis = lowest.choice("axis", dimension == 3 ? Keys{"x", "y", "z"} : Keys{"x", "y"});
  const double percent = lowest.positive("percent");
  if (percent > 100.0) {
    lowest.fail("percent", lowest.name_of("percent") + " is " + shown(percent), "use at most 100");
  }
  return {axis[0] - 'x', percent / 100.0};
}

}  // namespace

Vec3 read_vector(const TomlTable& table, std::string_view key, int dimension) {
  const std::string name(key);
  return table.vector(key, dimension,
                      dimension == 3 ? "in space write " + name + " = [x, y, z]; a body in the plane has " +
                                           R"(plane = "stress" or "strain" at the top level)"
                                     : "in the plane write " + name + " = [x, y]");
}

const Keys selection_kinds = alternatives_of(selection_title);

Selection read_selection(const TomlTable& entry, std::string_view kind, int dimension) {
  if (kind == "box") {
    return read_box(entry.table(kind, keys_of("selection box")), dimension);
  }
  if (kind == "half_space") {
    return read_half_space(entry.table(kind, keys_of("selection half_space")), dimension);
  }
  if (kind == "sphere") {
    const TomlTable sphere = entry.table(kind, keys_of("selection sphere"));
    return SelectSphere{read_vector(sphere, "center", dimension), sphere.positive("radius")};
  }
  if (kind == "nodes") {
    return SelectNodes{entry.integers(kind)};
  }
  if (kind == "tag") {
    return SelectTag{entry.integer(kind)};
  }
  return read_lowest(entry.table(kind, keys_of("selection lowest")), dimension);
}

}  // namespace palpate
