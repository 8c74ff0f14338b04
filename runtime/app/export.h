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
  std::filesystem::path csv{};    ///< the ticks (ticks_line)
  std::filesystem::path hdf5{};   ///< ticks and pictures, with a description for ParaView beside it
  std::optional<double> fps{};    ///< pictures a second at most; else 30, and all into HDF5
  double from = 0.0;              ///< [s]
  std::optional<double> to = {};  ///< [s]; else to the end
  bool force = false;             ///< outputs may take the place of any file that is not read
};

/// Writes what is asked for. Returns the exit code; throws Error.
int export_session(const ExportOptions& options);

}  // namespace palpate
