#include "runtime/core/body/patch.h"

namespace palpate {

std::size_t Patch::bytes() const noexcept {
  return sizeof(double) * static_cast<std::size_t>(parts_.compliance.size() + parts_.response.size() +
                                                   parts_.correction.size() + parts_.offset.size() +
                                                   parts_.offset_forces.size()) +
         sizeof(Part) * parts_.follows.size() +
         sizeof(Index) * (parts_.first_part.size() + parts_.elements.size() + parts_.surface_nodes.size() +
                          parts_.stored_nodes.size());
}

}  // namespace palpate
