// Readers of the tables of model.toml. All throw Error with line and column.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "base/toml_table.h"
#include "precompute/description/description.h"

namespace palpate {

/// True if a geometry is plane. A volume file may be either.
bool is_plane(std::string_view geometry_kind);

/// Reads [geometry]; `kind` is the alternative that it has.
Geometry read_geometry(const TomlTable& geometry, std::string_view kind, const std::filesystem::path& folder);

/// Kinds of elements that a kind of geometry can have, the default first; a volume has those of its file.
Keys elements_of(std::string_view geometry_kind);
/// Meshers for a kind of geometry, the default first.
Keys meshers_of(std::string_view geometry_kind);
/// Keys of [mesh] that apply to a kind of geometry; `mesher` is empty if there is no choice.
Keys mesh_keys_of(std::string_view geometry_kind, std::string_view mesher);
/// Reads [mesh] for a kind of geometry.
MeshOptions read_mesh_options(const TomlTable& mesh, std::string_view geometry_kind);

/// Reads `dimension` numbers, other components 0.
Vec3 read_vector(const TomlTable& table, std::string_view key, int dimension);

extern const Keys selection_kinds;
/// Reads the selection that an entry gives under `kind`.
Selection read_selection(const TomlTable& entry, std::string_view kind, int dimension);

/// Reads [material] or all of [[material]].
std::vector<MaterialPart> read_materials(const TomlTable& root, int dimension);
/// Reads all of [[fixed]], at least one.
std::vector<Fixing> read_fixed(const TomlTable& root, int dimension);
/// Reads [overlay], for the scope of [storage].
OverlayRegions read_overlay(const TomlTable& overlay, int dimension, Scope scope, Index layers);
/// Reads [dynamics], for the scope of [storage].
DynamicsOptions read_dynamics(const TomlTable& dynamics, Scope scope);
/// Reads all of [[load]], possibly none.
std::vector<Load> read_loads(const TomlTable& root, int dimension);

}  // namespace palpate
