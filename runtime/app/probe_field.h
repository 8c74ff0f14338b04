// The displacement that a probe finds, as a file.
#pragma once

#include <filesystem>
#include <span>

#include "runtime/body/body.h"
#include "runtime/body/overlay.h"

namespace palpate {

/// Writes u [n], the displacement of all stored nodes from rest [m], beside u0, that at rest: a table where
/// `file` ends in .csv, else a grid for ParaView (.vtu). With it the stress by u0 + u at nodes of the surface
/// that feel `force` [n] [N]; not a number inside, where the surface is held, and with an overlay, which may
/// be null and adds its fine mesh. Throws Error when the file cannot be written.
void write_field(const std::filesystem::path& file, const Body& body, const Overlay* overlay,
                 std::span<const double> u, std::span<const double> force);

}  // namespace palpate
