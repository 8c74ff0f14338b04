// Export of a recording as a glTF 2.0 scene, for Blender, game engines and browsers.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "base/write_file.h"
#include "formats/recording.h"
#include "runtime/background/surface_frames.h"
#include "runtime/core/touch/tool.h"

namespace palpate {

/// Writes a .glb file: the surface with a morph target for each picture, the tool, and an animation of both,
/// with lengths in metres. Between two pictures the surface is interpolated linearly. The body's z becomes
/// glTF's y, which points up. In the plane the surface is drawn as lines. `picture` returns each of the
/// `pictures` (at least one) in order, at ascending times. Throws Error if `picture` or `file` does.
void write_glb(FileWriter& file, const std::string& name, const RecordedSurface& surface, const Tool& tool,
               std::size_t pictures, const std::function<SurfacePicture(std::size_t)>& picture);

/// Size of the binary part for `pictures` pictures [byte].
[[nodiscard]] std::size_t glb_bytes(const RecordedSurface& surface, std::size_t pictures) noexcept;

}  // namespace palpate
