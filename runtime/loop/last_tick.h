// Export of the state after the last tick of a run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/core/tick/state.h"

namespace palpate {

/// Returns the contact points as CSV: position, outward normal, force on the body, gap, simplex, held by a
/// grab.
std::string contact_table(const Body& body, const State& state);

/// Displacement of the surface nodes from their places in the mesh, without loads [m].
std::vector<Vec3> displacement_from_mesh(const Body& body, const State& state);

/// Writes the undeformed surface with its visible displacement u0 + u, von Mises stress and contact pressure
/// (.vtu). Throws Error.
void write_surface(const std::filesystem::path& file, const Body& body, const State& state);

}  // namespace palpate
