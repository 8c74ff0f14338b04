// What a folder's gallery lists, what it answers, and to whom.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/error.h"
#include "base/regular_file.h"
#include "formats/model_file.h"
#include "formats/recording.h"
#include "runtime/background/picture_maker.h"
#include "runtime/background/surface_frames.h"
#include "runtime/gallery/gallery_answers.h"
#include "runtime/gallery/gallery_folder.h"
#include "runtime/gallery/gallery_scene.h"
#include "runtime/loop/loading.h"
#include "tests/support/files/formats_sample.h"
#include "tests/support/files/meshes_files.h"
#include "tests/support/files/viewer_decoder.h"
#include "tests/support/folders.h"

namespace palpate::gallery_test {
namespace {

namespace http = boost::beast::http;
using test::ScratchFolder;

const ServedAddress served = {.address = "127.0.0.1", .port = 8017, .token = "secret", .book = {}};

RequestHeader request(http::verb method, const std::string& target) {
  RequestHeader header;
  header.method(method);
  header.target(target);
  header.set(http::field::host, "127.0.0.1:8017");
  return header;
}

RequestHeader get(const std::string& target) {
  return request(http::verb::get, target);
}

TEST(GalleryFolder, KindsAreThoseOfTheEnding) {
  EXPECT_EQ(gallery_kind("a.palpate.hdf"), GalleryKind::body);
  EXPECT_EQ(gallery_kind("a.mcap"), GalleryKind::recording);
  for (const char* const name : {"a.stl", "a.obj", "a.ply", "a.off", "a.inr", "a.inr.gz", "a.nii", "a.nii.gz",
                                 "a.nrrd", "a.png", "a.pbm", "model.toml", "a.model.toml"})
    EXPECT_EQ(gallery_kind(name), GalleryKind::source) << name;
  const std::string no_name(300, 'a');
  for (const std::string& name : std::vector<std::string>{"", "a", "a.hdf", "a.gz", ".mcap", ".a.stl",
                                                          "a/b.stl", "../a.stl", "a\n.stl", no_name + ".stl"})
    EXPECT_EQ(gallery_kind(name), std::nullopt) << name;
}

TEST(GalleryFolder, BodiesComeBeforeRecordingsAndWhatNoBodyWasMadeOf) {
  const ScratchFolder folder;
  for (const char* const name :
       {"b.palpate.hdf", "a.palpate.hdf", "z.mcap", "b.stl", "c.stl", "plot.png", "notes.txt", ".a.stl"})
    static_cast<void>(folder.write(name, "12345"));
  std::filesystem::create_directory(folder.path() / "d.palpate.hdf");
  std::vector<std::string> names;
  for (const GalleryItem& item : list_gallery(folder.path())) {
    names.push_back(item.name);
    EXPECT_EQ(item.bytes, 5);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"a.palpate.hdf", "b.palpate.hdf", "z.mcap", "c.stl"}));
}

TEST(GalleryFolder, ANewNameMeetsNothingThatIsMadeOfIt) {
  const ScratchFolder folder;
  for (const char* const name : {"a.palpate.hdf", "a-2.model.toml", "b.model.toml", "c.palpate.hdf.partial",
                                 "d.repaired.off", "e.mcap", "f.palpate.hdf", "model.palpate.hdf"})
    static_cast<void>(folder.write(name, "12345"));
  std::filesystem::create_symlink("nowhere", folder.path() / "f-2.stl");
  for (const auto& [wanted, free] : {std::pair("new.stl", "new.stl"),
                                     {"a.palpate.hdf", "a-3.palpate.hdf"},
                                     {"a.stl", "a-3.stl"},
                                     {"b.png", "b-2.png"},
                                     {"c.nii.gz", "c-2.nii.gz"},
                                     {"d.stl", "d-2.stl"},
                                     {"e.mcap", "e-2.mcap"},
                                     {"f.model.toml", "f-3.model.toml"},
                                     {"model.toml", "model-2.model.toml"},
                                     {"mymodel.toml", "mymodel.toml"}}) {
    EXPECT_EQ(free_name(folder.path(), wanted), free) << wanted;
    EXPECT_EQ(gallery_kind(free), gallery_kind(wanted)) << free;
  }
  EXPECT_EQ(baked_name("a.stl"), "a.palpate.hdf");
  EXPECT_EQ(baked_name("a.b.nii.gz"), "a.b.palpate.hdf");
  EXPECT_EQ(baked_name("a.model.toml"), "a.palpate.hdf");
  EXPECT_EQ(baked_name("model.toml"), "model.palpate.hdf");
}

