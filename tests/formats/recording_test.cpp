#include "formats/recording.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <thread>

#include "formats/hdf5_contents.h"
#include "formats/recording_parts.h"
#include "tests/support/formats_sample.h"
#include "tests/support/formats_tamper.h"

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
          .greens_error = static_cast<float>(0.0625 * x)};
}

std::vector<TickRecord> some_ticks(std::size_t count, std::size_t first = 0) {
  std::vector<TickRecord> ticks;
  for (std::size_t i = first; i < first + count; ++i) ticks.push_back(some_tick(i));
  return ticks;
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
         a.force_error == b.force_error && a.left_out == b.left_out && a.greens_error == b.greens_error;
}

const SessionInfo info = {.model_path = "liver.palpate.hdf",
                          .content_hash = "00ff",
                          .device = "script:touch.csv",
                          .rate = 2000,
                          .options = "overlay=r=3,rings=2\ncontact=dynamic\n"};
const RecordedSurface surface = {
    {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}}, 3, {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}, {7, 0, 4, 0}};

void expect_ticks(const Recording& read, std::size_t count) {
  ASSERT_EQ(read.ticks.size(), count);
  for (std::size_t i = 0; i < count; ++i) ASSERT_TRUE(same(read.ticks[i], some_tick(i))) << i;
}

/// As those of a version before 4.3.
void expect_ticks_without_error(const Recording& read, std::size_t count) {
  ASSERT_EQ(read.ticks.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    TickRecord expected = some_tick(i);
    expected.force_error = 0.0F;
    expected.greens_error = 0.0F;
    expected.left_out = 0;
    ASSERT_TRUE(same(read.ticks[i], expected)) << i;
  }
}

/// Bit by bit, as not a number differs from itself.
void expect_floats(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  ASSERT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(float)), 0);
}

void expect_frame(const SurfaceFrame& read, const SurfaceFrame& expected) {
  ASSERT_EQ(read.tick, expected.tick);
  ASSERT_EQ(read.time, expected.time);
  expect_floats(read.displacement, expected.displacement);
  expect_floats(read.von_mises, expected.von_mises);
  expect_floats(read.pressure, expected.pressure);
}

void expect_frames(const std::filesystem::path& path, const Recording& read, std::size_t count) {
  ASSERT_EQ(read.frames.tick.size(), count);
  ASSERT_EQ(read.frames.time.size(), count);
  const RecordingFile file(path);
  const std::vector<float> u = file.displacement(0, static_cast<std::int64_t>(count));
  ASSERT_EQ(u.size(), 3 * surface_nodes * count);
  for (std::size_t k = 0; k < count; ++k) {
    const SurfaceFrame frame = some_frame(k);
    ASSERT_EQ(read.frames.tick[k], frame.tick);
    ASSERT_EQ(read.frames.time[k], frame.time);
    ASSERT_TRUE(std::equal(frame.displacement.begin(), frame.displacement.end(),
                           u.begin() + static_cast<std::ptrdiff_t>(3 * surface_nodes * k)))
        << k;
    if (k % 7 == 0 || k + 3 > count) expect_frame(file.frame(static_cast<std::int64_t>(k)), frame);
  }
}

/// One checkpoint after each `at_once` ticks, with a frame before each.
void append(RecordingWriter& writer, std::span<const TickRecord> ticks, std::size_t at_once) {
  for (std::size_t at = 0, frame = 0; at < ticks.size(); at += at_once, ++frame) {
    writer.append(some_frame(frame));
    writer.append(ticks.subspan(at, std::min(at_once, ticks.size() - at)));
    writer.checkpoint();
  }
}

void record(const std::filesystem::path& path, std::span<const TickRecord> ticks, std::size_t at_once) {
  RecordingWriter writer(path, info, surface);
  append(writer, ticks, at_once);
  writer.finish();
}

/// Flips one of a dataset's bits.
void flip_bit(const std::filesystem::path& path, const std::string& dataset, std::uint64_t number) {
  std::string bytes = read_bytes(path);
  const auto file = hdf5::File::open_to_change(path);
  const hdf5::Id opened(H5Dopen2(file.id(), dataset.c_str(), H5P_DEFAULT), H5Dclose);
  const std::uint64_t bit = number % (8 * H5Dget_storage_size(opened.get()));
  haddr_t first = H5Dget_offset(opened.get());
  if (first == HADDR_UNDEF) {  // compressed rows, one after another
    const hdf5::Id space(H5Dget_space(opened.get()), H5Sclose);
    H5Dget_chunk_info(opened.get(), space.get(), 0, nullptr, nullptr, &first, nullptr);
  }
  char& byte = bytes.at(first + bit / 8);
  byte = static_cast<char>(static_cast<unsigned char>(byte) ^ (1U << bit % 8));
  write_bytes(path, bytes);
}

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

