#include "formats/recording.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/printable.h"
#include "base/write_file.h"
#include "formats/contents.h"
#include "formats/mcap/reader.h"
#include "formats/mcap/writer.h"
#include "formats/recording_messages.h"

namespace palpate {

/// Throws Error for an invalid number of a message.
class RecordingChecker {
 public:
  explicit RecordingChecker(std::string where) : where_(std::move(where)) {}

  template <class T>
  void expect(bool possible, const char* topic, std::size_t row, const char* name, T value,
              const char* needed) const {
    if (possible) return;
    throw Error(std::string(topic) + ", row " + std::to_string(row) + ": " + name + " is " +
                    std::to_string(value) + ", which is not " + needed,
                where_, again);
  }
  void expect_whole(bool whole, const char* topic, std::size_t row) const {
    if (!whole)
      throw Error(std::string(topic) + ", row " + std::to_string(row) + ": is no whole message", where_,
                  again);
  }

 private:
  static constexpr const char* again = "Copy the file again, or record the session again";
  std::string where_;
};

namespace {

constexpr const char* give_another = "Give a recording that palpate-runtime has written";
constexpr const char* record_again = "Record the session again";
constexpr double longest_time = 1e9;                                          // s
constexpr std::int64_t longest_ns = std::int64_t{1'000'000'000'000'000'000};  // ns
constexpr std::int64_t highest_rate = 1'000'000;                              // ticks per second
constexpr std::uint64_t no_chunk = ~std::uint64_t{0};

/// Throws Error saying what a file with an index is: a model, or an export of a recording.
[[noreturn]] void refuse_indexed(const std::filesystem::path& path) {
  const std::string format = Contents::read(path).text_attribute("/", "format").value_or("");
  if (format == "palpate") {
    throw Error(
        "is a model, not a recording", path.string(),
        "palpate-runtime play " + shell_word(path.string()) + " --view shows it and lets you push it");
  }
  if (format == "palpate-recording")
    throw Error("is HDF5, which palpate-runtime export --hdf5 makes of a recording", path.string(),
                "Give the recording that it was made of, SESSION.mcap");
  throw Error("is HDF5, and not a recording", path.string(), give_another);
}

mcap::Layout layout_of(const FileDescriptor& file) {
  std::string start(mcap::magic.size(), '\0');
  start.resize(read_some(file, std::as_writable_bytes(std::span(start)), 0));
  if (start == index_magic) refuse_indexed(file.path());
  if (start != mcap::magic) throw Error("is not a recording", file.path().string(), give_another);
  return mcap::read_layout(file);
}

/// Reads the description of the run. Throws Error unless it is a recording of this version.
SessionInfo info_of(const mcap::Layout& layout, const std::string& path, std::string& generator) {
  const auto said = std::ranges::find(layout.metadata, "palpate", &mcap::Metadata::name);
  const auto value = [&](const char* key) {
    const auto found = said->values.find(key);
    return found == said->values.end() ? std::string() : found->second;
  };
  if (said == layout.metadata.end() || value("format") != "palpate-recording")
    throw Error("is an MCAP file, but not a recording of Palpate's", path, give_another);
  const std::string version = value("version");
  if (version.substr(0, version.find('.')) != "7")
    throw Error("is a recording of another version", path, record_again);
  generator = value("generator");
  SessionInfo info{.model_path = value("model"),
                   .content_hash = value("content_hash"),
                   .device = value("device"),
                   .options = value("options")};
  const std::string rate = value("rate");
  const auto [end, failed] = std::from_chars(rate.data(), rate.data() + rate.size(), info.rate);
  if (failed != std::errc() || end != rate.data() + rate.size() || info.rate < 1 || info.rate > highest_rate)
    throw Error("does not say how many ticks a second has", path, record_again);
  return info;
}

constexpr const char* on_surface = "/surface";
constexpr const char* on_tick = "/tool/0/tick";

void check_surface(const RecordedSurface& surface, const RecordingChecker& check) {
  const auto nodes = std::ssize(surface.nodes);
  check.expect(surface.corners == 2 || surface.corners == 3, on_surface, 0, "corners", surface.corners,
               "2 or 3");
  check.expect(std::ssize(surface.simplices) % surface.corners == 0, on_surface, 0, "simplices",
               surface.simplices.size(), "a multiple of their corners");
  check.expect(std::ssize(surface.held) == nodes, on_surface, 0, "held", surface.held.size(),
               "as many as nodes");
  for (const auto* of : {&surface.nodes, &surface.finer}) {
    for (std::size_t i = 0; i < of->size(); ++i)
      for (const double x : (*of)[i])
        check.expect(std::isfinite(x), on_surface, i, "node", x, "a finite number");
  }
  for (std::size_t i = 0; i < surface.simplices.size(); ++i)
    check.expect(surface.simplices[i] >= 0 && surface.simplices[i] < nodes, on_surface, i, "simplices",
                 surface.simplices[i], "a node of the surface");
  for (std::size_t i = 0; i < surface.held.size(); ++i)
    check.expect(surface.held[i] < 8, on_surface, i, "held", int{surface.held[i]}, "a set of axes");
}

bool is_time(double time) {
  return time >= 0.0 && time <= longest_time;
}

bool is_moment(std::int64_t ns) {
  return ns >= -longest_ns && ns <= longest_ns;
}

bool is_error(float value) {
  return std::isfinite(value) && value >= 0.0F;
}

void check_tick(const TickRecord& tick, double before, std::size_t row, const RecordingChecker& check) {
  const auto expect = [&](bool possible, const char* name, auto value, const char* needed) {
    check.expect(possible, on_tick, row, name, value, needed);
  };
  expect(is_time(tick.time) && tick.time > before, "time", tick.time, "a time after the one before it");
  expect(tick.contacts >= 0, "contacts", tick.contacts, "a number of contacts");
  expect(is_error(tick.force_error), "force_error", tick.force_error, "the size of an error");
  expect(is_error(tick.greens_error), "greens_error", tick.greens_error, "the size of an error");
  expect(std::isfinite(tick.small_strain), "small_strain", tick.small_strain, "a number");
  expect(tick.left_out >= 0, "left_out", tick.left_out, "a number of contacts");
  expect(tick.patch >= -1, "patch", tick.patch, "a node, or -1 for none");
  expect(tick.grab <= 1, "grab", int{tick.grab}, "0 or 1");
  expect(is_moment(tick.arrived_ns), "arrived_ns", tick.arrived_ns, "a time of this session");
  expect(is_moment(tick.begun_ns), "begun_ns", tick.begun_ns, "a time of this session");
}

void check_loads(const ContactLoads& loads, std::size_t nodes, std::size_t row,
                 const RecordingChecker& check) {
  constexpr const char* topic = "/contacts";
  check.expect(loads.force.size() == 3 * loads.node.size(), topic, row, "force", loads.force.size(),
               "three for each node");
  check.expect(loads.press.size() == loads.node.size(), topic, row, "press", loads.press.size(),
               "one for each node");
  Index before = -1;
  for (const Index node : loads.node) {
    check.expect(node > before && node < static_cast<std::int64_t>(nodes), topic, row, "node", node,
                 "a node of the surface behind the one before it");
    before = node;
  }
  for (const float f : loads.force) check.expect(std::isfinite(f), topic, row, "force", f, "a finite number");
  for (const float f : loads.press) check.expect(std::isfinite(f), topic, row, "press", f, "a finite number");
  for (const float q : loads.field) check.expect(std::isfinite(q), topic, row, "field", q, "a finite number");
}

}  // namespace

struct RecordingFile::Impl {
  /// Place of a message that is read on demand.
  struct Place {
    std::uint64_t chunk;
    std::uint64_t offset;
  };
  struct TickChunk {
    std::uint64_t chunk;
    std::int64_t first;  // row
  };

