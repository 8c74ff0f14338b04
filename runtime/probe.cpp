#include "runtime/probe.h"

#include <fmt/core.h>

#include <algorithm>
#include <span>
#include <string>

#include "meshes/error.h"
#include "meshes/vtu_writer.h"
#include "runtime/loading.h"
#include "runtime/output.h"
#include "runtime/step.h"

namespace palpate {
namespace {

/// What is told of one node.
struct Answer {
  Index node;                      // of the mesh
  Vec3 position;                   // undeformed [m]
  std::optional<double> distance;  // from the point asked for [m]
  Vec3 displacement;               // [m]
  Vec3 force;                      // on the body [N]
};

/// The stored node that is meant by a node of the mesh.
Index stored_node_of(const Body& body, Index node, const std::string& where) {
  const Model& model = body.model();
  if (node >= static_cast<Index>(model.mesh.nodes.size())) {
    throw Error(
        fmt::format("node {} does not exist: the mesh has nodes 0 to {}", node, model.mesh.nodes.size() - 1),
        where, "give a node of the mesh, or a place with --at");
  }
  const Index stored = body.stored_node(node);
  if (stored >= 0) return stored;
  if (model.fixed[static_cast<std::size_t>(node)] != 0) {
    throw Error(fmt::format("node {} is fixed and cannot be displaced", node), where,
                "give a node outside the fixed regions");
  }
  throw Error(fmt::format("node {} is inside the body and its Green's functions were not kept", node), where,
              "give a surface node, or precompute with storage scope \"full\" or more layers");
}

std::vector<Answer> ask(const Body& body, State& state, const ProbeOptions& options) {
  const std::string where = options.file.string();
  std::vector<Answer> answers;
  for (const ProbePlace& place : options.places) {
    std::optional<double> distance;
    Index stored = -1;
    if (place.at) {
      const NearestNode nearest = body.nearest_surface_node(*place.at);
      stored = nearest.node;
      distance = nearest.distance;
    } else {
      stored = stored_node_of(body, place.node.value(), where);
    }
    const Index node = body.mesh_node(stored);
    if (held_position(state, stored) >= 0) {
      throw Error(fmt::format("node {} is asked for twice", node), where,
                  "give each node one displacement; places closer than the mesh is fine share a node");
    }
    if (hold(body, state, stored) != StepStatus::ok ||
        prescribe(state, stored, place.displacement) != StepStatus::ok) {
      throw Error(
          fmt::format("node {} does not move independently of the others in the stored Green's functions",
                      node),
          where, "check the file with palpate-precompute verify");
    }
    answers.push_back({node, body.position(stored), distance, place.displacement, Vec3::Zero()});
  }
  if (solve(state) != StepStatus::ok) {
    throw Error("the forces are too large for a number", where, "give displacements in metres");
  }
  for (std::size_t k = 0; k < answers.size(); ++k)
    answers[k].force = Eigen::Map<const Vec3>(state.forces().data() + 3 * k);
  return answers;
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
    fmt::print("node {} at {} m", answer.node, text_vector(answer.position));
    if (answer.distance) fmt::print(", {:.4g} m from the point asked for", *answer.distance);
    fmt::print("\n  displacement      {} m\n", text_vector(answer.displacement));
    fmt::print("  force on the body {} N, {:.10g} N in all\n", text_vector(answer.force),
               answer.force.stableNorm());
  }
  fmt::print("total force on the body {} N\n", text_vector(total_force(answers)));
}

void print_json(const std::vector<Answer>& answers, const ProbeOptions& options) {
  fmt::print("{{\n  \"file\": {},\n  \"nodes\": [", json_string(options.file.string()));
  for (std::size_t k = 0; k < answers.size(); ++k) {
    const Answer& answer = answers[k];
    fmt::print("{}\n    {{\"node\": {}, \"position\": {}, ", k == 0 ? "" : ",", answer.node,
               json_vector(answer.position));
    if (answer.distance) fmt::print("\"distance\": {}, ", *answer.distance);
    fmt::print("\"displacement\": {}, \"force\": {}}}", json_vector(answer.displacement),
               json_vector(answer.force));
  }
  fmt::print("\n  ],\n  \"total_force\": {}\n}}\n", json_vector(total_force(answers)));
}

void write_csv(const std::filesystem::path& file, const Body& body, std::span<const double> u) {
  std::string csv = "node,x,y,z,ux,uy,uz\n";
  for (Index stored = 0; stored < body.greens().nodes(); ++stored) {
    const Vec3& x = body.position(stored);
    const double* v = u.data() + 3 * std::ptrdiff_t{stored};
    csv +=
        fmt::format("{},{},{},{},{},{},{}\n", body.mesh_node(stored), x.x(), x.y(), x.z(), v[0], v[1], v[2]);
  }
  write_text_file(file, csv);
}

/// The whole mesh where all of it was stored, else its surface. Nodes that are not stored there are fixed:
/// they do not move.
void write_grid(const std::filesystem::path& file, const Body& body, std::span<const double> u) {
  const Model& model = body.model();
  const bool full = model.scope == Scope::full;
  std::vector<bool> shown(model.mesh.nodes.size(), full);
  for (const Triangle& triangle : model.surface_triangles) {
    for (const Index node : triangle) shown[static_cast<std::size_t>(node)] = true;
  }

  std::vector<Index> number(model.mesh.nodes.size(), -1);
  std::vector<Vec3> nodes;
  std::vector<double> displacement;
  for (std::size_t node = 0; node < shown.size(); ++node) {
    if (!shown[node]) continue;
    number[node] = static_cast<Index>(nodes.size());
    nodes.push_back(model.mesh.nodes[node]);
    const Index stored = body.stored_node(static_cast<Index>(node));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      displacement.push_back(stored < 0 ? 0.0 : u[3 * static_cast<std::size_t>(stored) + axis]);
    }
  }
  std::vector<Triangle> triangles;
  if (!full) triangles = model.surface_triangles;
  for (Triangle& triangle : triangles) {
    for (Index& node : triangle) node = number[static_cast<std::size_t>(node)];
  }
  const NodalField field{"displacement", 3, displacement};
  write_vtu(file, nodes, full ? std::span<const Tet>(model.mesh.tets) : std::span<const Tet>(), triangles,
            {&field, 1});
}

}  // namespace

int probe(const ProbeOptions& options) {
  const std::string extension = options.field.extension().string();
  if (!options.field.empty() && extension != ".csv" && extension != ".vtu") {
    throw Error("is neither a .csv nor a .vtu file", options.field.string(),
                "name the field by what it should be, e.g. out.vtu");
  }
  const Body body = load_body(options.file, options.model_toml);
  State state({.max_nodes = static_cast<Index>(options.places.size())});
  const std::vector<Answer> answers = ask(body, state, options);

  if (!options.field.empty()) {
    std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
    surface_displacement(body, state, u);
    if (extension == ".csv") {
      write_csv(options.field, body, u);
    } else {
      write_grid(options.field, body, u);
    }
  }
  if (options.json) {
    print_json(answers, options);
  } else {
    print_text(answers);
  }
  return exit_ok;
}

}  // namespace palpate
