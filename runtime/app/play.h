// palpate-runtime play: the loop, its recording and its report.
#pragma once

#include "runtime/app/play_options.h"

namespace palpate {

/// Runs to the end or to SIGINT, SIGTERM or SIGHUP; recording, report and table of contacts are then
/// complete, and the device has no force. With a viewer but without a duration it runs until a signal.
/// Returns the exit code; throws Error.
int play(PlayOptions options);

}  // namespace palpate
