// Recordings that a replay and a viewer can trust.
#pragma once

#include <filesystem>

#include "formats/recording.h"
#include "runtime/body/body.h"

namespace palpate {

/// Proves that the ticks of a recording hold only phases, faults, events and status bits that there are.
/// Throws Error (the field is named).
void check_session(const RecordingFile& session);

/// Opens a recording and checks it. Throws Error.
RecordingFile open_session(const std::filesystem::path& path);

/// Proves that a replay on this body finds the nodes round which the session had its overlays. Throws Error.
void check_overlays(const RecordingFile& session, const Body& body);

}  // namespace palpate