TEST(GalleryAnswers, ADropReplacesNothing) {
  const ScratchFolder folder;
  const auto theirs = folder.write("kidney.palpate.hdf", "theirs");
  GalleryAnswers answers(folder.path(), {});
  for (const auto& [dropped, kept] : {std::pair("kidney.palpate.hdf", "kidney-2.palpate.hdf"),
                                      {"kidney.stl", "kidney-3.stl"},
                                      {"kidney.model.toml", "kidney-4.model.toml"}}) {
    const auto temporary = folder.write(".dropped", "new");
    const RequestHeader header = request(http::verb::post, std::string("/drop?name=") + dropped);
    EXPECT_EQ(nlohmann::json::parse(answers.keep_file(header, temporary).body())["name"], kept);
    EXPECT_EQ(read_all(folder.path() / kept), "new");
    EXPECT_FALSE(std::filesystem::exists(temporary));
  }
  EXPECT_EQ(read_all(theirs), "theirs");
}

TEST(GalleryFolder, ThousandsOfFilesAreListed) {
  const ScratchFolder folder;
  constexpr int bodies = 4000;
  for (int k = 0; k < bodies; ++k) {
    for (const char* const ending : {".palpate.hdf", ".stl", "-other.stl"})
      static_cast<void>(folder.write(std::to_string(k) + ending, ""));
  }
  EXPECT_EQ(list_gallery(folder.path()).size(), 2U * bodies);
}

TEST(GalleryFolder, OneThatIsNotThereIsTold) {
  const Error error = test::error_of([] { static_cast<void>(list_gallery("/nowhere/at/all")); });
  EXPECT_EQ(error.where(), "/nowhere/at/all");
  EXPECT_TRUE(test::contains(error.what(), "No such file")) << error.what();
}

TEST(GalleryAnswers, NamesAreReadFromTheTarget) {
  EXPECT_EQ(query_value("/scene?token=1&name=a%20b%2Fc.stl&x=2", "name"), "a b/c.stl");
  EXPECT_EQ(query_value("/scene?name=a", "name"), "a");
  EXPECT_EQ(query_value("/scene?name=a%2", "name"), "a%2");
  EXPECT_EQ(query_value("/scene?name=a%zz", "name"), "a%zz");
  EXPECT_EQ(query_value("/scene?names=a&name=", "name"), "");
  EXPECT_EQ(query_value("/scene", "name"), "");
}

unsigned status_of_refusal(const RequestHeader& header) {
  const std::optional<Response> refused = GalleryAnswers::refusal(header, served);
  return refused ? refused->result_int() : 0;
}

