#include "precompute/description/description_keys.h"

#include <fmt/format.h>

#include <algorithm>

#include "precompute/description/description.h"

namespace palpate {
namespace {

constexpr bool alternative = true;

KeyTable top_level() {
  return {
      "",
      {{"name", "", "required", "name of the model; the baked file is `NAME.palpate.hdf`"},
       {"plane", "", "in space",
        "required for bodies in the plane: `\"stress\"` (a thin sheet) or `\"strain\"` (a slice of a long "
        "body)"},
       {"thickness", "m", shown(Description{}.thickness), "bodies in the plane: extent across the plane"},
       {"geometry", "", "required", "table: the shape"},
       {"mesh", "", "defaults", "table: how the inside is filled"},
       {"material", "", "required", "table or list of tables: what it is made of"},
       {"fixed", "", "required", "list of tables: where it is held"},
       {"load", "", "none", "list of tables: forces that act all the time"},
       {"storage", "", "defaults", "table: what is kept in the file, and how precisely"},
       {"overlay", "", "none", "table: overlays that are condensed offline"},
       {"dynamics", "", "none", "table: free vibration of a body that was let go"}}};
}

KeyTable geometry() {
  return {
      "[geometry]",
      {{"surface", "", "", "closed triangle surface: a file .off, .obj, .stl (ASCII or binary) or .ply",
        alternative},
       {"image", "", "",
        "labelled image: a file .inr, .nii, one of these with .gz, or .nrrd, with one label per voxel",
        alternative},
       {"volume", "", "",
        "mesh of one kind of element, in space or in the plane: a file .msh (Gmsh 2.2 or 4.1, ASCII), "
        ".mesh (Medit), .node/.ele (TetGen) or .vtk (legacy ASCII)",
        alternative},
       {"box", "file units", "", "table; six tetrahedra or one hexahedron per cell", alternative},
       {"cylinder", "file units", "", "table; along z from 0", alternative},
       {"sphere", "file units", "", "table; about the origin", alternative},
       {"rectangle", "file units", "", "table; plane bodies", alternative},
       {"polygon", "file units", "", "table; plane bodies", alternative},
       {"picture", "pixels", "",
        "plane bodies: a file .png or .pbm; every pixel that is not black is body, the lower left corner "
        "of the picture is the origin",
        alternative},
       {"labels", "", "all but 0", "`image` only: list of the labels that are body"},
       {"range", "", "none",
        "`image` only: `[LOW, HIGH]`, the values that are body, for a grey image (CT, MR) instead of labels"},
       {"dark", "", "false", "`picture` only: what is black is body, as in a drawing on white paper"},
       {"scale", "m", shown(Description{}.scale),
        "metres per unit of the geometry: 0.001 for millimetres; for a picture, metres per pixel"}}};
}

// Tables of shapes.

KeyTable box() {
  return {"[geometry] box",
          {{"origin", "file units", "[0, 0, 0]", "corner with the smallest coordinates"},
           {"size", "file units", "required", "`[x, y, z]`"},
           {"cells", "", "required", "`[nx, ny, nz]`"}}};
}
KeyTable rectangle() {
  return {"[geometry] rectangle",
          {{"origin", "file units", "[0, 0]", "corner with the smallest coordinates"},
           {"size", "file units", "required", "`[x, y]`"},
           {"cells", "", "required", "`[nx, ny]`"}}};
}
KeyTable cylinder() {
  return {"[geometry] cylinder",
          {{"radius", "file units", "required", "> 0"},
           {"height", "file units", "required", "> 0"},
           {"cells_across", "", "required", "cells across the diameter, an even number"},
           {"cells_along", "", "required", "cells along z"}}};
}
KeyTable sphere() {
  return {"[geometry] sphere",
          {{"radius", "file units", "required", "> 0"},
           {"cells_across", "", "required", "cells across the diameter, an even number"}}};
}
KeyTable polygon() {
  return {"[geometry] polygon",
          {{"points", "file units", "required", "outline `[[x, y], ...]`, clockwise or counter-clockwise"},
           {"holes", "file units", "none", "list of outlines `[[[x, y], ...], ...]`"}}};
}

KeyTable mesh() {
  const MeshOptions usual;
  return {
      "[mesh]",
      {{"element", "", "the first in the table above", "kind of all elements; edges of `tet10` are straight"},
       {"mesher", "", "the first in the table above", "what fills the inside"},
       {"edge_length", "m", "required; `surface`: as the file has it",
        "target edge length at the boundary. Only a `surface` without `remesh` can leave it out; there "
        "TetGen "
        "keeps the file's boundary and the length is that of the inside"},
       {"remesh", "", "false",
        "remesh the surface to `edge_length` first; edges sharper than 60° are kept. Where the remeshed "
        "surface intersects itself, CGAL meshes the body instead (unless `mesher` is given), with a note"},
       {"grading", "", shown(usual.grading),
        "growth of the target edge length per length below the boundary, from 0 (uniform) to 10"},
       {"radius_edge", "", shown(usual.radius_edge),
        "bound on circumradius / shortest edge of a tetrahedron, from 1 to 100"},
       {"min_dihedral", "degree", shown(usual.min_dihedral),
        "bound on dihedral angles, from 0 to 20, where the boundary permits it"},
       {"facet_distance", "m", "`image`: largest side of a voxel; `surface`: `edge_length` / 20",
        "how far the mesh's boundary may be from that of the geometry"},
       {"feature_angle", "degree", shown(usual.feature_angle),
        "edges at which faces turn by more are kept, from 0 to 180 (none)"},
       {"optimize", "", "`[\"perturb\", \"exude\"]`; in the plane `[]`",
        "steps after refinement, exactly those listed: one of `\"odt\"` and `\"lloyd\"` (move all nodes), "
        "`\"perturb\"` and `\"exude\"` (remove slivers); in the plane only `\"lloyd\"`"}}};
}

/// Keys for the application of a material's constants.
KeyTable material() {
  return {
      "[material]",
      {{"regions", "", "",
        "elements with these labels of the image, or in these regions of the mesh file, by number or by name",
        alternative},
       {"box", "m", "", "elements whose centroid is inside", alternative},
       {"half_space", "m", "", "elements whose centroid is inside", alternative},
       {"sphere", "m", "", "elements whose centroid is inside", alternative},
       {"lowest", "", "", "elements whose centroid is inside", alternative}}};
}

KeyTable selection() {
  return {
      selection_title,
      {{"box", "m", "", "`{min = [x, y, z], max = [x, y, z]}`: nodes inside", alternative},
       {"half_space", "m", "",
        "`{point = [x, y, z], normal = [x, y, z]}`: nodes with (x − point) · normal ≥ 0", alternative},
       {"sphere", "m", "", "`{center = [x, y, z], radius = r}`: nodes inside", alternative},
       {"nodes", "", "",
        "list of node numbers, from 0; with them count the middles of the edges between them", alternative},
       {"tag", "", "", "nodes of the boundary facets with this tag in the volume mesh", alternative},
       {"lowest", "", "",
        "`{axis = \"x\", \"y\" or \"z\", percent = p}`: nodes in the lowest p per cent of the body's extent "
        "along the axis",
        alternative}}};
}

// Tables of selections.

KeyTable select_box() {
  return {"selection box", {{"min", "m", "required", ""}, {"max", "m", "required", ""}}};
}
KeyTable select_half_space() {
  return {"selection half_space", {{"point", "m", "required", ""}, {"normal", "", "required", ""}}};
}
KeyTable select_sphere() {
  return {"selection sphere", {{"center", "m", "required", ""}, {"radius", "m", "required", ""}}};
}
KeyTable select_lowest() {
  return {"selection lowest", {{"axis", "", "required", ""}, {"percent", "%", "required", ""}}};
}

KeyTable fixed() {
  return {
      "[[fixed]]",
      {{"axes", "", "all", "axes along which the nodes are held, such as `\"z\"` or `\"xy\"`"},
       {"displacement", "m", "0",
        "where the nodes are held, relative to their place in the mesh; 0 along axes that are not held"}}};
}

KeyTable load() {
  return {"[[load]]",
          {{"nodal_force", "N", "", "force on each selected node", alternative},
           {"traction", "N/m²", "",
            "force per area on the boundary facets that have the tag, or all of whose nodes are selected; in "
            "the plane it acts over the thickness",
            alternative},
           {"gravity", "m/s²", "",
            "acceleration of the whole body, multiplied by the density of each material; takes no selection",
            alternative}}};
}

KeyTable storage() {
  return {
      "[storage]",
      {{"scope", "", "`\"layers\"`; in the plane `\"full\"`",
        "nodes whose Green's functions are kept: `\"surface\"`, `\"layers\"` (the surface and what is close "
        "below) or `\"full\"`; `\"none\"`: no Green's functions, for `play --solver`, where `[[fixed]]` "
        "may be missing"},
       {"layers", "", shown(Description{}.layers), "scope `\"layers\"`: how many elements deep"},
       {"precision", "", "`\"auto\"`", "`\"auto\"`, `\"single\"`, `\"split\"` or `\"double\"`"},
       {"compression", "", "`\"auto\"`",
        "`\"none\"`: every entry; `\"h2\"`: in nested low-rank form; `\"auto\"`: that from 5 000 stored "
        "nodes on, where neither precision nor packed dynamics are asked for and the tolerance can be kept"},
       {"tolerance", "", shown(Description{}.tolerance),
        "compressed: largest relative error that forces may have, 1e-4 to 1"}}};
}

KeyTable overlay() {
  const OverlayRegions usual;
  return {
      "[overlay]",
      {{"refinement", "", shown(usual.refinement),
        fmt::format("each element is cut into this number to the power of the dimension, from {} to {}",
                    least_refinement, most_refinement)},
       {"rings", "", shown(usual.rings),
        fmt::format("rings of elements around the touched node, from 1 to {}, and at most as many as "
                    "`[storage]` keeps `layers`",
                    most_rings)},
       {"region", "", "required",
        "list of tables `[[overlay.region]]`, each with one selection: every surface node inside that can "
        "move gets an overlay of its own"}}};
}

KeyTable dynamics() {
  const Newmark usual;
  return {
      "[dynamics]",
      {{"method", "", "`\"auto\"`",
        "`\"packed\"`: all dofs, by the inverse of K̄ = K + a₀ M + a₁ C_d; exact, needs scope `\"full\"`. "
        "`\"modal\"`: the lowest modes, any scope. `\"auto\"`: packed where the scope is full and the "
        "inverse "
        "can be read once per time step at 10 GB/s, else modal"},
       {"time_step", "s", shown(usual.time_step), "Δt of a step, > 0"},
       {"alpha", "", shown(usual.alpha), "Newmark's α ≥ (δ + 1/2)²/4, which is stable for any Δt"},
       {"delta", "", shown(usual.delta),
        "Newmark's δ ≥ 1/2; 1/2 adds no numerical damping, more damps what is fast against the time step"},
       {"mass", "", "`\"consistent\"`",
        "`\"consistent\"` or `\"lumped\"` (diagonal; the mass of each element is kept)"},
       {"damping", "", "none", "table: C_d = a M + b K"},
       {"modes", "", "100, or all where there are fewer",
        "`\"modal\"`: how many, at most the number of free dofs; more than a third of them only up to 2 000 "
        "free dofs"}}};
}

KeyTable damping() {
  return {"[dynamics] damping",
          {{"mass", "1/s", "0", "a ≥ 0"},
           {"stiffness", "s", "0", "b ≥ 0"},
           {"ratios", "", "", "instead of these: damping ratios (1 is critical) `[z1, z2]` ..."},
           {"frequencies", "Hz", "", "... at two frequencies `[f1, f2]`, from which a, b ≥ 0 must follow"}}};
}

const KeyTable& table_of(std::string_view title) {
  return *std::ranges::find(key_tables(), title, &KeyTable::title);
}

}  // namespace

const std::vector<KeyTable>& key_tables() {
  static const std::vector<KeyTable> tables = {
      top_level(),  geometry(),          box(),           cylinder(),      sphere(),
      rectangle(),  polygon(),           mesh(),          material(),      selection(),
      select_box(), select_half_space(), select_sphere(), select_lowest(), fixed(),
      load(),       storage(),           overlay(),       dynamics(),      damping()};
  return tables;
}

Keys keys_of(std::string_view title) {
  Keys keys;
  for (const ModelKey& key : table_of(title).keys) keys.push_back(key.key);
  return keys;
}

Keys alternatives_of(std::string_view title) {
  Keys keys;
  for (const ModelKey& key : table_of(title).keys)
    if (key.is_alternative) keys.push_back(key.key);
  return keys;
}

}  // namespace palpate
