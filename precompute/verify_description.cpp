#include "precompute/verify_description.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/error.h"
#include "matrices/hierarchical.h"
#include "meshes/material_fields.h"
#include "precompute/description/description.h"
#include "precompute/description/read_description.h"
#include "precompute/geometry/material_parts.h"
#include "precompute/numerics/dynamics.h"
#include "precompute/numerics/fixed_nodes.h"
#include "precompute/numerics/loads.h"
#include "precompute/numerics/overlay_regions.h"
#include "precompute/verify_matrix.h"

namespace palpate {
namespace {

bool by_tag(const Selection& where) {
  return std::holds_alternative<SelectTag>(where);
}

bool by_tag(const Load& load) {
  return std::visit(
      [](const auto& part) {
        if constexpr (requires { part.where; }) {
          return by_tag(part.where);
        } else {
          return false;
        }
      },
      load);
}

class DescriptionComparison {
 public:
  DescriptionComparison(const Model& model, const Description& description)
      : model_(model), asked_(description) {}

  std::vector<std::string> differences() {
    compare_header();
    compare_materials();
    compare_held();
    compare_loads();
    compare_overlay();
    compare_dynamics();
    return std::move(differences_);
  }

 private:
  template <class T>
  void compare(const std::string& field, const T& stored, const T& asked) {
    if (stored != asked)
      differences_.push_back(fmt::format("{} is {}, model_toml asks for {}", field, stored, asked));
  }

  void compare_header() {
    compare<std::string>("the attribute name", model_.name, asked_.name);
    compare("the attribute analysis", static_cast<int>(model_.analysis), static_cast<int>(asked_.analysis));
    compare("/material/thickness", model_.thickness, asked_.thickness);
    compare("the attribute scope", static_cast<int>(model_.scope), static_cast<int>(asked_.scope));
    compare("the attribute layers", model_.layers, asked_.scope == Scope::layers ? asked_.layers : 0);
    if (asked_.mesh.element)
      compare<std::string>("the attribute element", traits(model_.mesh.element).name,
                           traits(*asked_.mesh.element).name);
    const bool compressed = model_.compressed != nullptr;
    if (asked_.form != StorageForm::automatic)
      compare("whether the Green's functions are compressed", compressed,
              asked_.form == StorageForm::compressed);
    if (compressed) compare("/greens/tolerance", model_.compressed->tolerance, asked_.tolerance);
    if (asked_.precision)
      compare<std::string>("the precision", name_of(model_.greens.precision()), name_of(*asked_.precision));
  }

  void compare_materials() {
    compare("the number of materials", model_.materials.size(), asked_.materials.size());
    if (model_.materials.size() != asked_.materials.size()) return;
    bool tags = false;
    for (std::size_t m = 0; m < model_.materials.size(); ++m) {
      const Material& stored = model_.materials[m];
      const MaterialPart& part = asked_.materials[m];
      std::vector<std::string> asked;
      for_each_material_field(part.material, [&](const MaterialField&, std::span<const double> values) {
        asked.push_back(fmt::format("{}", fmt::join(values, " ")));
      });
      for_each_material_field(stored,
                              [&, k = std::size_t{0}](const MaterialField& field, auto values) mutable {
                                compare(fmt::format("{}, row {}, {}", field.dataset, m, field.key),
                                        fmt::format("{}", fmt::join(values, " ")), asked[k++]);
                              });
      tags = tags || (part.where && by_tag(*part.where)) || !part.region_names.empty();
    }
    if (!tags)
      same_rows("/material/of_element", model_.material_of_element,
                materials_of_elements(model_.mesh, asked_.materials, "/model_toml"));
  }