TEST(GalleryAnswers, OnlyItsOwnPageIsAnswered) {
  EXPECT_EQ(status_of_refusal(get("/items?token=secret")), 0U);
  EXPECT_EQ(status_of_refusal(get("/items?token=other")), 403U);
  EXPECT_EQ(status_of_refusal(get("/gallery")), 0U) << "the page is the same for everybody";
  EXPECT_EQ(status_of_refusal(request(http::verb::post, "/gallery?token=secret")), 405U);
  for (const char* const path : {"/items", "/scene", "/opened", "/", "/galleryx", "/gallery/"})
    EXPECT_EQ(status_of_refusal(get(path)), 403U) << path;
  EXPECT_EQ(status_of_refusal(request(http::verb::post, "/items?token=secret")), 405U);
  for (const char* const deed : {"/open", "/close", "/drop"}) {
    EXPECT_EQ(status_of_refusal(request(http::verb::post, std::string(deed) + "?token=secret")), 0U);
    EXPECT_EQ(status_of_refusal(request(http::verb::post, deed)), 403U);
    EXPECT_EQ(status_of_refusal(get(std::string(deed) + "?token=secret")), 405U)
        << "a link must change nothing";
  }
  RequestHeader foreign = request(http::verb::post, "/open?token=secret");
  foreign.set(http::field::origin, "http://elsewhere.example");
  EXPECT_EQ(status_of_refusal(foreign), 403U);
  foreign.set(http::field::origin, "http://127.0.0.1:8017");
  EXPECT_EQ(status_of_refusal(foreign), 0U);
  foreign.set(http::field::host, "elsewhere.example:8017");
  EXPECT_EQ(status_of_refusal(foreign), 403U);
}

TEST(GalleryAnswers, FilesOfOtherFoldersAreNotThere) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder.path() / "shown");
  static_cast<void>(folder.write("secret.palpate.hdf", "x"));
  GalleryAnswers answers(folder.path() / "shown", {});
  for (const char* const name : {"..%2Fsecret.palpate.hdf", "secret.palpate.hdf", "%2Fetc%2Fpasswd"})
    EXPECT_EQ(answers.answer(get(std::string("/open?name=") + name), served).result_int(), 404U) << name;
  for (const char* const name : {"..%2Fsecret.palpate.hdf", "secret.palpate.hdf", "%2Fetc%2Fpasswd"})
    EXPECT_EQ(answers.scene(get(std::string("/scene?name=") + name)).result_int(), 404U) << name;
  for (const char* const name : {"..%2Fa.stl", ".a.stl", "a.txt", ""})
    EXPECT_TRUE(GalleryAnswers::drop_refusal(request(http::verb::post, std::string("/drop?name=") + name)))
        << name;
  EXPECT_FALSE(GalleryAnswers::drop_refusal(request(http::verb::post, "/drop?name=a.stl")));
}

TEST(GalleryAnswers, TheFolderIsTold) {
  const ScratchFolder folder;
  static_cast<void>(folder.write("a.mcap", "123"));
  GalleryAnswers answers(folder.path(), {});
  const auto told = nlohmann::json::parse(answers.answer(get("/items"), served).body());
  EXPECT_EQ(told["folder"], folder.path().string());
  ASSERT_EQ(told["items"].size(), 1U);
  EXPECT_EQ(told["items"][0]["name"], "a.mcap");
  EXPECT_EQ(told["items"][0]["kind"], "recording");
  EXPECT_EQ(told["items"][0]["bytes"], 3);
  EXPECT_EQ(answers.answer(get("/opened"), served).body(), "null");
}

std::string told(const std::string& port, const std::string& token) {
  return "{\"url\": \"javascript:alert(1)\", \"port\": " + port + ", \"token\": \"" + token + "\"}";
}

TEST(GalleryPage, IsToldAsJsonAndNothingElse) {
  const std::string token(32, 'a');
  const auto page = page_told(told("8018", token));
  ASSERT_TRUE(page);
  EXPECT_EQ(page->port, 8018);
  EXPECT_EQ(page->token, token);
  for (const std::string& line :
       {std::string(), "open http://127.0.0.1:8018/?token=" + token + " in a browser", std::string("null"),
        std::string("[]"), std::string("{}"), std::string("{\"port\": 8018}"), told("0", token),
        told("65536", token), told("-1", token), told("8018.5", token), told("\"8018\"", token),
        told("8018", ""), told("8018", token + "a"), told("8018", "A" + token.substr(1)),
        told("8018", "@evil.example/?" + token.substr(15))})
    EXPECT_FALSE(page_told(line)) << line;
}

