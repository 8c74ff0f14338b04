#include <gtest/gtest.h>

#include <algorithm>

#include "formats/recording.h"
#include "tests/formats_sample.h"
#include "tests/formats_tamper.h"

namespace palpate::test {
namespace {

std::vector<TickRecord> some_ticks(std::size_t count) {
  std::vector<TickRecord> ticks(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = static_cast<double>(i);
    ticks[i] = {.time = 1e-3 * x,
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
                .patch = static_cast<std::int32_t>(i % 7) - 1};
  }
  return ticks;
}

bool same(const TickRecord& a, const TickRecord& b) {
  return a.time == b.time && std::ranges::equal(a.device_position, b.device_position) &&
         std::ranges::equal(a.device_orientation, b.device_orientation) &&
         std::ranges::equal(a.tool_position, b.tool_position) &&
         std::ranges::equal(a.tool_orientation, b.tool_orientation) && std::ranges::equal(a.force, b.force) &&
         std::ranges::equal(a.torque, b.torque) && a.contacts == b.contacts &&
         std::ranges::equal(a.stiffness, b.stiffness) && a.status == b.status &&
         a.compute_ns == b.compute_ns && a.grab == b.grab && a.patch == b.patch;
}

void record(const std::filesystem::path& path, std::span<const TickRecord> ticks, std::size_t at_once) {
  RecordingWriter writer(path, SessionInfo{"liver.palpate.hdf", "00ff", "", 1000, "overlay=r=3,rings=2"});
  for (std::size_t at = 0; at < ticks.size(); at += at_once)
    writer.append(ticks.subspan(at, std::min(at_once, ticks.size() - at)));
  writer.finish();
}

class Lengths : public testing::TestWithParam<std::size_t> {};

TEST_P(Lengths, AreReadBack) {
  const Folder folder;
  const auto ticks = some_ticks(GetParam());
  record(folder / "a.h5", ticks, 1000);
  const Recording read = read_recording(folder / "a.h5");
  EXPECT_EQ(read.model_path, "liver.palpate.hdf");
  EXPECT_EQ(read.content_hash, "00ff");
  EXPECT_EQ(read.overlay, "r=3,rings=2");
  ASSERT_EQ(read.ticks.size(), ticks.size());
  for (std::size_t i = 0; i < ticks.size(); ++i) ASSERT_TRUE(same(read.ticks[i], ticks[i])) << i;
}

INSTANTIATE_TEST_SUITE_P(Recording, Lengths, testing::Values(0, 1, 4095, 4096, 4097, 30000));

TEST(Recording, EqualTicksMakeEqualFiles) {
  const Folder folder;
  const auto ticks = some_ticks(9000);
  record(folder / "a.h5", ticks, 1);
  record(folder / "b.h5", ticks, 9000);
  EXPECT_EQ(read_bytes(folder / "a.h5"), read_bytes(folder / "b.h5"));
}

TEST(Recording, IsThereOnlyWhenFinished) {
  const Folder folder;
  {
    RecordingWriter writer(folder / "a.h5", SessionInfo{"m", "h"});
    writer.append(some_ticks(5000));
    EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Recording, ThatCannotBeStartedLeavesNothing) {
  const Folder folder;
  const std::string text = refusal([&] {
    RecordingWriter(folder / "a.h5", SessionInfo{std::string(5000, 'm'), "h"});
  });
  EXPECT_NE(text.find("model is 5000 bytes long"), std::string::npos) << text;
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Recording, AnotherMajorVersionIsRefusedAndANewerMinorIsRead) {
  const Folder folder;
  record(folder / "a.h5", some_ticks(3), 3);
  set_integers(folder / "a.h5", "version", {3, 7});
  EXPECT_EQ(read_recording(folder / "a.h5").ticks.size(), 3U);
  for (const std::int64_t major : {2, 4}) {
    set_integers(folder / "a.h5", "version", {major, 0});
    const std::string text = refusal([&] { read_recording(folder / "a.h5"); });
    EXPECT_NE(text.find("another version | Record the session again"), std::string::npos) << text;
  }
}

TEST(Recording, BadPathsAndOtherFilesAreRefused) {
  const Folder folder;
  EXPECT_NE(refusal([&] {
              RecordingWriter(folder / "none" / "a.h5", SessionInfo{"m", "h"});
            }).find("No such file"),
            std::string::npos);
  write_sample(folder / "a.palpate.hdf");
  EXPECT_NE(refusal([&] { read_recording(folder / "a.palpate.hdf"); }).find("is not a recording"),
            std::string::npos);
  write_bytes(folder / "text", "text");
  EXPECT_NE(refusal([&] { read_recording(folder / "text"); }), "");
}

}  // namespace
}  // namespace palpate::test
