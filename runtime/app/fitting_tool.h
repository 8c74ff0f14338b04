// Which tools suit a body.
#pragma once

#include <string>

#include "runtime/app/play_options.h"
#include "runtime/body/body.h"
#include "runtime/touch/tool.h"

namespace palpate {

/// Radius of a ball that suits a body [m], to two digits: the mean edge of its surface, but no less than 3
/// and no more than 10 % of the diagonal of its bounds.
[[nodiscard]] double fitting_radius(const Body& body);

/// Why a tool is too large to feel a body with, for a person; empty where it is not. It is too large when it
/// is longer than the body's `size`, the diagonal of its bounds [m].
[[nodiscard]] std::string too_large(const Tool& tool, double size);

/// Why a tool is too small for the body's mesh, for a person: by how much the mesh is too stiff where the
/// tool is pressed in by a tenth of its radius, and by its radius (mesh_stiffening.h). Empty where the second
/// is not noticed. A tool without a radius is always too small.
[[nodiscard]] std::string too_small(const Tool& tool, const Body& body);

/// Prints what `too_small` gave, and what helps, on the error stream; nothing where it is empty.
void tell_small_tool(const std::string& note);

/// Where a person moves the tool (by a pointer or a device) and the settings name none: the ball that suits
/// the body, told on the error stream. Scripts and replays without one have a point, so that what they do
/// depends on no mesh. Warns of a tool that is too large.
void settle_tool(PlayOptions& options, const Body& body);

}  // namespace palpate
