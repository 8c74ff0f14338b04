// Writes files for the tests in Python: formats_sample_file FOLDER makes FOLDER/ELEMENT.palpate.hdf of every
// kind of element, FOLDER/single.palpate.hdf (tet4 in single precision), FOLDER/packed.palpate.hdf and
// FOLDER/modal.palpate.hdf (with dynamics), FOLDER/split.palpate.hdf (in split precision) and
// FOLDER/compressed.palpate.hdf (compressed).
#include <iostream>

#include "base/error.h"
#include "tests/support/files/formats_sample.h"

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
  } catch (const palpate::Error& error) {
    std::cerr << error.where() << ": " << error.what() << '\n';
    return palpate::exit_input_error;
  }
  return palpate::exit_ok;
}