  explicit Impl(const std::filesystem::path& path)
      : file(open_file(path, OpenMode::read)), layout(layout_of(file)), check(path.string()) {
    info = info_of(layout, path.string(), generator);
    for (const mcap::Channel& channel : layout.channels) {
      for (const ChannelKind& kind : channel_kinds()) {
        if (channel.topic == kind.topic && channel.encoding == "cdr")
          kinds.emplace_back(channel.id, kind.channel);
      }
    }
    for (std::uint64_t k = 0; k < layout.chunks.size(); ++k) read(k);
    if (!surface)
      throw Error("ends before its surface: it was killed as it began", path.string(), record_again);
    chunk_in_memory = no_chunk;
    records = {};
  }

  /// Kind of a channel; nullopt if it is not ours.
  [[nodiscard]] std::optional<RecordedChannel> kind_of(std::uint16_t channel) const {
    for (const auto& [id, kind] : kinds)
      if (id == channel) return kind;
    return std::nullopt;
  }

  void read(std::uint64_t chunk) {
    if (layout.chunks[chunk].size == 0) return;
    if (has_pictures(chunk)) return note_pictures(chunk);
    load(chunk);
    for (const mcap::Message& message : mcap::messages_of(file.path(), records)) take(message, chunk);
  }

  [[nodiscard]] bool has_pictures(std::uint64_t chunk) const {
    const auto first = mcap::message_starts(file, layout.chunks[chunk], 1);
    return kind_of(first.front().message.channel) == RecordedChannel::pictures;
  }

