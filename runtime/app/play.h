// palpate-runtime play: the loop, its recording and its report.
#pragma once

#include "runtime/app/play_options.h"

namespace palpate {

/// Runs to the end or to SIGINT, SIGTERM or SIGHUP, which leave a complete recording, report and table of
/// contacts, and the device without force. With a viewer it goes on until then, unless there is a duration.
/// Returns the exit code; throws Error.
int play(PlayOptions options);

}  // namespace palpate
