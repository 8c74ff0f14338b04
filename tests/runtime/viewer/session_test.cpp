// A recording as the viewer shows it, and as a page of its own.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "runtime/app/export.h"
#include "runtime/app/session_pictures.h"
#include "runtime/serving/http_guard.h"
#include "runtime/viewer/page_archive.h"
#include "runtime/web/page.h"
#include "tests/support/files/viewer_decoder.h"

namespace palpate::session_test {
namespace {

using Json = nlohmann::json;

// ---- The archive, read again

struct Kept {
  std::uint32_t kind;
  std::string bytes;
  bool operator==(const Kept&) const = default;
};

std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  EXPECT_EQ(text.size() % 4, 0U);
  std::string bytes;
  unsigned bits = 0;
  unsigned count = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const std::size_t digit = digits.find(c);
    EXPECT_NE(digit, std::string::npos) << c;
    bits = bits << 6U | static_cast<unsigned>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xFFU);
  }
  return bytes;
}

std::string inflated(const std::string& packed) {
  std::string bytes(std::size_t{1} << 22U, '\0');
  uLongf size = bytes.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &size,
                       reinterpret_cast<const Bytef*>(packed.data()), packed.size()),
            Z_OK);
  bytes.resize(size);
  return bytes;
}

const std::string script_begins = R"(<script type="application/octet-stream" id="palpate-session">)";
const std::string script_ends = "</script>\n";

/// What is in the page's script, and the page without it.
std::vector<Kept> messages_of(const std::string& page, std::string& around) {
  const std::size_t begin = page.rfind(script_begins);
  const std::size_t data = begin + script_begins.size();
  const std::size_t end = page.find(script_ends, data);
  EXPECT_NE(begin, std::string::npos);
  EXPECT_NE(end, std::string::npos);
  around = page.substr(0, begin) + page.substr(end + script_ends.size());
  const std::string bytes = inflated(from_base64(page.substr(data, end - data)));
  std::vector<Kept> messages;
  for (std::size_t at = 0; at < bytes.size();) {
    test::Bytes header(bytes.substr(at, 8));
    const std::uint32_t size = header.u32();
    messages.push_back({header.u32(), bytes.substr(at + 8, size)});
    EXPECT_EQ(messages.back().bytes.size(), size);
    at += 8 + size;
  }
  return messages;
}

TEST(PageArchive, KeepsAllMessagesAndThePage) {
  const std::string page = "<html><body>a page's text: </body> and the end</body>\n</html>\n";
  std::mt19937 random(1);                         // what is random cannot be deflated
  for (std::size_t more = 0; more < 4; ++more) {  // all paddings of base64
    std::string noise(1000 + more, '\0');
    for (char& c : noise) c = static_cast<char>(random() & 0xFFU);
    PageArchive archive;
    archive.add_text(R"({"type":"hello"})");
    archive.add_binary(noise);
    archive.add_binary("");
    archive.add_text("\"</script>\"");
    std::string around;
    const std::string whole = archive.page(page);
    EXPECT_EQ(messages_of(whole, around),
              (std::vector<Kept>{{0, R"({"type":"hello"})"}, {1, noise}, {1, ""}, {0, "\"</script>\""}}));
    EXPECT_EQ(around, page);
    EXPECT_TRUE(whole.ends_with(script_ends + "</body>\n</html>\n"));
  }
}

TEST(PageArchive, StandsAtTheEndOfAPageWithoutABody) {
  std::string around;
  EXPECT_TRUE(messages_of(PageArchive().page("text"), around).empty());
  EXPECT_EQ(around, "text");
}

// ---- Recordings

TickRecord tick_record(std::int64_t number) {
  TickRecord tick;
  const auto n = static_cast<double>(number);
  tick.time = n / 1000.0;
  tick.device_position[0] = n + 0.25;
  tick.tool_position[0] = n;
  tick.tool_orientation[0] = 0.8;
  tick.tool_orientation[1] = 0.6;
  tick.force[2] = -n;
  tick.torque[1] = 2.0 * n;
  tick.shown_force[0] = 3.0 * n;
  tick.shown_force[1] = 4.0 * n;
  tick.contacts = 2;
  tick.compute_ns = 70'000;
  tick.begun_ns = 1'000'000 * number + 5000;
  tick.status = 8;
  tick.force_error = 0.5F;
  tick.left_out = 6;
  tick.greens_error = 0.25F;
  return tick;
}

