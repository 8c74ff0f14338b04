// The parts of model.toml, each read from its table. All throw Error with line and column.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "base/toml_table.h"
#include "precompute/description/description.h"

namespace palpate {

/// Whether a geometry lies in the plane. A volume file can be either.
bool is_plane(std::string_view geometry_kind);

/// [geometry]; `kind` is the one that it has of its alternatives.
Geometry read_geometry(const TomlTable& geometry, std::string_view kind, const std::filesystem::path& folder);

/// Elements that a kind of geometry can be made of, the usual one first; a volume has what is in its file.
Keys elements_of(std::string_view geometry_kind);
/// Meshers that a kind of geometry can choose from, the usual one first.
Keys meshers_of(std::string_view geometry_kind);
/// The keys of [mesh] that mean something for a kind of geometry; `mesher` is empty where there is no choice.
Keys mesh_keys_of(std::string_view geometry_kind, std::string_view mesher);
/// [mesh], for a kind of geometry.
MeshOptions read_mesh_options(const TomlTable& mesh, std::string_view geometry_kind);

/// `dimension` numbers, the others 0.
Vec3 read_vector(const TomlTable& table, std::string_view key, int dimension);

extern const Keys selection_kinds;
/// The selection that an entry gives under `kind`.
Selection read_selection(const TomlTable& entry, std::string_view kind, int dimension);

/// [material] or every [[material]].
std::vector<MaterialPart> read_materials(const TomlTable& root, int dimension);
/// Every [[fixed]]: at least one.
std::vector<Fixing> read_fixed(const TomlTable& root, int dimension);
/// [overlay], for what [storage] keeps.
OverlayRegions read_overlay(const TomlTable& overlay, int dimension, Scope scope, Index layers);
/// [dynamics], for what [storage] keeps.
DynamicsOptions read_dynamics(const TomlTable& dynamics, Scope scope);
/// [warp], a table of `keys_of("[warp]")` and the kinds of selections.
WarpOptions read_warp(const TomlTable& warp, int dimension);
/// The keys of a table and those of selections.
Keys with_selections(Keys keys);
/// Every [[load]], possibly none.
std::vector<Load> read_loads(const TomlTable& root, int dimension);

}  // namespace palpate
