#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <map>
#include <string>

#include "base/error.h"
#include "base/write_file.h"
#include "formats/mcap/writer.h"
#include "formats/recording.h"
#include "formats/recording_messages.h"

namespace palpate {
namespace {

constexpr std::size_t enough = std::size_t{4} << 20;  // bytes of messages that make a chunk
constexpr std::size_t most_steps = 100;               // of others that come first

bool is_same_file(const FileDescriptor& file, const std::filesystem::path& path) {
  struct stat open {
  }, named{};
  return ::fstat(file.get(), &open) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

[[noreturn]] void refuse_second(const std::filesystem::path& path) {
  throw Error("is being recorded by another program", path.string(), "Wait for it, or record elsewhere");
}

/// Creates PATH.partial, or takes over one from a killed program, and locks it: of several programs that
/// begin to record to PATH at once, one gets it.
FileDescriptor make_locked(const std::filesystem::path& path, const std::filesystem::path& partial) {
  for (std::size_t step = 0; step < most_steps; ++step) {
    open_file(partial, OpenMode::read_append).close();
    FileDescriptor file = open_file(partial, OpenMode::write);
    if (!lock_file(file)) break;
    if (!is_same_file(file, partial)) continue;  // it was renamed to a recording meanwhile
    if (::ftruncate(file.get(), 0) == 0) return file;
  }
  refuse_second(path);
}

std::uint64_t nanoseconds(double seconds) {
  return static_cast<std::uint64_t>(std::llround(1e9 * seconds));
}

}  // namespace

struct RecordingWriter::Impl {
  Impl(FileDescriptor file, const SessionInfo& info, const RecordedSurface& surface)
      : writer(std::move(file), "palpate " PALPATE_VERSION) {
    writer.add(mcap::Metadata{.name = "palpate",
                              .values = {{"format", "palpate-recording"},
                                         {"version", "7.0"},
                                         {"generator", "palpate " PALPATE_VERSION},
                                         {"model", info.model_path},
                                         {"content_hash", info.content_hash},
                                         {"device", info.device},
                                         {"rate", std::to_string(info.rate)},
                                         {"options", info.options},
                                         {"clock", "since the start of the run"},
                                         {"units", "s, m, m/s, N, N m, N/m, Pa; names with _ns in ns"}}});
    for (const ChannelKind& kind : channel_kinds()) {
      const auto id = static_cast<std::uint16_t>(kind.channel);
      writer.add(mcap::Schema{.id = id, .name = kind.schema, .encoding = "ros2msg", .data = kind.definition});
      writer.add(mcap::Channel{.id = id,
                               .schema = id,
                               .topic = kind.topic,
                               .encoding = "cdr",
                               .metadata = {{"offered_qos_profiles", ""}}});
    }
    append(RecordedChannel::settings, 0.0, settings_message(info.options));
    append(RecordedChannel::surface, 0.0, to_message(surface));
    checkpoint();
  }

  void append(RecordedChannel channel, double time, const std::string& message) {
    mcap::Chunk& chunk = channel == RecordedChannel::pictures ? pictures : others;
    chunk.append(static_cast<std::uint16_t>(channel), sequence[channel]++, nanoseconds(time), message);
    if (chunk.bytes() >= enough) write(chunk);
  }

  void write(mcap::Chunk& chunk) {
    writer.write(chunk);
    for (const auto& [channel, count] : sequence)
      if ((channel == RecordedChannel::pictures) == (&chunk == &pictures)) kept[channel] = count;
  }

  void checkpoint() {
    write(others);
    write(pictures);
  }

  mcap::Writer writer;
  mcap::Chunk others, pictures;
  std::map<RecordedChannel, std::uint32_t> sequence;  // of the next message
  std::map<RecordedChannel, std::uint32_t> kept;      // messages that are in the file
};

RecordingWriter::RecordingWriter(const std::filesystem::path& path, const SessionInfo& info,
                                 const RecordedSurface& surface) {
  const std::filesystem::path partial = with_suffix(path, ".partial");
  FileDescriptor file = make_locked(path, partial);
  try {
    if (std::filesystem::is_regular_file(path) && is_being_recorded(path)) refuse_second(path);
    impl_ = std::make_unique<Impl>(std::move(file), info, surface);
    rename_file(partial, path);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw;
  }
}

RecordingWriter::~RecordingWriter() = default;

void RecordingWriter::append(const TickRecord& tick) {
  impl_->append(RecordedChannel::tick, tick.time, to_message(tick));
}

void RecordingWriter::append(const ContactLoads& loads) {
  impl_->append(RecordedChannel::contacts, loads.time, to_message(loads));
}

void RecordingWriter::append(const SurfaceFrame& frame) {
  impl_->append(RecordedChannel::pictures, frame.time, to_message(frame));
}

void RecordingWriter::append(const RecordedEvent& event) {
  impl_->append(RecordedChannel::events, event.time, to_message(event));
}

void RecordingWriter::checkpoint() {
  impl_->checkpoint();
}

std::int64_t RecordingWriter::ticks() const {
  return impl_->kept[RecordedChannel::tick];
}

std::int64_t RecordingWriter::pictures() const {
  return std::int64_t{impl_->kept[RecordedChannel::pictures]} + impl_->kept[RecordedChannel::contacts];
}

void RecordingWriter::finish() {
  checkpoint();
  impl_->writer.finish();
}

}  // namespace palpate