  void note_pictures(std::uint64_t chunk) {
    for (const mcap::MessageStart& start : mcap::message_starts(file, layout.chunks[chunk])) {
      const std::size_t row = pictures.size();
      PictureTime time;
      check.expect_whole(kind_of(start.message.channel) == RecordedChannel::pictures && surface &&
                             (stores_pictures || pictures.empty()) && from_start(start.first, time) &&
                             start.size == picture_bytes(),
                         "/pictures", row);
      note(time, {chunk, start.message.offset}, "/pictures");
      stores_pictures = true;
    }
  }

  /// Length of a message with a picture [byte].
  [[nodiscard]] std::uint64_t picture_bytes() const {
    const std::size_t numbers = surface->nodes.size();
    return to_message(SurfaceFrame{}).size() + 5 * sizeof(float) * numbers;
  }

  void note(const PictureTime& time, Place place, const char* topic) {
    const std::size_t row = pictures.size();
    const PictureTime before = row > 0 ? pictures.back() : PictureTime{};
    check.expect(time.tick >= before.tick, topic, row, "tick", time.tick,
                 "a tick after that of the picture before it");
    check.expect(is_time(time.time) && time.time >= before.time, topic, row, "time", time.time,
                 "a time after that of the picture before it");
    pictures.push_back(time);
    places.push_back(place);
  }

  void take(const mcap::Message& message, std::uint64_t chunk) {
    const std::optional<RecordedChannel> kind = kind_of(message.channel);
    if (kind == RecordedChannel::tick) return take_tick(message.data, chunk);
    if (kind == RecordedChannel::contacts) {
      ContactLoads loads;
      const std::size_t row = pictures.size();
      check.expect_whole(from_message(message.data, loads) && surface && !stores_pictures, "/contacts", row);
      check_loads(loads, surface->pressed_nodes(), row, check);
      note({loads.tick, loads.time}, {chunk, message.offset}, "/contacts");
    } else if (kind == RecordedChannel::surface) {
      check.expect_whole(!surface && from_message(message.data, surface.emplace()), on_surface, 0);
      check_surface(*surface, check);
    } else {
      check.expect_whole(kind != RecordedChannel::pictures, "/pictures", pictures.size());
    }
  }

  void take_tick(std::string_view message, std::uint64_t chunk) {
    TickRecord tick;
    check.expect_whole(from_message(message, tick), on_tick, static_cast<std::size_t>(ticks));
    check_tick(tick, last_time, static_cast<std::size_t>(ticks), check);
    last_time = tick.time;
    if (tick_chunks.empty() || tick_chunks.back().chunk != chunk) tick_chunks.push_back({chunk, ticks});
    ++ticks;
  }

  /// Reads a chunk into memory.
  void load(std::uint64_t chunk) {
    if (chunk_in_memory == chunk) return;
    chunk_in_memory = no_chunk;
    records = mcap::read_chunk(file, layout.chunks[chunk]);
    tick_messages.clear();
    for (const mcap::Message& message : mcap::messages_of(file.path(), records)) {
      if (kind_of(message.channel) == RecordedChannel::tick) tick_messages.push_back(message.data);
    }
    chunk_in_memory = chunk;
  }

