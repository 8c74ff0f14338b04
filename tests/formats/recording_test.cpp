#include "formats/recording.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <random>

#include "base/error.h"
#include "formats/mcap/reader.h"
#include "formats/mcap/writer.h"
#include "formats/recording_messages.h"
#include "formats/writer/hdf5_file.h"
#include "tests/support/files/formats_sample.h"

namespace palpate::test::recording_test {
namespace {

constexpr std::size_t surface_nodes = 4;

/// Numbers that tell ticks and fields apart.
TickRecord some_tick(std::size_t i) {
  const auto x = static_cast<double>(i);
  const auto n = static_cast<std::int64_t>(i);
  return {.time = 1e-3 * x,
          .device_position = {x + 1, x + 2, x + 3},
          .device_orientation = {0.5, -0.5, 0.5 * x, 1},
          .tool_position = {x, 2 * x, 3 * x},
          .tool_orientation = {1, 0, -x, 0.25},
          .force = {-x, 0.5 * x, 1},
          .torque = {1e-3 * x, 0, -1e-3 * x},
          .contacts = static_cast<std::int32_t>(i % 5),
          .stiffness = {x, 2 * x, 3 * x, -4 * x, 5 * x, 6 * x},
          .status = static_cast<std::uint32_t>(i % 3),
          .compute_ns = static_cast<std::uint32_t>(4'000'000'000U - i),
          .grab = static_cast<std::uint8_t>(i % 2),
          .patch = static_cast<std::int32_t>(i % 7) - 1,
          .handle_position = {x - 1, x - 2, x - 3},
          .handle_orientation = {0, x, 0.125, -1},
          .handle_velocity = {7 * x, -8 * x, 9},
          .buttons = static_cast<std::uint32_t>(0x80000000U + i),
          .sequence = static_cast<std::uint32_t>(0xffffffffU - i),
          .arrived_ns = -5'000'000'000 + n,
          .begun_ns = 5'000'000'000 + n,
          .shown_force = {11 * x, 12, -13 * x},
          .shown_torque = {14, -15 * x, 16 * x},
          .share = 1 / (1 + x),
          .phase = static_cast<std::uint8_t>(i % 4),
          .fault = static_cast<std::uint8_t>(i % 9),
          .event = static_cast<std::uint8_t>(i % 16),
          .motion_step = n / 3,
          .force_error = static_cast<float>(0.125 * x),
          .left_out = static_cast<std::int32_t>(i % 11),
          .greens_error = static_cast<float>(0.0625 * x),
          .small_strain = static_cast<float>(-0.03125 * x)};
}

SurfaceFrame some_frame(std::size_t k) {
  SurfaceFrame frame = {.tick = static_cast<std::int64_t>(17 * k), .time = 0.017 * static_cast<double>(k)};
  for (std::size_t i = 0; i < 3 * surface_nodes; ++i)
    frame.displacement.push_back(static_cast<float>(100 * k + i));
  for (std::size_t i = 0; i < surface_nodes; ++i) {
    frame.von_mises.push_back(static_cast<float>(3 * k + i));
    frame.pressure.push_back(-static_cast<float>(7 * k + i));
  }
  frame.von_mises[k % surface_nodes] = std::numeric_limits<float>::quiet_NaN();  // not known
  return frame;
}

bool same(const TickRecord& a, const TickRecord& b) {
  using std::ranges::equal;
  return a.time == b.time && equal(a.device_position, b.device_position) &&
         equal(a.device_orientation, b.device_orientation) && equal(a.tool_position, b.tool_position) &&
         equal(a.tool_orientation, b.tool_orientation) && equal(a.force, b.force) &&
         equal(a.torque, b.torque) && a.contacts == b.contacts && equal(a.stiffness, b.stiffness) &&
         a.status == b.status && a.compute_ns == b.compute_ns && a.grab == b.grab && a.patch == b.patch &&
         equal(a.handle_position, b.handle_position) && equal(a.handle_orientation, b.handle_orientation) &&
         equal(a.handle_velocity, b.handle_velocity) && a.buttons == b.buttons && a.sequence == b.sequence &&
         a.arrived_ns == b.arrived_ns && a.begun_ns == b.begun_ns && equal(a.shown_force, b.shown_force) &&
         equal(a.shown_torque, b.shown_torque) && a.share == b.share && a.phase == b.phase &&
         a.fault == b.fault && a.event == b.event && a.motion_step == b.motion_step &&
         a.force_error == b.force_error && a.left_out == b.left_out && a.greens_error == b.greens_error &&
         a.small_strain == b.small_strain;
}

ContactLoads some_loads(std::size_t k) {
  const auto x = static_cast<float>(k);
  ContactLoads loads = {.tick = static_cast<std::int64_t>(17 * k), .time = 0.017 * static_cast<double>(k)};
  for (std::size_t i = k % 2; i < surface_nodes; i += 1 + k % 3) {
    loads.node.push_back(static_cast<Index>(i));
    for (const float f : {x, -2 * x, 0.5F}) loads.force.push_back(f + static_cast<float>(i));
    loads.press.push_back(3 * x + 1);
  }
  return loads;
}

const SessionInfo info = {.model_path = "liver.palpate.hdf",
                          .content_hash = "00ff",
                          .device = "script:touch.csv",
                          .rate = 2000,
                          .options = "overlay=r=3,rings=2\ncontact=dynamic\n"};
const RecordedSurface surface = {
    {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}}, 3, {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}, {7, 0, 4, 0}};

enum class Shown { loads, frames };

/// Bit by bit, as not a number differs from itself.
template <class T>
void expect_bits(const std::vector<T>& a, const std::vector<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_TRUE(a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

void expect_picture(const RecordingFile& file, std::size_t k) {
  const auto number = static_cast<std::int64_t>(k);
  const SurfaceFrame frame = some_frame(k);
  ASSERT_EQ(file.pictures()[k].tick, frame.tick);
  ASSERT_EQ(file.pictures()[k].time, frame.time);
  if (file.stores_pictures()) {
    const SurfaceFrame read = file.frame(number);
    ASSERT_EQ(read.tick, frame.tick);
    ASSERT_EQ(read.time, frame.time);
    expect_bits(read.displacement, frame.displacement);
    expect_bits(read.von_mises, frame.von_mises);
    expect_bits(read.pressure, frame.pressure);
  } else {
    const ContactLoads read = file.loads(number), loads = some_loads(k);
    ASSERT_EQ(read.tick, loads.tick);
    ASSERT_EQ(read.time, loads.time);
    expect_bits(read.node, loads.node);
    expect_bits(read.force, loads.force);
    expect_bits(read.press, loads.press);
  }
}

/// That these are all that is in it.
void expect_contents(const RecordingFile& file, std::size_t ticks, std::size_t pictures) {
  ASSERT_EQ(file.ticks(), static_cast<std::int64_t>(ticks));
  for (std::size_t i = 0; i < ticks; ++i)
    ASSERT_TRUE(same(file.tick(static_cast<std::int64_t>(i)), some_tick(i))) << i;
  ASSERT_EQ(file.pictures().size(), pictures);
  for (std::size_t k = 0; k < pictures; ++k) expect_picture(file, k);
}

void append_picture(RecordingWriter& writer, std::size_t k, Shown shown) {
  if (shown == Shown::loads) {
    writer.append(some_loads(k));
  } else {
    writer.append(some_frame(k));
  }
}

/// A picture before each `at_once` ticks, and a checkpoint after them.
void append(RecordingWriter& writer, std::size_t ticks, std::size_t at_once, Shown shown = Shown::loads) {
  for (std::size_t i = 0; i < ticks; ++i) {
    if (i % at_once == 0) append_picture(writer, i / at_once, shown);
    writer.append(some_tick(i));
    if (i % at_once == at_once - 1 || i + 1 == ticks) writer.checkpoint();
  }
}

void record(const std::filesystem::path& path, std::size_t ticks, std::size_t at_once,
            Shown shown = Shown::loads) {
  RecordingWriter writer(path, info, surface);
  append(writer, ticks, at_once, shown);
  writer.append(RecordedEvent{.time = 0.5, .text = "the device is lost"});
  writer.finish();
}

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

std::string refusal_of(const std::filesystem::path& path) {
  return refusal([&] { RecordingFile file(path); });
}

class Lengths : public testing::TestWithParam<std::size_t> {};

TEST_P(Lengths, AreReadBack) {
  for (const Shown shown : {Shown::loads, Shown::frames}) {
    const Folder folder;
    record(folder / "a.mcap", GetParam(), 1000, shown);
    const RecordingFile read(folder / "a.mcap");
    EXPECT_EQ(read.info().model_path, info.model_path);
    EXPECT_EQ(read.info().content_hash, info.content_hash);
    EXPECT_EQ(read.info().device, info.device);
    EXPECT_EQ(read.info().rate, info.rate);
    EXPECT_EQ(read.info().options, info.options);
    EXPECT_EQ(read.generator(), "palpate " PALPATE_VERSION);
    EXPECT_TRUE(read.finished());
    EXPECT_EQ(read.stores_pictures(), shown == Shown::frames && GetParam() > 0);
    EXPECT_EQ(read.surface().nodes, surface.nodes);
    EXPECT_EQ(read.surface().corners, surface.corners);
    EXPECT_EQ(read.surface().simplices, surface.simplices);
    EXPECT_EQ(read.surface().held, surface.held);
    expect_contents(read, GetParam(), (GetParam() + 999) / 1000);
    EXPECT_EQ(files_in(folder.path()), 1U);
  }
}
INSTANTIATE_TEST_SUITE_P(Recording, Lengths, testing::Values(0, 1, 999, 1000, 1001, 30000));

TEST(Recording, IsReadInAnyOrder) {
  const Folder folder;
  record(folder / "a.mcap", 2000, 7);
  const RecordingFile file(folder / "a.mcap");
  std::mt19937 random(7);  // NOLINT(cert-msc51-cpp)
  for (int k = 0; k < 500; ++k) {
    const std::size_t row = random() % 2000;
    ASSERT_TRUE(same(file.tick(static_cast<std::int64_t>(row)), some_tick(row))) << row;
    expect_picture(file, random() % 286);
  }
  for (const std::int64_t row : {-1, 2000}) EXPECT_NE(refusal([&] { (void)file.tick(row); }), "");
  for (const std::int64_t k : {-1, 286}) EXPECT_NE(refusal([&] { (void)file.loads(k); }), "");
}

// By size alone: no checkpoint but the last one.
TEST(Recording, OfManyMegabytesHasChunksOfAFew) {
  const Folder folder;
  RecordingWriter writer(folder / "a.mcap", info, surface);
  for (std::size_t i = 0; i < 40000; ++i) writer.append(some_tick(i));
  EXPECT_GT(std::filesystem::file_size(folder / "a.mcap"), 12'000'000U) << "what is enough is written";
  writer.finish();
  expect_contents(RecordingFile(folder / "a.mcap"), 40000, 0);
  for (const mcap::ChunkPlace& chunk : mcap::read_layout(open_file(folder / "a.mcap", OpenMode::read)).chunks)
    EXPECT_LT(chunk.size, 5'000'000U);
}

TEST(Recording, OfALineSurfaceOrNoneIsReadBack) {
  const Folder folder;
  RecordingWriter(folder / "line.mcap", info, {{{0, 0, 0}, {1, 0, 0}}, 2, {0, 1, 1, 0}}).finish();
  const RecordingFile line(folder / "line.mcap");
  EXPECT_EQ(line.surface().corners, 2);
  EXPECT_EQ(line.surface().held, std::vector<std::uint8_t>(2));
  RecordingWriter none(folder / "none.mcap", info);
  for (std::size_t i = 0; i < 7; ++i) none.append(some_tick(i));
  none.append(SurfaceFrame{.tick = 3, .time = 0.5});
  none.finish();
  const RecordingFile read(folder / "none.mcap");
  EXPECT_EQ(read.ticks(), 7);
  EXPECT_TRUE(read.surface().nodes.empty());
  ASSERT_EQ(read.pictures().size(), 1U);
  EXPECT_EQ(read.frame(0).time, 0.5);
}

TEST(Recording, OfFramesWithoutStressSaysThatItIsNotKnown) {
  const Folder folder;
  RecordingWriter writer(folder / "a.mcap", info, surface);
  SurfaceFrame frame = some_frame(1);
  frame.von_mises.clear();
  frame.pressure.clear();
  writer.append(frame);
  writer.finish();
  const SurfaceFrame read = RecordingFile(folder / "a.mcap").frame(0);
  EXPECT_EQ(read.displacement, frame.displacement);
  EXPECT_EQ(read.pressure, std::vector<float>(surface_nodes, 0.0F));
  ASSERT_EQ(read.von_mises.size(), surface_nodes);
  for (const float stress : read.von_mises) EXPECT_TRUE(std::isnan(stress));
}

TEST(Recording, EqualCallsMakeEqualFiles) {
  const Folder folder;
  record(folder / "a.mcap", 100, 10);
  record(folder / "b.mcap", 100, 10);
  EXPECT_EQ(read_bytes(folder / "a.mcap"), read_bytes(folder / "b.mcap"));
}

TEST(Recording, ThatIsNotFinishedHoldsEachCheckpoint) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  RecordingWriter writer(path, info, surface);
  expect_contents(RecordingFile(path), 0, 0);
  EXPECT_TRUE(is_being_recorded(path));
  EXPECT_FALSE(finish_recording(path)) << "while it is recorded";
  for (std::size_t k = 0; k < 20; ++k) {
    for (std::size_t i = 10 * k; i < 10 * (k + 1); ++i) writer.append(some_tick(i));
    append_picture(writer, k, Shown::loads);
    writer.checkpoint();
    const RecordingFile read(path);
    EXPECT_FALSE(read.finished());
    expect_contents(read, 10 * (k + 1), k + 1);
  }
  writer.finish();
  EXPECT_TRUE(RecordingFile(path).finished());
}

TEST(Recording, IsWhatItWasForWhoHasOpenedIt) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  auto writer = std::make_unique<RecordingWriter>(path, info, surface);
  append(*writer, 100, 10);
  const RecordingFile read(path);
  for (std::size_t i = 100; i < 200; ++i) writer->append(some_tick(i));
  writer->finish();
  writer.reset();
  expect_contents(read, 100, 10);
  const RecordingFile whole(path);
  record(path, 3, 3);  // in its place
  expect_contents(whole, 200, 10);
  expect_contents(RecordingFile(path), 3, 1);
}

TEST(Recording, TakesThePlaceOfOneThatWasKilled) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  {
    RecordingWriter killed(path, info, surface);
    append(killed, 100, 10);
  }
  EXPECT_FALSE(is_being_recorded(path));
  write_bytes(path.string() + ".partial", "of one that was killed as it began");
  record(path, 50, 10);
  expect_contents(RecordingFile(path), 50, 5);
  EXPECT_EQ(files_in(folder.path()), 1U);
}

TEST(Recording, IsMadeByOneProgramAtATime) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  RecordingWriter writer(path, info, surface);
  append(writer, 30, 10);
  EXPECT_NE(refusal([&] {
              RecordingWriter second(path, info, surface);
            }).find("is being recorded by another program"),
            std::string::npos);
  EXPECT_EQ(files_in(folder.path()), 1U);
  writer.append(some_tick(30));
  writer.finish();
  expect_contents(RecordingFile(path), 31, 3);
}

