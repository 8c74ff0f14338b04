// palpate-runtime view: a recording in the viewer.
#pragma once

#include <filesystem>
#include <vector>

#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Serves a recording, or two side by side, until SIGINT or SIGTERM. Returns the exit code; throws Error.
int view(const std::vector<std::filesystem::path>& recordings, ViewerOptions options);

}  // namespace palpate
