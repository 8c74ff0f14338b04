// The system that a bake solves: the meshed body and its K.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "formats/model.h"
#include "meshes/surface.h"
#include "precompute/bake_run.h"
#include "precompute/numerics/assembly.h"
#include "precompute/numerics/factor.h"
#include "precompute/numerics/greens_solver.h"

namespace palpate {

/// A body before anything is solved.
struct MeshedModel {
  Model model;  ///< all but Green's functions, probes and the rest state
  Surface surface;
  std::vector<Vec3> loads;       ///< [N] [N]
  std::vector<Vec3> prescribed;  ///< [N] displacement along held axes [m]
  std::string warning;           ///< probable mistake; empty: none
};

/// Meshes the description's body and says what a person should know of it. Throws Error for bad input.
MeshedModel mesh_model(const BakeRun& run);

/// Stored nodes in the order of a file: the mesh node of each, and the dof of K of each of their dofs, -1 if
/// held.
struct StoredNumbering {
  std::vector<Index> nodes;
  std::vector<std::int64_t> dofs;
};

/// K of a meshed body, ordered but not factorised. Members refer to each other and to `meshed`.
struct AssembledBody {
  AssembledBody(const BakeRun& run, const MeshedModel& meshed);

  StiffnessInput elastic;
  Stiffness stiffness;
  std::unique_ptr<Factor> factor;
  std::vector<std::uint8_t> stored;  ///< [n] whether a dof of K is
  GreensSolver solver;

  /// Stored nodes in the order of the columns, which the factor determines.
  [[nodiscard]] StoredNumbering numbering() const;
};

}  // namespace palpate