  void compare_held() {
    if (std::any_of(asked_.fixed.begin(), asked_.fixed.end(),
                    [](const Fixing& f) { return by_tag(f.where); }))
      return;
    const FixedNodes held = hold_nodes(model_.mesh, asked_.fixed, "/model_toml");
    same_rows("/dofs/fixed", model_.fixed, held.axes);
    std::vector<Vec3> stored = model_.rest_displacement;
    for (std::size_t node = 0; node < stored.size(); ++node)
      for (int axis = 0; axis < 3; ++axis)
        if ((held.axes[node] >> axis & 1) == 0) stored[node][axis] = 0.0;
    same_rows("/rest/displacement of held nodes", stored, held.displacement);
  }

  void compare_loads() {
    if (std::any_of(asked_.loads.begin(), asked_.loads.end(), [](const Load& load) { return by_tag(load); }))
      return;
    MeshedBody body;
    body.mesh = model_.mesh;
    body.surface = extract_surface(body.mesh);
    body.material_of_element = model_.material_of_element;
    body.fixed = model_.fixed;
    const std::vector<Vec3> loads = nodal_loads(asked_, body);
    double largest = 0.0;
    for (const Vec3& force : loads) largest = std::max(largest, force.lpNorm<Eigen::Infinity>());
    for (std::size_t node = 0; node < loads.size(); ++node) {
      const Vec3 difference = model_.rest_force[node] - loads[node];
      if (difference.lpNorm<Eigen::Infinity>() <= same_sum * largest) continue;
      differences_.push_back(
          fmt::format("/rest/force of node {} is not that of the loads of model_toml", node));
      return;
    }
  }

  void compare_overlay() {
    compare("/overlay/refinement", model_.overlay.refinement,
            asked_.overlay ? asked_.overlay->refinement : 0);
    if (!asked_.overlay || model_.overlay.refinement == 0) return;
    compare("/overlay/rings", model_.overlay.rings, asked_.overlay->rings);
    const auto& regions = asked_.overlay->regions;
    if (std::none_of(regions.begin(), regions.end(), [](const Selection& where) { return by_tag(where); }))
      same_rows("/overlay/centres", model_.overlay.centres,
                plan_overlays(model_, *asked_.overlay, "/model_toml").centres);
  }

  void compare_dynamics() {
    const StoredDynamics& stored = model_.dynamics;
    compare("/dynamics", stored.method != DynamicsMethod::none, asked_.dynamics.has_value());
    if (!asked_.dynamics || stored.method == DynamicsMethod::none) return;
    const DynamicsOptions& asked = *asked_.dynamics;
    if (asked.method)
      compare("/dynamics/method", static_cast<int>(stored.method), static_cast<int>(*asked.method));
    compare("/dynamics/lumped", stored.lumped, asked.lumped);
    const auto newmark = [](const Newmark& n) {
      return fmt::format("{} {} {}", n.alpha, n.delta, n.time_step);
    };
    compare("/dynamics/newmark", newmark(stored.newmark), newmark(asked.newmark));
    const auto damping = [](const Rayleigh& r) { return fmt::format("{} {}", r.mass, r.stiffness); };
    compare("/dynamics/damping", damping(stored.damping), damping(asked.damping));
    if (asked.modes && stored.method == DynamicsMethod::modal)
      compare("the number of modes", stored.modes(), *asked.modes);
  }

  template <class T>
  void same_rows(const std::string& field, const std::vector<T>& stored, const std::vector<T>& asked) {
    const auto differs = std::mismatch(stored.begin(), stored.end(), asked.begin(), asked.end()).first;
    if (stored.size() == asked.size() && differs == stored.end()) return;
    differences_.push_back(
        fmt::format("{}: row {} is not that of model_toml", field, differs - stored.begin()));
  }

  const Model& model_;
  const Description& asked_;
  std::vector<std::string> differences_;
};

}  // namespace

std::vector<std::string> description_differences(const Model& model, const std::filesystem::path& file) {
  try {
    const Description description = parse_description(model.model_toml, file.parent_path() / "model_toml");
    return DescriptionComparison(model, description).differences();
  } catch (const Error& error) {
    return {fmt::format("/model_toml does not describe this file: {}", error.what())};
  }
}

}  // namespace palpate
