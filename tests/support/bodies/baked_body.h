// Bodies that palpate-precompute's library bakes in a folder of their own.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "formats/model_file.h"
#include "precompute/bake.h"
#include "precompute/description/read_description.h"

namespace palpate::test {

/// 30 times as long as high: bending along the whole length is 6e4 times softer than one node alone.
inline constexpr const char* slender_beam = R"(name = "beam"
[geometry]
box = {size = [0.3, 0.01, 0.01], cells = [40, 1, 1]}
[mesh]
element = "hex8"
[material]
youngs_modulus = 1e6
poissons_ratio = 0.3
[[fixed]]
lowest = {axis = "x", percent = 1}
)";

/// So slender that solves in double are wrong in the ninth figure, columns by 2e-9, and that rounding to
/// single spoils the forces of neighbouring nodes.
inline constexpr const char* thread = R"(name = "thread"
[geometry]
box = {size = [0.3, 0.003, 0.003], cells = [40, 1, 1]}
[mesh]
element = "hex8"
[material]
youngs_modulus = 1e6
poissons_ratio = 0.3
[[fixed]]
lowest = {axis = "x", percent = 0.1}
)";

/// A folder for one baked body, which goes with its contents.
class BakedBody {
 public:
  BakedBody() { std::filesystem::create_directories(folder_); }
  BakedBody(const BakedBody&) = delete;
  BakedBody& operator=(const BakedBody&) = delete;
  ~BakedBody() { std::filesystem::remove_all(folder_); }

  /// Bakes the body of a model.toml's text and loads its file; keeps in said_ what was printed.
  Model bake_body(const std::string& text, int jobs = 1) {
    std::ofstream(folder_ / "model.toml") << text;
    testing::internal::CaptureStderr();
    bake(read_description(folder_ / "model.toml"), {.output = file_, .jobs = jobs, .dry_run = false});
    said_ = testing::internal::GetCapturedStderr();
    return load_model(file_);
  }

 protected:
  /// Of the file.
  [[nodiscard]] std::string bytes() const {
    std::ifstream in(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("palpate-baked-" + std::to_string(getpid()));
  std::filesystem::path file_ = folder_ / "body.palpate.hdf";
  std::string said_;
};

}  // namespace palpate::test