  std::string_view message(std::int64_t picture) {
    if (picture < 0 || picture >= std::ssize(places)) {
      throw Error(
          "has " + std::to_string(places.size()) + " pictures, and no number " + std::to_string(picture),
          file.path().string(), "Ask for one that is there");
    }
    const Place& place = places[static_cast<std::size_t>(picture)];
    load(place.chunk);
    return mcap::message_at(file.path(), records, place.offset).data;
  }

  FileDescriptor file;
  mcap::Layout layout;
  RecordingChecker check;
  SessionInfo info;
  std::string generator;
  std::vector<std::pair<std::uint16_t, RecordedChannel>> kinds;
  std::optional<RecordedSurface> surface;
  std::vector<TickChunk> tick_chunks;
  std::int64_t ticks = 0;
  double last_time = -1.0;
  std::vector<PictureTime> pictures;
  std::vector<Place> places;
  bool stores_pictures = false;
  std::uint64_t chunk_in_memory = no_chunk;
  std::string records;
  std::vector<std::string_view> tick_messages;  // of these records
};

RecordingFile::RecordingFile(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}
RecordingFile::~RecordingFile() = default;
RecordingFile::RecordingFile(RecordingFile&&) noexcept = default;
RecordingFile& RecordingFile::operator=(RecordingFile&&) noexcept = default;

const std::filesystem::path& RecordingFile::path() const noexcept {
  return impl_->file.path();
}
const SessionInfo& RecordingFile::info() const noexcept {
  return impl_->info;
}
const std::string& RecordingFile::generator() const noexcept {
  return impl_->generator;
}
const RecordedSurface& RecordingFile::surface() const noexcept {
  return *impl_->surface;
}
bool RecordingFile::finished() const noexcept {
  return impl_->layout.finished;
}
std::int64_t RecordingFile::ticks() const noexcept {
  return impl_->ticks;
}
const std::vector<PictureTime>& RecordingFile::pictures() const noexcept {
  return impl_->pictures;
}
bool RecordingFile::stores_pictures() const noexcept {
  return impl_->stores_pictures;
}

TickRecord RecordingFile::tick(std::int64_t row) const {
  const auto& chunks = impl_->tick_chunks;
  const auto after = std::ranges::upper_bound(chunks, row, {}, &Impl::TickChunk::first);
  if (after == chunks.begin() || row >= impl_->ticks)
    throw Error("has " + std::to_string(impl_->ticks) + " ticks, and no row " + std::to_string(row),
                path().string(), "Ask for one that is there");
  const Impl::TickChunk& chunk = *std::prev(after);
  impl_->load(chunk.chunk);
  TickRecord tick;
  const auto place = static_cast<std::size_t>(row - chunk.first);
  impl_->check.expect_whole(
      place < impl_->tick_messages.size() && from_message(impl_->tick_messages[place], tick), on_tick,
      static_cast<std::size_t>(row));
  return tick;
}

SurfaceFrame RecordingFile::frame(std::int64_t number) const {
  SurfaceFrame frame;
  const std::size_t nodes = surface().nodes.size();
  impl_->check.expect_whole(from_message(impl_->message(number), frame) &&
                                frame.displacement.size() == 3 * nodes && frame.von_mises.size() == nodes &&
                                frame.pressure.size() == nodes,
                            "/pictures", static_cast<std::size_t>(number));
  return frame;
}

ContactLoads RecordingFile::loads(std::int64_t number) const {
  ContactLoads loads;
  const std::string_view message = impl_->message(number);
  impl_->check.expect_whole(from_message(message, loads), "/contacts", static_cast<std::size_t>(number));
  check_loads(loads, surface().pressed_nodes(), static_cast<std::size_t>(number), impl_->check);
  return loads;
}

bool is_being_recorded(const std::filesystem::path& path) {
  return is_locked(open_file(path, OpenMode::read));
}

bool finish_recording(const std::filesystem::path& path) {
  FileDescriptor file = open_file(link_target(path), OpenMode::write);
  if (!lock_file(file)) return false;
  mcap::Layout layout = layout_of(file);
  if (!layout.finished) mcap::Writer(std::move(file), std::move(layout)).finish();
  return true;
}

}  // namespace palpate