TEST(Recording, ThatWasKilledIsFinishedOnce) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap", whole = folder / "b.mcap";
  for (const Shown shown : {Shown::loads, Shown::frames}) {
    {
      RecordingWriter killed(path, info, surface);
      append(killed, 95, 10, shown);
    }
    {
      RecordingWriter writer(whole, info, surface);
      append(writer, 95, 10, shown);
      writer.finish();
    }
    ASSERT_TRUE(finish_recording(path));
    EXPECT_EQ(read_bytes(path), read_bytes(whole)) << "as if it had not been killed";
    ASSERT_TRUE(finish_recording(path));
    EXPECT_EQ(read_bytes(path), read_bytes(whole));
  }
}

/// Files of at most so many bytes, as on a disk that is full.
class FileLimit {
 public:
  explicit FileLimit(rlim_t bytes) : action_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit = {bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, action_);
  }
  FileLimit(const FileLimit&) = delete;
  FileLimit& operator=(const FileLimit&) = delete;

 private:
  rlimit before_ = {};
  void (*action_)(int);
};

TEST(Recording, KeepsWhatThereIsWhenTheDiskIsFull) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  {
    RecordingWriter writer(path, info, surface);
    append(writer, 30, 10);
    const auto before = std::filesystem::file_size(path);
    const FileLimit limit(before + 10'000);
    for (std::size_t i = 30; i < 100; ++i) writer.append(some_tick(i));
    EXPECT_NE(refusal([&] { writer.checkpoint(); }), "");
    EXPECT_EQ(std::filesystem::file_size(path), before);
    expect_contents(RecordingFile(path), 30, 3);
  }
  ASSERT_TRUE(finish_recording(path));
  expect_contents(RecordingFile(path), 30, 3);
}

