// palpate-runtime probe: one question, one answer.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "meshes/mesh.h"

namespace palpate {

/// A node and the displacement prescribed there.
struct ProbePlace {
  std::optional<Vec3> at;            ///< [m]: the nearest free surface node is meant
  std::optional<Index> node;         ///< mesh node; exactly one of the two is given
  Vec3 displacement = Vec3::Zero();  ///< [m]
};

struct ProbeOptions {
  std::filesystem::path file;        ///< baked model
  std::filesystem::path model_toml;  ///< that it must have been made from; empty: not asked
  std::vector<ProbePlace> places;
  bool json = false;
  std::filesystem::path field;  ///< .csv or .vtu for the whole displacement; empty: none
};

/// Prints the forces that hold the nodes displaced, and writes the field. Returns the exit code; throws
/// Error.
int probe(const ProbeOptions& options);

}  // namespace palpate
