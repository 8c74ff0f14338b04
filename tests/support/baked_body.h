// Bodies that palpate-precompute's library bakes in a folder of their own.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "formats/model_file.h"
#include "precompute/bake.h"
#include "precompute/description/description.h"

namespace palpate::test {

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
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("palpate-baked-" + std::to_string(getpid()));
  std::filesystem::path file_ = folder_ / "body.palpate.hdf";
  std::string said_;
};

}  // namespace palpate::test