TEST(Recording, ThatCannotBeFinishedStaysAsItWas) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  RecordingWriter writer(path, info, surface);
  append(writer, 30, 10);
  const auto before = std::filesystem::file_size(path);
  {
    const FileLimit limit(before + 100);
    EXPECT_NE(refusal([&] { writer.finish(); }), "");
  }
  EXPECT_EQ(std::filesystem::file_size(path), before);
  EXPECT_FALSE(RecordingFile(path).finished());
}

TEST(Recording, ThatCannotBeStartedLeavesWhatWasThere) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  record(path, 10, 10);
  const std::string before = read_bytes(path);
  {
    const FileLimit limit(100);
    EXPECT_NE(refusal([&] { RecordingWriter(path, info, surface); }), "");
  }
  EXPECT_EQ(read_bytes(path), before);
  EXPECT_EQ(files_in(folder.path()), 1U);
  EXPECT_NE(refusal([&] { RecordingWriter(folder / "none" / "a.mcap", info); }).find("No such file"),
            std::string::npos);
}

// ---- damage ----

/// The offsets and lengths of the records of a file, by the specification and not by the code under test.
struct Place {
  std::size_t offset;
  unsigned char opcode;
  std::uint64_t length;  // of the content
};

std::vector<Place> places_in(const std::string& bytes) {
  std::vector<Place> places;
  for (std::size_t at = 8; at + 9 <= bytes.size();) {
    std::uint64_t length = 0;
    std::memcpy(&length, bytes.data() + at + 1, sizeof length);
    if (length > bytes.size() - at - 9) break;
    places.push_back({at, static_cast<unsigned char>(bytes[at]), length});
    at += 9 + length;
  }
  return places;
}

