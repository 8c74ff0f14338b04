#include <algorithm>

#include "precompute/description/description_keys.h"
#include "precompute/description/description_parts.h"

namespace palpate {
namespace {

bool holds(const Keys& keys, std::string_view key) {
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

void check_keys(const TomlTable& mesh, std::string_view kind, std::string_view mesher) {
  const Keys keys = mesh_keys_of(kind, mesher);
  for (const std::string_view key : keys_of("[mesh]")) {
    if (!mesh.has(key) || holds(keys, key)) {
      continue;
    }
    std::string what = mesh.name_of(key) + " does not apply to geometry of kind " + std::string(kind);
    std::string hint = "remove it; what applies is " + comma_list(keys);
    for (const std::string_view other : meshers_of(kind)) {
      if (other != mesher && holds(mesh_keys_of(kind, other), key)) {
        what += " with mesher \"" + std::string(mesher) + "\"";
        hint = "remove it, or set mesher = \"" + std::string(other) + "\"";
      }
    }
    mesh.fail(key, what, hint);
  }
}

ElementType element_named(std::string_view name) {
  return std::find_if(element_traits.begin(), element_traits.end(),
                      [&](const ElementTraits& element) { return element.name == name; })
      ->type;
}

void read_optimize(const TomlTable& mesh, std::string_view kind, MeshOptions& options) {
  const bool plane = is_plane(kind);
  options.perturb = options.exude = !plane;
  if (!mesh.has("optimize")) {
    return;
  }
  const std::vector<std::string> steps =
      mesh.choices("optimize", plane ? Keys{"lloyd"} : Keys{"odt", "lloyd", "perturb", "exude"});
  const auto asked = [&](const char* step) {
    return std::find(steps.begin(), steps.end(), step) != steps.end();
  };
  options.odt = asked("odt");
  options.lloyd = asked("lloyd");
  options.perturb = asked("perturb");
  options.exude = asked("exude");
  if (options.odt && options.lloyd) {
    mesh.fail("optimize", "[mesh] optimize holds both \"odt\" and \"lloyd\"", "keep one of them");
  }
}

}  // namespace

Keys elements_of(std::string_view kind) {
  if (kind == "volume") {
    return {"tri3", "quad4", "tet4", "tet4a", "tet10", "hex8"};
  }
  if (kind == "box") {
    return {"tet4a", "tet4", "tet10", "hex8"};
  }
  if (kind == "rectangle") {
    return {"quad4", "tri3"};
  }
  return is_plane(kind) ? Keys{"tri3"} : Keys{"tet4a", "tet4", "tet10"};
}

Keys meshers_of(std::string_view kind) {
  if (kind == "surface") {
    return {"tetgen", "cgal"};
  }
  return kind == "image" ? Keys{"cgal", "tetgen"} : Keys{};
}

Keys mesh_keys_of(std::string_view kind, std::string_view mesher) {
  Keys keys = {"element"};
  if (kind == "polygon" || kind == "picture") {
    keys.insert(keys.end(), {"edge_length", "grading", "optimize"});
  }
  if (kind == "surface" || kind == "image") {
    keys.insert(keys.end(), {"mesher", "edge_length", "grading", "radius_edge"});
    keys.push_back(mesher == "tetgen" ? "min_dihedral" : "optimize");
  }
  if (kind == "surface") {
    keys.push_back(mesher == "tetgen" ? "remesh" : "feature_angle");
  }
  if (kind == "image" || mesher == "cgal") {
    keys.push_back("facet_distance");
  }
  return keys;
}

MeshOptions read_mesh_options(const TomlTable& mesh, std::string_view kind) {
  const Keys meshers = meshers_of(kind);
  std::string mesher = meshers.empty() ? "" : std::string(meshers[0]);
  if (!meshers.empty() && mesh.has("mesher")) {
    mesher = mesh.choice("mesher", meshers);
  }
  check_keys(mesh, kind, mesher);

  MeshOptions options;
  options.mesher = mesher == "cgal" ? Mesher::cgal : Mesher::tetgen;
  options.mesher_chosen = mesh.has("mesher");
  if (mesh.has("element")) {
    const std::string name = mesh.text("element");
    if (!holds(elements_of(kind), name)) {
      mesh.fail("element",
                "[mesh] element \"" + shortened(name) + "\" is not for geometry of kind " + std::string(kind),
                "use " + quoted_choice(elements_of(kind)));
    }
    options.element = element_named(name);
  } else if (kind != "volume") {
    options.element = element_named(elements_of(kind).front());
  }
  options.remesh = mesh.boolean("remesh", options.remesh);
  if (mesh.has("edge_length")) {
    options.edge_length = mesh.positive("edge_length");
  } else if (options.remesh || kind == "image" || kind == "polygon" || kind == "picture") {
    mesh.fail("remesh", "[mesh] has no edge_length",
              "give the edge length wanted at the boundary, in metres");
  }
  if (mesh.has("facet_distance")) {
    options.facet_distance = mesh.positive("facet_distance");
  }
  options.grading = mesh.within("grading", 0.0, 10.0, options.grading);
  options.radius_edge = mesh.within("radius_edge", 1.0, 100.0, options.radius_edge);
  options.min_dihedral = mesh.within("min_dihedral", 0.0, 20.0, options.min_dihedral);
  options.feature_angle = mesh.within("feature_angle", 0.0, 180.0, options.feature_angle);
  read_optimize(mesh, kind, options);
  return options;
}

}  // namespace palpate
