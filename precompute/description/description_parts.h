// The parts of model.toml, each read from its table. All throw Error with line and column.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "base/toml_table.h"
#include "precompute/description/description.h"

namespace palpate {

/// The keys of [geometry] that say what it is: one of them is given.
extern const Keys geometry_kinds;
/// Those that lie in the plane. A volume file can be either.
bool is_plane(std::string_view geometry_kind);

/// [geometry]; `kind` is the one of geometry_kinds that it has.
Geometry read_geometry(const TomlTable& geometry, std::string_view kind, const std::filesystem::path& folder);

extern const Keys mesh_keys;
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
extern const Keys overlay_keys;
/// [overlay], for what [storage] keeps.
OverlayRegions read_overlay(const TomlTable& overlay, int dimension, Scope scope, Index layers);
extern const Keys dynamics_keys;
/// [dynamics], for what [storage] keeps.
DynamicsOptions read_dynamics(const TomlTable& dynamics, Scope scope);
/// Every [[load]], possibly none.
std::vector<Load> read_loads(const TomlTable& root, int dimension);

}  // namespace palpate
