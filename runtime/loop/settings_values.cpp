// What single settings are written as, and what they come to.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "base/error.h"
#include "runtime/core/touch/tool_geometry.h"
#include "runtime/loop/numbers.h"
#include "runtime/loop/settings.h"

namespace palpate {
namespace {

constexpr double edge_per_radius = 0.35;  // of graded overlays at the touch, by the tool's radius
constexpr double usual_edge = 0.1;        // [radius] default rounding of a disc's edge

}  // namespace

WorkspaceOptions Settings::workspace() const {
  return {.device_origin = Vec3::Zero(),
          .body_origin = origin.value_or(Vec3::Zero()),
          .axes = parse_axes(axes),
          .motion_scale = motion_scale,
          .force_scale = force_scale};
}

BodyOptions Settings::body() const {
  const bool is_possible = is_compact(tool) && contact == ContactModel::quasi_static && !live.solver;
  const bool by_radius =
      overlay.kind == OverlayKind::graded ||
      (overlay.kind == OverlayKind::local && is_possible && overlay_law == PatchLaw::linear);
  return {.refinement = overlay.kind == OverlayKind::uniform ? overlay.refinement : 1,
          .radius = by_radius ? radius() : 0.0,
          .graded = overlay.kind == OverlayKind::graded,
          .overlay_law = overlay_law,
          .contact = contact,
          .load_scale = load_scale,
          .stiffness_scale = stiffness_scale,
          .live = live,
          .depth = depth};
}

Tool parse_shape(const std::string& text) {
  Tool tool;
  if (text == "point") return tool;
  const std::string_view rest = std::string_view(text).substr(std::min(text.find(':') + 1, text.size()));
  const std::vector<std::string_view> sizes = split_commas(rest);
  const bool sphere = text.starts_with("sphere:") && sizes.size() == 1;
  const bool capsule = text.starts_with("capsule:") && sizes.size() == 2;
  const bool disc = text.starts_with("disc:") && (sizes.size() == 1 || sizes.size() == 2);
  if (!sphere && !capsule && !disc) {
    throw Error(
        "'" + text + "' is none of point, sphere:RADIUS, capsule:RADIUS,LENGTH and disc:RADIUS[,EDGE]",
        "--tool", "lengths are metres");
  }
  const auto size = [&](std::string_view number) {
    const std::optional<double> metres = parse_number(number);
    if (metres && *metres > 0.0) return *metres;
    throw Error(fmt::format("'{}' of '{}' is not a positive number of metres", number, text), "--tool",
                "write for instance sphere:0.005");
  };
  if (disc) {
    tool.disc_radius = size(sizes[0]);
    tool.radius = sizes.size() == 2 ? size(sizes[1]) : usual_edge * tool.disc_radius;
    if (tool.radius <= tool.disc_radius) return tool;
    throw Error(fmt::format("the edge of '{}' is rounded by more than the radius", text), "--tool",
                "write for instance disc:0.01,0.001");
  }
  tool.radius = size(sizes[0]);
  if (capsule) tool.length = size(sizes[1]);
  return tool;
}

double Settings::radius() const {
  return tool.disc_radius > 0.0 ? tool.disc_radius : tool.radius;
}

double Settings::finest() const {
  return overlay.kind == OverlayKind::graded ? edge_per_radius * radius() : 0.0;
}

OverlayOptions parse_overlay(const std::string& text, const std::string& where) {
  OverlayOptions overlay{.kind = OverlayKind::uniform};
  if (text == "no") return {.kind = OverlayKind::none};
  if (text == "auto") return {};
  if (text == "graded") return {.kind = OverlayKind::graded, .rings = 1};
  for (const std::string_view part : split_commas(text)) {
    const auto [name, number] = split_named(part);
    const std::optional<Index> value = parse_index(std::string(number));
    if (name == "r" && value && *value >= least_refinement && *value <= most_refinement) {
      overlay.refinement = *value;
    } else if (name == "rings" && value && *value >= 1 && *value <= most_rings) {
      overlay.rings = *value;
    } else {
      throw Error(fmt::format("'{}' is neither r={} to r={} nor rings=1 to rings={}", part, least_refinement,
                              most_refinement, most_rings),
                  where, "write auto, no, graded, or for instance r=3,rings=2");
    }
  }
  return overlay;
}

Eigen::Quaterniond parse_axes(const std::string& text) {
  const std::string hint = "write three of x, y, z, -x, -y, -z, each axis once, for instance x,-z,y";
  const std::vector<std::string_view> names = split_commas(text);
  if (names.size() != 3) throw Error("'" + text + "' is not three axes", "--axes", hint);
  Mat3 axes = Mat3::Zero();
  for (Eigen::Index column = 0; column < 3; ++column) {
    std::string_view name = names[static_cast<std::size_t>(column)];
    const double sign = name.starts_with('-') ? -1.0 : 1.0;
    if (name.starts_with('-') || name.starts_with('+')) name.remove_prefix(1);
    if (name.size() != 1 || name[0] < 'x' || name[0] > 'z')
      throw Error("'" + text + "' is not three axes", "--axes", hint);
    axes(name[0] - 'x', column) = sign;
  }
  const double determinant = axes.determinant();
  if (determinant < 0.0)
    throw Error("'" + text + "' is a mirror image", "--axes", "turn the sign of one axis round");
  if (determinant == 0.0) throw Error("'" + text + "' names an axis twice", "--axes", hint);
  return Eigen::Quaterniond(axes);
}

SafetyOptions parse_safety(const std::string& text) {
  SafetyOptions options;
  if (text == "default") return options;
  for (const std::string_view part : split_commas(text)) {
    const auto [name, number] = split_named(part);
    const std::optional<double> parsed = parse_number(number);
    if (!parsed || *parsed < 0.0)
      throw Error(fmt::format("'{}' is not NAME=NUMBER, from 0 on", part), "--safety",
                  "write max_force=2,ramp=3");
    bool known = false;
    for_each_safety_field(options, [&, name = name, bound = *parsed](const SafetyField& field, auto& value) {
      if (name != field.name) return;
      known = true;
      value = static_cast<std::remove_reference_t<decltype(value)>>(std::min(bound, field.range.high));
      if (!field.range.contains(bound) || value != bound)
        throw Error(fmt::format("{} must be {}, not {}", name, field.range.words, bound), "--safety",
                    "palpate-runtime play --help lists the bounds");
    });
    if (!known)
      throw Error(fmt::format("there is no safety option '{}'", name), "--safety",
                  "palpate-runtime play --help lists them");
  }
  return options;
}

std::string safety_help() {
  std::string text;
  const SafetyOptions defaults;
  for_each_safety_field(defaults, [&](const SafetyField& field, const auto& value) {
    text += fmt::format("    {:<16} {:>7} {:<6} {}\n", field.name, value, field.unit, field.meaning);
  });
  return text;
}

}  // namespace palpate
