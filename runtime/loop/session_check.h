// Checks of recordings, so that replay and viewer can trust them.
#pragma once

#include <filesystem>

#include "formats/recording.h"
#include "runtime/body/body.h"

namespace palpate {

/// Checks that the ticks of a recording hold only known phases, faults, events and status bits. Throws Error
/// that names the field.
void check_session(const RecordingFile& session);

/// Opens a recording and checks it. Throws Error.
RecordingFile open_session(const std::filesystem::path& path);

/// Checks that the body has the nodes around which the session had its overlays. Throws Error.
void check_overlays(const RecordingFile& session, const Body& body);

}  // namespace palpate
