// Reader of NAME.palpate.hdf, which checks everything in the file. docs/file-format.md documents the layout.
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

/// Options for loading a model.
struct LoadOptions {
  /// Largest packed matrix that is read into memory [byte]; -1: half of the available memory. A larger one is
  /// mapped: the file must not change while the model lives, since truncating a mapped file ends the program
  /// (SIGBUS).
  std::int64_t most_in_memory = -1;
};

/// Loads a file and checks every size, range, index, finite value and checksum once. Throws Error naming the
/// faulty field.
Model load_model(const std::filesystem::path& path, const LoadOptions& options = {});

/// Loads only the body: mesh, surface, materials, supports, loads and description. Takes milliseconds, since
/// Green's functions, dynamics and overlays are not read. Throws Error as `load_model`.
Model load_outline(const std::filesystem::path& path);

/// Format version, major and minor, of a model that this program can read. Throws Error for any other file.
std::vector<std::int64_t> format_version(const Contents& file);

/// Content hash stored in a file, without reading the rest; empty if it is no model.
std::string stored_content_hash(const std::filesystem::path& path);

/// Sources of a loaded model that have changed: a sentence for each ("model.toml changed since …", "… is
/// gone"), none if nothing is stale. `model_path` is the baked file.
std::vector<std::string> stale_sources(const Model& model, const std::filesystem::path& model_path);

/// Path of a source of the model at `model_path`.
std::filesystem::path source_path(const SourceFile& source, const std::filesystem::path& model_path);

/// SourceFile entry for `file`, with its path relative to the folder of `model_path`.
SourceFile describe_source(const std::string& role, const std::filesystem::path& file,
                           const std::filesystem::path& model_path);

}  // namespace palpate
