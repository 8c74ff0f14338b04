// palpate-runtime view: recordings in a browser, or all that is in a folder.
#pragma once

#include <filesystem>
#include <vector>

#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Serves one recording or two, or the gallery of a folder, until SIGINT, SIGTERM or SIGHUP. Returns the exit
/// code; throws Error.
int view(const std::vector<std::filesystem::path>& files, ViewerOptions options);

}  // namespace palpate
