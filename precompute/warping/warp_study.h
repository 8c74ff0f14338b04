// How far off small strain and warping are where a body bends.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "precompute/description/description.h"

namespace palpate {

/// Told of the share (0..1) of a study that is done; false to stop it.
using WarpStudyProgress = std::function<bool(double share)>;

/// A study, and why it ended.
struct WarpStudyResult {
  WarpStudy study;
  std::string note;  ///< why it ended before the angle that was asked for; empty: it did not
};

/// Bends the body of `model` (without Green's functions: mesh, materials, held nodes, loads, rest) step by
/// step by a force that turns with the part of the surface that it acts on, as a smooth tool's does, and
/// compares small strain and warping with a corotational body at each step:
///
/// - displacement: the distance between the mean displacements of that part under the same force, of the
///   corotational one;
/// - force: the force that moves the part as far along the first direction, less that of the corotational
/// body, of
///   it; infinite where no force does.
///
/// Nothing where `progress` stops it. Throws Error where the body cannot be bent so.
std::optional<WarpStudyResult> study_warp(const Model& model, const WarpOptions& options,
                                          const WarpStudyProgress& progress);

/// A stored study anew: its nodes, direction and forces, and what comes of them by the body of `model`. Where
/// the body has no balance the levels end.
WarpStudy repeat_warp_study(const Model& model);

/// "forces within 5 % up to 19 degrees by small strain, 90 warped (studied to 90)".
std::string range_text(const WarpStudy& study);

}  // namespace palpate