class Lengths : public testing::TestWithParam<std::size_t> {};

TEST_P(Lengths, AreReadBack) {
  const Folder folder;
  const auto ticks = some_ticks(GetParam());
  record(folder / "a.h5", ticks, 1000);
  const Recording read = read_recording(folder / "a.h5");
  EXPECT_EQ(read.info.model_path, info.model_path);
  EXPECT_EQ(read.info.content_hash, info.content_hash);
  EXPECT_EQ(read.info.device, info.device);
  EXPECT_EQ(read.info.rate, info.rate);
  EXPECT_EQ(read.info.options, info.options);
  EXPECT_EQ(read.generator, "palpate " PALPATE_VERSION);
  EXPECT_TRUE(read.finished);
  EXPECT_EQ(read.frames.surface.nodes, surface.nodes);
  EXPECT_EQ(read.frames.surface.corners, surface.corners);
  EXPECT_EQ(read.frames.surface.simplices, surface.simplices);
  EXPECT_EQ(read.frames.surface.held, surface.held);
  expect_ticks(read, GetParam());
  expect_frames(folder / "a.h5", read, (GetParam() + 999) / 1000);
  EXPECT_EQ(files_in(folder.path()), 1U) << "parts are left";
}

INSTANTIATE_TEST_SUITE_P(Recording, Lengths, testing::Values(0, 1, 999, 1000, 1001, 30000));

TEST(Recording, OfALineSurfaceOrNoneIsReadBack) {
  const Folder folder;
  RecordingWriter(folder / "line.h5", info, {{{0, 0, 0}, {1, 0, 0}}, 2, {0, 1, 1, 0}}).finish();
  EXPECT_EQ(read_recording(folder / "line.h5").frames.surface.corners, 2);
  RecordingWriter none(folder / "none.h5", info);
  none.append(some_ticks(7));
  none.append(SurfaceFrame{.tick = 3, .time = 0.5, .displacement = {}});
  none.finish();
  const Recording read = read_recording(folder / "none.h5");
  expect_ticks(read, 7);
  EXPECT_TRUE(read.frames.surface.nodes.empty());
  EXPECT_EQ(read.frames.time, std::vector<double>{0.5});
}

TEST(Recording, OfFramesWithoutStressSaysThatItIsNotKnown) {
  const Folder folder;
  RecordingWriter writer(folder / "a.h5", info, {surface.nodes, 3, surface.simplices});
  SurfaceFrame frame = some_frame(1);
  frame.von_mises.clear();
  frame.pressure.clear();
  writer.append(frame);
  writer.finish();
  const SurfaceFrame read = RecordingFile(folder / "a.h5").frame(0);
  EXPECT_EQ(read.displacement, frame.displacement);
  EXPECT_EQ(read.pressure, std::vector<float>(surface_nodes, 0.0F));
  ASSERT_EQ(read.von_mises.size(), surface_nodes);
  for (const float stress : read.von_mises) EXPECT_TRUE(std::isnan(stress));
  EXPECT_EQ(read_recording(folder / "a.h5").frames.surface.held, std::vector<std::uint8_t>(surface_nodes));
}

/// Writes the values of a part's frames as they were stored before version 4.4: as they are, in one piece.
void unpack_frames(const std::filesystem::path& path) {
  const auto frames = hdf5::Contents::read(path);
  for (const std::string name : {"/frames/displacement", "/frames/von_mises", "/frames/pressure"}) {
    std::vector<hsize_t> dims = {0, surface_nodes};
    if (name == "/frames/displacement") dims.push_back(3);
    const auto stored = frames.locate_rows(name, hdf5::element_type<float>(), dims.size());
    if (stored.row_starts.empty()) continue;  // no rows, or shown by a master
    dims[0] = static_cast<hsize_t>(stored.dims[0]);
    std::vector<float> values(dims[0] * surface_nodes * 3);
    frames.read_rows(name, hdf5::element_type<float>(), 0, stored.dims[0], values.data());
    replace(path, name, H5T_IEEE_F32LE, dims, values.data());
  }
  reseal(path);
}

/// Calls it for each file that a recording which was killed is made of, the master last.
void for_each_part(const std::filesystem::path& recording,
                   const std::function<void(const std::filesystem::path&)>& change) {
  for (const auto& part : std::filesystem::directory_iterator(recording.string() + ".parts"))
    if (part.path().extension() == ".h5") change(part.path());
}

/// Makes it one of version 4.0, which had neither stress nor pressure.
void make_older(const std::filesystem::path& path) {
  if (std::filesystem::exists(path.string() + ".parts")) {
    for_each_part(path, unpack_frames);
  } else {
    unpack_frames(path);
  }
  for (const char* name : {"/frames/von_mises", "/frames/pressure", "/surface/held"})
    remove_object(path, name);
  set_integers(path, "version", {4, 0});
}

