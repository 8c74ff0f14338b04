#include "runtime/app/probe.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <span>
#include <string>

#include "base/error.h"
#include "base/json_text.h"
#include "base/program.h"
#include "base/vectors.h"
#include "formats/model_check.h"
#include "runtime/app/probe_field.h"
#include "runtime/body/prescribed_nodes.h"
#include "runtime/loop/loading.h"
#include "runtime/loop/output.h"

namespace palpate {
namespace {

/// Result for one node.
struct Answer {
  Index node = -1;                   // mesh node
  Index stored = -1;                 // stored node
  Vec3 position = Vec3::Zero();      // at rest [m]
  std::optional<double> distance;    // from the requested point [m]
  Vec3 displacement = Vec3::Zero();  // relative to rest [m]
  Vec3 force = Vec3::Zero();         // on the body [N]
};

/// Converts a vector as given to the dimension of the body.
Vec3 vector_of(const std::vector<double>& numbers, const Body& body, const std::string& option,
               const std::string& where) {
  const bool has_z = numbers.size() == 3;
  if (body.dimension() == 3 && !has_z) {
    throw Error(
        fmt::format("{} {} has two numbers and the body is in space", option, fmt::join(numbers, ",")), where,
        "give three numbers, x,y,z in metres");
  }
  if (body.dimension() == 2 && has_z && numbers[2] != 0.0) {
    throw Error(
        fmt::format("{} {} leaves the plane z = 0 that the body is in", option, fmt::join(numbers, ",")),
        where, "give two numbers, x,y in metres");
  }
  return {numbers[0], numbers[1], has_z ? numbers[2] : 0.0};
}

/// Names of the axes whose bits are set: "x and z".
std::string axes_text(unsigned axes) {
  std::vector<std::string> names;
  for (unsigned axis = 0; axis < 3; ++axis) {
    if ((axes >> axis & 1U) != 0) names.emplace_back(1, "xyz"[axis]);
  }
  return fmt::format("{}", fmt::join(names, " and "));
}

/// Returns the stored node of a mesh node.
Index stored_node_of(const Body& body, Index node, const std::string& where) {
  const Model& model = body.model();
  if (node >= static_cast<Index>(model.mesh.nodes.size())) {
    throw Error(
        fmt::format("node {} does not exist: the mesh has nodes 0 to {}", node, model.mesh.nodes.size() - 1),
        where, "give a node of the mesh, or a place with --at");
  }
  const unsigned all_axes = (1U << model.dimension()) - 1U;
  const unsigned held = model.fixed[static_cast<std::size_t>(node)] & all_axes;
  const Index stored = body.stored_node(node);
  if (stored >= 0 && held == 0) return stored;
  if (held == all_axes) {
    throw Error(fmt::format("node {} is fixed and cannot be displaced", node), where,
                "give a node outside the fixed regions");
  }
  if (held != 0) {
    throw Error(fmt::format("node {} is held along {}, and only nodes that are free along every axis can be "
                            "displaced",
                            node, axes_text(held)),
                where, "give a node outside the fixed regions");
  }
  throw Error(fmt::format("node {} is inside the body and its Green's functions were not kept", node), where,
              "give a surface node, or precompute with storage scope \"full\" or more layers");
}

/// Returns the requested nodes and displacements; forces are added later.
std::vector<Answer> read_questions(const Body& body, const ProbeOptions& options) {
  const std::string where = options.file.string();
  std::vector<Answer> answers;
  for (const ProbePlace& place : options.places) {
    Answer answer;
    answer.displacement = vector_of(place.displacement, body, "--displace", where);
    if (place.at) {
      const NearestNode nearest = body.nearest_surface_node(vector_of(*place.at, body, "--at", where));
      answer.stored = nearest.node;
      answer.distance = nearest.distance;
    } else {
      answer.stored = stored_node_of(body, place.node.value(), where);
    }
    answer.node = body.mesh_node(answer.stored);
    answer.position = body.rest_position(answer.stored);
    const bool twice = std::any_of(answers.begin(), answers.end(),
                                   [&](const Answer& other) { return other.stored == answer.stored; });
    if (twice) {
      throw Error(fmt::format("node {} is asked for twice", answer.node), where,
                  "give each node one displacement; places closer than the mesh is fine share a node");
    }
    answers.push_back(answer);
  }
  return answers;
}

/// Returns warnings about likely mistakes, a sentence each.
std::vector<std::string> warnings_of(const Body& body, const std::vector<Answer>& answers) {
  const double edge = body.longest_surface_edge();
  const double size = body.bounds().diagonal().norm();
  std::vector<std::string> warnings;
  for (const Answer& answer : answers) {
    if (answer.distance && *answer.distance > edge) {
      warnings.push_back(fmt::format(
          "the place asked for is {:.3g} m from node {}, the nearest of the surface that is not held, and "
          "the "
          "surface's longest edge is {:.3g} m: check the place, which is in metres, on the body at rest",
          *answer.distance, answer.node, edge));
    }
    const double moved = answer.displacement.norm();
    if (moved > small_strain * size) {
      warnings.push_back(fmt::format(
          "a displacement of {:.3g} m of node {} is more than a tenth of the body's size, {:.3g} m: forces "
          "and "
          "displacements are those of small strain, and not the body's any more; check that it is in metres",
          moved, answer.node, size));
    }
  }
  return warnings;
}

/// Returns a finer mesh over the elements around all requested nodes.
Overlay make_overlay(const Body& body, const std::vector<Answer>& answers, const OverlayOptions& options) {
  if (options.kind != OverlayKind::uniform)
    throw Error("auto and graded go by a tool's radius, and displaced nodes have none", "--overlay",
                "write for instance r=3,rings=2");
  const Model& model = body.model();
  const ElementsAtNodes at(model.mesh);
  std::vector<Index> nodes;
  nodes.reserve(answers.size());
  for (const Answer& answer : answers) nodes.push_back(answer.node);
  return {body,
          make_patch_mesh(model, at, rings_round(model.mesh, at, nodes, options.rings), options.refinement)};
}

void solve(const Body& body, PrescribedNodes& contact, std::vector<Answer>& answers,
           const std::string& where) {
  for (const Answer& answer : answers) {
    if (contact.hold(body, answer.stored) != PrescribedStatus::ok ||
        contact.prescribe(answer.stored, answer.displacement) != PrescribedStatus::ok) {
      throw Error(
          fmt::format("node {} does not move independently of the others in the stored Green's functions",
                      answer.node),
          where, "check the file with palpate-precompute verify");
    }
  }
  if (contact.solve() != PrescribedStatus::ok) {
    throw Error("the forces are too large for a number", where, "give displacements in metres");
  }
  for (std::size_t k = 0; k < answers.size(); ++k)
    answers[k].force = vector_at(contact.forces(), contact.dimension(), static_cast<Index>(k));
}

Vec3 total_force(const std::vector<Answer>& answers) {
  Vec3 sum = Vec3::Zero();
  for (const Answer& answer : answers) sum += answer.force;
  return sum;
}

std::string text_vector(const Vec3& v) {
  return fmt::format("({:.10g}, {:.10g}, {:.10g})", v.x(), v.y(), v.z());
}

void print_text(const std::vector<Answer>& answers) {
  for (const Answer& answer : answers) {
    say(stdout, "node {} at {} m", answer.node, text_vector(answer.position));
    if (answer.distance) say(stdout, ", {:.4g} m from the point asked for", *answer.distance);
    say(stdout, "\n  displacement      {} m\n", text_vector(answer.displacement));
    say(stdout, "  force on the body {} N, {:.10g} N in all\n", text_vector(answer.force),
        answer.force.stableNorm());
  }
  say(stdout, "total force on the body {} N\n", text_vector(total_force(answers)));
}

nlohmann::ordered_json json_vector(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

void print_json(const std::vector<Answer>& answers, const std::vector<std::string>& warnings,
                const ProbeOptions& options) {
  auto nodes = nlohmann::ordered_json::array();
  for (const Answer& answer : answers) {
    nlohmann::ordered_json node = {{"node", answer.node}, {"position", json_vector(answer.position)}};
    if (answer.distance) node["distance"] = *answer.distance;
    node["displacement"] = json_vector(answer.displacement);
    node["force"] = json_vector(answer.force);
    nodes.push_back(std::move(node));
  }
  const nlohmann::ordered_json json = {{"file", options.file.string()},
                                       {"nodes", nodes},
                                       {"total_force", json_vector(total_force(answers))},
                                       {"warnings", warnings}};
  std::fputs(json_text(json, 2).c_str(), stdout);
}

}  // namespace

int probe(const ProbeOptions& options) {
  const std::string extension = options.field.extension().string();
  if (!options.field.empty() && extension != ".csv" && extension != ".vtu") {
    throw Error("is neither a .csv nor a .vtu file", options.field.string(),
                "name the field by what it should be, e.g. out.vtu");
  }
  OutputPaths paths(options.force);
  paths.add_input(options.file, "the model");
  if (!options.model_toml.empty()) paths.add_input(options.model_toml, "the model's description");
  const std::filesystem::path field =
      options.field.empty()
          ? options.field
          : paths.add(options.field, extension == ".csv" ? OutputKind::field : OutputKind::grid, "--field");
  const Body body = load_body(options.file, options.model_toml);
  add_sources(paths, body.model(), options.file);
  std::vector<Answer> answers = read_questions(body, options);
  const std::vector<std::string> warnings = warnings_of(body, answers);
  for (const std::string& warning : warnings) print_warning(warning);
  std::optional<Overlay> overlay;
  if (options.overlay) overlay.emplace(make_overlay(body, answers, *options.overlay));
  PrescribedNodes contact(body, static_cast<Index>(options.places.size()), overlay ? &*overlay : nullptr);
  solve(body, contact, answers, options.file.string());

  if (!options.field.empty()) {
    std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
    contact.displace(body, u);
    std::vector<double> force(u.size());
    for (const Answer& answer : answers) set_vector(force, body.dimension(), answer.stored, answer.force);
    write_field(field, body, overlay ? &*overlay : nullptr, u, force);
  }
  if (options.json) {
    print_json(answers, warnings, options);
  } else {
    print_text(answers);
  }
  return exit_ok;
}

}  // namespace palpate
