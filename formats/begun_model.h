// Results that an interrupted run computed before the columns of its model.
#pragma once

#include <filesystem>
#include <optional>

#include "formats/model.h"

namespace palpate {

/// A model without packed matrices, near pairs and probes.
struct BegunModel {
  Model model;
  Precision precision = Precision::double_precision;
  bool is_packed = false;  ///< its Green's functions are not compressed
};

/// Reads PATH.partial of an interrupted run; nullopt if there is none or it is damaged.
std::optional<BegunModel> read_begun_model(const std::filesystem::path& partial);

}  // namespace palpate
