// palpate-runtime export: a recording for people and programs without Palpate.
#pragma once

#include <filesystem>
#include <optional>

namespace palpate {

/// What of a recording is written, and where; files that are not asked for are empty.
struct ExportOptions {
  std::filesystem::path recording;
  std::filesystem::path html{};   ///< one page with the recording in it, which asks no network and no runtime
  std::filesystem::path gltf{};   ///< the surface and the tool as an animation (glb_of)
  std::filesystem::path vtu{};    ///< a collection (.pvd) of .vtu files in a folder beside it
  std::filesystem::path csv{};    ///< the ticks (ticks_table)
  double fps = 30.0;              ///< pictures a second at most
  double from = 0.0;              ///< [s]
  std::optional<double> to = {};  ///< [s]; else to the end
  bool force = false;             ///< outputs may take the place of any file that is not read
};

/// Writes what is asked for. Returns the exit code; throws Error.
int export_session(const ExportOptions& options);

}  // namespace palpate