TEST(Recording, OfVersion40IsReadAsBefore) {
  const Folder folder;
  const auto expect_older = [&](std::size_t frames) {
    EXPECT_EQ(hdf5::Contents::read(folder / "a.h5").integer_attribute("/", "version", 2),
              (std::vector<std::int64_t>{4, 0}));
    const Recording read = read_recording(folder / "a.h5");
    expect_ticks_without_error(read, 30);
    EXPECT_FALSE(read.frames.has_stress);
    EXPECT_TRUE(read.frames.surface.held.empty());
    for (std::size_t k = 0; k < frames; ++k) {
      SurfaceFrame expected = some_frame(k);
      expected.von_mises.clear();
      expected.pressure.clear();
      expect_frame(RecordingFile(folder / "a.h5").frame(static_cast<std::int64_t>(k)), expected);
    }
  };
  record(folder / "a.h5", some_ticks(30), 10);
  make_older(folder / "a.h5");
  expect_older(3);
  {
    RecordingWriter killed(folder / "a.h5", info, surface);
    append(killed, some_ticks(30), 10);
  }
  make_older(folder / "a.h5");
  expect_older(3);
  ASSERT_TRUE(finish_recording(folder / "a.h5"));
  expect_older(3);
}

TEST(Recording, EqualTicksMakeEqualFiles) {
  const Folder folder;
  const auto ticks = some_ticks(900);
  record(folder / "a.h5", ticks, 20);  // 45 checkpoints: two parts of sixteen, and thirteen
  {
    RecordingWriter writer(folder / "b.h5", info, surface);
    for (std::size_t k = 0; k < 45; ++k) writer.append(some_frame(k));
    writer.append(ticks);
    writer.finish();
  }
  EXPECT_EQ(read_bytes(folder / "a.h5"), read_bytes(folder / "b.h5"));
}

TEST(Recording, ThatIsNotFinishedHoldsEachCheckpoint) {
  const Folder folder;
  const std::filesystem::path path = folder / "50%b %% 1.h5";  // the library takes % for a format
  {
    RecordingWriter writer(path, info, surface);
    writer.append(some_ticks(1));
    EXPECT_TRUE(read_recording(path).ticks.empty());
    writer.checkpoint();
    expect_ticks(read_recording(path), 1);
    append(writer, some_ticks(3000, 1), 10);
    writer.append(some_ticks(5, 3001));
    writer.append(some_frame(300));
    const Recording read = read_recording(path);
    EXPECT_FALSE(read.finished);
    expect_ticks(read, 3001);
    expect_frames(path, read, 300);
    // A reader opens them all: 301 checkpoints are 1 part of 256, 2 of 16 and 13 of one, the last sixteen
    // that were merged, and the lock.
    EXPECT_LE(files_in(path.string() + ".parts"), 1U + 2U + 13U + 16U + 1U);
    EXPECT_FALSE(finish_recording(path)) << "it is being recorded";
    EXPECT_NE(refusal([&] { RecordingWriter(path, info); }).find("is being recorded by another program"),
              std::string::npos);
  }
  expect_ticks(read_recording(path), 3001);
  EXPECT_TRUE(finish_recording(path));
  const Recording read = read_recording(path);
  EXPECT_TRUE(read.finished);
  expect_ticks(read, 3001);
  expect_frames(path, read, 300);
  EXPECT_EQ(files_in(folder.path()), 1U);
  EXPECT_TRUE(finish_recording(path)) << "nothing to do";
}

// A reader opens the master first, then its parts. In between the writer may merge them: what an opened
// master names stays until the writer's next checkpoint.
TEST(Recording, ThatIsMergedIsStillReadByWhoHasOpenedIt) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.h5", parts = folder / "a.h5.parts";
  const auto append_one = [](RecordingWriter& writer, std::size_t k) {
    writer.append(some_ticks(10, 10 * k));
    writer.checkpoint();
  };
  RecordingWriter writer(path, info, surface);
  for (std::size_t k = 0; k < 15; ++k) append_one(writer, k);
  {
    hdf5::Contents opened = hdf5::Contents::read(path);
    append_one(writer, 15);
    ASSERT_EQ(open_recording(hdf5::Contents::read(path)).tick_files.size(), 1U) << "16 are one now";
    const RecordingFiles before = open_recording(std::move(opened));
    ASSERT_EQ(before.tick_files.size(), 15U);
    for (std::size_t k = 0; k < 15; ++k) {
      double time = 0.0;
      before.files[before.tick_files[k]].read_rows("/ticks/time", hdf5::element_type<double>(), 3, 1, &time);
      EXPECT_EQ(time, some_tick(10 * k + 3).time);
    }
  }
  append_one(writer, 16);
  EXPECT_EQ(files_in(parts), 1U + 1U + 1U) << "the merged one, the new one and the lock";
  expect_ticks(read_recording(path), 170);
}

