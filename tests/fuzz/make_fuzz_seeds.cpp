// make_fuzz_seeds FOLDER: FOLDER/model and FOLDER/recording, whole files, a cut one, and a few choices of
// edits.
#include <random>

#include "formats/recording.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/support/files/formats_sample.h"

namespace {

void record(const std::filesystem::path& path, bool with_frames, bool finish) {
  using namespace palpate;
  RecordingWriter writer(path, {.options = "tool=point\n"},
                         {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 3, {0, 1, 2}, {7, 0, 0}});
  for (int k = 0; k < 6; ++k) {
    writer.append(TickRecord{.time = 1e-3 * k});
    if (with_frames) {
      writer.append(
          SurfaceFrame{k, 1e-3 * k, std::vector<float>(9), std::vector<float>(3), std::vector<float>(3)});
    } else {
      writer.append(ContactLoads{k, 1e-3 * k, {0, 2}, {1, 2, 3, 4, 5, 6}, {1, 2}});
    }
    if (k % 3 == 2) writer.checkpoint();
  }
  writer.append(RecordedEvent{.time = 0.005, .text = "the device is lost"});
  if (finish) writer.finish();
}

}  // namespace

int main(int count, char** arguments) {
  using namespace palpate;
  if (count != 2) return 2;
  const std::filesystem::path recordings = std::filesystem::path(arguments[1]) / "recording";
  std::filesystem::create_directories(recordings);
  for (const bool with_frames : {false, true}) {
    for (const bool finish : {false, true})
      record(recordings / (std::string(with_frames ? "frames" : "contacts") + (finish ? "" : "-killed")),
             with_frames, finish);
  }
  const std::filesystem::path folder = std::filesystem::path(arguments[1]) / "model";
  std::filesystem::create_directories(folder);
  const test::Folder temporary;
  const std::string raw(1, static_cast<char>(test::raw_file));

  test::write_sample(temporary / "single", Precision::single_precision, ElementType::tet4, 1);
  test::write_sample(temporary / "double", Precision::double_precision, ElementType::tet4, 1);
  test::write_sample(temporary / "plane", Precision::double_precision, ElementType::quad4, 1);
  for (const DynamicsMethod method : {DynamicsMethod::packed, DynamicsMethod::modal}) {
    const std::string name = method == DynamicsMethod::packed ? "packed" : "modal";
    test::write_swinging_sample(temporary / name, method, Precision::double_precision, ElementType::tri3);
    test::write_bytes(folder / name, raw + test::read_bytes(temporary / name));
  }
  test::write_compressed_sample(temporary / "compressed");
  test::write_bytes(folder / "compressed", raw + test::read_bytes(temporary / "compressed"));
  const std::string whole = test::read_bytes(temporary / "double");
  test::write_bytes(folder / "single", raw + test::read_bytes(temporary / "single"));
  test::write_bytes(folder / "double", raw + whole);
  test::write_bytes(folder / "plane", raw + test::read_bytes(temporary / "plane"));
  test::write_bytes(folder / "cut", raw + whole.substr(0, whole.size() / 2));

  std::mt19937 random(1);
  for (int seed = 0; seed < 30; ++seed) {
    std::string bytes(1, static_cast<char>(seed % 3 == 0 ? test::some_plane_edits : test::some_edits));
    for (int i = 0; i < 40; ++i) bytes += static_cast<char>(random() & 255U);
    test::write_bytes(folder / ("edits" + std::to_string(seed)), bytes);
  }
  return 0;
}
