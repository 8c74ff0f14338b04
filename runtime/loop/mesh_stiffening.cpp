#include "runtime/loop/mesh_stiffening.h"

#include <cmath>

namespace palpate {
namespace {

/// Constant C of the law: mean of the values for nu = 0.3 and 0.45, which are within 5 % of it.
double factor_of(ElementType element) noexcept {
  switch (element) {
    case ElementType::tet4:
      return 1.1;
    case ElementType::tet4a:
      return 0.71;
    case ElementType::tet10:
      return 0.98;
    case ElementType::hex8:
      return 0.78;
    case ElementType::line2:
    case ElementType::tri3:
    case ElementType::tri6:
    case ElementType::quad4:
      break;  // in the plane, or not used by bodies
  }
  return 0.0;
}

}  // namespace

double mesh_stiffening(const Body& body, const Tool& tool, double depth) noexcept {
  const double radius = tool.disc_radius > 0.0 ? tool.disc_radius : std::sqrt(tool.radius * depth);
  if (!(depth > 0.0) || !(radius > 0.0)) return 1.0;
  return std::hypot(1.0, factor_of(body.model().mesh.element) * body.mean_surface_edge() / radius);
}

}  // namespace palpate
