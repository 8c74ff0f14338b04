// Recorded sessions: every tick of a run, and the surface at display rate. docs/recording-format.md documents
// the layout.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "formats/recorded.h"

namespace palpate {

/// Writer of a session to an MCAP file that only grows: data written by `checkpoint` survive any end of the
/// program. `finish` adds the index. Not for the tick: a recorder thread calls it.
class RecordingWriter {
 public:
  /// Replaces an earlier recording at PATH. Throws Error if PATH cannot be created, or is being recorded to.
  RecordingWriter(const std::filesystem::path& path, const SessionInfo& info,
                  const RecordedSurface& surface = {});
  ~RecordingWriter();  ///< without `finish`, data up to the last `checkpoint` remain
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  // These append in memory until the next `checkpoint` or until a chunk is full, and then throw as
  // `checkpoint` does.
  void append(const TickRecord& tick);
  void append(const ContactLoads& loads);
  /// The frame has as many nodes as the surface. Empty stress or pressure is written as NaN or as none.
  void append(const SurfaceFrame& frame);
  void append(const RecordedEvent& event);

  /// Writes all appended data to the file. Throws Error if that fails (a full disk), with the file as it was
  /// after the last successful call; nothing may be appended then.
  void checkpoint();

  [[nodiscard]] std::int64_t ticks() const;     ///< in the file
  [[nodiscard]] std::int64_t pictures() const;  ///< in the file

  /// Writes the rest and the index. The file's bytes depend only on the appended data and on when
  /// `checkpoint` was called. Throws Error as `checkpoint` does.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// An open recording. Ticks and pictures are read on demand, so that a recording of hours takes little
/// memory. Shows the file as it was when opened, even while it is still being recorded. For one thread at a
/// time.
class RecordingFile {
 public:
  /// Indexes the recording and checks all but stored pictures: checksums, sizes, ascending times, counts and
  /// valid numbers. Throws Error (the field is named) if it is no recording or is damaged.
  explicit RecordingFile(const std::filesystem::path& path);
  ~RecordingFile();
  RecordingFile(RecordingFile&&) noexcept;
  RecordingFile& operator=(RecordingFile&&) noexcept;

  [[nodiscard]] const std::filesystem::path& path() const noexcept;
  [[nodiscard]] const SessionInfo& info() const noexcept;
  [[nodiscard]] const std::string& generator() const noexcept;  ///< program and version
  [[nodiscard]] const RecordedSurface& surface() const noexcept;
  /// False if the program was killed or is still recording: the index is missing (`finish_recording`).
  [[nodiscard]] bool finished() const noexcept;

  [[nodiscard]] std::int64_t ticks() const noexcept;  ///< number of ticks
  /// Row 0 .. ticks() - 1 of the ticks. Fast for consecutive rows, since a chunk is kept in memory. Throws
  /// Error if it can no longer be read.
  [[nodiscard]] TickRecord tick(std::int64_t row) const;

  [[nodiscard]] const std::vector<PictureTime>& pictures() const noexcept;
  /// True if pictures are stored; if not, `loads` returns the data they follow from.
  [[nodiscard]] bool stores_pictures() const noexcept;
  /// Stored picture 0 .. pictures().size() - 1. Throws Error if it is damaged.
  [[nodiscard]] SurfaceFrame frame(std::int64_t number) const;
  /// Contact loads of picture 0 .. pictures().size() - 1, if pictures are not stored. Throws Error.
  [[nodiscard]] ContactLoads loads(std::int64_t number) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// True if a program records to it now.
bool is_being_recorded(const std::filesystem::path& path);

/// Adds the index to a recording whose program was killed; does nothing if it has one. Returns false, without
/// effect, while it is being recorded. Throws Error.
bool finish_recording(const std::filesystem::path& path);

}  // namespace palpate
