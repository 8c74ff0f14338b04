#include "precompute/assembled_body.h"

#include <cblas.h>

#include <stdexcept>
#include <utility>

#include "base/limits/child_seal.h"
#include "formats/model_file.h"
#include "meshes/quality.h"
#include "precompute/machine/blas_room.h"
#include "precompute/numerics/loads.h"
#include "precompute/numerics/meshed_body.h"
#include "precompute/numerics/scope.h"
#include "precompute/progress.h"

namespace palpate {
namespace {

Model describe_model(const Description& description, const BakeOptions& options, MeshedBody body) {
  Model model;
  model.name = description.name;
  model.generator = "palpate-precompute " PALPATE_VERSION;
  model.model_toml = description.text;
  model.surface = surface_simplices(body.surface);
  model.analysis = description.analysis;
  model.thickness = description.thickness;
  for (const MaterialPart& part : description.materials) model.materials.push_back(part.material);
  model.material_of_element = std::move(body.material_of_element);
  model.fixed = std::move(body.fixed);
  model.scope = description.scope;
  model.layers = description.scope == Scope::layers ? description.layers : 0;
  model.quality = measure_quality(body.mesh);
  model.mesh = std::move(body.mesh);
  model.rest_displacement.assign(model.mesh.nodes.size(), Vec3::Zero());  // until it is computed
  model.sources.push_back(describe_source("model", description.file, options.output));
  for (const auto& file : input_files(description)) {
    model.sources.push_back(describe_source("geometry", file, options.output));
  }
  return model;
}

StiffnessInput stiffness_input(const MeshedModel& meshed) {
  StiffnessInput body = stiffness_input(meshed.model);
  body.prescribed = meshed.prescribed;
  return body;
}

std::unique_ptr<Factor> analyse(const BakeRun& run, const Stiffness& stiffness) {
  take_blas_room(run.jobs);
  openblas_set_num_threads(1);  // blocks of columns are the parallel work: the bytes do not depend on `jobs`
  run.progress.begin("ordering K");
  return std::make_unique<Factor>(stiffness.K, stiffness.node_start);
}

}  // namespace

MeshedModel mesh_model(const BakeRun& run) {
  const Description& description = run.description;
  MeshedBody body = mesh_body(
      description, [&](const std::string& text) { run.progress.begin(text); }, run.options.keep);
  for (const std::string& note : body.notes) run.progress.line("note: " + note);
  for (const std::string& doubt : body.doubts) run.progress.line("warning: " + doubt);
  if (!can_seal() && !input_files(description).empty()) {
    run.progress.line(
        "note: this system cannot seal processes (seccomp): those that read the geometry's file may do what "
        "this program may");
  }
  if (description.scope != Scope::none) run.progress.begin("assembling K");
  MeshedModel meshed{{}, body.surface, nodal_loads(description, body), body.prescribed, body.warning};
  meshed.model = describe_model(description, run.options, std::move(body));
  return meshed;
}

AssembledBody::AssembledBody(const BakeRun& run, const MeshedModel& meshed)
    : elastic(stiffness_input(meshed)),
      stiffness(assemble_stiffness(elastic)),
      factor(analyse(run, stiffness)),
      stored(stored_dof_marks(meshed.model.mesh, meshed.surface, stiffness, run.description.scope,
                              run.description.layers)),
      solver(*factor, stored, stiffness.free_dofs, meshed.model.dimension()) {}

StoredNumbering AssembledBody::numbering() const {
  const std::vector<std::int64_t> columns = solver.stored_dofs();
  const int dimension = elastic.mesh.dimension();
  const auto d = static_cast<std::size_t>(dimension);
  std::vector<Index> nodes(columns.size() / d, -1);  // mesh nodes
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (columns[k] < 0) continue;
    const std::int64_t dof = stiffness.free_dofs[static_cast<std::size_t>(columns[k])];
    Index& node = nodes[k / d];
    if (node < 0) node = static_cast<Index>(dof / dimension);
    if (dof != std::int64_t{dimension} * node + static_cast<std::int64_t>(k % d)) {
      throw std::logic_error("the elimination order has separated the dofs of a node");
    }
  }
  return {nodes, columns};
}

}  // namespace palpate
