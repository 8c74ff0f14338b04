#include "runtime/warp/body_warp.h"

#include <numeric>
#include <vector>

namespace palpate {

WarpSurface warp_surface(const Body& body) {
  const std::span<const Vec3> rest = body.surface_rest_positions();
  const std::span<const Index> simplices = body.simplices(), stored = body.surface_stored_nodes();
  WarpSurface surface{.dimension = body.dimension(),
                      .rest = {rest.begin(), rest.end()},
                      .simplices = {simplices.begin(), simplices.end()},
                      .stored = {stored.begin(), stored.end()},
                      .held = {}};
  for (const Index node : body.surface_mesh_nodes())
    surface.held.push_back(body.model().fixed[static_cast<std::size_t>(node)]);
  return surface;
}

LinearResponse linear_response(const Body& body) {
  std::vector<Index> all(static_cast<std::size_t>(body.greens().nodes()));
  std::iota(all.begin(), all.end(), 0);
  return [&body, all = std::move(all)](std::span<const double> f, std::span<double> u) {
    body.greens().displacement(all, f, u);
  };
}

}  // namespace palpate
