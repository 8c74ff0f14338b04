#include "runtime/core/body/elastic_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "runtime/core/body/two_level_greens.h"
#include "runtime/core/solve/tick_tuning.h"

namespace palpate {
namespace {

constexpr std::size_t search_block = 64;
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

ElasticBody::ElasticBody(BodyParts parts)
    : name_(std::move(parts.name)),
      greens_(std::move(parts.greens)),
      contact_model_(parts.contact_model),
      modes_(std::move(parts.modes)),
      swing_(parts.swing),
      coarse_(std::move(parts.coarse)),
      refinement_(parts.refinement),
      simplices_(std::move(parts.simplices)),
      surface_friction_(std::move(parts.friction)),
      surface_rest_(std::move(parts.rest)),
      surface_stored_nodes_(std::move(parts.surface_stored)),
      first_part_(std::move(parts.first_part)),
      part_stored_(std::move(parts.part_stored)),
      part_weight_(std::move(parts.part_weight)) {
  find_free_nodes(parts.free);
  find_followers();
  std::vector<bool> moves;
  std::vector<Index> follows;
  for (Index node = 0; node < static_cast<Index>(surface_rest_.size()); ++node) {
    const SurfaceParts of_node = surface_parts(node);
    moves.push_back(refinement_ == 1 && surface_moves(node));
    follows.push_back(of_node.stored.empty() ? -1 : of_node.stored.back());
  }
  aggregates_ = SurfaceAggregates(dimension(), simplices(), moves);
  runs_ = NodeRuns(tuning.far.run, greens_->nodes(), dimension(), simplices(), follows);
  measure_surface();
}

std::int64_t ElasticBody::motion_size() const noexcept {
  return greens_->order() + (coarse_ != nullptr ? coarse_->dofs() : 0);
}

void ElasticBody::find_free_nodes(const std::vector<Index>& free) {
  surface_node_of_stored_.assign(static_cast<std::size_t>(greens_->nodes()), -1);
  for (std::size_t k = 0; k < surface_stored_nodes_.size(); ++k) {
    const Index stored = surface_stored_nodes_[k];
    if (stored >= 0) surface_node_of_stored_[stored] = static_cast<Index>(k);
  }
  for (const Index stored : free) {
    const Vec3& rest = surface_rest_[surface_node_of_stored_[stored]];
    surface_.push_back(stored);
    x_.push_back(rest.x());
    y_.push_back(rest.y());
    z_.push_back(rest.z());
  }
  if (surface_.empty()) {
    throw Error("no node of the surface is free to move, so nothing can be touched", name_,
                "fix a smaller region of the body and precompute the model again");
  }
  const std::size_t padded = (surface_.size() + search_block - 1) / search_block * search_block;
  for (std::vector<double>* coordinate : {&x_, &y_, &z_}) coordinate->resize(padded, infinity);
}

void ElasticBody::find_followers() {
  const auto last_part = [&](std::size_t node) {
    const std::span<const Index> stored = surface_parts(static_cast<Index>(node)).stored;
    return stored.empty() ? -1 : stored.back();
  };
  first_follower_.assign(static_cast<std::size_t>(greens_->nodes()) + 1, 0);
  for (std::size_t node = 0; node < surface_rest_.size(); ++node) {
    const auto parts = static_cast<Index>(surface_parts(static_cast<Index>(node)).stored.size());
    most_surface_parts_ = std::max(most_surface_parts_, parts);
    if (last_part(node) >= 0) ++first_follower_[static_cast<std::size_t>(last_part(node)) + 1];
  }
  std::partial_sum(first_follower_.begin(), first_follower_.end(), first_follower_.begin());
  followers_.resize(first_follower_.back());
  std::vector<Index> next(first_follower_.begin(), first_follower_.end() - 1);
  for (std::size_t node = 0; node < surface_rest_.size(); ++node) {
    if (last_part(node) < 0) continue;
    Index& place = next[last_part(node)];
    followers_[place++] = static_cast<Index>(node);
  }
}

void ElasticBody::measure_surface() {
  for (const Vec3& position : surface_rest_) bounds_.extend(position);
  const auto corners = static_cast<std::size_t>(dimension());
  double sum = 0.0;
  for (std::size_t simplex = 0; simplex < simplices().size(); simplex += corners) {
    double around = 0.0;
    for (std::size_t k = 0; k < corners; ++k) {
      const auto a = static_cast<std::size_t>(simplices()[simplex + k]);
      const auto b = static_cast<std::size_t>(simplices()[simplex + (k + 1) % corners]);
      const double length = (surface_rest_[a] - surface_rest_[b]).norm();
      longest_surface_edge_ = std::max(longest_surface_edge_, length);
      around += length;
      sum += length;  // a closed surface counts each edge equally often
    }
    simplex_edges_.push_back(around / static_cast<double>(corners));
  }
  mean_surface_edge_ = sum / static_cast<double>(simplices().size());
}

NearestNode ElasticBody::nearest_surface_node(const Vec3& point) const noexcept {
  const double z = dimension() == 3 ? point.z() : 0.0;
  const auto squared_distance = [&](std::size_t i) {
    const double dx = x_[i] - point.x();
    const double dy = y_[i] - point.y();
    const double dz = z_[i] - z;
    return dx * dx + dy * dy + dz * dz;
  };

  double nearest = infinity;
  std::size_t nearest_block = 0;
  for (std::size_t block = 0; block < x_.size(); block += search_block) {
    double in_block = infinity;
#pragma omp simd reduction(min : in_block)
    for (std::size_t i = block; i < block + search_block; ++i)
      in_block = std::min(in_block, squared_distance(i));
    if (in_block < nearest) {
      nearest = in_block;
      nearest_block = block;
    }
  }

  std::size_t best = nearest_block;
  for (std::size_t i = best; i < std::min(nearest_block + search_block, surface_.size()); ++i) {
    if (squared_distance(i) < squared_distance(best)) best = i;
  }
  return {surface_[best], std::sqrt(squared_distance(best))};
}

}  // namespace palpate
