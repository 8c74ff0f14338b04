#include "runtime/core/tick/contact_merging.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/touch/contact_feature.h"
#include "runtime/core/touch/contact_nodes.h"

namespace palpate {
namespace {

constexpr Index none = -1;
constexpr Index several = -2;

std::int64_t feature_of_group(std::int64_t of_vertex, Index group) noexcept {
  return with_kind(of_vertex, FeatureKind::group, group);
}

std::int64_t feature_of_vertex(std::int64_t of_group, Index node) noexcept {
  return with_kind(of_group, FeatureKind::vertex, node);
}

/// Returns a feature that no contact point has; those of held contacts count down from -1.
std::int64_t feature_of_nobody(Index number) noexcept {
  return std::numeric_limits<std::int64_t>::min() + number;
}

/// Surface node of a contact point; -1 if it is at none or at several.
Index vertex_of(const ContactPoint& contact) noexcept {
  if (contact.aggregate >= 0) return none;
  Index vertex = none;
  for (const Index node : contact.nodes) {
    if (node < 0) continue;
    if (vertex >= 0) return none;
    vertex = node;
  }
  return vertex;
}

/// Fraction of the available friction used by a contact.
double share_of_friction(const ContactPoint& contact) noexcept {
  if (contact.friction == 0.0) return 0.0;
  const Vec3 n = contact.frame.col(0);
  const double normal = n.dot(contact.force);
  return normal > 0.0 ? (contact.force - normal * n).norm() / (contact.friction * normal) : 0.0;
}

bool slips(double share) noexcept {
  return share > tuning.merging.slipping;
}

/// Merges the candidates of a tick.
class Merging {
 public:
  Merging(const ElasticBody& body, State& state, Scratch& scratch) noexcept
      : body_(body), state_(state), scratch_(scratch), room_(state.max_contacts() - state.held_count) {}

  [[nodiscard]] bool is_wanted() const noexcept {
    if (state_.surface.patch != nullptr || state_.surface.near.patch() != nullptr) return false;
    Index pressed = 0;  // nodes in the last tick
    bool has_merged = false;
    for (Index k = 0; k < scratch_.last.count; ++k) {
      const ContactPoint& last = scratch_.last.contacts[k];
      if (last.held || last.force.isZero(0.0)) continue;
      has_merged = has_merged || is_group(last);
      for_each_node(body_, state_.surface.near, last, [&](Index, double) { ++pressed; });
    }
    const auto is_above = [&](Index count, Index most) {
      return count > (has_merged ? most - most / 4 : most);
    };
    return is_above(pressed, tuning.merging.from) ||
           is_above(scratch_.detection.candidate_count, room_ - room_ / 4);
  }

  void run() noexcept {
    list_candidates();
    left_ = scratch_.detection.candidate_count;
    is_crowded_ = left_ > std::min(tuning.merging.crowd, room_ - room_ / 8);
    look_at_merged();
    merge_again();
    merge_more();
    const auto begin = scratch_.detection.candidates.begin();
    const auto end = std::remove_if(begin, begin + scratch_.detection.candidate_count,
                                    [](const ContactPoint& contact) { return contact.tool == none; });
    scratch_.detection.candidate_count = static_cast<Index>(end - begin);
  }

 private:
  void list_candidates() noexcept {
    std::vector<Index>& candidate_of_node = scratch_.merging.candidate_of_node;
    std::fill(candidate_of_node.begin(), candidate_of_node.end(), none);
    for (Index k = 0; k < scratch_.detection.candidate_count; ++k) {
      const Index node = vertex_of(scratch_.detection.candidates[k]);
      if (node < 0) continue;
      candidate_of_node[node] = candidate_of_node[node] == none ? k : several;
    }
  }

  /// Returns the only candidate at a node; null if there is none or there are several.
  [[nodiscard]] ContactPoint* candidate_at(Index node) const noexcept {
    const Index k = scratch_.merging.candidate_of_node[node];
    return k < 0 ? nullptr : &scratch_.detection.candidates[k];
  }

