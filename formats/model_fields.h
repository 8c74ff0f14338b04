// The table of what NAME.palpate.hdf holds. Writer, reader, checks and content hash all walk it, so a field
// that is added here is stored, loaded, checked and hashed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/model.h"

namespace palpate {

/// Counts that several fields share.
enum class Count : std::uint8_t {
  one,
  nodes,
  elements,
  triangles,
  stored_nodes,
  probes,
  bytes_of_text,
  bytes_of_sources
};
inline constexpr std::size_t number_of_counts = 8;

/// One dimension of a field: factor * count + plus.
struct Extent {
  Count count = Count::one;
  std::int64_t factor = 1;
  std::int64_t plus = 0;
};

/// What the file says beside the model's own fields.
struct FileHeader {
  Precision precision = Precision::double_precision;
};

/// A root attribute. T is std::string or std::int64_t.
template <class T>
struct Attribute {
  const char* name;
  T (*take)(const Model&, const FileHeader&);  ///< its value for a model
  void (*put)(Model&, FileHeader&,
              const T&);  ///< null: it must have the value that `take` gives; throws Unreadable
};

/// A dataset.
template <class T>
struct Field {
  const char* path;
  std::vector<Extent> shape;
  std::vector<T> (*take)(const Model&);  ///< its values for a model
  void (*put)(Model&,
              const std::vector<T>&);  ///< null: it must have the values that `take` gives; throws Unreadable
  Extent below = {Count::one, 0, 0};   ///< integers: every value must be in [0, below); no limit when 0
};

/// Thrown by `put`: what is wrong with the values, without the field's name.
struct Unreadable {
  std::string what;
};

std::string text_of(Scope scope);
std::string text_of(Precision precision);

// Conversions between rows (Vec3, Tet, ...) and the flat arrays of the file.
template <class T, class Row>
std::vector<T> flat(const std::vector<Row>& rows) {
  std::vector<T> values;
  values.reserve(rows.size() * (sizeof(Row) / sizeof(rows[0][0])));
  for (const Row& row : rows)
    for (const auto value : row) values.push_back(static_cast<T>(value));
  return values;
}

template <class Row, class T>
std::vector<Row> rows(const std::vector<T>& values) {
  using Scalar = std::remove_cvref_t<decltype(std::declval<Row&>()[0])>;
  constexpr std::size_t width = sizeof(Row) / sizeof(Scalar);
  std::vector<Row> result(values.size() / width);
  auto value = values.begin();
  for (Row& row : result)
    for (auto& entry : row) entry = static_cast<Scalar>(*value++);
  return result;
}

// The longer conversions of the table.
std::vector<std::int64_t> offsets_of(const Model& model);
std::vector<double> quality_summary(const Model& model);
void put_quality_summary(Model& model, const std::vector<double>& values);
std::vector<std::uint8_t> sources_text(const Model& model);
void put_sources_text(Model& model, const std::vector<std::uint8_t>& text);
Scope scope_from(const std::string& text);
Precision precision_from(const std::string& text);

/// Root attributes beside `format`, `version` and `content_hash`.
template <class Visitor>
void for_each_attribute(Visitor&& visit) {
  using Text = std::string;
  using Integer = std::int64_t;
  visit(Attribute<Text>{"units", [](const Model&, const FileHeader&) { return Text("m, N, Pa, kg, s"); },
                        nullptr});
  visit(Attribute<Integer>{"dimension", [](const Model&, const FileHeader&) { return Integer{3}; }, nullptr});
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

/// Datasets that are known before the Green's functions; a field's counts and limits are set by those above
/// it.
template <class Visitor>
void for_each_body_field(Visitor&& visit) {
  using Bytes = std::vector<std::uint8_t>;
  using Int32s = std::vector<std::int32_t>;
  using Int64s = std::vector<std::int64_t>;
  using Doubles = std::vector<double>;
  constexpr Extent nodes = {Count::nodes}, elements = {Count::elements}, three = {Count::one, 3, 0};

  visit(Field<double>{"/mesh/nodes",
                      {nodes, three},
                      [](const Model& m) { return flat<double>(m.mesh.nodes); },
                      [](Model& m, const Doubles& v) { m.mesh.nodes = rows<Vec3>(v); }});
  visit(Field<std::int64_t>{"/mesh/connectivity",
                            {{Count::elements, 4, 0}},
                            [](const Model& m) { return flat<std::int64_t>(m.mesh.tets); },
                            [](Model& m, const Int64s& v) { m.mesh.tets = rows<Tet>(v); },
                            nodes});
  visit(Field<std::int64_t>{"/mesh/offsets", {{Count::elements, 1, 1}}, offsets_of, nullptr});
  visit(Field<std::uint8_t>{"/mesh/types",
                            {elements},
                            [](const Model& m) { return Bytes(m.mesh.tets.size(), 10); },  // VTK_TETRA
                            nullptr});
  visit(Field<std::int32_t>{"/mesh/regions",
                            {elements},
                            [](const Model& m) { return m.mesh.regions; },
                            [](Model& m, const Int32s& v) { m.mesh.regions = v; }});
  visit(Field<std::int32_t>{"/mesh/surface_triangles",
                            {{Count::triangles}, three},
                            [](const Model& m) { return flat<std::int32_t>(m.surface_triangles); },
                            [](Model& m, const Int32s& v) { m.surface_triangles = rows<Triangle>(v); },
                            nodes});
  visit(Field<std::uint8_t>{"/dofs/fixed",
                            {nodes},
                            [](const Model& m) { return m.fixed; },
                            [](Model& m, const Bytes& v) { m.fixed = v; },
                            {Count::one, 2, 0}});
  visit(Field<std::int32_t>{"/dofs/stored_nodes",
                            {{Count::stored_nodes}},
                            [](const Model& m) { return m.stored_nodes; },
                            [](Model& m, const Int32s& v) { m.stored_nodes = v; },
                            nodes});
  visit(Field<double>{
      "/material/isotropic",
      {{Count::one}, three},
      [](const Model& m) {
        return Doubles{m.material.youngs_modulus, m.material.poissons_ratio, m.material.density};
      },
      [](Model& m, const Doubles& v) {
        m.material = {v[0], v[1], v[2]};
      }});
  visit(Field<double>{"/quality/summary", {{Count::one, 11, 0}}, quality_summary, put_quality_summary});
  visit(Field<std::int64_t>{
      "/quality/dihedral_histogram",
      {{Count::one, QualityReport::bins, 0}},
      [](const Model& m) {
        return Int64s(m.quality.dihedral_histogram.begin(), m.quality.dihedral_histogram.end());
      },
      [](Model& m, const Int64s& v) { std::copy(v.begin(), v.end(), m.quality.dihedral_histogram.begin()); },
      {Count::elements, 6, 1}});
  visit(Field<std::uint8_t>{"/model_toml",
                            {{Count::bytes_of_text}},
                            [](const Model& m) { return Bytes(m.model_toml.begin(), m.model_toml.end()); },
                            [](Model& m, const Bytes& v) { m.model_toml.assign(v.begin(), v.end()); }});
  visit(Field<std::uint8_t>{
      "/provenance/sources", {{Count::bytes_of_sources}}, sources_text, put_sources_text});

  // What VTK asks for beside the soft links.
  visit(Field<std::int64_t>{
      "/VTKHDF/NumberOfPoints",
      {{Count::one}},
      [](const Model& m) { return Int64s{static_cast<std::int64_t>(m.mesh.nodes.size())}; },
      nullptr});
  visit(Field<std::int64_t>{
      "/VTKHDF/NumberOfCells",
      {{Count::one}},
      [](const Model& m) { return Int64s{static_cast<std::int64_t>(m.mesh.tets.size())}; },
      nullptr});
  visit(Field<std::int64_t>{
      "/VTKHDF/NumberOfConnectivityIds",
      {{Count::one}},
      [](const Model& m) { return Int64s{4 * static_cast<std::int64_t>(m.mesh.tets.size())}; },
      nullptr});
}

/// Datasets that are added last.
template <class Visitor>
void for_each_probe_field(Visitor&& visit) {
  const std::vector<Extent> shape = {{Count::probes}, {Count::stored_nodes, 3, 0}};
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

/// Every dataset but the Green's functions, which are mapped and not copied.
template <class Visitor>
void for_each_field(Visitor&& visit) {
  for_each_body_field(visit);
  for_each_probe_field(visit);
}

inline constexpr const char* greens_path = "/greens/packed";

}  // namespace palpate
