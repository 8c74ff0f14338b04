// Errors of small strain and warping for a bent body.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "precompute/description/description.h"

namespace palpate {

/// Called with the finished fraction (0..1) of a study; returns false to stop it.
using WarpStudyProgress = std::function<bool(double share)>;

/// A study, and the reason for its end.
struct WarpStudyResult {
  WarpStudy study;
  std::string note;  ///< reason for ending before the requested angle; empty: it reached it
};

/// Bends the body of `model` (without Green's functions: mesh, materials, held nodes, loads, rest) step by
/// step by a force that rotates with the part of the surface on which it acts, as a smooth tool's does, and
/// compares small strain and warping with a corotational body at each step:
///
/// - displacement: the distance between the mean displacements of that part under the same force, relative to
/// the corotational one;
/// - force: the difference of the forces that move the part equally far along the first direction, relative
/// to the corotational one; infinite if there is no such force.
///
/// Nullopt if `progress` stops it. Throws Error if the body cannot be bent.
std::optional<WarpStudyResult> study_warp(const Model& model, const WarpOptions& options,
                                          const WarpStudyProgress& progress);

/// Repeats a stored study: its nodes, direction and forces, with results for the body of `model`. Levels end
/// where the body has no balance.
WarpStudy repeat_warp_study(const Model& model);

/// Result in words: "forces within 5 % up to 19 degrees by small strain, 90 warped (studied to 90)".
std::string range_text(const WarpStudy& study);

}  // namespace palpate