/// A program in the place of palpate-runtime: a shell script that is given what the gallery gives.
class GalleryChild : public testing::Test {
 protected:
  std::filesystem::path script(const std::string& text) const {
    const auto file = folder_.write("program", "#!/bin/sh\n" + text);
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
    return file;
  }
  [[nodiscard]] OpenedItem::Wanted wanted(const std::string& name) const {
    return {.folder = folder_.path(), .name = name, .gallery = {.port = 0}};
  }
  template <class Condition>
  static OpenedItem::State wait_for(const OpenedItem& item, Condition&& is_so) {
    for (;;) {
      const std::optional<OpenedItem::State> state = item.state();
      if (state && is_so(*state)) return *state;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  void wait_for_file(const char* name) const {
    while (!std::filesystem::exists(folder_.path() / name))
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  ScratchFolder folder_;
};

TEST_F(GalleryChild, WhatAFileSaysIsTextAndNoAddress) {
  const std::string token(32, 'b');
  OpenedItem item(
      script("printf 'open javascript:alert(1) in a browser\\n\\033[31mred\\n' >&2\n"
             "printf '{\"port\": 1, \"token\": \"' >&2; echo\n"
             "echo '{\"port\": 8018, \"token\": \"" +
             token + "\"}' >&3\nsleep 1000\n"));
  item.open(wanted("a.palpate.hdf"));
  const auto state = wait_for(item, [](const auto& one) { return one.page && one.said.size() > 1; });
  EXPECT_EQ(state.page->port, 8018);
  EXPECT_EQ(state.page->token, token);
  EXPECT_EQ(state.said[0], "open javascript:alert(1) in a browser") << "a line like any other";
  EXPECT_EQ(state.said[1], "\\x1b[31mred");
  EXPECT_FALSE(state.has_ended);
}

TEST_F(GalleryChild, ThatHeedsNoSignalIsKilledAndNobodyWaitsForIt) {
  OpenedItem item(script("case $2 in *stubborn*) trap '' TERM; echo > begun; kill -STOP $$;; esac\n"
                         "echo \"here is $2\" >&2; exec sleep 1000\n"),
                  std::chrono::milliseconds(200));
  item.open(wanted("stubborn.palpate.hdf"));
  wait_for_file("begun");
  item.close();  // returns at once, as all that follows
  EXPECT_FALSE(item.state());
  item.open(wanted("never.palpate.hdf"));
  item.open(wanted("next.palpate.hdf"));
  EXPECT_EQ(item.state()->name, "next.palpate.hdf");
  const auto state = wait_for(item, [](const auto& one) { return !one.said.empty(); });
  EXPECT_EQ(state.said.front(), "here is " + (folder_.path() / "next.palpate.hdf").string());
}

TEST_F(GalleryChild, ThatEndsOrCannotBeStartedIsTold) {
  OpenedItem item(script("echo 'error: no' >&2; exit 1\n"));
  item.open(wanted("a.palpate.hdf"));
  EXPECT_EQ(wait_for(item, [](const auto& one) { return one.has_ended; }).said.front(), "error: no");
  OpenedItem none(folder_.path() / "nothing");
  none.open(wanted("a.palpate.hdf"));
  EXPECT_TRUE(test::contains(wait_for(none, [](const auto& one) { return one.has_ended; }).said.front(),
                             "cannot be started"));
}

TEST_F(GalleryChild, ASourceMayWriteNoFileThatIsThere) {
  OpenedItem item(script("echo \"$*\" >&2\n"));
  item.open(wanted("foreign.model.toml"));
  const auto state = wait_for(item, [](const auto& one) { return one.has_ended; });
  const std::string folder = folder_.path().string() + "/";
  EXPECT_TRUE(state.said.front().starts_with("push " + folder + "foreign.model.toml --output " + folder +
                                             "foreign.palpate.hdf --keep --view-address 127.0.0.1:"))
      << state.said.front();
}

TEST(GalleryScene, IsTheSurfaceAtRest) {
  const ScratchFolder folder;
  const Model model = test::write_sample(folder.path() / "a.palpate.hdf", Precision::double_precision);
  const test::DecodedScene scene = test::decode_scene(gallery_scene(folder.path() / "a.palpate.hdf"));
  ASSERT_EQ(model.dimension(), 3);
  EXPECT_EQ(scene.triangle.size(), model.surface.size());
  std::vector<std::array<float, 3>> seen, wanted;
  for (const std::uint32_t node : scene.triangle)
    seen.push_back({scene.position[3 * node], scene.position[3 * node + 1], scene.position[3 * node + 2]});
  for (const Index node : model.surface) {
    const Vec3 place = model.mesh.nodes[static_cast<std::size_t>(node)] +
                       model.rest_displacement[static_cast<std::size_t>(node)];
    wanted.push_back(
        {static_cast<float>(place.x()), static_cast<float>(place.y()), static_cast<float>(place.z())});
  }
  EXPECT_EQ(seen, wanted);
}

/// Where its picture has the corners of triangles, one after the other.
std::vector<float> corners_in(const std::filesystem::path& file) {
  const test::DecodedScene scene = test::decode_scene(gallery_scene(file));
  std::vector<float> corners;
  for (const std::uint32_t node : scene.triangle)
    for (const std::size_t axis : {0U, 1U, 2U}) corners.push_back(scene.position[3 * node + axis]);
  return corners;
}

/// The same of a surface that is displaced by so much [S x 3].
std::vector<float> corners_of(const RecordedSurface& surface, const std::vector<float>& displacement) {
  std::vector<float> corners;
  for (const Index node : surface.simplices) {
    const auto at = static_cast<std::size_t>(node);
    for (const std::size_t axis : {0U, 1U, 2U})
      corners.push_back(static_cast<float>(surface.nodes[at][static_cast<Eigen::Index>(axis)] +
                                           static_cast<double>(displacement[3 * at + axis])));
  }
  return corners;
}

// Pictures are computed, of which the second was felt most.
TEST(GalleryScene, OfARecordingIsAsItWasPressedMost) {
  const ScratchFolder folder;
  const std::filesystem::path model = folder.path() / "cube2.palpate.hdf";
  std::filesystem::copy_file(test::source_file("tests/golden/cube2/cube2.palpate.hdf"), model);
  const Body body = load_body(model, "", {.depth = Depth::no});
  const RecordedSurface surface = recorded_surface(body);
  const Index node = body.surface_node_of_stored(body.free_surface_nodes().front());
  const auto pressed = [&](std::int64_t tick, float force) {
    return ContactLoads{.tick = tick,
                        .time = 1e-3 * static_cast<double>(tick),
                        .node = {node},
                        .force = {0.0F, 0.0F, -force},
                        .press = {force}};
  };
  const std::filesystem::path file = folder.path() / "a.mcap";
  RecordingWriter writer(
      file,
      {model.string(), body.model().content_hash, "script", 1000, "tool=sphere:0.1\noverlay=no\ndepth=no\n"},
      surface);
  for (const std::int64_t tick : {0, 1, 2}) {
    const float force = tick == 1 ? 0.02F : 0.01F;
    writer.append(TickRecord{.time = 1e-3 * static_cast<double>(tick), .force = {0, 0, -force}});
    writer.append(pressed(tick, force));
  }
  writer.finish();

  const SurfaceFrame picture = PictureMaker(body).picture(pressed(1, 0.02F));
  EXPECT_LT(std::ranges::min(picture.displacement), -1e-4F);
  EXPECT_EQ(corners_in(file), corners_of(surface, picture.displacement));

  std::filesystem::remove(model);
  EXPECT_EQ(corners_in(file), corners_of(surface, std::vector<float>(picture.displacement.size())));
}

TEST(GalleryScene, OfASourceThereIsNone) {
  const ScratchFolder folder;
  const auto file = folder.write("a.stl", "solid");
  EXPECT_TRUE(
      test::contains(test::error_of([&] { static_cast<void>(gallery_scene(file)); }).what(), "no picture"));
}

}  // namespace
}  // namespace palpate::gallery_test