TEST(Recording, OfFramesAloneAtTheEndKeepsThem) {
  const Folder folder;
  {
    RecordingWriter writer(folder / "a.h5", info, surface);
    writer.append(some_ticks(3));
    writer.append(some_frame(0));
    writer.checkpoint();
    writer.append(some_frame(1));
    writer.checkpoint();
  }
  expect_frames(folder / "a.h5", read_recording(folder / "a.h5"), 2);
  finish_recording(folder / "a.h5");
  expect_ticks(read_recording(folder / "a.h5"), 3);
  expect_frames(folder / "a.h5", read_recording(folder / "a.h5"), 2);
}

TEST(Recording, TakesThePlaceOfOneThatWasKilled) {
  const Folder folder;
  {
    RecordingWriter killed(folder / "a.h5", info, surface);
    append(killed, some_ticks(500, 7000), 10);
  }
  RecordingWriter writer(folder / "a.h5", info, surface);
  EXPECT_TRUE(read_recording(folder / "a.h5").ticks.empty());
  append(writer, some_ticks(20), 10);
  const Recording read = read_recording(folder / "a.h5");
  expect_ticks(read, 20);
  expect_frames(folder / "a.h5", read, 2);
  writer.finish();
  expect_ticks(read_recording(folder / "a.h5"), 20);
}

