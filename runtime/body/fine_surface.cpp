#include "runtime/body/fine_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "meshes/element.h"
#include "meshes/surface.h"
#include "meshes/topology.h"

namespace palpate {
namespace {

constexpr double no_part = 1e-12;  // threshold of a shape function

class Builder {
 public:
  Builder(const Model& model, int r, const Rounding* rounding)
      : mesh_(model.mesh), cuts_(model.mesh.element, r), rounding_(rounding) {
    result_.mesh_nodes = model.surface;
    std::sort(result_.mesh_nodes.begin(), result_.mesh_nodes.end());
    result_.mesh_nodes.erase(std::unique(result_.mesh_nodes.begin(), result_.mesh_nodes.end()),
                             result_.mesh_nodes.end());
    result_.first.push_back(0);
    for (const Index node : result_.mesh_nodes) add_node({{node, 1.0}});
  }

  FineSurface build() {
    Surface surface;
    surface.facet = traits(mesh_.element).facet;
    std::vector<Index> elements;  // element of each facet
    for (const ElementSide& side : boundary_sides(mesh_)) {
      const auto nodes = mesh_.element_nodes(side.element);
      const auto corners = nodes.first(traits(mesh_.element).corners);
      const Subdivision& parts = cuts_.of(corners);
      result_.denominator = parts.denominator;
      for (const Index node : parts.sides[side.side])
        surface.facets.push_back(number_of(parts.nodes[node], corners, nodes));
      elements.resize(static_cast<std::size_t>(surface.count()), side.element);
    }
    result_.simplices = surface_simplices(surface);
    const auto d = static_cast<std::size_t>(mesh_.dimension());
    const std::size_t parts = result_.simplices.size() / d / elements.size();
    for (const Index element : elements) result_.element.insert(result_.element.end(), parts, element);
    return std::move(result_);
  }

 private:
  using Parts = std::vector<std::pair<Index, double>>;

  Index add_node(const Parts& parts) {
    for (const auto& [node, weight] : parts) {
      result_.parents.push_back(node);
      result_.weights.push_back(weight);
    }
    result_.first.push_back(static_cast<Index>(result_.parents.size()));
    result_.corners.push_back({-1, -1, -1, -1});
    if (rounding_ != nullptr) result_.rise.emplace_back(Vec3::Zero());
    return result_.nodes() - 1;
  }

  Index number_of(const Subdivision::Node& node, std::span<const Index> corners,
                  std::span<const Index> nodes) {
    const NodeKey key = key_of(node, corners);
    const auto found = result_.number.find(key);
    if (found != result_.number.end()) return found->second;
    const ShapeValues N = shape_functions(mesh_.element, node.xi);
    Parts parts;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double part = N[static_cast<Eigen::Index>(k)];
      if (std::abs(part) > no_part) parts.emplace_back(nodes[k], part);
    }
    std::sort(parts.begin(), parts.end());
    if (parts.size() == 1) {
      const auto place =
          std::lower_bound(result_.mesh_nodes.begin(), result_.mesh_nodes.end(), parts.front().first);
      return enter(static_cast<Index>(place - result_.mesh_nodes.begin()), key);
    }
    return enter(add_node(parts), key);
  }

  Index enter(Index number, const NodeKey& key) {
    result_.number.emplace(key, number);
    for (std::size_t k = 0; k < key.size(); ++k) result_.corners[number][k] = key[k].first;
    raise(number, key);
    return number;
  }

  void raise(Index number, const NodeKey& key) {
    if (rounding_ == nullptr) return;
    double sum = 0.0;
    for (const auto& [corner, weight] : key) sum += weight;
    std::vector<std::pair<Index, double>> weights;
    for (const auto& [corner, weight] : key) weights.emplace_back(corner, weight / sum);
    result_.rise[number] = rounding_->offset(weights);
  }

  const Mesh& mesh_;
  Subdivisions cuts_;
  const Rounding* rounding_;
  FineSurface result_;
};

}  // namespace

void reorder(FineSurface& surface, std::span<const Index> order) {
  const std::size_t of_body = surface.mesh_nodes.size();
  std::vector<Index> number(static_cast<std::size_t>(surface.nodes()));  // new number of each old one
  std::iota(number.begin(), number.end(), 0);
  const FineSurface old = surface;
  const auto kept = static_cast<std::size_t>(old.first[of_body]);
  surface.first.resize(of_body + 1);
  surface.parents.resize(kept);
  surface.weights.resize(kept);
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t from = of_body + static_cast<std::size_t>(order[k]);
    number[from] = static_cast<Index>(of_body + k);
    for (auto part = static_cast<std::size_t>(old.first[from]);
         part < static_cast<std::size_t>(old.first[from + 1]); ++part) {
      surface.parents.push_back(old.parents[part]);
      surface.weights.push_back(old.weights[part]);
    }
    surface.first.push_back(static_cast<Index>(surface.parents.size()));
    surface.corners[of_body + k] = old.corners[from];
    if (!surface.rise.empty()) surface.rise[of_body + k] = old.rise[from];
  }
  for (Index& node : surface.simplices) node = number[node];
  for (auto& [key, node] : surface.number) node = number[node];
}

FineSurface make_fine_surface(const Model& model, int r, const Rounding* rounding) {
  return Builder(model, r, rounding).build();
}

}  // namespace palpate
