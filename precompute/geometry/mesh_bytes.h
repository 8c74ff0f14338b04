// Meshes on their way from a child process.
#pragma once

#include "base/child_process.h"
#include "meshes/mesh.h"

namespace palpate {

/// A mesh as bytes, for unpack_mesh.
Bytes pack(const Mesh& mesh);

/// The mesh that `pack` has made bytes of. Throws Error for bytes that are none.
Mesh unpack_mesh(const Bytes& bytes);

}  // namespace palpate
