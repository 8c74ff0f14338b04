#include <fmt/format.h>

#include <numbers>

#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double most_warp_angle = 150.0;  // [degree]
constexpr Index most_warp_levels = 200;

/// Reads axes: bit `axis` is set for each letter.
std::uint8_t read_axes(const TomlTable& entry, int dimension) {
  const std::string letters = dimension == 3 ? "xyz" : "xy";
  if (!entry.has("axes")) {
    return dimension == 3 ? 7 : 3;
  }
  const std::string axes = entry.text("axes");
  std::uint8_t bits = 0;
  for (const char letter : axes) {
    const std::size_t axis = letters.find(letter);
    if (axis == std::string::npos) {
      bits = 0;
      break;
    }
    bits = static_cast<std::uint8_t>(bits | 1U << axis);
  }
  if (bits == 0) {
    entry.fail("axes", entry.name_of("axes") + " is \"" + shortened(axes) + "\"",
               "use some of the letters of \"" + letters + "\", such as \"x\"");
  }
  return bits;
}

Fixing read_fixing(const TomlTable& entry, int dimension) {
  Fixing fixing{read_selection(entry, entry.only_one_of(selection_kinds), dimension),
                read_axes(entry, dimension),
                entry.has("displacement") ? read_vector(entry, "displacement", dimension) : Vec3::Zero()};
  for (int axis = 0; axis < 3; ++axis) {
    const double u = fixing.displacement[axis];
    if (u != 0.0 && (fixing.axes >> axis & 1) == 0) {
      const char letter = "xyz"[axis];
      entry.fail("displacement",
                 fmt::format("[[fixed]] displacement along {} is {}, but axes \"{}\" does not hold {}",
                             letter, u, entry.text("axes"), letter),
                 fmt::format("add {} to axes, or make that component 0", letter));
    }
  }
  return fixing;
}

Load read_load(const TomlTable& entry, int dimension) {
  const std::string_view kind = entry.only_one_of(alternatives_of("[[load]]"));
  const Vec3 value = read_vector(entry, kind, dimension);
  if (kind == "gravity") {
    if (const std::string_view where = entry.at_most_one_of(selection_kinds); !where.empty()) {
      entry.fail(where, "[[load]] gravity acts on the whole body and takes no " + std::string(where),
                 "remove " + std::string(where));
    }
    return Gravity{value};
  }
  const Selection where = read_selection(entry, entry.only_one_of(selection_kinds), dimension);
  if (kind == "traction") {
    return Traction{value, where};
  }
  return ConcentratedForce{value, where};
}

}  // namespace

Keys with_selections(Keys keys) {
  keys.insert(keys.end(), selection_kinds.begin(), selection_kinds.end());
  return keys;
}

std::vector<Fixing> read_fixed(const TomlTable& root, int dimension) {
  const std::string hint = dimension == 3
                               ? "add for example\n[[fixed]]\nlowest = {axis = \"z\", percent = 5}"
                               : "add for example\n[[fixed]]\nlowest = {axis = \"y\", percent = 5}";
  if (!root.has("fixed")) {
    root.fail("fixed", "no region is fixed: the body would fly away at the first touch", hint);
  }
  std::vector<Fixing> result;
  for (const TomlTable& entry : root.tables("fixed", with_selections(keys_of("[[fixed]]")), hint)) {
    result.push_back(read_fixing(entry, dimension));
  }
  return result;
}

OverlayRegions read_overlay(const TomlTable& overlay, int dimension, Scope scope, Index layers) {
  OverlayRegions result;
  result.refinement = overlay.integer("refinement", least_refinement, most_refinement, result.refinement);
  result.rings = overlay.integer("rings", 1, most_rings, result.rings);
  if (scope != Scope::full && result.rings > layers) {
    const std::string kept = scope == Scope::surface ? "none" : std::to_string(layers);
    overlay.fail(
        "rings",
        fmt::format("[overlay] rings reaches {} layer{} of elements deep, of which [storage] keeps {}",
                    result.rings, result.rings == 1 ? "" : "s", kept),
        fmt::format("set scope = \"layers\" and layers = {0} in [storage], or take fewer rings",
                    result.rings));
  }
  const std::string hint =
      dimension == 3 ? "write for example\n[[overlay.region]]\nsphere = {center = [0, 0, 0], radius = 0.01}"
                     : "write for example\n[[overlay.region]]\nsphere = {center = [0, 0], radius = 0.01}";
  if (!overlay.has("region")) {
    overlay.fail("region", "[overlay] has no region", hint);
  }
  for (const TomlTable& entry : overlay.tables("region", selection_kinds, hint)) {
    result.regions.push_back(read_selection(entry, entry.only_one_of(selection_kinds), dimension));
  }
  return result;
}

std::vector<Load> read_loads(const TomlTable& root, int dimension) {
  std::vector<Load> result;
  if (!root.has("load")) {
    return result;
  }
  const Keys keys = with_selections(keys_of("[[load]]"));
  const std::string hint = "write for example\n[[load]]\ngravity = " +
                           std::string(dimension == 3 ? "[0, 0, -9.81]" : "[0, -9.81]");
  for (const TomlTable& entry : root.tables("load", keys, hint)) {
    result.push_back(read_load(entry, dimension));
  }
  return result;
}

WarpOptions read_warp(const TomlTable& warp, int dimension) {
  WarpOptions options;
  if (const std::string_view kind = warp.at_most_one_of(selection_kinds); !kind.empty())
    options.where = read_selection(warp, kind, dimension);
  if (warp.has("direction")) {
    options.direction = read_vector(warp, "direction", dimension);
    if (options.direction->isZero(0.0)) {
      warp.fail(
          "direction", "[warp] direction is the zero vector",
          "give the direction of the force, or leave it out for that along which the part gives way most");
    }
  }
  const double degrees = warp.positive("angle", options.angle / degree);
  if (degrees > most_warp_angle) {
    warp.fail("angle",
              fmt::format("[warp] angle is {}, and must be at most {} degrees", shown(degrees),
                          shown(most_warp_angle)),
              "beyond it a force no longer says how far a body has bent");
  }
  options.angle = degrees * degree;
  if (warp.has("levels")) options.levels = warp.count("levels");
  if (options.levels > most_warp_levels) {
    warp.fail("levels",
              fmt::format("[warp] levels is {}, and must be at most {}", options.levels, most_warp_levels),
              "each level takes some factorisations");
  }
  options.place = warp.place_of("");
  return options;
}

}  // namespace palpate