constexpr unsigned char chunk_code = 6, index_code = 7, data_end_code = 15, footer_code = 2;

/// Makes the CRC of each chunk right again.
void reseal(std::string& bytes) {
  for (const Place& place : places_in(bytes)) {
    if (place.opcode != chunk_code || place.length < 40) continue;
    const std::size_t records = place.offset + 9 + 40;
    const auto crc = static_cast<std::uint32_t>(crc32(
        0, reinterpret_cast<const Bytef*>(bytes.data()) + records, static_cast<uInt>(place.length - 40)));
    std::memcpy(bytes.data() + place.offset + 9 + 24, &crc, sizeof crc);
  }
}

// A file is cut off where it was killed, or copied in part: chunks that are whole are all there.
TEST(Recording, CutOffAnywhereHasItsWholeChunks) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap", cut = folder / "cut.mcap";
  record(path, 6, 2);
  const std::string bytes = read_bytes(path);
  std::vector<std::size_t> chunk_ends;
  std::size_t data_end = 0;
  for (const Place& place : places_in(bytes)) {
    if (place.opcode == chunk_code) chunk_ends.push_back(place.offset + 9 + place.length);
    if (place.opcode == data_end_code) data_end = place.offset;
  }
  ASSERT_EQ(chunk_ends.size(), 5U) << "surface, three times two ticks, an event";
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    write_bytes(cut, bytes.substr(0, size));
    const auto whole = static_cast<std::size_t>(
        std::count_if(chunk_ends.begin(), chunk_ends.end(), [&](std::size_t end) { return end <= size; }));
    if (whole == 0) {
      ASSERT_NE(refusal_of(cut), "") << size;
      continue;
    }
    const std::size_t pairs = std::min<std::size_t>(whole - 1, 3);
    {
      const RecordingFile read(cut);
      ASSERT_FALSE(read.finished()) << size;
      expect_contents(read, 2 * pairs, pairs);
    }
    if (size % 97 != 0 && size != data_end) continue;  // it waits for the disk each time
    ASSERT_TRUE(finish_recording(cut));
    const RecordingFile read(cut);
    ASSERT_TRUE(read.finished()) << size;
    expect_contents(read, 2 * pairs, pairs);
    if (whole == chunk_ends.size()) {
      ASSERT_EQ(read_bytes(cut), bytes) << size;
    }
  }
}

