#include "runtime/push/solved_settings.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

namespace palpate {
namespace {

constexpr double falls = 0.5;  // [size of the body] from the body to the floor
constexpr double walls = 1.0;  // [size of the body] from the body to each wall

/// Lowest and highest corner of the box around the body, as text.
std::string room_around(const Eigen::AlignedBox3d& body, int up) {
  const double size = body.sizes().maxCoeff();
  Vec3 low = body.min() - Vec3::Constant(walls * size), high = body.max() + Vec3::Constant(walls * size);
  low[up] = body.min()[up] - falls * size;
  return fmt::format("{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", low.x(), low.y(), low.z(), high.x(),
                     high.y(), high.z());
}

}  // namespace

SettingsText solved_settings(const Model& outline) {
  if (outline.scope != Scope::none) return {};
  SettingsText settings = {{"solver", "corotational"}};
  const bool is_held = std::ranges::any_of(outline.fixed, [](auto axes) { return axes != 0; });
  if (is_held) return settings;
  Eigen::AlignedBox3d body;
  for (const Vec3& node : outline.mesh.nodes) body.extend(node);
  const int up = outline.dimension() - 1;
  settings["gravity"] = up == 1 ? "0,-9.81,0" : "0,0,-9.81";
  settings["room"] = room_around(body, up);
  settings["yield"] = "0.15";
  settings["creep"] = "20";
  return settings;
}

std::string option_text(const SettingsText& settings) {
  std::string text;
  for (const auto& [name, value] : settings)
    text += fmt::format("{}--{} {}", text.empty() ? "" : " ", name, value);
  return text;
}

}  // namespace palpate
