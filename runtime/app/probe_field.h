// Export of a probe's displacement.
#pragma once

#include <filesystem>
#include <span>

#include "runtime/body/body.h"
#include "runtime/body/overlay.h"

namespace palpate {

/// Writes u [n], the displacement of all stored nodes from rest [m], beside u0, that at rest: a table if
/// `file` ends in .csv, otherwise a grid for ParaView (.vtu). It includes the stress due to u0 + u at surface
/// nodes under `force` [n] [N]; the stress is NaN inside, where the surface is held, and with an overlay.
/// `overlay` may be null; otherwise its fine mesh is added. Throws Error if the file cannot be written.
void write_field(const std::filesystem::path& file, const Body& body, const Overlay* overlay,
                 std::span<const double> u, std::span<const double> force);

}  // namespace palpate