TEST(Recording, IsRefusedWhereABitOfAChunkIsFlipped) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  for (const Shown shown : {Shown::loads, Shown::frames}) {
    record(path, 6, 2, shown);
    const std::string bytes = read_bytes(path);
    for (const Place& place : places_in(bytes)) {
      if (place.opcode != chunk_code) continue;
      for (std::size_t at = place.offset + 9 + 40; at < place.offset + 9 + place.length; at += 13) {
        std::string flipped = bytes;
        flipped[at] = static_cast<char>(flipped[at] ^ (1 << at % 8));
        write_bytes(path, flipped);
        const std::string text = refusal([&] {
          const RecordingFile file(path);
          for (std::int64_t k = 0; k < std::ssize(file.pictures()); ++k) {
            if (shown == Shown::frames) (void)file.frame(k);
          }
        });
        ASSERT_NE(text, "") << at;
      }
    }
  }
}

TEST(Recording, IsRefusedWhereItsIndexIsAltered) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  record(path, 30, 10);
  const std::string bytes = read_bytes(path);
  const std::vector<Place> places = places_in(bytes);
  const auto end = std::ranges::find(places, data_end_code, &Place::opcode);
  for (auto place = end + 1; place != places.end(); ++place) {
    std::string altered = bytes;
    altered[place->offset + 9 + place->length / 2] ^= 1;
    write_bytes(path, altered);
    EXPECT_NE(refusal_of(path), "") << static_cast<int>(place->opcode);
  }
  write_bytes(path, bytes + "more");
  EXPECT_NE(refusal_of(path), "");
}

/// What a recording's checks refuse although its checksums are right.
struct Impossible {
  const char* name;
  std::function<void(RecordingWriter&)> write;
  const char* says;
};

std::function<void(RecordingWriter&)> tick_with(void (*change)(TickRecord&)) {
  return [change](RecordingWriter& writer) {
    writer.append(some_tick(0));
    writer.append(some_tick(1));
    TickRecord tick = some_tick(2);
    change(tick);
    writer.append(tick);
  };
}

std::function<void(RecordingWriter&)> loads_with(void (*change)(ContactLoads&)) {
  return [change](RecordingWriter& writer) {
    writer.append(some_loads(1));
    ContactLoads loads = some_loads(2);
    change(loads);
    writer.append(loads);
  };
}

const Impossible impossible[] = {
    {"Patch", tick_with([](TickRecord& t) { t.patch = -2; }), "/tool/0/tick, row 2: patch is -2"},
    {"Contacts", tick_with([](TickRecord& t) { t.contacts = -1; }), "row 2: contacts is -1"},
    {"ForceError", tick_with([](TickRecord& t) { t.force_error = -1.0F; }), "row 2: force_error is -1"},
    {"SmallStrain", tick_with([](TickRecord& t) { t.small_strain = NAN; }), "row 2: small_strain is nan"},
    {"GreensError", tick_with([](TickRecord& t) { t.greens_error = NAN; }), "row 2: greens_error is nan"},
    {"LeftOut", tick_with([](TickRecord& t) { t.left_out = -7; }), "row 2: left_out is -7"},
    {"Grab", tick_with([](TickRecord& t) { t.grab = 2; }), "row 2: grab is 2"},
    {"TimeBackwards", tick_with([](TickRecord& t) { t.time = 1e-3; }), "row 2: time is 0.001"},
    {"TimeNotFinite", tick_with([](TickRecord& t) { t.time = HUGE_VAL; }), "row 2: time is inf"},
    {"Arrived", tick_with([](TickRecord& t) { t.arrived_ns = std::numeric_limits<std::int64_t>::min(); }),
     "row 2: arrived_ns"},
    {"Begun", tick_with([](TickRecord& t) { t.begun_ns = std::numeric_limits<std::int64_t>::max(); }),
     "row 2: begun_ns"},
    {"PictureTick", loads_with([](ContactLoads& l) { l.tick = 3; }), "/contacts, row 1: tick is 3"},
    {"PictureTime", loads_with([](ContactLoads& l) { l.time = NAN; }), "/contacts, row 1: time"},
    {"Node", loads_with([](ContactLoads& l) { l.node.back() = surface_nodes; }),
     "/contacts, row 1: node is 4"},
    {"NodeTwice", loads_with([](ContactLoads& l) { l.node.back() = l.node.front(); }),
     "/contacts, row 1: node"},
    {"Force", loads_with([](ContactLoads& l) { l.force[1] = HUGE_VALF; }), "/contacts, row 1: force is inf"},
    {"Forces", loads_with([](ContactLoads& l) { l.force.pop_back(); }), "/contacts, row 1: force"},
    {"Press", loads_with([](ContactLoads& l) { l.press.push_back(1.0F); }), "/contacts, row 1: press"},
    {"FrameTick",
     [](RecordingWriter& w) {
       w.append(some_frame(1));
       w.append(some_frame(0));
     },
     "/pictures, row 1: tick is 0"},
    {"FrameSize",
     [](RecordingWriter& w) {
       SurfaceFrame frame = some_frame(0);
       frame.displacement.push_back(1.0F);
       w.append(frame);
     },
     "/pictures, row 0: is no whole message"},
    {"FramesAndLoads",
     [](RecordingWriter& w) {
       w.append(some_frame(0));
       w.checkpoint();
       w.append(some_loads(1));
     },
     "/contacts, row 1: is no whole message"},
    {"LoadsAndFrames",
     [](RecordingWriter& w) {
       w.append(some_loads(0));
       w.checkpoint();
       w.append(some_frame(1));
     },
     "/pictures, row 1: is no whole message"},
};

