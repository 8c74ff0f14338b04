// The small picture of a file, as its page draws it.
#pragma once

#include <filesystem>
#include <string>

namespace palpate {

/// The message `scene` (web/PROTOCOL.md) of the surface of a body at rest, in the plane of its elements, or
/// of a recording's in the picture in which its tick felt most. Throws Error where the file is neither, or
/// damaged.
[[nodiscard]] std::string gallery_scene(const std::filesystem::path& file);

}  // namespace palpate
