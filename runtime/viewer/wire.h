// The binary messages of the viewer (web/PROTOCOL.md).
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "runtime/background/surface_frames.h"
#include "runtime/loop/monitor.h"
#include "runtime/viewer/scene.h"

namespace palpate {

/// What no von Mises stress in the unit of a frame is: it is not known.
inline constexpr std::uint16_t unknown_stress = 65535;

/// Each as the bytes of one message.
std::string encode_scene(const Scene& scene);
std::string encode_patch(std::uint32_t scene, const ScenePatch& patch);

/// Whether a picture has values for all nodes of the scene and of the patch (null: none).
bool fits(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// A picture that fits; displacements to 1/65534 of the range from -largest to largest, stresses to 1/65534
/// of the largest. What is not finite counts as 0, a stress as not known.
std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// Ticks that are `stride` apart, at least one.
std::string encode_ticks(std::uint32_t scene, std::span<const TickNote> ticks, std::int64_t stride);

}  // namespace palpate
