// What a folder's gallery lists, what it answers, and to whom.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/gallery/gallery_answers.h"
#include "runtime/gallery/gallery_folder.h"
#include "runtime/gallery/gallery_scene.h"
#include "tests/support/formats_sample.h"
#include "tests/support/meshes_files.h"
#include "tests/support/viewer_decoder.h"

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
  EXPECT_EQ(free_name(folder.path(), "new.stl"), "new.stl");
  EXPECT_EQ(free_name(folder.path(), "a.palpate.hdf"), "a-2.palpate.hdf");
  static_cast<void>(folder.write("a-2.palpate.hdf", ""));
  EXPECT_EQ(free_name(folder.path(), "a.palpate.hdf"), "a-3.palpate.hdf");
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
  EXPECT_EQ(status_of_refusal(get("/gallery")), 403U);
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
    for (const std::string path : {"/scene", "/open"})
      EXPECT_EQ(answers.answer(get(path + "?name=" + name), served).result_int(), 404U) << name;
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

TEST(GalleryScene, OfASourceThereIsNone) {
  const ScratchFolder folder;
  const auto file = folder.write("a.stl", "solid");
  EXPECT_TRUE(
      test::contains(test::error_of([&] { static_cast<void>(gallery_scene(file)); }).what(), "no picture"));
}

}  // namespace
}  // namespace palpate::gallery_test
