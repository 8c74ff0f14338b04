#include "runtime/background/patch_choice.h"

#include <algorithm>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/tool_geometry.h"

namespace palpate {
namespace {

/// Weight of a contact point for locating the touch: the square of the depth of the device in the body at
/// rest there.
double share_of(const ContactPoint& contact) noexcept {
  if (contact.held) return 1.0;
  const double depth = std::max(0.0, -contact.free_gap);
  return depth * depth;
}

}  // namespace

Index PatchKey::count() const noexcept {
  return static_cast<Index>(std::count_if(centres.begin(), centres.end(), [](Index c) { return c >= 0; }));
}

void PatchKey::add(Index centre) noexcept {
  const auto end = centres.begin() + count();
  if (centre < 0 || end == centres.end() || std::find(centres.begin(), end, centre) != end) return;
  *end = centre;
  std::sort(centres.begin(), end + 1);
}

void PatchRequests::add(const PatchKey& key) noexcept {
  const auto end = keys.begin() + static_cast<std::ptrdiff_t>(count);
  if (key.empty() || count == most || std::find(keys.begin(), end, key) != end) return;
  keys[count++] = key;
}

PatchChoice::PatchChoice(const Body& body, const State& state)
    : reach_(tuning.patches.near_edges * body.mean_surface_edge() * body.refinement()),
      tools_(state.tools.size()),
      touched_(std::size_t{3} * static_cast<std::size_t>(body.most_surface_parts()) *
               static_cast<std::size_t>(state.max_contacts())),
      share_(touched_.size()) {}

/// Distributes a weight over the body's nodes that a surface node follows.
void PatchChoice::add_share(const Body& body, Index surface_node, double share) noexcept {
  if (body.rounding() != nullptr) {
    touched_[count_] = surface_node;
    share_[count_++] = share;
    return;
  }
  const SurfaceParts parts = body.surface_parts(surface_node);
  for (std::size_t p = 0; p < parts.stored.size(); ++p) {
    const auto end = touched_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto place =
        static_cast<std::size_t>(std::find(touched_.begin(), end, parts.stored[p]) - touched_.begin());
    if (place == count_) {
      touched_[count_] = parts.stored[p];
      share_[count_++] = 0.0;
    }
    share_[place] += share * parts.weights[p];
  }
}

/// Returns the node with the largest weight; the present one, if any, unless it has clearly less.
Index PatchChoice::chosen(Index present) const noexcept {
  Index best = -1;
  double of_best = 0.0, of_present = 0.0, sum = 0.0;
  for (std::size_t k = 0; k < count_; ++k) {
    sum += share_[k];
    if (touched_[k] == present) of_present = share_[k];
    if (share_[k] <= of_best) continue;
    of_best = share_[k];
    best = touched_[k];
  }
  return present >= 0 && of_best <= of_present + tuning.patches.clearly_more * sum ? present : best;
}

/// Returns the surface node nearest to the middle of the weights; the present one unless it is clearly
/// farther away.
Index PatchChoice::nearest_to_middle(const Body& body, Index present) const noexcept {
  const std::span<const Vec3> rest = body.surface_rest_positions();
  Vec3 middle = Vec3::Zero();
  double sum = 0.0;
  for (std::size_t k = 0; k < count_; ++k) {
    middle += share_[k] * rest[touched_[k]];
    sum += share_[k];
  }
  if (!(sum > 0.0)) return present;
  middle /= sum;
  Index best = -1;
  const auto distance = [&](Index node) { return (rest[node] - middle).norm(); };
  for (std::size_t k = 0; k < count_; ++k) {
    if (best < 0 || distance(touched_[k]) < distance(best)) best = touched_[k];
  }
  const double margin = tuning.patches.farther * body.mean_surface_edge();
  return present >= 0 && distance(present) <= distance(best) + margin ? present : best;
}

Index PatchChoice::touched_centre(const Body& body, const State& state, std::size_t number) noexcept {
  count_ = 0;
  for (const ContactPoint& contact : state.contacts()) {
    if (contact.tool != static_cast<Index>(number)) continue;
    for (std::size_t n = 0; n < 3; ++n) {
      if (contact.nodes[n] >= 0) add_share(body, contact.nodes[n], share_of(contact) * contact.weights[n]);
    }
  }
  return body.rounding() != nullptr ? nearest_to_middle(body, tools_[number].centre)
                                    : chosen(tools_[number].centre);
}

Index PatchChoice::nearest_centre(const Body& body, const NearestSimplex& found, Index present) noexcept {
  const auto d = static_cast<std::size_t>(body.dimension());
  const std::span<const Index> corners =
      body.simplices().subspan(d * static_cast<std::size_t>(found.simplex), d);
  count_ = 0;
  for (std::size_t k = 0; k < d; ++k) add_share(body, corners[k], found.nearest.weights[k]);
  return body.rounding() != nullptr ? nearest_to_middle(body, present) : chosen(present);
}

void PatchChoice::follow_tool(const Body& body, const State& state, std::size_t number) noexcept {
  const ToolState& tool = state.tools[number];
  Followed& followed = tools_[number];
  if (!tool.placed) return;
  const Vec3 moved = tool.device.position - tool.last_device.position;
  followed.velocity += tuning.patches.smoothing * (moved - followed.velocity);
  if (tool.contacts > 0) {
    followed.centre = touched_centre(body, state, number);
    return;
  }
  if (ticks_ % tuning.patches.look_stride != 0) return;
  const NearestSimplex found = state.surface.tree.nearest(tool.pose.position);
  const double most = reach_ + tool.tool.radius + core_extent(tool.tool);
  followed.centre = tool.engaged && found.nearest.squared_distance < most * most
                        ? nearest_centre(body, found, followed.centre)
                        : -1;
}

/// Predicts the centres that the tools will need in some ticks.
PatchKey PatchChoice::key_at(const Body& body, const State& state, double ticks) noexcept {
  PatchKey key;
  for (std::size_t k = 0; k < tools_.size(); ++k) {
    if (tools_[k].centre < 0) continue;
    const Vec3 place = state.tools[k].pose.position + ticks * tools_[k].velocity;
    if (place.allFinite()) key.add(nearest_centre(body, state.surface.tree.nearest(place), -1));
  }
  return key;
}

void PatchChoice::follow(const Body& body, const State& state) noexcept {
  ++ticks_;
  now_ = {};
  for (std::size_t k = 0; k < tools_.size(); ++k) {
    follow_tool(body, state, k);
    if (tools_[k].centre >= 0) now_.add(tools_[k].centre);
  }
  const auto turn = static_cast<std::size_t>(ticks_) % ahead_.size();
  ahead_[turn] = now_.empty() ? PatchKey{} : key_at(body, state, tuning.patches.times_ahead[turn]);
  requests_.count = 0;
  requests_.add(now_);
  for (const PatchKey& key : ahead_) requests_.add(key);
  const double speed = tools_.front().velocity.norm();
  requests_.direction = speed > 0.0 ? Vec3(tools_.front().velocity / speed) : Vec3::Zero();
}

}  // namespace palpate
