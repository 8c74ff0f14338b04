// `palpate-precompute verify`: comparison of a file with a newly assembled K.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/model.h"
#include "precompute/verify_matrix.h"

namespace palpate {

struct VerifyReport {
  std::vector<Check> checks;
  std::vector<std::string> differences;  ///< fields that do not match /model_toml; a wrong index
  std::vector<std::string> stale;        ///< sources that have changed since
  std::vector<std::string> warnings;     ///< on data that are as baked, but poor
  [[nodiscard]] bool passed() const noexcept;
};

/// Checks a loaded model (loading has checked sizes, ranges and checksums):
/// - probes: Xi f = u for each stored pair, every entry of Xi taking part; error |Xi f - u|_max / |u|_max;
/// - energy: f^T Xi f > 0 and equal to f^T u;
/// - columns, rows and touches against K solved anew from the stored mesh: see verify_matrix;
/// - residual: for some stored columns, K u - e with the nodes that are not stored condensed (theory.md
/// section 2), as normwise backward error
///   |K u - e|_max / (|K|_inf |u|_max + 1);
/// - rest state: K u0 = f on the free dofs, held ones as prescribed: |K u0 - f|_max / |f|_max;
/// - dynamics: see verify_dynamics;
/// - all fields determined by /model_toml and the mesh: see description_differences;
/// - the index against the metadata of HDF5: see is_index_right.
VerifyReport verify(const Model& model, const std::filesystem::path& file, int samples = 12);

/// Report as lines of text.
std::string to_text(const VerifyReport& report);

}  // namespace palpate
