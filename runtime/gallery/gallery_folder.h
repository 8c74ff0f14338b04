// Files of a folder that can be pushed, viewed or made into a body.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// Kind of a file, given by the ending of its name.
enum class GalleryKind : std::uint8_t {
  body,       ///< NAME.palpate.hdf
  recording,  ///< SESSION.mcap
  source,     ///< input of palpate-runtime push: a surface, a labelled image, a description
};

struct GalleryItem {
  std::string name;  ///< file name in the folder
  GalleryKind kind = GalleryKind::body;
  std::int64_t bytes = 0;
  double modified = 0.0;  ///< [s] since 1970
};

/// Returns the kind of a file of this name; empty for a hidden one, one with a folder, or another ending.
[[nodiscard]] std::optional<GalleryKind> gallery_kind(std::string_view name);

/// Lists bodies, then recordings, then sources for which there is no body of the same name, except pictures;
/// each sorted by name. Throws Error if the folder cannot be read.
[[nodiscard]] std::vector<GalleryItem> list_gallery(const std::filesystem::path& folder);

/// Returns the name of the body made from a source: NAME.palpate.hdf for NAME.stl and for NAME.model.toml,
/// whatever model name the description has.
[[nodiscard]] std::string baked_name(std::string_view source);

/// Returns a free name like `wanted` for a new file of the folder: `wanted` itself, or with a number before
/// its ending. No file there begins with its stem and a dot, so neither the file nor those derived from it
/// (NAME.model.toml, NAME.palpate.hdf, ...) collide with another one.
[[nodiscard]] std::string free_name(const std::filesystem::path& folder, const std::string& wanted);

}  // namespace palpate
