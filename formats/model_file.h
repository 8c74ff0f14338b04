// NAME.palpate.hdf: its reader, which proves all that it says. The layout is documented in
// docs/file-format.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "formats/contents.h"
#include "formats/model.h"

namespace palpate {

inline constexpr int format_major = 4;  ///< another major version is refused: "precompute it again"
inline constexpr int format_minor = 0;  ///< newer minor versions are read, what they add is ignored

/// How a model is loaded.
struct LoadOptions {
  /// Bytes of a packed matrix that are at most read into memory; -1: half of what is available. A larger one
  /// is mapped: the file must stay as it is for as long as the model lives, as a mapped file that is cut off
  /// ends the program (SIGBUS).
  std::int64_t most_in_memory = -1;
};

/// Loads a file and proves every size, range, index, finite value and checksum once. Throws Error naming the
/// field that is wrong.
Model load_model(const std::filesystem::path& path, const LoadOptions& options = {});

/// What a file says of its body alone: mesh, surface, materials, supports, loads and description. Takes
/// milliseconds, as neither Green's functions nor dynamics and overlays are read. Throws Error as
/// `load_model`.
Model load_outline(const std::filesystem::path& path);

/// The format version, major and minor, of a model that this program reads. Throws Error of any other file.
std::vector<std::int64_t> format_version(const Contents& file);

/// The content hash that a file has in it, without a look at the rest; empty where it is no model.
std::string stored_content_hash(const std::filesystem::path& path);

/// The sources of a loaded model that are no longer what they were: a sentence for each ("model.toml changed
/// since …", "… is gone"). `model_path` is the baked file; empty when nothing is stale.
std::vector<std::string> stale_sources(const Model& model, const std::filesystem::path& model_path);

/// Where a source of the model at `model_path` is.
std::filesystem::path source_path(const SourceFile& source, const std::filesystem::path& model_path);

/// A SourceFile entry for `file`, its path relative to the folder of `model_path`.
SourceFile describe_source(const std::string& role, const std::filesystem::path& file,
                           const std::filesystem::path& model_path);

}  // namespace palpate
