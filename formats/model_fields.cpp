#include "formats/model_fields.h"

#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "meshes/material_fields.h"

namespace palpate {
namespace {

constexpr std::array analyses = {"solid", "plane_stress", "plane_strain"};
constexpr std::array scopes = {"surface", "layers", "full", "none"};
// A reader that does not know the second name refuses the file instead of taking R for Xi.
constexpr std::array precisions = {"float32", "float32+smooth", "float64"};

/// Removes the text before the next separator from the front and returns it.
std::string_view cut(std::string_view& rest, char separator) {
  const std::size_t at = rest.find(separator);
  if (at == std::string_view::npos) throw Unreadable{"has an incomplete line"};
  const std::string_view part = rest.substr(0, at);
  rest.remove_prefix(at + 1);
  return part;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Distributes the values over the patches, as many to each as `size` says. Throws Unreadable unless the
/// total is right.
template <class T, class Size, class Put>
void hand_out(Model& model, const std::vector<T>& values, Size&& size, Put&& put) {
  std::vector<CondensedPatch>& patches = model.overlay.patches;
  std::int64_t left = std::ssize(values);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    left -= size(patches[k]);
    if (left < 0) throw Unreadable{"ends within patch " + std::to_string(k)};
  }
  if (left > 0) throw Unreadable{"has " + std::to_string(left) + " entries more than its patches"};
  std::span<const T> rest = values;
  for (CondensedPatch& patch : patches) {
    const auto count = static_cast<std::size_t>(size(patch));
    put(patch, rest.first(count));
    rest = rest.subspan(count);
  }
}

/// Lower triangles of a matrix of each patch, column by column.
template <class Which>
std::vector<double> all_packed(const Model& model, Which&& which) {
  std::vector<double> values;
  for (const CondensedPatch& patch : model.overlay.patches) {
    const Eigen::MatrixXd& matrix = which(patch);
    for (Eigen::Index j = 0; j < matrix.cols(); ++j)
      for (Eigen::Index i = j; i < matrix.rows(); ++i) values.push_back(matrix(i, j));
  }
  return values;
}

/// Fills a matrix that already has its columns.
void unpack(std::span<const double> packed, Eigen::MatrixXd& matrix) {
  const Eigen::Index order = matrix.cols();
  matrix.resize(order, order);
  auto value = packed.begin();
  for (Eigen::Index j = 0; j < order; ++j)
    for (Eigen::Index i = j; i < order; ++i) matrix(i, j) = matrix(j, i) = *value++;
}

bool is_checksum(std::string_view text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace

std::string text_of(ElementType element) {
  return traits(element).name;
}

std::string text_of(Analysis analysis) {
  return analyses.at(static_cast<std::size_t>(analysis));
}

std::string text_of(Scope scope) {
  return scopes.at(static_cast<std::size_t>(scope));
}

std::string text_of(Precision precision) {
  return precisions.at(static_cast<std::size_t>(precision));
}

ElementType element_from(const std::string& text) {
  for (const ElementType element : body_elements)
    if (text == text_of(element)) return element;
  throw Unreadable{"is '" + text + "', not tri3, quad4, tet4, tet4a, tet10 or hex8"};
}

void expect_dimension(const Model& model, std::int64_t dimension) {
  if (dimension != model.dimension())
    throw Unreadable{"is " + std::to_string(dimension) + ", that of " + text_of(model.mesh.element) +
                     " elements is " + std::to_string(model.dimension())};
}

Analysis analysis_from(const std::string& text) {
  for (const Analysis analysis : {Analysis::solid, Analysis::plane_stress, Analysis::plane_strain})
    if (text == text_of(analysis)) return analysis;
  throw Unreadable{"is '" + text + "', not solid, plane_stress or plane_strain"};
}

Scope scope_from(const std::string& text) {
  for (const Scope scope : {Scope::surface, Scope::layers, Scope::full, Scope::none})
    if (text == text_of(scope)) return scope;
  throw Unreadable{"is '" + text + "', not surface, layers, full or none"};
}

Precision precision_from(const std::string& text) {
  for (const Precision precision :
       {Precision::single_precision, Precision::split_precision, Precision::double_precision})
    if (text == text_of(precision)) return precision;
  throw Unreadable{"is '" + text + "', not float32, float32+smooth or float64"};
}

std::vector<double> flat(const std::vector<Vec3>& rows) {
  std::vector<double> values;
  values.reserve(3 * rows.size());
  for (const Vec3& row : rows) values.insert(values.end(), row.begin(), row.end());
  return values;
}

std::vector<Vec3> rows(const std::vector<double>& values) {
  std::vector<Vec3> result(values.size() / 3);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = Vec3::Map(values.data() + 3 * i);
  return result;
}

std::vector<std::int64_t> offsets_of(const Model& model) {
  std::vector<std::int64_t> offsets(static_cast<std::size_t>(model.mesh.elements()) + 1);
  for (std::size_t i = 0; i < offsets.size(); ++i)
    offsets[i] = traits(model.mesh.element).nodes * static_cast<std::int64_t>(i);
  return offsets;
}

namespace {

std::vector<double> material_values(const Model& model, std::string_view dataset) {
  std::vector<double> values;
  for (const Material& material : model.materials) {
    for_each_material_field(material, [&](const MaterialField& field, std::span<const double> numbers) {
      if (field.dataset == dataset) values.insert(values.end(), numbers.begin(), numbers.end());
    });
  }
  return values;
}

void put_material_values(Model& model, std::string_view dataset, std::size_t width,
                         const std::vector<double>& values) {
  model.materials.resize(values.size() / width);
  auto value = values.begin();
  for (Material& material : model.materials) {
    for_each_material_field(material, [&](const MaterialField& field, std::span<double> numbers) {
      if (field.dataset == dataset)
        for (double& number : numbers) number = *value++;
    });
  }
}

}  // namespace

std::vector<Field<double>> material_datasets() {
  std::vector<std::pair<std::string_view, std::size_t>> widths;
  for_each_material_field(Material{}, [&](const MaterialField& field, std::span<const double> numbers) {
    if (widths.empty() || widths.back().first != field.dataset) widths.emplace_back(field.dataset, 0);
    widths.back().second += numbers.size();
  });
  std::vector<Field<double>> datasets;
  for (const auto& [path, width] : widths) {
    std::vector<Extent> shape = {{Count::materials}};
    if (width > 1) shape.push_back({Count::one, static_cast<std::int64_t>(width), 0});
    datasets.push_back({path.data(), shape,
                        [path = path](const Model& model) { return material_values(model, path); },
                        [path = path, width = width](Model& model, const std::vector<double>& values) {
                          put_material_values(model, path, width, values);
                        }});
  }
  return datasets;
}

std::vector<double> quality_summary(const Model& model) {
  const QualityReport& q = model.quality;
  return {q.min_angle,
          q.max_angle,
          q.min_shape,
          q.mean_shape,
          q.min_edge,
          q.max_edge,
          q.volume,
          static_cast<double>(q.worst_element),
          q.worst_centroid.x(),
          q.worst_centroid.y(),
          q.worst_centroid.z()};
}

void put_quality_summary(Model& model, const std::vector<double>& values) {
  const double worst = values[7];
  if (worst != std::floor(worst) || worst < 0 || worst >= static_cast<double>(model.mesh.elements()))
    throw Unreadable{"names an element that does not exist"};
  QualityReport& q = model.quality;
  q.min_angle = values[0];
  q.max_angle = values[1];
  q.min_shape = values[2];
  q.mean_shape = values[3];
  q.min_edge = values[4];
  q.max_edge = values[5];
  q.volume = values[6];
  q.worst_element = static_cast<Index>(worst);
  q.worst_centroid = {values[8], values[9], values[10]};
}

std::vector<std::uint8_t> sources_text(const Model& model) {
  std::string text;
  for (const SourceFile& source : model.sources)
    text +=
        source.role + ' ' + std::to_string(source.bytes) + ' ' + source.checksum + ' ' + source.path + '\n';
  return {text.begin(), text.end()};
}

void put_sources_text(Model& model, const std::vector<std::uint8_t>& text) {
  const std::string all(text.begin(), text.end());
  for (std::string_view rest = all; !rest.empty();) {
    std::string_view line = cut(rest, '\n');
    SourceFile source;
    source.role = cut(line, ' ');
    const std::string_view bytes = cut(line, ' ');
    source.checksum = cut(line, ' ');
    source.path = line;
    const auto [end, error] = std::from_chars(bytes.data(), bytes.data() + bytes.size(), source.bytes);
    if (error != std::errc() || end != bytes.data() + bytes.size() || source.bytes < 0)
      throw Unreadable{"has a line with an unreadable size"};
    if (source.role.empty() || source.path.empty() || !is_checksum(source.checksum))
      throw Unreadable{"has a line that is not 'role bytes checksum path'"};
    model.sources.push_back(std::move(source));
  }
}

void put_centres(Model& model, const std::vector<std::int32_t>& values) {
  model.overlay.centres = values;
  model.overlay.patches.resize(values.size());
}

// Until its entries are read, a matrix has columns but no rows: no memory is allocated for sizes that a file
// merely claims.

std::vector<std::int32_t> patch_node_counts(const Model& model) {
  std::vector<std::int32_t> counts;
  for (const CondensedPatch& patch : model.overlay.patches)
    counts.push_back(static_cast<std::int32_t>(patch.G.cols() / model.dimension()));
  return counts;
}

void put_patch_node_counts(Model& model, const std::vector<std::int32_t>& values) {
  for (std::size_t k = 0; k < values.size(); ++k)
    model.overlay.patches[k].G.resize(0, model.dimension() * Eigen::Index{values[k]});
}

std::vector<std::int32_t> patch_surface_counts(const Model& model) {
  std::vector<std::int32_t> counts;
  for (const CondensedPatch& patch : model.overlay.patches)
    counts.push_back(static_cast<std::int32_t>(patch.compliance.cols() / model.dimension()));
  return counts;
}

void put_patch_surface_counts(Model& model, const std::vector<std::int32_t>& values) {
  for (std::size_t k = 0; k < values.size(); ++k)
    model.overlay.patches[k].compliance.resize(0, model.dimension() * Eigen::Index{values[k]});
}

std::vector<std::int32_t> patch_surface_nodes(const Model& model) {
  std::vector<std::int32_t> nodes;
  for (const CondensedPatch& patch : model.overlay.patches)
    nodes.insert(nodes.end(), patch.surface.begin(), patch.surface.end());
  return nodes;
}

void put_patch_surface_nodes(Model& model, const std::vector<std::int32_t>& values) {
  hand_out(
      model, values, [&](const CondensedPatch& patch) { return patch.compliance.cols() / model.dimension(); },
      [](CondensedPatch& patch, std::span<const std::int32_t> part) {
        patch.surface.assign(part.begin(), part.end());
      });
}

std::vector<double> patch_softenings(const Model& model) {
  return all_packed(
      model, [](const CondensedPatch& patch) -> auto& { return patch.G; });
}

void put_patch_softenings(Model& model, const std::vector<double>& values) {
  hand_out(
      model, values, [](const CondensedPatch& patch) { return packed_size(patch.G.cols()); },
      [](CondensedPatch& patch, std::span<const double> part) { unpack(part, patch.G); });
}

std::vector<double> patch_transfers(const Model& model) {
  std::vector<double> values;
  for (const CondensedPatch& patch : model.overlay.patches) {
    const RowMajor rows = patch.T;
    values.insert(values.end(), rows.data(), rows.data() + rows.size());
  }
  return values;
}

void put_patch_transfers(Model& model, const std::vector<double>& values) {
  hand_out(
      model, values, [](const CondensedPatch& patch) { return patch.compliance.cols() * patch.G.cols(); },
      [](CondensedPatch& patch, std::span<const double> part) {
        patch.T = Eigen::Map<const RowMajor>(part.data(), patch.compliance.cols(), patch.G.cols());
      });
}

std::vector<double> patch_compliances(const Model& model) {
  return all_packed(
      model, [](const CondensedPatch& patch) -> auto& { return patch.compliance; });
}

void put_patch_compliances(Model& model, const std::vector<double>& values) {
  hand_out(
      model, values, [](const CondensedPatch& patch) { return packed_size(patch.compliance.cols()); },
      [](CondensedPatch& patch, std::span<const double> part) { unpack(part, patch.compliance); });
}

}  // namespace palpate
