// Pictures of a recording for ParaView, a file each.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "formats/recording.h"
#include "runtime/background/surface_frames.h"

namespace palpate {

/// The surface of one picture, where it is: displacement [m], von_mises and pressure [Pa] at its nodes.
[[nodiscard]] std::string frame_vtu(const RecordedSurface& surface, const SurfaceFrame& frame);

/// "00042.vtu"
[[nodiscard]] std::string frame_name(std::size_t number);

/// The collection (.pvd) of pictures that lie in `folder` beside it, with their times.
[[nodiscard]] std::string series_pvd(const std::filesystem::path& folder,
                                     std::span<const SurfacePicture> pictures);

}  // namespace palpate