/// A triangle whose third node goes up with time.
class Recorded : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "palpate_session.XXXXXX";
    folder_ = mkdtemp(name.data());
    file_ = folder_ / "touch.mcap";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void record(const std::vector<std::int64_t>& ticks, const std::vector<std::int64_t>& frames) const {
    RecordingWriter writer(
        file_,
        {.model_path = "/models/liver.palpate.hdf",
         .content_hash = "",
         .device = "a hand",
         .options = "tool=sphere:0.005\nfriction=0.5\n"},
        {.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, .simplices = {0, 1, 2}, .held = {7, 0, 0}});
    for (const std::int64_t number : ticks) writer.append(tick_record(number));
    for (const std::int64_t tick : frames) {
      SurfaceFrame frame;
      frame.tick = tick;
      frame.time = static_cast<double>(tick) / 1000.0;
      frame.displacement = {0, 0, 0, 0, 0, 0, 0, 0, static_cast<float>(tick)};
      frame.von_mises = {1, 2, static_cast<float>(tick)};
      frame.pressure = {0, 0, 5};
      writer.append(frame);
    }
    writer.finish();
  }

  std::filesystem::path folder_;
  std::filesystem::path file_;
};

std::vector<std::int64_t> numbers(std::int64_t first, std::int64_t end, std::int64_t step = 1) {
  std::vector<std::int64_t> all;
  for (std::int64_t k = first; k < end; k += step) all.push_back(k);
  return all;
}

std::vector<std::int64_t> joined(std::vector<std::int64_t> first, const std::vector<std::int64_t>& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

TEST_F(Recorded, APictureShowsItsTick) {
  record(joined(numbers(0, 10), numbers(15, 20)), {0, 4, 12, 16});
  const SessionPictures pictures(file_);
  ASSERT_EQ(pictures.frames(), 4);
  const SurfacePicture seen = pictures.picture(1);
  EXPECT_EQ(seen.frame.tick, 4);
  EXPECT_EQ(seen.frame.displacement[8], 4.0F);
  EXPECT_EQ(seen.frame.von_mises[2], 4.0F);
  EXPECT_EQ(seen.tool.position, Vec3(4, 0, 0));
  EXPECT_EQ(seen.tool.orientation.x(), 0.6);
  EXPECT_EQ(seen.tool.orientation.w(), 0.8);
  EXPECT_EQ(seen.device.position, Vec3(4.25, 0, 0));
  EXPECT_EQ(seen.on_body.force, Vec3(0, 0, -4));
  EXPECT_EQ(seen.on_body.torque, Vec3(0, 8, 0));
  EXPECT_EQ(static_cast<int>(seen.status), 8);
  EXPECT_EQ(seen.force_error, 0.5);
  EXPECT_EQ(seen.left_out, 6);
  EXPECT_EQ(seen.greens_error, 0.25);
  EXPECT_EQ(pictures.picture(2).tool.position.x(), 9.0) << "tick 12 was lost: that before it";
  EXPECT_EQ(pictures.picture(3).tool.position.x(), 16.0);
  EXPECT_THROW((void)pictures.picture(4), Error);
}

TEST_F(Recorded, TicksWithGapsAreSeveralRuns) {
  record(joined(numbers(0, 10), numbers(15, 20)), {0});
  const std::vector<TickRun> runs = SessionPictures(file_).ticks();
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0].notes.size(), 10U);
  ASSERT_EQ(runs[1].notes.size(), 5U);
  EXPECT_EQ(runs[1].stride, 1);
  const TickNote& note = runs[1].notes[1];
  EXPECT_EQ(note.number, 16);
  EXPECT_EQ(note.lateness_ns, 5000);
  EXPECT_EQ(note.compute_ns, 70'000);
  EXPECT_EQ(note.force, Vec3(0, 0, -16));
  EXPECT_EQ(note.shown, 80.0);
  EXPECT_EQ(note.contacts, 2);
  EXPECT_EQ(static_cast<int>(note.status), 8);
  EXPECT_EQ(note.force_error, 0.5);
  EXPECT_EQ(note.left_out, 6);
  EXPECT_TRUE(std::isnan(note.depth));
}

