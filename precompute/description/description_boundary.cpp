#include <fmt/format.h>

#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

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

/// Keys of a table together with those of selections.
Keys with_selections(Keys keys) {
  keys.insert(keys.end(), selection_kinds.begin(), selection_kinds.end());
  return keys;
}

}  // namespace

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

}  // namespace palpate
