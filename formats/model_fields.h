// The table of the fields of NAME.palpate.hdf. Writer, reader, checks and content hash all walk it, so that a
// field added here is stored, loaded, checked and hashed.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// Counts common to several fields.
enum class Count : std::uint8_t {
  one,
  nodes,
  elements,
  simplices,
  materials,
  stored_nodes,
  probes,
  bytes_of_text,
  bytes_of_sources,
  patches,
  patch_surface_nodes,  // of all patches together, as the next ones are
  patch_softening_entries,
  patch_transfer_entries,
  patch_compliance_entries,
  matrix_entries,  // of M and C_d
  modes,
  smooth_terms,
  near_pairs,
  far_pairs,
  clusters,
  certified  // kinds of touches
};
inline constexpr std::size_t number_of_counts = 21;

/// One dimension of a field: factor * count + plus.
struct Extent {
  Count count = Count::one;
  std::int64_t factor = 1;
  std::int64_t plus = 0;
};

/// Data of the file besides the model's own fields.
struct FileHeader {
  Precision precision = Precision::double_precision;
};

/// A root attribute. T is std::string or std::int64_t.
template <class T>
struct Attribute {
  const char* name;
  T (*take)(const Model&, const FileHeader&);  ///< its value for a model
  void (*put)(Model&, FileHeader&,
              const T&);  ///< null: it must have the value that `take` returns; throws Unreadable
};

/// A dataset.
template <class T>
struct Field {
  const char* path;
  std::vector<Extent> shape;
  std::function<std::vector<T>(const Model&)> take;  ///< its values for a model
  /// Null: it must have the values that `take` returns; throws Unreadable.
  std::function<void(Model&, const std::vector<T>&)> put;
  Extent below = {Count::one, 0, 0};  ///< integers: every value must be in [0, below); no limit when 0
  bool infinite = false;              ///< numbers: infinity is allowed
};

/// Largest number of nodes on the surface of one patch; with more its matrices' sizes would overflow.
inline constexpr std::int64_t most_patch_surface_nodes = 1 << 28;

/// Exception of `put`: the fault in the values, without the field's name.
struct Unreadable {
  std::string what;
};

std::string text_of(ElementType element);
std::string text_of(Analysis analysis);
std::string text_of(Scope scope);
std::string text_of(Precision precision);

// The longer conversions of the table.
std::vector<double> flat(const std::vector<Vec3>& rows);
std::vector<Vec3> rows(const std::vector<double>& values);
std::vector<std::int64_t> offsets_of(const Model& model);
/// The datasets of the materials' constants.
std::vector<Field<double>> material_datasets();
std::vector<double> quality_summary(const Model& model);
void put_quality_summary(Model& model, const std::vector<double>& values);
std::vector<std::uint8_t> sources_text(const Model& model);
void put_sources_text(Model& model, const std::vector<std::uint8_t>& text);
void put_centres(Model& model, const std::vector<std::int32_t>& values);
std::vector<std::int32_t> patch_node_counts(const Model& model);
void put_patch_node_counts(Model& model, const std::vector<std::int32_t>& values);
std::vector<std::int32_t> patch_surface_counts(const Model& model);
void put_patch_surface_counts(Model& model, const std::vector<std::int32_t>& values);
std::vector<std::int32_t> patch_surface_nodes(const Model& model);
void put_patch_surface_nodes(Model& model, const std::vector<std::int32_t>& values);
/// Matrices of all patches, one after the other: symmetric matrices as lower triangles, column by column, T
/// by rows.
std::vector<double> patch_softenings(const Model& model);
void put_patch_softenings(Model& model, const std::vector<double>& values);
std::vector<double> patch_transfers(const Model& model);
void put_patch_transfers(Model& model, const std::vector<double>& values);
std::vector<double> patch_compliances(const Model& model);
void put_patch_compliances(Model& model, const std::vector<double>& values);

void expect_dimension(const Model& model, std::int64_t dimension);
ElementType element_from(const std::string& text);
Analysis analysis_from(const std::string& text);
Scope scope_from(const std::string& text);
Precision precision_from(const std::string& text);

