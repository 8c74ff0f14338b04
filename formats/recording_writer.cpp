#include <iterator>
#include <string>

#include "base/error.h"
#include "formats/recording_parts.h"

namespace palpate {
namespace {

/// Parts of one level that are merged into one of the next. A reader opens all parts that there are, and the
/// system lets it open a thousand files: of a part each half second that is enough for years.
constexpr std::size_t fan = 16;

}  // namespace

struct RecordingWriter::Impl {
  struct Level {
    RecordingPart part;
    int level = 0;
  };

  Impl(std::filesystem::path to, const SessionInfo& info, const RecordedSurface& surface)
      : path(std::move(to)), head{.info = info, .generator = "palpate " PALPATE_VERSION, .surface = surface} {
    shown.surface = surface;
    std::optional<FileDescriptor> locked = lock_parts(path);
    if (!locked)
      throw Error("is being recorded by another program", path.string(), "Wait for it, or record elsewhere");
    lock = std::move(*locked);
    try {
      write_master(path, head, {});
    } catch (...) {
      leave_folder_if_empty();
      throw;
    }
    clear_parts(path);  // of an earlier recording, which nothing names any more
  }

  /// Removes a folder of parts that holds nothing but the lock.
  void leave_folder_if_empty() const {
    std::error_code ignored;
    const std::filesystem::directory_iterator all(parts_folder(path), ignored);
    if (std::distance(begin(all), end(all)) <= 1) remove_parts(path);
  }

  std::filesystem::path next_file() { return parts_folder(path) / (std::to_string(files++) + ".h5"); }

  [[nodiscard]] std::vector<RecordingPart> parts() const {
    std::vector<RecordingPart> all;
    for (const Level& level : levels) all.push_back(level.part);
    return all;
  }

  /// The last parts into one, as long as there are enough of one level.
  void merge_levels() {
    while (levels.size() >= fan && levels[levels.size() - fan].level == levels.back().level) {
      std::vector<RecordingPart> parts;
      for (auto it = levels.end() - fan; it != levels.end(); ++it) parts.push_back(it->part);
      const int level = levels.back().level + 1;
      const RecordingPart merged = merge_parts(next_file(), parts, head);
      levels.resize(levels.size() - fan);
      levels.push_back({merged, level});
      for (const RecordingPart& part : parts) replaced.push_back(part.file);
    }
  }

  std::filesystem::path path;
  RecordingHead head;
  RecordedFrames shown;  // surface and times of all frames
  FileDescriptor lock;
  std::vector<TickRecord> ticks;  // since the last checkpoint
  std::vector<SurfaceFrame> frames;
  std::vector<Level> levels;
  std::vector<std::filesystem::path> replaced;  // by merging, and no longer named by the master
  bool is_behind = false;                       // the master shows fewer parts than there are
  std::int64_t files = 0;
};

RecordingWriter::RecordingWriter(std::filesystem::path path, const SessionInfo& info,
                                 const RecordedSurface& surface) {
  const hdf5::Quiet quiet;
  impl_ = std::make_unique<Impl>(std::move(path), info, surface);
}

RecordingWriter::~RecordingWriter() = default;

void RecordingWriter::append(std::span<const TickRecord> ticks) {
  impl_->ticks.insert(impl_->ticks.end(), ticks.begin(), ticks.end());
}

void RecordingWriter::append(SurfaceFrame frame) {
  impl_->shown.tick.push_back(frame.tick);
  impl_->shown.time.push_back(frame.time);
  impl_->frames.push_back(std::move(frame));
}

void RecordingWriter::checkpoint() {
  const hdf5::Quiet quiet;
  Impl& self = *impl_;
  if (!self.ticks.empty() || !self.frames.empty()) {
    self.levels.push_back({write_part(self.next_file(), self.ticks, self.frames, self.head)});
    self.is_behind = true;
    self.ticks.clear();
    self.frames.clear();
  }
  if (!self.is_behind) return;
  // Whoever has opened the master before the last one has had the time since then to open their parts.
  std::vector<std::filesystem::path> to_remove;
  to_remove.swap(self.replaced);
  self.merge_levels();
  write_master(self.path, self.head, self.parts());
  self.is_behind = false;
  std::error_code ignored;
  for (const std::filesystem::path& file : to_remove) std::filesystem::remove(file, ignored);
}

void RecordingWriter::finish() {
  const hdf5::Quiet quiet;
  checkpoint();
  merge_recording(impl_->path, impl_->parts(), impl_->head);
}

const RecordedFrames& RecordingWriter::frames() const noexcept {
  return impl_->shown;
}

}  // namespace palpate