TEST(Recording, WithoutOneOfItsPartsIsRefused) {
  const Folder folder;
  {
    RecordingWriter writer(folder / "a.h5", info, surface);
    append(writer, some_ticks(30), 10);
  }
  std::filesystem::remove(folder / "a.h5.parts" / "1.h5");
  const std::string text = refusal([&] { read_recording(folder / "a.h5"); });
  EXPECT_NE(text.find("1.h5 is missing"), std::string::npos) << text;
  EXPECT_NE(refusal([&] { finish_recording(folder / "a.h5"); }).find("1.h5 is missing"), std::string::npos);
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
  {
    RecordingWriter writer(folder / "a.h5", info, surface);
    writer.append(some_ticks(100));
    writer.checkpoint();
    writer.append(some_ticks(4000, 100));
    std::string text;
    {
      const FileLimit limit(200'000);
      text = refusal([&] { writer.finish(); });
    }
    EXPECT_NE(text.find("File too large"), std::string::npos) << text;
    EXPECT_NE(text.find("Check the disk"), std::string::npos) << text;
    expect_ticks(read_recording(folder / "a.h5"), 100);
    EXPECT_EQ(files_in(folder / "a.h5.parts"), 2U) << "half of a part is left";
    writer.finish();  // there is room again
  }
  expect_ticks(read_recording(folder / "a.h5"), 4100);
}

TEST(Recording, HasEachRowOnceWhenOnlyTheMasterFailed) {
  const Folder folder;
  RecordingWriter writer(folder / "a.h5", info, surface);
  append(writer, some_ticks(10), 10);
  std::filesystem::create_directories(folder / "a.h5.parts" / "master.partial" / "in the way");
  writer.append(some_ticks(10, 10));
  EXPECT_NE(refusal([&] { writer.checkpoint(); }).find("is in the way"), std::string::npos);
  expect_ticks(read_recording(folder / "a.h5"), 10);
  std::filesystem::remove_all(folder / "a.h5.parts" / "master.partial");
  writer.finish();
  expect_ticks(read_recording(folder / "a.h5"), 20);
}

TEST(Recording, ThatCannotBeStartedLeavesNothing) {
  const Folder folder;
  SessionInfo too_long = info;
  too_long.model_path = std::string(5000, 'm');
  const std::string text = refusal([&] { RecordingWriter(folder / "a.h5", too_long); });
  EXPECT_NE(text.find("model is 5000 bytes long"), std::string::npos) << text;
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  {
    RecordingWriter killed(folder / "a.h5", info, surface);
    append(killed, some_ticks(20), 10);
  }
  EXPECT_NE(refusal([&] { RecordingWriter(folder / "a.h5", too_long); }), "");
  expect_ticks(read_recording(folder / "a.h5"), 20);
}

TEST(Recording, NamesTheFrameThatDoesNotExpand) {
  const Folder folder;
  record(folder / "a.h5", some_ticks(40), 10);
  for (std::uint64_t bit = 3; bit < 40; bit += 4) flip_bit(folder / "a.h5", "/frames/displacement", bit);
  reseal(folder / "a.h5");
  const RecordingFile file(folder / "a.h5");
  const std::string text = refusal([&] { static_cast<void>(file.frame(0)); });
  EXPECT_NE(text.find("/frames/displacement, row 0, is damaged"), std::string::npos) << text;
  expect_frame(file.frame(1), some_frame(1));
}

// One flipped bit anywhere in the data is noticed, and the dataset named.
TEST(Recording, NamesTheDatasetInWhichABitIsFlipped) {
  const Folder folder;
  record(folder / "good.h5", some_ticks(40), 10);
  std::mt19937 random(20261122);  // NOLINT(cert-msc51-cpp): the same bits in each run
  const std::vector<std::string> datasets = checked_datasets(folder / "good.h5");
  EXPECT_EQ(datasets.size(), 38U);
  for (const std::string& dataset : datasets) {
    std::filesystem::copy_file(folder / "good.h5", folder / "a.h5",
                               std::filesystem::copy_options::overwrite_existing);
    flip_bit(folder / "a.h5", dataset, random());
    const std::string text = refusal([&] { read_recording(folder / "a.h5"); });
    EXPECT_NE(text.find(dataset + " was altered"), std::string::npos) << dataset << ": " << text;
    EXPECT_NE(text.find("a.h5"), std::string::npos) << text;
  }
}

TEST(Recording, NamesThePartInWhichABitIsFlipped) {
  const Folder folder;
  {
    RecordingWriter killed(folder / "a.h5", info, surface);
    append(killed, some_ticks(200), 10);  // 20 parts, 16 of them merged into one
  }
  std::filesystem::copy(folder / "a.h5.parts", folder / "good");
  for (const auto& part : std::filesystem::directory_iterator(folder / "good")) {
    if (part.path().extension() != ".h5") continue;
    for (const char* dataset : {"/ticks/force", "/ticks/patch", "/frames/displacement", "/frames/tick"}) {
      const std::filesystem::path altered = folder / "a.h5.parts" / part.path().filename();
      flip_bit(altered, dataset, 77);
      for (const auto& reader : {std::function<void()>([&] { read_recording(folder / "a.h5"); }),
                                 std::function<void()>([&] { finish_recording(folder / "a.h5"); })}) {
        const std::string text = refusal(reader);
        EXPECT_NE(text.find(std::string(dataset) + " was altered"), std::string::npos) << text;
        EXPECT_NE(text.find(altered.string()), std::string::npos) << text;
      }
      std::filesystem::copy_file(part.path(), altered, std::filesystem::copy_options::overwrite_existing);
    }
  }
  expect_ticks(read_recording(folder / "a.h5"), 200);
  EXPECT_TRUE(finish_recording(folder / "a.h5"));
  expect_ticks(read_recording(folder / "a.h5"), 200);
}

TEST(Recording, DoesNotMergeAPartThatWasAlteredMeanwhile) {
  const Folder folder;
  RecordingWriter writer(folder / "a.h5", info, surface);
  append(writer, some_ticks(150), 10);
  flip_bit(folder / "a.h5.parts" / "3.h5", "/ticks/share", 12);
  writer.append(some_ticks(10, 150));
  EXPECT_NE(refusal([&] { writer.checkpoint(); }).find("/ticks/share was altered"), std::string::npos);
}

/// What a recording's checks refuse although its checksums are right.
struct Impossible {
  const char* name;
  void (*apply)(const std::filesystem::path&);
  const char* says;
};

const Impossible impossible[] = {
    {"Patch", [](const std::filesystem::path& p) { set_entry<std::int32_t>(p, "/ticks/patch", 7, -2); },
     "/ticks/patch, row 7, holds -2"},
    {"Contacts", [](const std::filesystem::path& p) { set_entry<std::int32_t>(p, "/ticks/contacts", 1, -1); },
     "/ticks/contacts, row 1, holds -1"},
    {"ForceError",
     [](const std::filesystem::path& p) { set_entry<float>(p, "/ticks/force_error", 4, -1.0F); },
     "/ticks/force_error, row 4, holds -1"},
    {"GreensError",
     [](const std::filesystem::path& p) { set_entry<float>(p, "/ticks/greens_error", 2, -3.0F); },
     "/ticks/greens_error, row 2, holds -3"},
    {"LeftOut", [](const std::filesystem::path& p) { set_entry<std::int32_t>(p, "/ticks/left_out", 5, -7); },
     "/ticks/left_out, row 5, holds -7"},
    {"Grab", [](const std::filesystem::path& p) { set_entry<std::uint8_t>(p, "/ticks/grab", 3, 2); },
     "/ticks/grab, row 3, holds 2"},
    {"TimeBackwards", [](const std::filesystem::path& p) { set_entry<double>(p, "/ticks/time", 9, 1e-3); },
     "/ticks/time, row 9"},
    {"TimeNotFinite",
     [](const std::filesystem::path& p) { set_entry<double>(p, "/ticks/time", 29, HUGE_VAL); },
     "/ticks/time, row 29, holds inf"},
    {"Arrived",
     [](const std::filesystem::path& p) {
       set_entry<std::int64_t>(p, "/ticks/arrived_ns", 2, std::numeric_limits<std::int64_t>::min());
     },
     "/ticks/arrived_ns, row 2"},
    {"FrameTick", [](const std::filesystem::path& p) { set_entry<std::int64_t>(p, "/frames/tick", 2, -1); },
     "/frames/tick, row 2, holds -1"},
    {"FrameTime", [](const std::filesystem::path& p) { set_entry<double>(p, "/frames/time", 1, NAN); },
     "/frames/time, row 1"},
    {"Simplex",
     [](const std::filesystem::path& p) { set_entry<std::int32_t>(p, "/surface/simplices", 4, 4); },
     "/surface/simplices, row 1, holds 4"},
    {"SimplexNegative",
     [](const std::filesystem::path& p) { set_entry<std::int32_t>(p, "/surface/simplices", 11, -1); },
     "/surface/simplices, row 3, holds -1"},
    {"Node", [](const std::filesystem::path& p) { set_entry<double>(p, "/surface/nodes", 3, NAN); },
     "/surface/nodes, row 1"},
    {"Held", [](const std::filesystem::path& p) { set_entry<std::uint8_t>(p, "/surface/held", 2, 8); },
     "/surface/held, row 2, holds 8"},
    {"RowsOfTicks", [](const std::filesystem::path& p) { replace(p, "/ticks/phase", H5T_STD_U8LE, {29}); },
     "/ticks/phase has 29 rows, /ticks/time has 30"},
    {"RowsOfFrames", [](const std::filesystem::path& p) { replace(p, "/frames/time", H5T_IEEE_F64LE, {4}); },
     "/frames/time has 4 rows, /frames/tick has 3"},
    {"SizeOfRows",
     [](const std::filesystem::path& p) {
       replace(p, "/frames/displacement", H5T_IEEE_F32LE, {3, surface_nodes + 1, 3});
     },
     "/frames/displacement has rows of another size"},
    {"FramesInOnePiece",
     [](const std::filesystem::path& p) {
       replace(p, "/frames/pressure", H5T_IEEE_F32LE, {3, surface_nodes});
     },
     "/frames/pressure has rows that are not compressed"},
    {"FramesInOneChunk",
     [](const std::filesystem::path& p) {
       replace(p, "/frames/pressure", H5T_IEEE_F32LE, {3, surface_nodes}, nullptr, true);
     },
     "/frames/pressure is not stored in one piece"},
    {"Chunked",
     [](const std::filesystem::path& p) {
       replace(p, "/ticks/force", H5T_IEEE_F64LE, {30, 3}, nullptr, true);
     },
     "/ticks/force is not stored in one piece"},
    {"NoChecksum", [](const std::filesystem::path& p) { remove_attribute(p, "/ticks/force", "xxh3"); },
     "/ticks/force has no checksum"},
};

void PrintTo(const Impossible& edit, std::ostream* out) {
  *out << edit.name;
}

class RecordingHostile : public testing::TestWithParam<Impossible> {};
TEST_P(RecordingHostile, IsRefusedByName) {
  const Folder folder;
  record(folder / "a.h5", some_ticks(30), 10);
  GetParam().apply(folder / "a.h5");
  reseal(folder / "a.h5");
  const std::string text = refusal([&] { read_recording(folder / "a.h5"); });
  EXPECT_NE(text.find(GetParam().says), std::string::npos) << text;
}
INSTANTIATE_TEST_SUITE_P(Recording, RecordingHostile, testing::ValuesIn(impossible),
                         [](const auto& edit) { return std::string(edit.param.name); });

TEST(Recording, OfVersion41IsReadWithoutChecksumsAndFinishedWithThem) {
  const Folder folder;
  {
    RecordingWriter killed(folder / "a.h5", info, surface);
    append(killed, some_ticks(30), 10);
  }
  for_each_part(folder / "a.h5", unpack_frames);
  set_integers(folder / "a.h5", "version", {4, 1});
  for_each_part(folder / "a.h5", [](const std::filesystem::path& part) {
    for (const std::string& dataset : checked_datasets(part)) remove_attribute(part, dataset, "xxh3");
  });
  expect_ticks_without_error(read_recording(folder / "a.h5"), 30);
  EXPECT_TRUE(finish_recording(folder / "a.h5"));
  expect_ticks_without_error(read_recording(folder / "a.h5"), 30);
  flip_bit(folder / "a.h5", "/ticks/torque", 5);
  EXPECT_NE(refusal([&] { read_recording(folder / "a.h5"); }).find("/ticks/torque was altered"),
            std::string::npos);
}

TEST(Recording, OfVersion42IsReadAndFinishedWithoutForceErrors) {
  const Folder folder;
  const auto make_42 = [&](const std::filesystem::path& file) {
    for (const char* name : {"/ticks/force_error", "/ticks/left_out", "/ticks/greens_error"})
      remove_object(file, name);
  };
  {
    RecordingWriter killed(folder / "a.h5", info, surface);
    append(killed, some_ticks(30), 10);
  }
  make_42(folder / "a.h5");
  set_integers(folder / "a.h5", "version", {4, 2});
  for_each_part(folder / "a.h5", [&](const std::filesystem::path& part) {
    unpack_frames(part);
    make_42(part);
  });
  expect_ticks_without_error(read_recording(folder / "a.h5"), 30);
  EXPECT_TRUE(finish_recording(folder / "a.h5"));
  expect_ticks_without_error(read_recording(folder / "a.h5"), 30);
  EXPECT_EQ(hdf5::Contents::read(folder / "a.h5").integer_attribute("/", "version", 2),
            (std::vector<std::int64_t>{4, 2}));
}

TEST(Recording, OfVersion43IsReadAndFinishedWithItsFramesAsTheyWere) {
  const Folder folder;
  const std::filesystem::path path = folder / "a.h5";
  {
    RecordingWriter killed(path, info, surface);
    append(killed, some_ticks(200), 10);  // 20 parts, 16 of them merged into one
  }
  remove_object(path, "/ticks/greens_error");
  for_each_part(path, [](const std::filesystem::path& part) {
    unpack_frames(part);
    remove_object(part, "/ticks/greens_error");
  });
  set_integers(path, "version", {4, 3});
  for (int pass = 0; pass < 2; ++pass) {  // as it was left, then as one file
    const Recording read = read_recording(path);
    ASSERT_EQ(read.ticks.size(), 200U);
    for (std::size_t i = 0; i < 200; ++i) {
      TickRecord expected = some_tick(i);
      expected.greens_error = 0.0F;
      ASSERT_TRUE(same(read.ticks[i], expected)) << i;
    }
    expect_frames(path, read, 20);
    const auto contents = hdf5::Contents::read(path);
    EXPECT_EQ(contents.integer_attribute("/", "version", 2), (std::vector<std::int64_t>{4, 3}));
    if (pass == 1) {
      EXPECT_NO_THROW(
          static_cast<void>(contents.locate("/frames/displacement", hdf5::element_type<float>(), 3)));
    }
    ASSERT_TRUE(finish_recording(path));
  }
}

TEST(Recording, OfThisVersionHasCompressedFrames) {
  const Folder folder;
  record(folder / "a.h5", some_ticks(30), 10);
  unpack_frames(folder / "a.h5");
  EXPECT_NE(refusal([&] { read_recording(folder / "a.h5"); }).find("has rows that are not compressed"),
            std::string::npos);
}

// Small rows lie among what the library keeps of a file, and its list of rows grows with their number.
TEST(Recording, OfManySmallFramesIsReadBack) {
  const Folder folder;
  for (const std::size_t at_once : {1U, 2U, 7U, 2500U}) {
    RecordingWriter writer(folder / "a.h5", info, surface);
    for (std::size_t k = 0; k < 2500; ++k) {
      writer.append(some_frame(k));
      if (k % at_once == 0 && k / at_once < 40) writer.checkpoint();
    }
    writer.finish();
    expect_frames(folder / "a.h5", read_recording(folder / "a.h5"), 2500);
  }
}

/// A sheet of N x N nodes that a sphere presses: a smooth dent, a stress with it, and pressure in its middle.
SurfaceFrame dented(std::size_t N, double depth) {
  SurfaceFrame frame = {.tick = 0, .time = 0.0};
  for (std::size_t i = 0; i < N * N; ++i) {
    const double x = static_cast<double>(i % N) / static_cast<double>(N) - 0.5,
                 y = static_cast<double>(i / N) / static_cast<double>(N) - 0.5;
    const double dent = depth / (1.0 + 40.0 * (x * x + y * y));
    for (const double u : {x * dent, y * dent, -dent}) frame.displacement.push_back(static_cast<float>(u));
    frame.von_mises.push_back(static_cast<float>(1e6 * dent * dent));
    frame.pressure.push_back(x * x + y * y < 0.01 ? static_cast<float>(1e5 * dent) : 0.0F);
  }
  return frame;
}

// Of four bytes of a number, those of sign and exponent hardly differ from node to node, and no two mantissas
// are alike: of 20 bytes a node a smooth field is to take less than 15, and what rests next to nothing.
TEST(Recording, OfASmoothFieldIsAQuarterSmaller) {
  const Folder folder;
  constexpr std::size_t N = 60, frames = 20;
  RecordedSurface sheet = {.nodes = std::vector<Vec3>(N * N, Vec3::Zero()), .corners = 3, .simplices = {}};
  const auto bytes_per_node = [&](double depth) {
    std::int64_t files[2] = {};
    for (const std::size_t count : {std::size_t{1}, 1 + frames}) {
      RecordingWriter writer(folder / "a.h5", info, sheet);
      for (std::size_t k = 0; k < count; ++k)
        writer.append(dented(N, depth * (1.0 + 0.1 * static_cast<double>(k))));
      writer.finish();
      files[count > 1] = static_cast<std::int64_t>(std::filesystem::file_size(folder / "a.h5"));
    }
    return static_cast<double>(files[1] - files[0]) / static_cast<double>(frames * N * N);
  };
  EXPECT_LT(bytes_per_node(0.005), 15.0);
  EXPECT_LT(bytes_per_node(0.0), 0.6);
}

TEST(Recording, AnotherMajorVersionIsRefusedAndANewerMinorIsRead) {
  const Folder folder;
  record(folder / "a.h5", some_ticks(3), 3);
  set_integers(folder / "a.h5", "version", {4, 7});
  EXPECT_EQ(read_recording(folder / "a.h5").ticks.size(), 3U);
  for (const std::int64_t major : {3, 5}) {
    set_integers(folder / "a.h5", "version", {major, 0});
    const std::string text = refusal([&] { read_recording(folder / "a.h5"); });
    EXPECT_NE(text.find("another version | Record the session again"), std::string::npos) << text;
  }
}

TEST(Recording, BadPathsAndOtherFilesAreRefused) {
  const Folder folder;
  EXPECT_NE(refusal([&] { RecordingWriter(folder / "none" / "a.h5", info); }).find("No such file"),
            std::string::npos);
  write_sample(folder / "a.palpate.hdf");
  EXPECT_NE(refusal([&] { read_recording(folder / "a.palpate.hdf"); }).find("is a model, not a recording"),
            std::string::npos);
  write_bytes(folder / "text", "text");
  EXPECT_NE(refusal([&] { read_recording(folder / "text"); }), "");
  record(folder / "a.h5", some_ticks(3), 1);
  EXPECT_NE(refusal([&] {
              static_cast<void>(RecordingFile(folder / "a.h5").displacement(1, 3));
            }).find("has 3 frames"),
            std::string::npos);
  EXPECT_EQ(RecordingFile(folder / "a.h5").displacement(1, 2)[0], 100.0F);
  for (const std::int64_t number : {-1, 3}) {
    EXPECT_NE(refusal([&] {
                static_cast<void>(RecordingFile(folder / "a.h5").frame(number));
              }).find("has 3 frames"),
              std::string::npos);
  }
}

/// Records as fast as it goes, and says after each checkpoint how many ticks there are.
[[noreturn]] void record_until_killed(const std::filesystem::path& path, int say) {
  RecordingWriter writer(path, info, surface);
  for (std::size_t k = 0;; ++k) {
    writer.append(some_ticks(10, 10 * k));
    writer.append(some_frame(k));
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

// Each checkpoint and merge is another instant. It is killed some moments after a checkpoint: after the
// first ones, and around the 16th and 17th, which merge parts and remove those that were merged, more often.
TEST(Recording, SurvivesBeingKilledAtAnyMoment) {
  std::mt19937 random(20240229);  // NOLINT(cert-msc51-cpp): the same checkpoints in each run
  std::uniform_int_distribution<std::size_t> any(0, 40);
  std::uniform_int_distribution<int> microseconds(0, 5000);
  std::size_t most = 0;
  for (std::size_t run = 0; run < 40; ++run) {
    const Folder folder;
    const std::filesystem::path path = folder / "a.h5";
    int ends[2] = {};
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) record_until_killed(path, ends[1]);
    close(ends[1]);
    const std::size_t checkpoints = run < 25 ? any(random) : 14 + run % 4;
    const std::size_t heard = last_said(ends[0], checkpoints);
    ASSERT_EQ(heard, 10 * checkpoints);
    std::this_thread::sleep_for(std::chrono::microseconds(microseconds(random)));
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    const std::size_t said = std::max(heard, last_said(ends[0], std::numeric_limits<std::size_t>::max()));
    close(ends[0]);
    most = std::max(most, said);
    if (!std::filesystem::exists(path)) {
      ASSERT_EQ(said, 0U);
      continue;
    }
    for (int pass = 0; pass < 2; ++pass) {  // as it was left, then as one file
      const Recording read = read_recording(path);
      ASSERT_GE(read.ticks.size(), said);
      ASSERT_LE(read.ticks.size(), said + 10);
      expect_ticks(read, read.ticks.size());
      expect_frames(path, read, read.ticks.size() / 10);
      ASSERT_TRUE(finish_recording(path));
      ASSERT_EQ(files_in(folder.path()), 1U);
    }
  }
  ASSERT_GT(most, 320U) << "parts were merged twice";
}

}  // namespace
}  // namespace palpate::test::recording_test
