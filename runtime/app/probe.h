// palpate-runtime probe: one question, one answer.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "meshes/mesh.h"
#include "runtime/body/patch_maker.h"

namespace palpate {

/// A node and the displacement prescribed there. Vectors are as they were written, with two numbers or three.
struct ProbePlace {
  std::optional<std::vector<double>> at;  ///< [m]: the free surface node that rests nearest is meant
  std::optional<Index> node;              ///< mesh node; exactly one of the two is given
  std::vector<double> displacement;       ///< [m] relative to rest
};

struct ProbeOptions {
  std::filesystem::path file;        ///< baked model
  std::filesystem::path model_toml;  ///< that it must have been made from; empty: not asked
  std::vector<ProbePlace> places;
  std::optional<OverlayOptions> overlay;  ///< round the nodes that are displaced; none: the body's own mesh
  bool json = false;
  std::filesystem::path field;  ///< .csv or .vtu for the whole displacement, at rest and by the probe, the
                                ///< overlay's too; empty: none
  bool force = false;           ///< `field` may take the place of any file that is not read
};

/// Prints the forces that hold the nodes displaced, and writes the field. Returns the exit code; throws
/// Error, also for vectors that have not as many numbers as the body has dimensions.
int probe(const ProbeOptions& options);

}  // namespace palpate
