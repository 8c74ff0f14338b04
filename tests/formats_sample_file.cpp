// Writes files for the tests in Python: formats_sample_file FOLDER makes FOLDER/single.palpate.hdf,
// FOLDER/double.palpate.hdf and FOLDER/recording.h5.
#include <array>
#include <iostream>

#include "formats/recording.h"
#include "meshes/error.h"
#include "tests/formats_sample.h"

int main(int count, char** arguments) {
  if (count != 2) return palpate::exit_usage;
  const std::filesystem::path folder = arguments[1];
  try {
    std::filesystem::create_directories(folder);
    palpate::test::write_sample(folder / "single.palpate.hdf", palpate::Precision::single_precision);
    palpate::test::write_sample(folder / "double.palpate.hdf", palpate::Precision::double_precision);
    palpate::RecordingWriter recording(folder / "recording.h5", "double.palpate.hdf", "00ff");
    for (int i = 0; i < 5000; ++i) {
      const double x = i;
      recording.append(std::array{palpate::TickRecord{.time = 1e-3 * x,
                                                      .tool_position = {x, 2 * x, 3 * x},
                                                      .force = {-x, 0, 1},
                                                      .node = i % 5 - 1,
                                                      .grab = 1}});
    }
    recording.finish();
  } catch (const palpate::Error& error) {
    std::cerr << error.where() << ": " << error.what() << '\n';
    return palpate::exit_input_error;
  }
  return palpate::exit_ok;
}
