// What the last tick of a run left behind, as files.
#pragma once

#include <filesystem>
#include <string>

#include "runtime/tick/state.h"

namespace palpate {

/// The contact points as CSV: place, outward normal, force on the body, gap, simplex, held by a grab.
std::string contact_table(const Body& body, const State& state);

/// Writes the surface, undeformed, with u0 + u, which is what is seen, von Mises stress and contact pressure
/// (.vtu). Throws Error.
void write_surface(const std::filesystem::path& file, const Body& body, const State& state);

}  // namespace palpate
