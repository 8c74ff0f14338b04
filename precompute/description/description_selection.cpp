#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

SelectBox read_box(const Section& box, int dimension) {
  SelectBox result{box.vector("min", dimension), box.vector("max", dimension)};
  if ((result.min.array() > result.max.array()).any()) {
    box.fail("min", box.name_of("min") + " is greater than max", "exchange them where min > max");
  }
  return result;
}

SelectHalfSpace read_half_space(const Section& half_space, int dimension) {
  SelectHalfSpace result{half_space.vector("point", dimension), half_space.vector("normal", dimension)};
  if (result.normal.isZero(0.0)) {
    half_space.fail("normal", half_space.name_of("normal") + " is the zero vector",
                    "the half space is where (x - point) . normal >= 0");
  }
  return result;
}

SelectLowest read_lowest(const Section& lowest, int dimension) {
  const std::string axis = lowest.choice("axis", dimension == 3 ? Keys{"x", "y", "z"} : Keys{"x", "y"});
  const double percent = lowest.positive("percent");
  if (percent > 100.0) {
    lowest.fail("percent", lowest.name_of("percent") + " is " + shown(percent), "use at most 100");
  }
  return {axis[0] - 'x', percent / 100.0};
}

}  // namespace

const Keys selection_kinds = {"box", "half_space", "sphere", "nodes", "tag", "lowest"};

Selection read_selection(const Section& entry, std::string_view kind, int dimension) {
  if (kind == "box") {
    return read_box(entry.section(kind, {"min", "max"}), dimension);
  }
  if (kind == "half_space") {
    return read_half_space(entry.section(kind, {"point", "normal"}), dimension);
  }
  if (kind == "sphere") {
    const Section sphere = entry.section(kind, {"center", "radius"});
    return SelectSphere{sphere.vector("center", dimension), sphere.positive("radius")};
  }
  if (kind == "nodes") {
    return SelectNodes{entry.integers(kind)};
  }
  if (kind == "tag") {
    return SelectTag{entry.integer(kind)};
  }
  return read_lowest(entry.section(kind, {"axis", "percent"}), dimension);
}

}  // namespace palpate
