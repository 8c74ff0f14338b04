// Thumbnail of a file, as its page draws it.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// Returns the message `scene` (web/PROTOCOL.md) of a body's surface at rest (in the plane: its elements) or
/// of a recording's surface in the picture with the largest force. Throws Error if the file is neither, or
/// damaged.
[[nodiscard]] std::string gallery_scene(const std::filesystem::path& file);

}  // namespace palpate
