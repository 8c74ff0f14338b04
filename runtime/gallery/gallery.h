// palpate-runtime view FOLDER: gallery of the files in a folder.
#pragma once

#include <filesystem>

#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Serves the gallery of a folder until SIGINT or SIGTERM. Returns the exit code; throws Error.
int show_gallery(const std::filesystem::path& folder, const ViewerOptions& options);

}  // namespace palpate
