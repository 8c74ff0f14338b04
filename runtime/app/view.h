// palpate-runtime view and export: a recording in the viewer, and as a page of its own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "runtime/viewer/viewer_port.h"

namespace palpate {

/// Serves a recording, or two side by side, until SIGINT or SIGTERM. Returns the exit code; throws Error.
int view(const std::vector<std::filesystem::path>& recordings, const ViewerOptions& options);

/// What of a recording goes into a page.
struct ExportOptions {
  std::filesystem::path recording;
  std::filesystem::path html;
  double fps = 30.0;              ///< pictures a second at most
  double from = 0.0;              ///< [s]
  std::optional<double> to = {};  ///< [s]; else to the end
  bool force = false;             ///< `html` may take the place of any file that is not read
};

/// Writes one page with the recording in it, which asks no network and no runtime. Returns the exit code;
/// throws Error.
int export_html(const ExportOptions& options);

}  // namespace palpate