TEST_F(Recorded, ManyTicksAreThinnedOut) {
  record(joined(numbers(0, 100'000), numbers(100'001, 100'004)), {0});  // one is lost
  const std::vector<TickRun> runs = SessionPictures(file_).ticks();
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[0].stride, 2);
  ASSERT_EQ(runs[0].notes.size(), 50'000U);
  EXPECT_EQ(runs[0].notes.back().number, 99'998);
  ASSERT_EQ(runs[1].notes.size(), 2U);
  EXPECT_EQ(runs[1].notes.front().number, 100'001);
  EXPECT_EQ(runs[1].notes.back().number, 100'003);
}

TEST_F(Recorded, StateAndSceneAreTheRecordings) {
  record(numbers(0, 5), {0, 4});
  const SessionPictures pictures(file_);
  const Json state = pictures.state({0.0, 0.004});
  EXPECT_EQ(state.at("model").at("name"), "liver");
  EXPECT_EQ(state.at("model").at("surface_nodes"), 3);
  EXPECT_EQ(state.at("model").at("size"), std::sqrt(2.0));
  EXPECT_EQ(state.at("device"), "a hand");
  EXPECT_EQ(state.at("settings"), (Json{{"tool", "sphere:0.005"}, {"friction", "0.5"}}));
  EXPECT_EQ(state.at("times"), (Json{0.0, 0.004}));
  EXPECT_EQ(state.at("frames"), 2);
  EXPECT_EQ(state.at("duration"), 0.004);
  EXPECT_EQ(state.at("locked"), "this is a recording");
  EXPECT_EQ(state.at("ticks"), 5);
  const Scene scene = pictures.scene();
  EXPECT_EQ(scene.nodes.size(), 3U);
  EXPECT_EQ(scene.triangles, (std::vector<std::array<Index, 3>>{{0, 1, 2}}));
  EXPECT_EQ(scene.held, (std::vector<std::uint8_t>{7, 0, 0}));
}

std::string hint_of(const std::function<void()>& wish) {
  try {
    wish();
  } catch (const Error& error) {
    return error.hint();
  }
  return "";
}

TEST_F(Recorded, WithoutPicturesItIsNotShown) {
  record(numbers(0, 5), {});
  EXPECT_NE(hint_of([&] { const SessionPictures pictures(file_); }).find("--record-frames"),
            std::string::npos);
  EXPECT_NE(hint_of([&] { const SessionPictures pictures(folder_ / "none.mcap"); }), "");
}

// ---- Its page

/// The page that is written, read again: ticks of its pictures, and its state.
struct Exported {
  std::vector<double> pictures;
  std::vector<std::size_t> runs;  // of ticks
  Json hello;
  Json state;
};

class Export : public Recorded {
 protected:
  void SetUp() override {
    Recorded::SetUp();
    record(joined(numbers(0, 300), numbers(400, 1001)), numbers(0, 1001, 20));  // 50 pictures a second
  }
  [[nodiscard]] ExportOptions options() const {
    return {.recording = file_, .html = folder_ / "touch.html", .fps = 1000.0};
  }
  /// A page that is written says by whom: it is known again by that when it is written over.
  static std::string page_with_its_maker() {
    const std::string head = "<head>";
    std::string page(viewer_page());
    page.insert(page.find(head) + head.size(),
                "\n<meta name=\"generator\" content=\"palpate-runtime " PALPATE_VERSION
                "\">\n<meta http-equiv=\"Content-Security-Policy\" content=\"" +
                    page_policy() + "\">");
    return page;
  }
  static Exported exported(const ExportOptions& options) {
    EXPECT_EQ(export_session(options), 0);
    std::ifstream stream(options.html, std::ios::binary);
    const std::string page{std::istreambuf_iterator<char>(stream), {}};
    std::string around;
    const std::vector<Kept> messages = messages_of(page, around);
    EXPECT_TRUE(around == page_with_its_maker()) << "a page of " << around.size() << " bytes";
    EXPECT_GE(messages.size(), 3U);
    Exported found{{}, {}, Json::parse(messages.at(0).bytes), Json::parse(messages.at(1).bytes)};
    const test::DecodedScene scene = test::decode_scene(messages.at(2).bytes);
    std::optional<test::DecodedFrame> last;
    EXPECT_EQ(scene.scene, found.state.at("scene"));
    for (std::size_t k = 3; k < messages.size(); ++k) {
      EXPECT_EQ(messages[k].kind, 1U);
      if (test::Bytes(messages[k].bytes).u32() == 4) {
        found.runs.push_back(test::decode_ticks(messages[k].bytes).shown.size());
        continue;
      }
      const test::DecodedFrame frame = test::decode_frame(messages[k].bytes, 3, last ? &*last : nullptr);
      last = frame;
      EXPECT_EQ(frame.tick, 1000.0 * frame.time);
      EXPECT_EQ(frame.base == 0, found.pictures.size() % 30 == 0) << "one in 30 pictures is whole";
      for (std::size_t node = 0; node < 3; ++node) {  // the third one, at y = 1, goes up with time
        const double up = scene.position.at(3 * node + 1) == 1.0F ? frame.tick : 0.0;
        EXPECT_NEAR(frame.u.at(3 * node + 2), up, 1e-4 * up);
      }
      found.pictures.push_back(frame.tick);
    }
    return found;
  }
};

std::vector<double> ticks(std::int64_t first, std::int64_t last, std::int64_t step) {
  const std::vector<std::int64_t> all = numbers(first, last + 1, step);
  return {all.begin(), all.end()};
}

TEST_F(Export, HasAllThatWasRecorded) {
  const Exported found = exported(options());
  EXPECT_EQ(found.hello.at("mode"), "file");
  EXPECT_EQ(found.state.at("type"), "state");
  EXPECT_EQ(found.pictures, ticks(0, 1000, 20));
  EXPECT_EQ(found.runs, (std::vector<std::size_t>{300, 601}));
  EXPECT_EQ(found.state.at("times").size(), 51U);
  EXPECT_EQ(found.state.at("frames"), 51);
}

TEST_F(Export, ChoosesPictures) {
  ExportOptions fewer = options();
  fewer.fps = 25.0;
  EXPECT_EQ(exported(fewer).pictures, ticks(0, 1000, 40)) << "each second one";
  fewer.fps = 30.0;
  EXPECT_EQ(exported(fewer).pictures, ticks(0, 1000, 40)) << "not one more than 30 a second";
  fewer.fps = 50.0;
  EXPECT_EQ(exported(fewer).pictures, ticks(0, 1000, 20));
  ExportOptions part = options();
  part.from = 0.2;
  part.to = 0.3;
  const Exported found = exported(part);
  EXPECT_EQ(found.pictures, ticks(200, 300, 20)) << "both ends are in";
  EXPECT_EQ(found.state.at("times"), (Json{0.2, 0.22, 0.24, 0.26, 0.28, 0.3}));
}

TEST_F(Export, SaysWhatCannotBe) {
  ExportOptions late = options();
  late.from = 2.0;
  EXPECT_EQ(hint_of([&] { export_session(late); }), "it lasts from 0 to 1 s");
  ExportOptions backwards = options();
  backwards.from = 0.5;
  backwards.to = 0.4;
  EXPECT_EQ(hint_of([&] { export_session(backwards); }), "it lasts from 0 to 1 s");
  EXPECT_FALSE(std::filesystem::exists(late.html));
  ExportOptions nowhere = options();
  nowhere.html = folder_ / "none" / "touch.html";
  EXPECT_NE(hint_of([&] { export_session(nowhere); }), "");
}

}  // namespace
}  // namespace palpate::session_test
