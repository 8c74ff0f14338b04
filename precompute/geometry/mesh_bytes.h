// Meshes sent by a child process.
#pragma once

#include "base/child_process.h"
#include "meshes/mesh.h"

namespace palpate {

/// A mesh as bytes, for unpack_mesh.
Bytes pack(const Mesh& mesh);

/// Mesh from bytes made by `pack`. Throws Error for other bytes.
Mesh unpack_mesh(const Bytes& bytes);

}  // namespace palpate
