// palpate-runtime probe: response of a body to prescribed displacements.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "meshes/mesh.h"
#include "runtime/body/patch_maker.h"

namespace palpate {

/// Node and the displacement prescribed there. Vectors are as given, with two or three numbers.
struct ProbePlace {
  std::optional<std::vector<double>> at;  ///< [m]: stands for the nearest free surface node at rest
  std::optional<Index> node;              ///< mesh node; exactly one of the two is given
  std::vector<double> displacement;       ///< [m] relative to rest
};

struct ProbeOptions {
  std::filesystem::path file;        ///< baked model
  std::filesystem::path model_toml;  ///< description that it must have been made from; empty: not checked
  std::vector<ProbePlace> places;
  std::optional<OverlayOptions> overlay;  ///< around the displaced nodes; empty: the body's own mesh
  bool json = false;
  std::filesystem::path field;  ///< .csv or .vtu for the complete displacement, at rest and by the probe,
                                ///< including the overlay's; empty: none
  bool force = false;           ///< `field` may replace any file that is not an input
};

/// Prints the forces that hold the displaced nodes, and writes the field. Returns the exit code; throws
/// Error, also if a vector does not have the dimension of the body.
int probe(const ProbeOptions& options);

}  // namespace palpate
