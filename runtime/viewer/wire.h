// The binary messages of the viewer (web/PROTOCOL.md).
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "runtime/background/surface_frames.h"
#include "runtime/loop/monitor.h"
#include "runtime/scene/scene.h"
#include "runtime/viewer/wire_values.h"

namespace palpate {

/// Each as the bytes of one message.
std::string encode_scene(const Scene& scene);
std::string encode_patch(std::uint32_t scene, const ScenePatch& patch);

/// A picture that fits: `values` are its own, of which only what differs from `base` is in the message (null:
/// all of them). Who reads it must have that base.
std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch,
                         const WireValues& values, const WireValues* base);
/// Picture number 1, for a reader that has nothing.
std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// Ticks that are `stride` apart, at least one.
std::string encode_ticks(std::uint32_t scene, std::span<const TickNote> ticks, std::int64_t stride);

}  // namespace palpate
