#include "runtime/core/tick/scratch.h"

#include <algorithm>
#include <bit>

#include "runtime/core/solve/tick_tuning.h"

namespace palpate {
namespace {

constexpr std::size_t most_simplices_left_out = 2048;  // stored; further ones are only counted

/// A contact has up to d rows, and d - 1 for the tilt of its face.
Index most_rows(const ElasticBody& body, Index max_contacts) {
  return (2 * body.dimension() - 1) * max_contacts;
}

std::size_t size(Index count) {
  return static_cast<std::size_t>(count);
}

Index few(Index max_contacts) {
  return std::min(max_contacts, tuning.many.few_contacts);
}

/// Rows of the direct solvers' problems: those of few contacts, or of more frictionless ones, each with one
/// row and those of its tilt.
Index few_rows(const ElasticBody& body, Index max_contacts) {
  return std::max(most_rows(body, few(max_contacts)),
                  body.dimension() * std::min(max_contacts, tuning.many.few_frictionless));
}

/// Capacity for many contacts; 0 if there are always few.
Index many(Index max_contacts) {
  return max_contacts > tuning.many.few_closed ? max_contacts : 0;
}

/// Twice the number of contacts, so that a feature is found quickly.
std::size_t places_of_features(Index max_contacts) {
  return std::bit_ceil(size(2 * max_contacts));
}

std::size_t hash(std::int64_t feature) noexcept {
  return static_cast<std::size_t>((static_cast<std::uint64_t>(feature) * 0x9E3779B97F4A7C15U) >> 32U);
}

}  // namespace

RollingScratch::RollingScratch(int dimension, Index max_contacts, Index max_rows)
    : turning(size(max_contacts)),
      following(size(max_rows)),
      T(size(dimension * tuning.hand.most_turning) * size(dimension * tuning.hand.most_turning)),
      B(size(tuning.hand.most_following) * size(dimension * tuning.hand.most_turning)),
      turning_force(size(dimension * max_contacts)),
      next_force(turning_force.size()),
      row_force(following.size()),
      device_change(following.size()) {}

MergingScratch::MergingScratch(Index surface_nodes, Index groups, Index most_members, Index max_contacts)
    : candidate_of_node(size(surface_nodes), -1),
      merged(size(max_contacts)),
      weights(size(most_members)),
      maps(weights.size(), Eigen::Matrix3d::Zero()),
      feature(size(groups), -1) {}

LastContacts::LastContacts(Index max_contacts)
    : contacts(size(max_contacts)), of_feature_(places_of_features(max_contacts), -1) {}

void LastContacts::remember(std::span<const ContactPoint> now) noexcept {
  const std::size_t mask = of_feature_.size() - 1;
  for (Index k = 0; k < count; ++k) {
    std::size_t at = hash(contacts[size(k)].feature) & mask;
    while (of_feature_[at] != k) at = (at + 1) & mask;
    of_feature_[at] = -1;
  }
  std::copy(now.begin(), now.end(), contacts.begin());
  count = static_cast<Index>(now.size());
  for (Index k = 0; k < count; ++k) enter(k);
}

void LastContacts::enter(Index number) noexcept {
  const std::size_t mask = of_feature_.size() - 1;
  std::size_t at = hash(contacts[size(number)].feature) & mask;
  while (of_feature_[at] >= 0) at = (at + 1) & mask;
  of_feature_[at] = number;
}

void LastContacts::list_features() noexcept {
  std::fill(of_feature_.begin(), of_feature_.end(), -1);
  for (Index k = 0; k < count; ++k) enter(k);
}

Index LastContacts::number_of(std::int64_t feature) const noexcept {
  const std::size_t mask = of_feature_.size() - 1;
  std::size_t at = hash(feature) & mask;
  while (true) {
    const Index k = of_feature_[at];
    if (k < 0 || contacts[size(k)].feature == feature) return k;
    at = (at + 1) & mask;
  }
}

DetectionScratch::DetectionScratch(const ElasticBody& body, Index tools, Index max_contacts)
    : found(body.surface_friction().size()),
      found_distance(found.size()),
      pairs(size(std::min(8 * max_contacts, static_cast<Index>(found.size())))),
      candidates(size(3 * tools) * pairs.size()),
      candidate_at_node(body.surface_rest_positions().size(), -1),
      candidates_between(candidates.size()),
      left_out(candidates.size() + std::min(most_simplices_left_out, found.size())) {}

AssemblyScratch::AssemblyScratch(const ElasticBody& body, Index max_contacts, Index near_nodes)
    : row_response(size(body.dimension() * near_nodes)),
      guess_force(row_response.size()),
      upcoming(size(max_contacts)),
      order(upcoming.size()),
      response(upcoming.size()),
      last_response(upcoming.size()),
      compliance(few_rows(body, max_contacts), most_rows(body, many(max_contacts)),
                 body.dimension() * near_nodes),
      coupling(std::vector<double>(size(6 * few_rows(body, max_contacts))),
               std::vector<float>(size(6 * most_rows(body, many(max_contacts))))),
      tilt_spring(size(most_rows(body, max_contacts))) {}

ForceErrorScratch::ForceErrorScratch(const ElasticBody& body, Index tools, Index max_contacts)
    : imbalance(body.dimension() * max_contacts, most_rows(body, max_contacts)),
      missing_force(size(tools), Vec3::Zero()),
      left_out_nodes(most_sampled),
      left_out_blocks(size(body.dimension() * body.dimension()) * most_sampled) {}

ChangeScratch::ChangeScratch(const ElasticBody& body, Index max_contacts)
    : of_rows(size(body.dimension() * most_rows(body, max_contacts))),
      of_forces(of_rows.size()),
      rolling(body.dimension(), max_contacts, most_rows(body, max_contacts)) {}

Scratch::Scratch(const ElasticBody& body, Index tools, Index max_contacts, const NearField& near)
    : last(max_contacts),
      detection(body, tools, max_contacts),
      merging(static_cast<Index>(detection.candidate_at_node.size()), body.aggregates().count(),
              body.aggregates().most_members(), max_contacts),
      problem(body.dimension(), body.dimension() * max_contacts, few_rows(body, max_contacts),
              most_rows(body, many(max_contacts))),
      rows(size(most_rows(body, max_contacts))),
      assembly(body, max_contacts, near.capacity()),
      solver(few_rows(body, max_contacts),
             {body.dimension() * few(max_contacts), most_rows(body, few(max_contacts))},
             {body.dimension() * many(max_contacts), most_rows(body, many(max_contacts))}),
      force_error(body, tools, max_contacts),
      greens_error(body, near),
      changes(body, max_contacts),
      far_displacement(size(body.dimension() * (tuning.far.nodes + tuning.far.run))) {}

}  // namespace palpate
