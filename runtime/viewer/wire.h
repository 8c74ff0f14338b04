// Binary messages of the viewer (web/PROTOCOL.md).
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "runtime/background/surface_frames.h"
#include "runtime/loop/monitor.h"
#include "runtime/scene/scene.h"
#include "runtime/viewer/wire_values.h"

namespace palpate {

/// Each returns the bytes of one message.
std::string encode_scene(const Scene& scene);
std::string encode_patch(std::uint32_t scene, const ScenePatch& patch);

/// Encodes a picture that fits. `values` are its own, of which only the difference from `base` is in the
/// message (null: all of them). The reader must have that base.
std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch,
                         const WireValues& values, const WireValues* base);
/// Encodes picture number 1, for a reader without a base.
std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch);

/// Encodes ticks that are `stride` apart; at least one.
std::string encode_ticks(std::uint32_t scene, std::span<const TickNote> ticks, std::int64_t stride);

}  // namespace palpate
