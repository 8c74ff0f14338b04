// Tools that suit a body.
#pragma once

#include <string>

#include "runtime/app/play_options.h"
#include "runtime/body/body.h"
#include "runtime/core/touch/tool.h"

namespace palpate {

/// Returns the radius of a sphere that suits a body [m], to two digits: the mean edge of its surface, but at
/// least 3 and at most 10 % of the diagonal of its bounds.
[[nodiscard]] double fitting_radius(const Body& body);

/// Returns a warning if the tool is too large for a body, that is, longer than `size`, the diagonal of its
/// bounds [m]; empty otherwise.
[[nodiscard]] std::string too_large(const Tool& tool, double size);

/// Returns a warning if the tool is too small for the body's mesh: the stiffening by the mesh for a press of
/// a tenth of the tool's radius, and that radius (mesh_stiffening.h). Empty if the stiffening is not
/// noticeable. A tool without a radius is always too small.
[[nodiscard]] std::string too_small(const Tool& tool, const Body& body);

/// Prints the result of `too_small` with a hint to the error stream; nothing if it is empty.
void tell_small_tool(const std::string& note);

/// Chooses the sphere that suits the body, and reports it on the error stream, if a person moves the tool (by
/// a pointer or a device) and the settings name no tool. Scripts and replays then use a point, so that their
/// results do not depend on the mesh. Warns of a tool that is too large.
void settle_tool(PlayOptions& options, const Body& body);

}  // namespace palpate
