#include "runtime/background/side_tractions.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

namespace palpate {
namespace {

/// Cosine of the largest angle between adjacent facets of a side.
const double smooth = std::cos(std::numbers::pi / 6.0);
constexpr double shear_cost = 100.0;   // relative to pressure, when a force is distributed
constexpr int most_rounds = 5;         // on most bodies all edges are done, with short rows
constexpr std::size_t most_alone = 3;  // sides treated separately among those without inner nodes

std::size_t index(Index number) {
  return static_cast<std::size_t>(number);
}

/// Facets at each node, concatenated: offsets [nodes + 1] and indices into facet_nodes.
struct FacetsAtNodes {
  FacetsAtNodes(std::size_t nodes, std::span<const Index> facet_nodes)
      : first(nodes + 1), entry(facet_nodes.size()) {
    for (const Index node : facet_nodes) ++first[index(node) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::size_t> next(first.begin(), first.end() - 1);
    for (std::size_t k = 0; k < facet_nodes.size(); ++k) entry[next[index(facet_nodes[k])]++] = k;
  }
  [[nodiscard]] std::span<const std::size_t> of(std::size_t node) const {
    return std::span(entry).subspan(first[node], first[node + 1] - first[node]);
  }
  std::vector<std::size_t> first, entry;
};

/// True if two facets at a node are adjacent there; lines always are.
bool are_neighbours(std::span<const Index> a, std::span<const Index> b, Index node) {
  return a.size() == 2 || std::any_of(a.begin(), a.end(), [&](Index other) {
           return other != node && std::find(b.begin(), b.end(), other) != b.end();
         });
}

/// Traction at a place as a function of nodal forces.
using Row = std::map<Index, Mat3>;

void add(const Row& row, const Mat3& factor, Row& to) {
  for (const auto& [node, by_force] : row) {
    const auto [found, is_new] = to.emplace(node, Mat3::Zero());
    found->second += factor * by_force;
  }
}

/// Computes the row of each place at an edge, from the inner nodes of the sides outwards.
class EdgeRows {
 public:
  EdgeRows(const SurfaceSides& sides, const std::vector<double>& area)
      : sides_(sides), area_(area), rows_(sides.places()), done_(sides.places()), beside_(sides.places()) {
    std::vector<Index> edge_nodes;
    for (std::size_t place = 0; place < sides.places(); ++place) {
      const Index node = sides.node(static_cast<Index>(place));
      if (!sides.is_creased(node)) {
        done_[place] = area[place] > 0.0 ? 1 : 0;
      } else if (area[place] > 0.0) {
        places_[node].push_back(static_cast<Index>(place));
      }
    }
    find_beside();
    for (const auto& [node, places] : places_) edge_nodes.push_back(node);
    for (int round = 1; !edge_nodes.empty(); ++round) {
      const auto alone = [&](Index node) { return places_without_neighbours(node); };
      std::size_t least = most_alone;
      for (const Index node : edge_nodes) least = std::min(least, alone(node));
      const auto now = std::partition(edge_nodes.begin(), edge_nodes.end(),
                                      [&](Index node) { return round < most_rounds && alone(node) > least; });
      for (auto node = now; node != edge_nodes.end(); ++node) share_out(*node);
      for (auto node = now; node != edge_nodes.end(); ++node) {
        for (const Index place : places_.at(*node)) done_[index(place)] = 1;
      }
      edge_nodes.erase(now, edge_nodes.end());
    }
  }

  [[nodiscard]] const Row& operator[](std::size_t place) const { return rows_[place]; }

 private:
  void find_beside() {
    const std::size_t width = sides_.width();
    const std::span<const Index> places = sides_.places_of_facets();
    for (std::size_t f = 0; f < places.size(); f += width) {
      const auto of_facet = places.subspan(f, width);
      for (const Index place : of_facet) {
        if (!sides_.is_creased(sides_.node(place))) continue;
        for (const Index other : of_facet) {
          if (other != place) beside_[index(place)].push_back(other);
        }
      }
    }
  }

  [[nodiscard]] bool has_neighbour(Index place) const {
    const std::vector<Index>& beside = beside_[index(place)];
    return std::any_of(beside.begin(), beside.end(), [&](Index other) { return done_[index(other)] != 0; });
  }
  [[nodiscard]] std::size_t places_without_neighbours(Index node) const {
    const std::vector<Index>& places = places_.at(node);
    const auto count =
        std::count_if(places.begin(), places.end(), [&](Index place) { return !has_neighbour(place); });
    return std::min(most_alone, static_cast<std::size_t>(count));
  }

