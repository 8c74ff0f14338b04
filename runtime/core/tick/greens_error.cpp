#include "runtime/core/tick/greens_error.h"

#include <algorithm>

#include "runtime/core/body/elastic_body.h"
#include "runtime/core/body/near_field.h"
#include "runtime/core/touch/compliance.h"

namespace palpate {

GreensErrorScratch::GreensErrorScratch(const ElasticBody& body, const NearField& near)
    : stored_force(body.dimension(), 0) {
  const HierarchicalMatrix* matrix = body.greens().compressed_form();
  if (matrix == nullptr) return;
  const std::size_t stored_nodes = near.load().node.size();
  bound.emplace(*matrix, stored_nodes);
  near_force.resize(static_cast<std::size_t>(body.dimension()) * static_cast<std::size_t>(near.capacity()));
  stored_force = NodalLoad(body.dimension(), static_cast<Index>(stored_nodes));
}

void begin_greens_error(const NearField& near, GreensErrorScratch& work) noexcept {
  if (work.bound) work.bound->carry(near.load().nodes(), near.load().forces());
}

double greens_error(NearField& near, GreensErrorScratch& work, std::span<const ContactRow> rows,
                    std::span<const double> force_change) noexcept {
  if (!work.bound) return 0.0;
  const int d = near.dimension();
  std::fill_n(work.near_force.begin(), d * near.count(), 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ContactRow& row = rows[i];
    for (std::size_t n = 0; n < 3; ++n) {
      for (int axis = 0; axis < d && row.places[n] >= 0; ++axis)
        work.near_force[d * row.places[n] + axis] -= force_change[i] * row.body[n][axis];
    }
  }
  work.stored_force.clear();
  near.put_on_stored_nodes(std::span(work.near_force).first(static_cast<std::size_t>(d * near.count())),
                           work.stored_force);
  return work.bound->work(work.stored_force.nodes(), work.stored_force.forces());
}

}  // namespace palpate