  /// Finds the groups of the last tick that are still pressed by all their nodes, and the deviation of the
  /// nodes' gaps.
  void look_at_merged() noexcept {
    for (Index k = 0; k < scratch_.last.count; ++k) {
      const ContactPoint& last = scratch_.last.contacts[k];
      if (!is_group(last) || last.force.isZero(0.0)) continue;
      double mean = 0.0;
      bool is_whole = true;
      for_each_node(body_, state_.surface.near, last, [&](Index node, double weight) {
        const ContactPoint* at = candidate_at(node);
        is_whole = is_whole && at != nullptr && at->feature == feature_of_vertex(last.feature, node) &&
                   at->friction == last.friction;
        if (is_whole) mean += weight * at->gap;
      });
      if (!is_whole) continue;
      double defect = may_begin_to_slip(last) ? std::numeric_limits<double>::infinity() : 0.0;
      for_each_node(body_, state_.surface.near, last, [&](Index node, double) {
        defect = std::max(defect, std::abs(candidate_at(node)->gap - mean));
      });
      scratch_.merging.merged[merged_count_++] = {k, defect};
    }
  }

  /// True if some nodes of a group may slip before others, which the group cannot represent.
  [[nodiscard]] bool may_begin_to_slip(const ContactPoint& group) const noexcept {
    const double share = share_of_friction(group);
    return !is_crowded_ && share > tuning.merging.no_longer_sticking && !slips(share);
  }

  /// Merges these groups again, except those with the largest defects, as long as all contact points fit.
  void merge_again() noexcept {
    const auto begin = scratch_.merging.merged.begin();
    std::sort(begin, begin + merged_count_, [](const MergedGroup& a, const MergedGroup& b) {
      return a.defect < b.defect || (a.defect == b.defect && a.last < b.last);
    });
    const double most = tuning.merging.defect * body_.mean_surface_edge();
    for (Index k = 0; k < merged_count_; ++k) {
      const MergedGroup& group = scratch_.merging.merged[k];
      const bool may_part = k >= merged_count_ - tuning.merging.most_parted && left_ <= room_;
      if (may_part && group.defect > most) continue;
      const Index number = scratch_.last.contacts[group.last].aggregate;
      if (state_.surface.near.want(body_, body_.aggregate_node(number))) merge(number);
    }
  }

  /// Merges the nodes of other groups, by the forces that they carried.
  void merge_more() noexcept {
    Index more = left_ > room_ ? left_ : tuning.merging.most_new;
    for (Index k = 0; k < scratch_.detection.candidate_count && more > 0; ++k) {
      const ContactPoint& candidate = scratch_.detection.candidates[k];
      const Index node = candidate.tool == none ? none : vertex_of(candidate);
      const Index group = node < 0 ? none : body_.aggregates().of_node(node);
      if (group < 0 || scratch_.merging.candidate_of_node[node] != k) continue;
      if (!find_weights(group, candidate) || !find_maps(group)) continue;
      if (!state_.surface.near.want_group(body_, group, scratch_.merging.weights, scratch_.merging.maps))
        continue;
      merge(group);
      --more;
    }
  }

