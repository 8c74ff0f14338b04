#include "runtime/exports/tool_mesh.h"

#include <cmath>
#include <numbers>

namespace palpate {
namespace {

constexpr int quarter = 8;  // rings from a pole to the straight part of the outline
constexpr int around = 32;  // vertices per ring

/// Point of the outline: distance from the axis, height, and elevation angle of its normal.
struct Ring {
  double wide, high, latitude;
};

/// Outline from the lower pole to the upper one.
std::vector<Ring> outline(const Tool& tool, double point) {
  const double radius = tool.radius > 0.0 || tool.disc_radius > 0.0 ? tool.radius : point;
  const double flat = std::max(tool.disc_radius - radius, 0.0);
  std::vector<Ring> rings;
  const auto arc = [&](double from, double height) {
    for (int k = 0; k <= quarter; ++k) {
      const double latitude = from + 0.5 * std::numbers::pi * k / quarter;
      rings.push_back({flat + radius * std::cos(latitude), height + radius * std::sin(latitude), latitude});
    }
  };
  if (flat > 0.0) rings.push_back({0.0, -radius, -0.5 * std::numbers::pi});
  arc(-0.5 * std::numbers::pi, 0.0);
  arc(0.0, tool.length);
  if (flat > 0.0) rings.push_back({0.0, tool.length + radius, 0.5 * std::numbers::pi});
  return rings;
}

}  // namespace

ToolMesh tool_mesh(const Tool& tool, double point) {
  ToolMesh mesh;
  const std::vector<Ring> rings = outline(tool, point);
  for (const Ring& ring : rings) {
    for (int k = 0; k < around; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / around;
      const double x = std::cos(angle), y = std::sin(angle);
      mesh.positions.emplace_back(ring.wide * x, ring.wide * y, ring.high);
      mesh.normals.emplace_back(std::cos(ring.latitude) * x, std::cos(ring.latitude) * y,
                                std::sin(ring.latitude));
    }
  }
  for (Index ring = 0; ring + 1 < static_cast<Index>(rings.size()); ++ring) {
    for (Index k = 0; k < around; ++k) {
      const Index a = around * ring + k, b = around * ring + (k + 1) % around;
      for (const Index corner : {a, b, b + around, a, b + around, a + around})
        mesh.triangles.push_back(corner);
    }
  }
  return mesh;
}

}  // namespace palpate
