// Writes files for the tests in Python: formats_sample_file FOLDER makes FOLDER/ELEMENT.palpate.hdf of every
// kind of element, FOLDER/single.palpate.hdf (tet4 in single precision), FOLDER/packed.palpate.hdf and
// FOLDER/modal.palpate.hdf (with dynamics), FOLDER/split.palpate.hdf (in split precision),
// FOLDER/compressed.palpate.hdf (compressed) and FOLDER/recording.h5.
#include <array>
#include <cmath>
#include <iostream>

#include "base/error.h"
#include "formats/recording.h"
#include "tests/support/formats_sample.h"

int main(int count, char** arguments) {
  if (count != 2) return palpate::exit_usage;
  const std::filesystem::path folder = arguments[1];
  try {
    std::filesystem::create_directories(folder);
    palpate::test::write_sample(folder / "single.palpate.hdf", palpate::Precision::single_precision);
    for (const palpate::ElementType element : palpate::body_elements)
      palpate::test::write_sample(folder / (std::string(palpate::traits(element).name) + ".palpate.hdf"),
                                  palpate::Precision::double_precision, element);
    palpate::test::write_swinging_sample(folder / "packed.palpate.hdf", palpate::DynamicsMethod::packed,
                                         palpate::Precision::single_precision);
    palpate::test::write_swinging_sample(folder / "modal.palpate.hdf", palpate::DynamicsMethod::modal);
    palpate::test::write_split_sample(folder / "split.palpate.hdf", palpate::DynamicsMethod::packed);
    palpate::test::write_compressed_sample(folder / "compressed.palpate.hdf");
    palpate::RecordingWriter recording(
        folder / "recording.h5",
        {.model_path = "tet4.palpate.hdf", .content_hash = "00ff", .device = "none", .options = ""},
        {.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
         .corners = 3,
         .simplices = {0, 1, 2},
         .held = {7, 0, 0}});
    for (int i = 0; i < 5000; ++i) {
      const double x = i;
      recording.append(std::array{palpate::TickRecord{.time = 1e-3 * x,
                                                      .tool_position = {x, 2 * x, 3 * x},
                                                      .force = {-x, 0, 1},
                                                      .contacts = i % 5,
                                                      .stiffness = {1, 2, 3, 4, 5, x},
                                                      .grab = 1,
                                                      .force_error = 0.5F * static_cast<float>(i),
                                                      .left_out = i % 3,
                                                      .greens_error = 0.25F * static_cast<float>(i)}});
      if (i % 500 == 0) {
        recording.append(
            palpate::SurfaceFrame{.tick = i,
                                  .time = 1e-3 * x,
                                  .displacement = {0, 0, static_cast<float>(i), 1, 2, 3, 4, 5, 6},
                                  .von_mises = {NAN, 1, static_cast<float>(i)},
                                  .pressure = {0, static_cast<float>(-i), 2}});
      }
    }
    recording.finish();
  } catch (const palpate::Error& error) {
    std::cerr << error.where() << ": " << error.what() << '\n';
    return palpate::exit_input_error;
  }
  return palpate::exit_ok;
}
