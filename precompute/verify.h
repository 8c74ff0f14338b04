// `palpate-precompute verify`: whether a file still says what K says.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// One check: its largest relative error and the bound that it must keep.
struct Check {
  std::string name;
  double error = 0.0;
  double bound = 0.0;
  [[nodiscard]] bool passed() const noexcept { return error <= bound; }  // false for NaN too
};

struct VerifyReport {
  std::vector<Check> checks;
  std::vector<std::string> stale;  ///< sources that have changed since
  [[nodiscard]] bool passed() const noexcept;
};

/// Checks a loaded model (loading has proved sizes, ranges and checksums):
/// - probes: Xi f = u for each stored pair, every entry of Xi taking part; error |Xi f - u|_max / |u|_max;
/// - energy: f^T Xi f > 0 and equal to f^T u;
/// - columns: `samples` columns, both triangles, against K x = e solved anew from the stored mesh: |Xi e -
/// x|_max / |x|_max. A
///   matrix that is not symmetric to rounding fails here, because the rows above the diagonal come from other
///   columns' solves;
/// - residual: for the same columns, K u - e with the nodes that are not stored condensed (theory.md section
/// 2), as normwise backward error
///   |K u - e|_max / (|K|_inf |u|_max + 1);
/// - rest state: K u0 = f on the free dofs, held ones as prescribed: |K u0 - f|_max / |f|_max;
/// - of dynamics: see verify_dynamics.
VerifyReport verify(const Model& model, const std::filesystem::path& file, int samples = 12);

/// The report as lines of text.
std::string to_text(const VerifyReport& report);

}  // namespace palpate