  /// Computes the weights of a group's nodes from the forces that they carried, for those that stick (or
  /// slip) as the first of them does; for all in a crowd. False if there are too few, or the group was
  /// examined from another of its nodes.
  [[nodiscard]] bool find_weights(Index group, const ContactPoint& candidate) noexcept {
    const std::span<const Index> members = body_.aggregates().members(group);
    std::vector<double>& weights = scratch_.merging.weights;
    double sum = 0.0;
    Index count = 0;
    bool first_slips = false;
    for (std::size_t k = 0; k < members.size(); ++k) {
      weights[k] = 0.0;
      const ContactPoint* last = last_at(members[k], candidate);
      if (last == nullptr) continue;
      const double share = share_of_friction(*last);
      if (!is_crowded_ && !slips(share) && share > tuning.merging.sticking) continue;
      if (!is_crowded_ && count > 0 && slips(share) != first_slips) continue;
      if (count == 0 && candidate_at(members[k]) != &candidate) return false;
      first_slips = slips(share);
      weights[k] = last->force.dot(last->frame.col(0));
      sum += weights[k];
      ++count;
    }
    if (count < tuning.merging.fewest) return false;
    for (std::size_t k = 0; k < members.size(); ++k) weights[k] /= sum;
    return true;
  }

  /// Computes maps that rotate the group's force at each node from the mean normal to the node's own,
  /// preserving the sum. False if the normals differ too much.
  [[nodiscard]] bool find_maps(Index group) noexcept {
    const std::span<const Index> members = body_.aggregates().members(group);
    const std::vector<double>& weights = scratch_.merging.weights;
    const auto normal_at = [&](std::size_t k) { return Vec3(candidate_at(members[k])->frame.col(0)); };
    Vec3 mean = Vec3::Zero();
    for (std::size_t k = 0; k < members.size(); ++k) {
      if (weights[k] != 0.0) mean += weights[k] * normal_at(k);
    }
    const double length = mean.norm();
    if (length < tuning.merging.least_mean_normal) return false;
    for (std::size_t k = 0; k < members.size(); ++k) {
      if (weights[k] != 0.0)
        scratch_.merging.maps[k] =
            weights[k] / length * Eigen::Quaterniond::FromTwoVectors(mean, normal_at(k)).toRotationMatrix();
    }
    return true;
  }

  /// Returns the contact point of a node in the last tick; null if it carried no force or is of another kind
  /// than the candidate.
  [[nodiscard]] const ContactPoint* last_at(Index node, const ContactPoint& candidate) const noexcept {
    const ContactPoint* at = candidate_at(node);
    if (at == nullptr || at->friction != candidate.friction || !are_alike(at->feature, candidate.feature))
      return nullptr;
    const Index number = scratch_.last.number_of(at->feature);
    if (number == none) return nullptr;
    const ContactPoint& last = scratch_.last.contacts[number];
    return last.force.dot(last.frame.col(0)) > 0.0 ? &last : nullptr;
  }

  /// Replaces the first of a group's candidates by their mean.
  void merge(Index group) noexcept {
    ContactPoint merged;
    ContactPoint* first = nullptr;
    Vec3 position = Vec3::Zero();
    Vec3 normal = Vec3::Zero();
    const ContactPoint of_group{.aggregate = group};
    for_each_node(body_, state_.surface.near, of_group, [&](Index node, double weight) {
      ContactPoint& member = *candidate_at(node);
      if (first == nullptr) {
        first = &member;
        merged = member;
        merged.gap = merged.free_gap = 0.0;
        merged.nodes = {node, none, none};
        merged.weights = {1.0, 0.0, 0.0};
      }
      position += weight * member.position;
      normal += weight * Vec3(member.frame.col(0));
      merged.gap += weight * member.gap;
      merged.free_gap += weight * member.free_gap;
      member.tool = none;
      --left_;
    });
    merged.aggregate = group;
    merged.feature = feature_of_group(merged.feature, group);
    merged.arm += position - merged.position;
    merged.position = position;
    merged.gap /= normal.norm();
    merged.free_gap /= normal.norm();
    merged.frame = contact_frame(normal.normalized(), body_.dimension());
    *first = merged;
    ++left_;
  }

