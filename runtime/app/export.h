// palpate-runtime export: converts a recording for people and programs without Palpate.
#pragma once

#include <filesystem>
#include <optional>

namespace palpate {

/// Outputs of an export; an empty path is not written.
struct ExportOptions {
  std::filesystem::path recording;
  std::filesystem::path html{};   ///< page that contains the recording and works without network and runtime
  std::filesystem::path gltf{};   ///< animation of surface and tool (glb_of)
  std::filesystem::path vtu{};    ///< a collection (.pvd) of .vtu files in a folder beside it
  std::filesystem::path csv{};    ///< ticks (ticks_line)
  std::filesystem::path hdf5{};   ///< ticks and pictures, with a description for ParaView beside it
  std::optional<double> fps{};    ///< most pictures per second; default 30, for HDF5 all
  double from = 0.0;              ///< [s]
  std::optional<double> to = {};  ///< [s]; default: the end
  bool force = false;             ///< outputs may replace any file that is not an input
};

/// Writes the requested files. Returns the exit code; throws Error.
int export_session(const ExportOptions& options);

}  // namespace palpate