/// Root attributes besides `format`, `version` and `content_hash`; the element kind comes before the
/// attributes that depend on it.
template <class Visitor>
void for_each_attribute(Visitor&& visit) {
  using Text = std::string;
  using Integer = std::int64_t;
  visit(Attribute<Text>{"units", [](const Model&, const FileHeader&) { return Text("m, N, Pa, kg, s"); },
                        nullptr});
  visit(Attribute<Text>{"element", [](const Model& m, const FileHeader&) { return text_of(m.mesh.element); },
                        [](Model& m, FileHeader&, const Text& t) { m.mesh.element = element_from(t); }});
  visit(Attribute<Integer>{"dimension",
                           [](const Model& m, const FileHeader&) { return Integer{m.dimension()}; },
                           [](Model& m, FileHeader&, const Integer& i) { expect_dimension(m, i); }});
  visit(Attribute<Text>{"analysis", [](const Model& m, const FileHeader&) { return text_of(m.analysis); },
                        [](Model& m, FileHeader&, const Text& t) { m.analysis = analysis_from(t); }});
  visit(Attribute<Text>{"scalar", [](const Model&, const FileHeader& h) { return text_of(h.precision); },
                        [](Model&, FileHeader& h, const Text& t) { h.precision = precision_from(t); }});
  visit(Attribute<Text>{"generator", [](const Model& m, const FileHeader&) { return m.generator; },
                        [](Model& m, FileHeader&, const Text& t) { m.generator = t; }});
  visit(Attribute<Text>{"name", [](const Model& m, const FileHeader&) { return m.name; },
                        [](Model& m, FileHeader&, const Text& t) { m.name = t; }});
  visit(Attribute<Text>{"scope", [](const Model& m, const FileHeader&) { return text_of(m.scope); },
                        [](Model& m, FileHeader&, const Text& t) { m.scope = scope_from(t); }});
  visit(Attribute<Integer>{"layers", [](const Model& m, const FileHeader&) { return Integer{m.layers}; },
                           [](Model& m, FileHeader&, const Integer& i) {
                             if (i < 0 || i > 1'000'000) throw Unreadable{"is " + std::to_string(i)};
                             m.layers = static_cast<Index>(i);
                           }});
}

/// Datasets of the mesh of a body made of `element`.
template <class Visitor>
void for_each_mesh_field(ElementType element, Visitor&& visit) {
  using Octets = std::vector<std::uint8_t>;
  using Int32s = std::vector<std::int32_t>;
  using Int64s = std::vector<std::int64_t>;
  using Doubles = std::vector<double>;
  const ElementTraits& kind = traits(element);
  const Extent nodes = {Count::nodes}, elements = {Count::elements}, three = {Count::one, 3, 0},
               d = {Count::one, kind.dimension, 0};

  visit(Field<double>{"/mesh/nodes",
                      {nodes, three},
                      [](const Model& m) { return flat(m.mesh.nodes); },
                      [](Model& m, const Doubles& v) { m.mesh.nodes = rows(v); }});
  visit(Field<std::int64_t>{
      "/mesh/connectivity",
      {{Count::elements, kind.nodes, 0}},
      [](const Model& m) { return Int64s(m.mesh.connectivity.begin(), m.mesh.connectivity.end()); },
      [](Model& m, const Int64s& v) { m.mesh.connectivity.assign(v.begin(), v.end()); },
      nodes});
  visit(Field<std::int64_t>{"/mesh/offsets", {{Count::elements, 1, 1}}, offsets_of, nullptr});
  visit(Field<std::uint8_t>{"/mesh/types",
                            {elements},
                            [](const Model& m) {
                              return Octets(static_cast<std::size_t>(m.mesh.elements()),
                                            traits(m.mesh.element).vtk);
                            },
                            nullptr});
  visit(Field<std::int32_t>{"/mesh/regions",
                            {elements},
                            [](const Model& m) { return m.mesh.regions; },
                            [](Model& m, const Int32s& v) { m.mesh.regions = v; }});
  visit(Field<std::int32_t>{"/mesh/surface",
                            {{Count::simplices}, d},
                            [](const Model& m) { return m.surface; },
                            [](Model& m, const Int32s& v) { m.surface = v; },
                            nodes});
}

