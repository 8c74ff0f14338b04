// A recording as a glTF 2.0 scene, for Blender, game engines and browsers.
#pragma once

#include <span>
#include <string>

#include "formats/recording.h"
#include "runtime/background/surface_frames.h"
#include "runtime/touch/tool.h"

namespace palpate {

/// Bytes of a .glb file: the surface with a morph target for each picture, the tool, and an animation that
/// moves both, with lengths in metres. Between two pictures the surface goes straight. The body's z becomes
/// glTF's y, which is up there. In the plane the surface is lines. `pictures`: at least one, times ascending.
[[nodiscard]] std::string glb_of(const std::string& name, const RecordedSurface& surface, const Tool& tool,
                                 std::span<const SurfacePicture> pictures);

}  // namespace palpate
