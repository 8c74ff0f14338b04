// What an interrupted run had computed before the columns of its model.
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

/// Reads PATH.partial, which a run has begun; nothing where there is none, or it is damaged.
std::optional<BegunModel> read_begun_model(const std::filesystem::path& partial);

/// Takes over what was computed with a factor (rest displacements, dynamics, a study of warping, force
/// errors, smooth parts) from the PATH.partial of the same model that an interrupted run has left, and gives
/// its precision. Nothing where there is none of the same model: all else must be equal, and what is taken
/// over undamaged. A factor over several processes does not give the same last digits again, and columns go
/// with its smooth part.
std::optional<Precision> take_up_begun_model(const std::filesystem::path& path, Model& model);

}  // namespace palpate