void PrintTo(const Impossible& edit, std::ostream* out) {
  *out << edit.name;
}

class RecordingHostile : public testing::TestWithParam<Impossible> {};
TEST_P(RecordingHostile, IsRefusedByName) {
  const Folder folder;
  RecordingWriter writer(folder / "a.mcap", info, surface);
  GetParam().write(writer);
  writer.finish();
  const std::string text = refusal_of(folder / "a.mcap");
  EXPECT_NE(text.find(GetParam().says), std::string::npos) << text;
}
INSTANTIATE_TEST_SUITE_P(Recording, RecordingHostile, testing::ValuesIn(impossible),
                         [](const auto& edit) { return std::string(edit.param.name); });

TEST(Recording, OfASurfaceThatCannotBeIsRefused) {
  const Folder folder;
  const std::pair<const char*, RecordedSurface> surfaces[] = {
      {"simplices is 4", {surface.nodes, 3, {0, 1, 4}}},
      {"simplices is -1", {surface.nodes, 3, {0, 1, -1}}},
      {"a multiple", {surface.nodes, 3, {0, 1}}},
      {"corners is 4", {surface.nodes, 4, {0, 1, 2, 3}}},
      {"node is nan", {{{0, 0, 0}, {NAN, 0, 0}}, 3, {}}},
      {"held is 8", {surface.nodes, 3, {}, {0, 8, 0, 0}}}};
  for (const auto& [says, wrong] : surfaces) {
    RecordingWriter(folder / "a.mcap", info, wrong).finish();
    const std::string text = refusal_of(folder / "a.mcap");
    EXPECT_NE(text.find(says), std::string::npos) << text;
  }
}

/// Changes a record that was found by its opcode, and what then is said; the chunks' checksums are made
/// right.
struct Lie {
  const char* name;
  unsigned char opcode;
  std::size_t at;  // in the content
  std::uint64_t value;
  std::size_t bytes;
  const char* says;
};

constexpr std::uint64_t far_away = std::uint64_t{1} << 62;
constexpr std::size_t length_field = ~std::size_t{0};  // of the record, before the content

const Lie lies[] = {
    {"ChunkOfNoEnd", chunk_code, length_field, ~std::uint64_t{0}, 8, "is cut off"},
    {"ChunkFarTooLong", chunk_code, length_field, far_away, 8, "is cut off"},
    {"RecordsBeyondTheChunk", chunk_code, 32, far_away, 8, "is no chunk"},
    {"ExpandsToMore", chunk_code, 16, far_away, 8, "is no chunk"},
    {"Compressed", chunk_code, 28, 4, 4, "is compressed"},
    {"MessageBeyondTheChunk", chunk_code, 40 + 1, far_away, 8, "begins no message"},
    {"MessageOfNothing", chunk_code, 40 + 1, 3, 8, "begins no message"},
    {"NoMessage", chunk_code, 40, 3, 1, "begins no message"},
    {"IndexOfMore", index_code, 2, 0xfffffff0U, 4, "is no index of messages"},
    {"IndexOfHalf", index_code, 2, 8, 4, "is no index of messages"},
    {"SchemaOfMore", 3, 2, 0xffffffffU, 4, "is no schema"},
    {"SchemaOfNoNumber", 3, 0, 0, 2, "is no schema"},
    {"TwoOfANumber", 3, 0, 2, 2, "has the number of another one"},
    {"ChannelOfMore", 4, 4, 0xffffffffU, 4, "is no channel"},
    {"MetadataOfMore", 12, 0, 0xffffffffU, 4, "is no metadata"},
    {"MapOfMore", 12, 4 + 7, 0xffffffffU, 4, "is no metadata"},
    {"NoHeader", 1, length_field - 8, 3, 1, "is no header"},
    {"OfNoKind", index_code, length_field - 8, 0, 1, "is of no kind"},
    {"MessageBesideChunks", index_code, length_field - 8, 5, 1, "beside all chunks"},
    {"IndexBeforeTheEnd", index_code, length_field - 8, 8, 1, "does not belong before the end"},
    {"FooterElsewhere", footer_code, 0, 1, 8, "begins elsewhere"},
    {"FooterTooLong", 8, length_field - 8, 2, 1, "is no footer"},
};