/// Datasets that VTK requires besides the soft links.
template <class Visitor>
void for_each_vtk_field(Visitor&& visit) {
  using Int64s = std::vector<std::int64_t>;
  visit(Field<std::int64_t>{
      "/VTKHDF/NumberOfPoints",
      {{Count::one}},
      [](const Model& m) { return Int64s{static_cast<std::int64_t>(m.mesh.nodes.size())}; },
      nullptr});
  visit(Field<std::int64_t>{"/VTKHDF/NumberOfCells",
                            {{Count::one}},
                            [](const Model& m) { return Int64s{std::int64_t{m.mesh.elements()}}; },
                            nullptr});
  visit(Field<std::int64_t>{
      "/VTKHDF/NumberOfConnectivityIds",
      {{Count::one}},
      [](const Model& m) { return Int64s{static_cast<std::int64_t>(m.mesh.connectivity.size())}; },
      nullptr});
}

/// Datasets known before the Green's functions, for a body made of `element`; a field's counts and limits are
/// set by the fields before it.
template <class Visitor>
void for_each_body_field(ElementType element, Visitor&& visit) {
  using Octets = std::vector<std::uint8_t>;
  using Int32s = std::vector<std::int32_t>;
  using Int64s = std::vector<std::int64_t>;
  using Doubles = std::vector<double>;
  const ElementTraits& kind = traits(element);
  const Extent nodes = {Count::nodes}, elements = {Count::elements}, materials = {Count::materials},
               three = {Count::one, 3, 0};

  for_each_mesh_field(element, visit);
  visit(Field<std::uint8_t>{"/dofs/fixed",
                            {nodes},
                            [](const Model& m) { return m.fixed; },
                            [](Model& m, const Octets& v) { m.fixed = v; },
                            {Count::one, std::int64_t{1} << kind.dimension, 0}});
  visit(Field<std::int32_t>{"/dofs/stored_nodes",
                            {{Count::stored_nodes}},
                            [](const Model& m) { return m.stored_nodes; },
                            [](Model& m, const Int32s& v) { m.stored_nodes = v; },
                            nodes});
  for (const Field<double>& dataset : material_datasets()) visit(dataset);
  visit(Field<std::int32_t>{"/material/of_element",
                            {elements},
                            [](const Model& m) { return m.material_of_element; },
                            [](Model& m, const Int32s& v) { m.material_of_element = v; },
                            materials});
  visit(Field<double>{"/material/thickness",
                      {{Count::one}},
                      [](const Model& m) { return Doubles{m.thickness}; },
                      [](Model& m, const Doubles& v) { m.thickness = v[0]; }});
  visit(Field<double>{"/rest/force",
                      {nodes, three},
                      [](const Model& m) { return flat(m.rest_force); },
                      [](Model& m, const Doubles& v) { m.rest_force = rows(v); }});
  visit(Field<double>{"/rest/displacement",
                      {nodes, three},
                      [](const Model& m) { return flat(m.rest_displacement); },
                      [](Model& m, const Doubles& v) { m.rest_displacement = rows(v); }});
  visit(Field<double>{"/quality/summary", {{Count::one, 11, 0}}, quality_summary, put_quality_summary});
  visit(Field<std::int64_t>{
      "/quality/angle_histogram",
      {{Count::one, QualityReport::bins, 0}},
      [](const Model& m) {
        return Int64s(m.quality.angle_histogram.begin(), m.quality.angle_histogram.end());
      },
      [](Model& m, const Int64s& v) { std::copy(v.begin(), v.end(), m.quality.angle_histogram.begin()); },
      {Count::elements, kind.edges, 1}});  // every kind has as many angles as edges
  visit(Field<std::uint8_t>{"/model_toml",
                            {{Count::bytes_of_text}},
                            [](const Model& m) { return Octets(m.model_toml.begin(), m.model_toml.end()); },
                            [](Model& m, const Octets& v) { m.model_toml.assign(v.begin(), v.end()); }});
  visit(Field<std::uint8_t>{
      "/provenance/sources", {{Count::bytes_of_sources}}, sources_text, put_sources_text});
  for_each_vtk_field(visit);
}

