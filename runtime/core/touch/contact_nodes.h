// Surface nodes on which a contact point acts.
#pragma once

#include <cstddef>

#include "runtime/core/body/near_field.h"
#include "runtime/core/touch/contact_point.h"

namespace palpate {

/// Calls visit(surface node, weight) for each node whose displacement moves the contact point. A group must
/// be in the near field; otherwise there are no calls.
template <class Visit>
void for_each_node(const ElasticBody& body, const NearField& near, const ContactPoint& contact,
                   Visit&& visit) noexcept {
  if (contact.aggregate < 0) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (contact.nodes[k] >= 0) visit(contact.nodes[k], contact.weights[k]);
    }
    return;
  }
  const Index place = near.place_of(body.aggregate_node(contact.aggregate));
  if (place < 0) return;
  near.for_each_member(place,
                       [&](Index node, double weight, const Eigen::Matrix3d&) { visit(node, weight); });
}

}  // namespace palpate