void PrintTo(const Lie& lie, std::ostream* out) {
  *out << lie.name;
}

class RecordingLies : public testing::TestWithParam<Lie> {};
TEST_P(RecordingLies, AreRefused) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  record(path, 30, 10);
  std::string bytes = read_bytes(path);
  const std::vector<Place> places = places_in(bytes);
  const auto place = std::ranges::find(places, GetParam().opcode, &Place::opcode);
  ASSERT_NE(place, places.end());
  // Its opcode is eight bytes before its length ends.
  const std::size_t at = GetParam().at > length_field - 9
                             ? place->offset + (GetParam().at == length_field ? 1 : 0)
                             : place->offset + 9 + GetParam().at;
  std::memcpy(bytes.data() + at, &GetParam().value, GetParam().bytes);
  if (GetParam().opcode == chunk_code && GetParam().at >= 40 && GetParam().at != length_field) reseal(bytes);
  write_bytes(path, bytes);
  const std::string text = refusal_of(path);
  EXPECT_NE(text.find(GetParam().says), std::string::npos) << text;
}
INSTANTIATE_TEST_SUITE_P(Recording, RecordingLies, testing::ValuesIn(lies),
                         [](const auto& lie) { return std::string(lie.param.name); });

/// Reads all that a file has.
void read_all_of(const std::filesystem::path& path) {
  const RecordingFile file(path);
  for (std::int64_t row = 0; row < file.ticks(); ++row) (void)file.tick(row);
  for (std::int64_t k = 0; k < std::ssize(file.pictures()); ++k) {
    if (file.stores_pictures()) {
      (void)file.frame(k);
    } else {
      (void)file.loads(k);
    }
  }
}

/// One of the numbers that programs stumble over, in one of the usual sizes, somewhere in `bytes`.
void put_number(std::string& bytes, std::mt19937& random) {
  constexpr std::uint64_t numbers[] = {0,          1,          2,           8,
                                       0x7f,       0xff,       0xffff,      0x7fffffff,
                                       0xfffffff0, 0xffffffff, far_away,    ~std::uint64_t{0},
                                       1U << 20,   1U << 30,   0x100000000, ~std::uint64_t{7}};
  const std::size_t size = std::size_t{1} << random() % 4;
  const std::uint64_t number = numbers[random() % std::size(numbers)];
  if (bytes.size() >= size) std::memcpy(bytes.data() + random() % (bytes.size() - size + 1), &number, size);
}

/// Some damage: bits, numbers, pieces that are gone, doubled or moved.
std::string damaged(std::string bytes, std::mt19937& random) {
  for (std::size_t k = 1 + random() % 4; k > 0 && !bytes.empty(); --k) {
    const std::size_t at = random() % bytes.size(),
                      count = std::min<std::size_t>(random() % 64, bytes.size() - at);
    switch (random() % 6) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
        break;
      case 1:
      case 2:
        put_number(bytes, random);
        break;
      case 3:
        bytes.erase(at, count);
        break;
      case 4:
        bytes.insert(random() % bytes.size(), bytes.substr(at, count));
        break;
      default:
        if (random() % 8 == 0) bytes.resize(at);
    }
  }
  return bytes;
}

// It is read to its end, or refused by an Error: anything else ends this test.
TEST(Recording, ThousandsOfDamagedFilesDoNoHarm) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  std::mt19937 random(20261128);  // NOLINT(cert-msc51-cpp): the same files in each run
  std::size_t whole = 0, refused = 0, finished = 0;
  for (const Shown shown : {Shown::loads, Shown::frames}) {
    record(path, 12, 4, shown);
    const std::string good = read_bytes(path);
    for (int k = 0; k < 2000; ++k) {
      std::string bytes = damaged(good, random);
      if (k % 2 == 0) reseal(bytes);
      write_bytes(path, bytes);
      if (refusal([&] { read_all_of(path); }).empty()) {
        ++whole;
      } else {
        ++refused;
      }
      if (k % 100 == 0 && refusal([&] { (void)finish_recording(path); }).empty()) ++finished;
    }
  }
  EXPECT_GT(whole, 100U) << "damage that leaves a prefix, or where nobody looks";
  EXPECT_GT(refused, 1000U);
  EXPECT_GT(finished, 5U);
}

// ---- other files ----

void change_metadata(const std::filesystem::path& path, const std::string& from, const std::string& to) {
  std::string bytes = read_bytes(path);
  ASSERT_EQ(from.size(), to.size());
  bytes.replace(bytes.find(from), from.size(), to);
  write_bytes(path, bytes);
}