/// Datasets added last.
template <class Visitor>
void for_each_probe_field(ElementType element, Visitor&& visit) {
  const std::vector<Extent> shape = {{Count::probes}, {Count::stored_nodes, traits(element).dimension, 0}};
  visit(Field<double>{"/probes/forces", shape,
                      [](const Model& m) {
                        std::vector<double> all;
                        for (const Probe& p : m.probes) all.insert(all.end(), p.force.begin(), p.force.end());
                        return all;
                      },
                      [](Model& m, const std::vector<double>& v) {
                        const auto n = m.stored_dofs();
                        for (auto at = v.begin(); at != v.end(); at += n)
                          m.probes.push_back({{at, at + n}, {}});
                      }});
  visit(Field<double>{"/probes/displacements", shape,
                      [](const Model& m) {
                        std::vector<double> all;
                        for (const Probe& p : m.probes)
                          all.insert(all.end(), p.displacement.begin(), p.displacement.end());
                        return all;
                      },
                      [](Model& m, const std::vector<double>& v) {
                        auto at = v.begin();
                        for (Probe& p : m.probes) {
                          p.displacement.assign(at, at + m.stored_dofs());
                          at += m.stored_dofs();
                        }
                      }});
}

inline constexpr const char* overlay_group = "/overlay";

/// Datasets of files with overlays; other files do not have the group.
template <class Visitor>
void for_each_overlay_field(Visitor&& visit) {
  using Int32s = std::vector<std::int32_t>;
  const Extent one = {Count::one}, patches = {Count::patches};
  visit(Field<std::int32_t>{"/overlay/refinement",
                            {one},
                            [](const Model& m) { return Int32s{m.overlay.refinement}; },
                            [](Model& m, const Int32s& v) { m.overlay.refinement = v[0]; }});
  visit(Field<std::int32_t>{"/overlay/rings",
                            {one},
                            [](const Model& m) { return Int32s{m.overlay.rings}; },
                            [](Model& m, const Int32s& v) { m.overlay.rings = v[0]; }});
  visit(Field<std::int32_t>{"/overlay/centres",
                            {patches},
                            [](const Model& m) { return Int32s(m.overlay.centres); },
                            put_centres,
                            {Count::nodes}});
  visit(Field<std::int32_t>{
      "/overlay/nodes", {patches}, patch_node_counts, put_patch_node_counts, {Count::nodes, 1, 1}});
  visit(Field<std::int32_t>{"/overlay/surface_nodes",
                            {patches},
                            patch_surface_counts,
                            put_patch_surface_counts,
                            {Count::one, most_patch_surface_nodes, 1}});
  visit(Field<std::int32_t>{"/overlay/surface",
                            {{Count::patch_surface_nodes}},
                            patch_surface_nodes,
                            put_patch_surface_nodes,
                            {Count::one, std::numeric_limits<std::int32_t>::max(), 0}});
  visit(Field<double>{
      "/overlay/G", {{Count::patch_softening_entries}}, patch_softenings, put_patch_softenings});
  visit(Field<double>{"/overlay/T", {{Count::patch_transfer_entries}}, patch_transfers, put_patch_transfers});
  visit(Field<double>{
      "/overlay/compliance", {{Count::patch_compliance_entries}}, patch_compliances, put_patch_compliances});
}

/// All datasets except those of overlays and dynamics, and except the Green's functions, which are mapped and
/// not copied.
template <class Visitor>
void for_each_field(ElementType element, Visitor&& visit) {
  for_each_body_field(element, visit);
  for_each_probe_field(element, visit);
}

inline constexpr const char* greens_path = "/greens/packed";

}  // namespace palpate
