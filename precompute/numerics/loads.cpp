#include "precompute/numerics/loads.h"

#include <algorithm>
#include <set>
#include <variant>

#include "base/error.h"
#include "meshes/element.h"

namespace palpate {
namespace {

/// Adds each kind of load to the nodal forces.
class Loader {
 public:
  Loader(const Description& description, const MeshedBody& body, std::vector<Vec3>& f)
      : description_(description), body_(body), mesh_(body.mesh), f_(f) {}

  /// Adds a load; `where` names it in errors.
  void add(const Load& load, const std::string& where) const {
    std::visit([&](const auto& kind) { add(kind, where); }, load);
  }

  void add_initial_strains() const {
    for (std::size_t m = 0; m < description_.materials.size(); ++m) {
      const StressVector stress = initial_stress(description_.materials[m].material, description_.analysis);
      if (stress.isZero(0.0)) continue;
      const int d = mesh_.dimension();
      for_each_element_of(m, [&](std::span<const Index> nodes, const ElementNodes& x) {
        const ElementVector f = element_stress_force(mesh_.element, x, stress, description_.thickness);
        for (std::size_t i = 0; i < nodes.size(); ++i) {
          at(nodes[i]).head(d) += f.segment(d * static_cast<Eigen::Index>(i), d);
        }
      });
    }
  }

 private:
  void add(const ConcentratedForce& load, const std::string& where) const {
    const std::vector<std::uint8_t> selected = select_nodes(mesh_, load.where, where);
    for (std::size_t node = 0; node < selected.size(); ++node) {
      if (selected[node] != 0) f_[node] += load.force;
    }
  }

  void add(const Traction& load, const std::string& where) const {
    const std::vector<std::uint8_t> selected = select_nodes(mesh_, load.where, where);
    const auto* tag = std::get_if<SelectTag>(&load.where);
    std::set<std::vector<Index>> tagged;
    if (tag != nullptr) tagged = tagged_facets(tag->tag);
    bool found = false;
    for (Index facet = 0; facet < body_.surface.count(); ++facet) {
      const std::span<const Index> nodes = body_.surface.facet_nodes(facet);
      const bool loaded = std::all_of(nodes.begin(), nodes.end(), [&](Index node) {
        return selected[static_cast<std::size_t>(node)] != 0;
      });
      if (!loaded || (tag != nullptr && !tagged.contains(in_order(nodes)))) continue;
      found = true;
      add_shares(nodes, load.traction,
                 facet_shape_integrals(body_.surface.facet, positions(mesh_, nodes), description_.thickness));
    }
    if (!found) {
      throw Error("the traction's selection holds nodes but no whole facet of the boundary", where,
                  "Select a part of the boundary that is larger than one element");
    }
  }

  void add(const Gravity& load, const std::string&) const {
    for (std::size_t m = 0; m < description_.materials.size(); ++m) {
      const Vec3 weight = description_.materials[m].material.density * load.acceleration;
      for_each_element_of(m, [&](std::span<const Index> nodes, const ElementNodes& x) {
        add_shares(nodes, weight, element_shape_integrals(mesh_.element, x, description_.thickness));
      });
    }
  }

  static std::vector<Index> in_order(std::span<const Index> nodes) {
    std::vector<Index> result(nodes.begin(), nodes.end());
    std::sort(result.begin(), result.end());
    return result;
  }

  /// Nodes of each facet with the tag. In a body one element thick nodes do not suffice: a side between two
  /// tagged ones has all its nodes on them.
  [[nodiscard]] std::set<std::vector<Index>> tagged_facets(Index tag) const {
    std::set<std::vector<Index>> facets;
    for (std::size_t t = 0; t < mesh_.facet_tags.size(); ++t)
      if (mesh_.facet_tags[t] == tag) facets.insert(in_order(mesh_.tagged_facet(static_cast<Index>(t))));
    return facets;
  }

  template <class F>
  void for_each_element_of(std::size_t material, F f) const {
    for (Index e = 0; e < mesh_.elements(); ++e) {
      if (body_.material_of_element[static_cast<std::size_t>(e)] != static_cast<Index>(material)) continue;
      f(mesh_.element_nodes(e), element_nodes(mesh_, e));
    }
  }

  void add_shares(std::span<const Index> nodes, const Vec3& total, const ShapeValues& shares) const {
    for (std::size_t i = 0; i < nodes.size(); ++i)
      at(nodes[i]) += shares[static_cast<Eigen::Index>(i)] * total;
  }

  [[nodiscard]] Vec3& at(Index node) const { return f_[static_cast<std::size_t>(node)]; }

  const Description& description_;
  const MeshedBody& body_;
  const Mesh& mesh_;
  std::vector<Vec3>& f_;
};

}  // namespace

std::vector<Vec3> nodal_loads(const Description& description, const MeshedBody& body) {
  std::vector<Vec3> f(body.mesh.nodes.size(), Vec3::Zero());
  const Loader loader(description, body, f);
  for (std::size_t k = 0; k < description.loads.size(); ++k) {
    loader.add(description.loads[k],
               description.file.string() + ": [[load]] number " + std::to_string(k + 1));
  }
  loader.add_initial_strains();
  return f;
}

std::vector<Vec3> rest_displacement(const Factor& factor, const Stiffness& stiffness,
                                    const std::vector<Vec3>& loads, const std::vector<Vec3>& prescribed,
                                    int dimension) {
  std::vector<Vec3> u0 = prescribed;
  std::vector<double> f(stiffness.free_dofs.size());
  const auto place = [&](std::size_t k) {
    return std::pair{static_cast<std::size_t>(stiffness.free_dofs[k] / dimension),
                     stiffness.free_dofs[k] % dimension};
  };
  for (std::size_t k = 0; k < f.size(); ++k) {
    const auto [node, axis] = place(k);
    f[k] = loads[node][axis] - stiffness.held_force[k];
  }
  if (std::all_of(f.begin(), f.end(), [](double value) { return value == 0.0; })) return u0;
  const std::vector<double> u = factor.solve(f);
  for (std::size_t k = 0; k < u.size(); ++k) {
    const auto [node, axis] = place(k);
    u0[node][axis] = u[k];
  }
  return u0;
}

}  // namespace palpate
