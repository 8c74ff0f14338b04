// What a recording is made of on disk: one plain HDF5 file, or until it is finished several, the parts, which
// a master file shows as one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "base/file_io.h"
#include "formats/hdf5_contents.h"
#include "formats/recording.h"

namespace palpate {

/// The number that a field of TickRecord is, or has several of.
template <class Member>
using Scalar = std::remove_all_extents_t<Member>;

/// What the file says beside its rows.
struct RecordingHead {
  bool has_stress = true;       ///< version 4.1 and later: stress and pressure, and where the surface is held
  bool has_checksums = true;    ///< version 4.2 and later
  bool has_force_error = true;  ///< version 4.3 and later, and how many contacts were left out
  bool has_compressed_frames = true;  ///< version 4.4 and later
  bool has_greens_error = true;       ///< version 4.4 and later
  SessionInfo info;
  std::string generator;
  RecordedSurface surface;
};

/// One dataset a field of TickRecord: path, number of components, member. As far as a recording
/// of the head's version has them.
template <class Visitor>
void for_each_tick_field(const RecordingHead& head, Visitor&& visit) {
  visit("/ticks/time", 1, &TickRecord::time);
  visit("/ticks/device_position", 3, &TickRecord::device_position);
  visit("/ticks/device_orientation", 4, &TickRecord::device_orientation);
  visit("/ticks/tool_position", 3, &TickRecord::tool_position);
  visit("/ticks/tool_orientation", 4, &TickRecord::tool_orientation);
  visit("/ticks/force", 3, &TickRecord::force);
  visit("/ticks/torque", 3, &TickRecord::torque);
  visit("/ticks/contacts", 1, &TickRecord::contacts);
  visit("/ticks/stiffness", 6, &TickRecord::stiffness);
  visit("/ticks/status", 1, &TickRecord::status);
  visit("/ticks/compute_ns", 1, &TickRecord::compute_ns);
  visit("/ticks/grab", 1, &TickRecord::grab);
  visit("/ticks/patch", 1, &TickRecord::patch);
  visit("/ticks/handle_position", 3, &TickRecord::handle_position);
  visit("/ticks/handle_orientation", 4, &TickRecord::handle_orientation);
  visit("/ticks/handle_velocity", 3, &TickRecord::handle_velocity);
  visit("/ticks/buttons", 1, &TickRecord::buttons);
  visit("/ticks/sequence", 1, &TickRecord::sequence);
  visit("/ticks/arrived_ns", 1, &TickRecord::arrived_ns);
  visit("/ticks/begun_ns", 1, &TickRecord::begun_ns);
  visit("/ticks/shown_force", 3, &TickRecord::shown_force);
  visit("/ticks/shown_torque", 3, &TickRecord::shown_torque);
  visit("/ticks/share", 1, &TickRecord::share);
  visit("/ticks/phase", 1, &TickRecord::phase);
  visit("/ticks/fault", 1, &TickRecord::fault);
  visit("/ticks/event", 1, &TickRecord::event);
  visit("/ticks/motion_step", 1, &TickRecord::motion_step);
  if (!head.has_force_error) return;
  visit("/ticks/force_error", 1, &TickRecord::force_error);
  visit("/ticks/left_out", 1, &TickRecord::left_out);
  if (!head.has_greens_error) return;
  visit("/ticks/greens_error", 1, &TickRecord::greens_error);
}

/// Where a plain file has the rows of a dataset.
struct StoredRows {
  std::int64_t offset = 0;                 ///< of the first byte
  std::int64_t bytes = 0;                  ///< of all rows as they are stored
  std::vector<std::int64_t> row_starts{};  ///< [rows + 1] in the file where they are compressed; else empty
  std::string checksum{};                  ///< of those bytes; empty where none is stored
};

/// A plain file with rows.
struct RecordingPart {
  std::filesystem::path file;
  std::int64_t ticks = 0;
  std::int64_t frames = 0;
  std::vector<StoredRows> fields{};  ///< of each dataset with rows, in the order of `row_fields`
};

/// A recording that is open: one plain file, or a master and its parts. All are open, as they may be merged
/// and removed while a recording that goes on is read.
struct RecordingFiles {
  RecordingHead head;
  std::vector<hdf5::Contents> files;     ///< that of the recording's name first
  std::vector<std::size_t> tick_files;   ///< those with ticks, in order
  std::vector<std::size_t> frame_files;  ///< those with frames
};

/// Reads what a recording says beside its rows, and opens its parts. Throws Error unless it is one of this
/// version, with all its parts.
RecordingFiles open_recording(hdf5::Contents recording);

/// Proves that all datasets have the shapes that belong together, and the bytes that were written (where
/// there are checksums). Throws Error naming file and dataset.
void check_rows(const RecordingFiles& recording);

/// PATH.parts, beside the file itself where PATH is a symbolic link.
std::filesystem::path parts_folder(const std::filesystem::path& recording);

/// Throws Error where PATH.parts is there and is not the folder of parts of a recording that was killed: a
/// link, or with files in it that no recording leaves.
void expect_own_parts(const std::filesystem::path& recording);

/// Makes the folder of parts and locks it for this program as long as the result lives; nothing where another
/// one has it. Throws Error when it cannot be made, or is another's.
std::optional<FileDescriptor> lock_parts(const std::filesystem::path& recording);

/// Removes the files of a recording in the folder of parts, but the lock.
void clear_parts(const std::filesystem::path& recording);

/// Removes the folder of parts with the files of a recording in it; what else is in it stays.
void remove_parts(const std::filesystem::path& recording);

/// Writes a part. Throws Error.
RecordingPart write_part(const std::filesystem::path& file, std::span<const TickRecord> ticks,
                         std::span<const SurfaceFrame> frames, const RecordingHead& head);

/// Writes a part with the rows of several. Throws Error.
RecordingPart merge_parts(const std::filesystem::path& file, std::span<const RecordingPart> parts,
                          const RecordingHead& head);

/// Puts a master in the place of a recording: it shows the rows of the parts as its own. Throws Error.
void write_master(const std::filesystem::path& recording, const RecordingHead& head,
                  std::span<const RecordingPart> parts);

/// Puts one plain file in the place of a recording and its parts. Throws Error with the recording as it was.
void merge_recording(const std::filesystem::path& recording, std::span<const RecordingPart> parts,
                     const RecordingHead& head);

/// The parts of an open recording, for `merge_recording`.
std::vector<RecordingPart> parts_of(const RecordingFiles& recording);

}  // namespace palpate