  /// Mean of the adjacent places that are done.
  [[nodiscard]] Row mean_beside(Index place) const {
    Row mean;
    double count = 0.0;
    for (const Index other : beside_[index(place)]) count += done_[index(other)] != 0 ? 1.0 : 0.0;
    for (const Index other : beside_[index(place)]) {
      if (done_[index(other)] == 0) continue;
      const Index node = sides_.node(other);
      if (sides_.is_creased(node)) {
        add(rows_[index(other)], Mat3::Identity() / count, mean);
      } else {
        add({{node, Mat3::Identity()}}, Mat3::Identity() / (count * area_[index(other)]), mean);
      }
    }
    return mean;
  }

  void share_out(Index node) {
    const std::vector<Index>& places = places_.at(node);
    const bool all = places_without_neighbours(node) == 0;
    Row left{{node, Mat3::Identity()}};
    Mat3 sum = Mat3::Zero();
    const auto takes_part = [&](Index place) { return all || !has_neighbour(place); };
    const auto cheap = [&](Index place) -> Mat3 {
      const Vec3& n = sides_.normal(place);
      return n * n.transpose() + (Mat3::Identity() - n * n.transpose()) / shear_cost;
    };
    for (const Index place : places) {
      Row& row = rows_[index(place)] = mean_beside(place);
      add(row, -area_[index(place)] * Mat3::Identity(), left);
      if (takes_part(place)) sum += area_[index(place)] * cheap(place);
    }
    const Mat3 inverse = sum.inverse();
    for (const Index place : places) {
      if (takes_part(place)) add(left, cheap(place) * inverse, rows_[index(place)]);
    }
  }

  const SurfaceSides& sides_;
  const std::vector<double>& area_;
  std::vector<Row> rows_;                       // [places]
  std::vector<std::uint8_t> done_;              // [places]
  std::vector<std::vector<Index>> beside_;      // [places] neighbours of places at edges
  std::map<Index, std::vector<Index>> places_;  // places with an area, of each node where sides meet
};

}  // namespace

SurfaceSides::SurfaceSides(std::size_t nodes, std::span<const Index> facet_nodes,
                           std::span<const Vec3> facet_normals)
    : width_(facet_nodes.size() / facet_normals.size()),
      facet_nodes_(facet_nodes.begin(), facet_nodes.end()),
      place_(facet_nodes.size(), -1),
      normal_(nodes, Vec3::Zero()),
      is_creased_(nodes) {
  node_.resize(nodes);
  std::iota(node_.begin(), node_.end(), 0);
  const FacetsAtNodes facets(nodes, facet_nodes);
  const auto nodes_of = [&](std::size_t facet) { return facet_nodes.subspan(width_ * facet, width_); };
  for (std::size_t node = 0; node < nodes; ++node) {
    const std::span<const std::size_t> here = facets.of(node);
    auto place = static_cast<Index>(node);
    std::vector<std::size_t> side;  // facet indices of the side being traversed
    for (const std::size_t begin : here) {
      if (place_[begin] >= 0) continue;
      if (begin != here.front()) {
        is_creased_[node] = 1;
        place = static_cast<Index>(node_.size());
        node_.push_back(static_cast<Index>(node));
        normal_.push_back(Vec3::Zero());
      }
      place_[begin] = place;
      side.assign(1, begin);
      while (!side.empty()) {
        const std::size_t from = side.back() / width_;
        side.pop_back();
        normal_[index(place)] += facet_normals[from];
        for (const std::size_t entry : here) {
          const std::size_t to = entry / width_;
          if (place_[entry] >= 0 || facet_normals[from].dot(facet_normals[to]) < smooth ||
              !are_neighbours(nodes_of(from), nodes_of(to), static_cast<Index>(node)))
            continue;
          place_[entry] = place;
          side.push_back(entry);
        }
      }
      normal_[index(place)].normalize();
    }
  }
}

SideTractions::SideTractions(const SurfaceSides& sides, std::span<const double> areas)
    : sides_(&sides), area_(sides.places()) {
  for (std::size_t k = 0; k < areas.size(); ++k) area_[index(sides.places_of_facets()[k])] += areas[k];
  const EdgeRows rows(sides, area_);
  first_.push_back(0);
  for (std::size_t place = 0; place < sides.places(); ++place) {
    for (const auto& [node, by_force] : rows[place]) {
      by_.push_back(node);
      by_force_.push_back(by_force);
    }
    first_.push_back(static_cast<Index>(by_.size()));
  }
}

Vec3 SideTractions::at(Index place, std::span<const Vec3> force) const noexcept {
  Vec3 traction = Vec3::Zero();
  for_each(place, [&](Index node, const Mat3& by_force) { traction.noalias() += by_force * force[node]; });
  return traction;
}

}  // namespace palpate
