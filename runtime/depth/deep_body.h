// Body on two levels.
#pragma once

#include <cstdint>

#include "formats/model.h"
#include "runtime/body/body.h"

namespace palpate {

/// Choice of two levels, for deep presses.
enum class Depth : std::uint8_t {
  automatic,  ///< yes if goes_deep
  yes,
  no,  ///< small strain
};

/// Returns the name as users give it: auto, yes, no.
constexpr const char* name_of(Depth depth) noexcept {
  return depth == Depth::automatic ? "auto" : depth == Depth::yes ? "yes" : "no";
}

/// True for a static body in space whose steps on two levels are short enough for a hand.
[[nodiscard]] bool goes_deep(const Model& model) noexcept;

/// Makes a body on two levels: quasi-static, its balance found beside the tick every few milliseconds, longer
/// for large meshes, whatever its dynamics; `refinement`, `local`: see Body. Throws Error if there are no
/// Green's functions.
Body deep_body(Model model, int refinement = 1, bool local = false);

}  // namespace palpate