  const ElasticBody& body_;
  State& state_;
  Scratch& scratch_;
  Index room_;
  Index left_ = 0;           // contact points
  bool is_crowded_ = false;  // sticking and slipping nodes are merged alike
  Index merged_count_ = 0;
};

/// Distributes a group's force over its nodes. Nodes that do not fit start without force.
void part_last(const ElasticBody& body, const NearField& near, Scratch& scratch, Index number) noexcept {
  const ContactPoint group = scratch.last.contacts[number];
  const Eigen::Matrix3d response = scratch.assembly.response[number];
  const Index place = near.place_of(body.aggregate_node(group.aggregate));
  if (place < 0) return;
  bool is_first = true;
  near.for_each_member(place, [&](Index node, double, const Eigen::Matrix3d& map) {
    if (!is_first && static_cast<std::size_t>(scratch.last.count) == scratch.last.contacts.size()) return;
    const Index to = is_first ? number : scratch.last.count++;
    ContactPoint& part = scratch.last.contacts[to];
    part = group;
    part.aggregate = none;
    part.nodes = {node, none, none};
    part.feature = feature_of_vertex(group.feature, node);
    part.force = map * group.force;
    part.frame.col(0) = (map * group.frame.col(0)).normalized();
    if (to == scratch.assembly.response_count) ++scratch.assembly.response_count;
    if (to < scratch.assembly.response_count) scratch.assembly.response[to] = map * response;
    is_first = false;
  });
}

/// Adds up the forces of a group's nodes, at the place of the first of them. False if there is none.
bool merge_last(const ElasticBody& body, const NearField& near, Scratch& scratch,
                const ContactPoint& group) noexcept {
  Index first = none;
  Vec3 force = Vec3::Zero();
  Vec3 carry = Vec3::Zero();
  Eigen::Matrix3d response = Eigen::Matrix3d::Zero();
  for_each_node(body, near, group, [&](Index node, double weight) {
    const Index last = scratch.last.number_of(feature_of_vertex(group.feature, node));
    if (last == none) return;
    ContactPoint& from = scratch.last.contacts[last];
    force += from.force;
    carry += weight * from.carry;
    if (last < scratch.assembly.response_count) response += scratch.assembly.response[last];
    from.force.setZero();
    from.feature = feature_of_nobody(last);
    if (first == none) first = last;
  });
  if (first == none) return false;
  ContactPoint& merged = scratch.last.contacts[first];
  merged.aggregate = group.aggregate;
  merged.nodes = group.nodes;
  merged.weights = group.weights;
  merged.feature = group.feature;
  merged.frame = group.frame;
  merged.force = force;
  merged.carry = carry;
  if (first < scratch.assembly.response_count) scratch.assembly.response[first] = response;
  return true;
}

}  // namespace

bool is_group(const ContactPoint& contact) noexcept {
  return contact.aggregate >= 0 && !contact.held;
}

void merge_contacts(const ElasticBody& body, State& state, Scratch& scratch) noexcept {
  Merging merging(body, state, scratch);
  if (merging.is_wanted()) merging.run();
}

void hand_over_merged(const ElasticBody& body, const State& state, Scratch& scratch) noexcept {
  MergingScratch& merging = scratch.merging;
  const NearField& near = state.surface.near;
  merging.has_changed = false;
  for (const ContactPoint& contact : state.contacts()) {
    if (is_group(contact)) merging.feature[contact.aggregate] = contact.feature;
  }
  const Index before = scratch.last.count;
  for (Index k = 0; k < before; ++k) {
    const ContactPoint& last = scratch.last.contacts[k];
    if (!is_group(last) || merging.feature[last.aggregate] == last.feature) continue;
    part_last(body, near, scratch, k);
    merging.has_changed = true;
  }
  if (merging.has_changed) scratch.last.list_features();
  for (const ContactPoint& contact : state.contacts()) {
    if (!is_group(contact)) continue;
    merging.feature[contact.aggregate] = none;
    if (scratch.last.number_of(contact.feature) != none) continue;
    if (!merge_last(body, near, scratch, contact)) continue;
    scratch.last.list_features();
    merging.has_changed = true;
  }
}

}  // namespace palpate