TEST(Recording, AnotherMajorVersionIsRefusedAndANewerMinorIsRead) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.mcap";
  record(path, 3, 3);
  change_metadata(path, "7.0", "7.7");
  EXPECT_EQ(RecordingFile(path).ticks(), 3);
  change_metadata(path, "7.7", "6.0");
  EXPECT_NE(refusal_of(path).find("another version | Record the session again"), std::string::npos);
  record(path, 3, 3);
  for (const char* rate : {"0000", "-200", "20x0"}) {
    record(path, 3, 3);
    change_metadata(path, "2000", rate);
    EXPECT_NE(refusal_of(path).find("does not say how many ticks a second has"), std::string::npos) << rate;
  }
}

TEST(Recording, OtherFilesAreRefused) {
  const Folder folder;
  write_sample(folder / "a.palpate.hdf");
  EXPECT_NE(refusal_of(folder / "a.palpate.hdf").find("is a model, not a recording"), std::string::npos);
  write_bytes(folder / "text", "text");
  EXPECT_NE(refusal_of(folder / "text").find("is not a recording"), std::string::npos);
  write_bytes(folder / "empty", "");
  EXPECT_NE(refusal_of(folder / "empty").find("is not a recording"), std::string::npos);
  EXPECT_NE(refusal_of(folder / "none"), "");
  EXPECT_NE(refusal_of(folder.path()), "");
  {
    hdf5::File exported = hdf5::File::create(folder / "touch.h5");
    exported.write_attribute("/", "format", "palpate-recording");
    exported.close();
    hdf5::File::create(folder / "any.h5").close();
  }
  const std::string text = refusal_of(folder / "touch.h5");
  EXPECT_NE(text.find("is HDF5, which palpate-runtime export --hdf5 makes of a recording"), std::string::npos)
      << text;
  EXPECT_NE(text.find("Give the recording that it was made of"), std::string::npos) << text;
  EXPECT_NE(refusal_of(folder / "any.h5").find("is HDF5, and not a recording"), std::string::npos);
  write_bytes(folder / "foreign.mcap", "");
  mcap::Writer foreign(open_file(folder / "foreign.mcap", OpenMode::write), "another program");
  foreign.add(mcap::Metadata{.name = "camera", .values = {{"lens", "35 mm"}}});
  foreign.finish();
  EXPECT_NE(refusal_of(folder / "foreign.mcap").find("not a recording of Palpate's"), std::string::npos);
}

// ---- kills ----

/// Records as fast as it goes, and says after each checkpoint how many ticks there are.
[[noreturn]] void record_until_killed(const std::filesystem::path& path, int say) {
  RecordingWriter writer(path, info, surface);
  for (std::size_t k = 0;; ++k) {
    append_picture(writer, k, Shown::loads);
    for (std::size_t i = 10 * k; i < 10 * (k + 1); ++i) writer.append(some_tick(i));
    writer.checkpoint();
    const std::size_t ticks = 10 * (k + 1);
    if (write(say, &ticks, sizeof ticks) != sizeof ticks) _exit(1);
  }
}

/// The last number that was said, of the next `at_most` ones.
std::size_t last_said(int hear, std::size_t at_most) {
  std::size_t last = 0;
  for (std::size_t k = 0, ticks = 0; k < at_most && read(hear, &ticks, sizeof ticks) == sizeof ticks; ++k)
    last = ticks;
  return last;
}

// It is killed while it goes on after some checkpoint: within a write, or between two.
TEST(Recording, SurvivesBeingKilledAtAnyMoment) {
  std::mt19937 random(20240229);  // NOLINT(cert-msc51-cpp): the same checkpoints in each run
  for (std::size_t run = 0; run < 40; ++run) {
    const Folder folder;
    const std::filesystem::path path = folder / "a.mcap";
    int ends[2] = {};
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) record_until_killed(path, ends[1]);
    close(ends[1]);
    const std::size_t checkpoints = random() % 300;
    const std::size_t heard = last_said(ends[0], checkpoints);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    ASSERT_EQ(heard, 10 * checkpoints);
    const std::size_t said = std::max(heard, last_said(ends[0], std::numeric_limits<std::size_t>::max()));
    close(ends[0]);
    if (!std::filesystem::exists(path)) {
      ASSERT_EQ(said, 0U);
      continue;
    }
    const std::int64_t ticks = RecordingFile(path).ticks();
    ASSERT_GE(ticks, static_cast<std::int64_t>(said));
    ASSERT_LE(ticks, static_cast<std::int64_t>(said) + 10);
    const auto n = static_cast<std::size_t>(ticks);
    expect_contents(RecordingFile(path), n, n / 10);
    EXPECT_FALSE(RecordingFile(path).finished());
    ASSERT_TRUE(finish_recording(path));
    EXPECT_TRUE(RecordingFile(path).finished());
    expect_contents(RecordingFile(path), n, n / 10);
    ASSERT_EQ(files_in(folder.path()), 1U);
  }
}

}  // namespace
}  // namespace palpate::test::recording_test
