#include "runtime/tick/greens_error.h"

#include <algorithm>
#include <cmath>

#include "runtime/tick/state.h"

namespace palpate {

GreensErrorScratch::GreensErrorScratch(const Body& body, const NearField& near)
    : stored_force(body.dimension(), 0) {
  const HierarchicalMatrix* matrix = body.greens().compressed_form();
  if (matrix == nullptr) return;
  const std::size_t stored_nodes = near.load().node.size();
  bound.emplace(*matrix, stored_nodes);
  near_force.resize(static_cast<std::size_t>(body.dimension()) * static_cast<std::size_t>(near.capacity()));
  stored_force = NodalLoad(body.dimension(), static_cast<Index>(stored_nodes));
}

void begin_greens_error(const NearField& near, Scratch& scratch) noexcept {
  GreensErrorScratch& work = scratch.greens_error;
  if (work.bound) work.bound->carry(near.load().nodes(), near.load().forces());
}

void note_greens_error(NearField& near, Scratch& scratch, ToolState& tool, Index begin) noexcept {
  GreensErrorScratch& work = scratch.greens_error;
  if (!work.bound) return;
  const int d = near.dimension();
  std::fill_n(work.near_force.begin(), d * near.count(), 0.0);
  for (Index i = 0; i < scratch.problem.rows; ++i) {
    const ContactRow& row = scratch.rows[i];
    for (std::size_t n = 0; n < 3; ++n) {
      for (int axis = 0; axis < d && row.places[n] >= 0; ++axis)
        work.near_force[d * row.places[n] + axis] -= scratch.force_change[begin + i] * row.body[n][axis];
    }
  }
  work.stored_force.clear();
  near.put_on_stored_nodes(std::span(work.near_force).first(static_cast<std::size_t>(d * near.count())),
                           work.stored_force);
  tool.greens_error =
      std::hypot(tool.greens_error, work.bound->work(work.stored_force.nodes(), work.stored_force.forces()));
}

}  // namespace palpate
