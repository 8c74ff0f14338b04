// Recorded sessions: every tick of a run, and what shows the surface at display rate. The layout is
// documented in docs/recording-format.md.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "formats/recorded.h"

namespace palpate {

/// Writes a session to an MCAP file that only grows: what `checkpoint` put there is whole however the program
/// ends. `finish` adds the index. Not for the tick: a recorder thread calls it.
class RecordingWriter {
 public:
  /// Takes the place of what was recorded to PATH before. Throws Error when PATH cannot be made, or is being
  /// recorded to.
  RecordingWriter(const std::filesystem::path& path, const SessionInfo& info,
                  const RecordedSurface& surface = {});
  ~RecordingWriter();  ///< without `finish`, what the last `checkpoint` kept is there
  RecordingWriter(const RecordingWriter&) = delete;
  RecordingWriter& operator=(const RecordingWriter&) = delete;

  // Only into memory, until the next `checkpoint`, or until there is enough for a chunk: then they throw what
  // `checkpoint` throws.
  void append(const TickRecord& tick);
  void append(const ContactLoads& loads);
  /// The frame has as many nodes as the surface. Without stress or pressure (empty): not a number, and none.
  void append(const SurfaceFrame& frame);
  void append(const RecordedEvent& event);

  /// Puts all that was appended into the file. Throws Error when that fails (a full disk), with the file as
  /// it was after the last one that did not; nothing may be appended then.
  void checkpoint();

  [[nodiscard]] std::int64_t ticks() const;     ///< in the file
  [[nodiscard]] std::int64_t pictures() const;  ///< in the file

  /// The rest and the index. The bytes of the file depend on what was appended and on when `checkpoint` was
  /// called only. Throws Error as `checkpoint` does.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A recording that is open. Ticks and pictures are read as they are asked for, so that a recording of hours
/// takes no memory to speak of. It stays as it was when it was opened, also while it is still being recorded.
/// One thread uses it at a time.
class RecordingFile {
 public:
  /// Finds all that is in it and proves all but stored pictures: checksums, sizes, ascending times, counts
  /// and numbers that can be. Throws Error (the field is named) when it is no recording or is damaged.
  explicit RecordingFile(const std::filesystem::path& path);
  ~RecordingFile();
  RecordingFile(RecordingFile&&) noexcept;
  RecordingFile& operator=(RecordingFile&&) noexcept;

  [[nodiscard]] const std::filesystem::path& path() const noexcept;
  [[nodiscard]] const SessionInfo& info() const noexcept;
  [[nodiscard]] const std::string& generator() const noexcept;  ///< program and version
  [[nodiscard]] const RecordedSurface& surface() const noexcept;
  /// False where it was killed, or is being recorded: its index is missing (`finish_recording`).
  [[nodiscard]] bool finished() const noexcept;

  [[nodiscard]] std::int64_t ticks() const noexcept;  ///< how many
  /// A row of the ticks, 0 .. ticks() - 1. Quick one after the other, as a chunk of them is kept. Throws
  /// Error when it cannot be read any more.
  [[nodiscard]] TickRecord tick(std::int64_t row) const;

  [[nodiscard]] const std::vector<PictureTime>& pictures() const noexcept;
  /// Whether pictures are stored; else `loads` has what they follow from.
  [[nodiscard]] bool stores_pictures() const noexcept;
  /// Picture 0 .. pictures().size() - 1 as it is stored. Throws Error when it is damaged.
  [[nodiscard]] SurfaceFrame frame(std::int64_t number) const;
  /// What picture 0 .. pictures().size() - 1 follows from, where they are not stored. Throws Error.
  [[nodiscard]] ContactLoads loads(std::int64_t number) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether a program records to it now.
bool is_being_recorded(const std::filesystem::path& path);

/// Adds the index to a recording that was killed; nothing where it is there. False, and nothing happens,
/// while it is being recorded. Throws Error.
bool finish_recording(const std::filesystem::path& path);

}  // namespace palpate
