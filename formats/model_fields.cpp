#include "formats/model_fields.h"

#include <array>
#include <charconv>
#include <cmath>
#include <string_view>

namespace palpate {
namespace {

constexpr std::array analyses = {"solid", "plane_stress", "plane_strain"};
constexpr std::array scopes = {"surface", "layers", "full"};
constexpr std::array precisions = {"float32", "float64"};

/// Cuts the text before the next separator off the front.
std::string_view cut(std::string_view& rest, char separator) {
  const std::size_t at = rest.find(separator);
  if (at == std::string_view::npos) throw Unreadable{"has an incomplete line"};
  const std::string_view part = rest.substr(0, at);
  rest.remove_prefix(at + 1);
  return part;
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
  throw Unreadable{"is '" + text + "', not tri3, quad4, tet4, tet10 or hex8"};
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
  for (const Scope scope : {Scope::surface, Scope::layers, Scope::full})
    if (text == text_of(scope)) return scope;
  throw Unreadable{"is '" + text + "', not surface, layers or full"};
}

Precision precision_from(const std::string& text) {
  for (const Precision precision : {Precision::single_precision, Precision::double_precision})
    if (text == text_of(precision)) return precision;
  throw Unreadable{"is '" + text + "', not float32 or float64"};
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

std::vector<double> constants_of(const Model& model) {
  std::vector<double> values;
  for (const Material& m : model.materials)
    values.insert(values.end(), {m.youngs_modulus, m.poissons_ratio, m.density});
  return values;
}

void put_constants(Model& model, const std::vector<double>& values) {
  model.materials.resize(values.size() / 3);
  auto value = values.begin();
  for (Material& m : model.materials) {
    m.youngs_modulus = *value++;
    m.poissons_ratio = *value++;
    m.density = *value++;
  }
}

std::vector<double> frictions_of(const Model& model) {
  std::vector<double> values;
  for (const Material& m : model.materials) values.push_back(m.friction);
  return values;
}

void put_frictions(Model& model, const std::vector<double>& values) {
  auto value = values.begin();
  for (Material& m : model.materials) m.friction = *value++;
}

std::vector<double> initial_strains_of(const Model& model) {
  std::vector<double> values;
  for (const Material& m : model.materials)
    values.insert(values.end(), m.initial_strain.begin(), m.initial_strain.end());
  return values;
}

void put_initial_strains(Model& model, const std::vector<double>& values) {
  auto value = values.begin();
  for (Material& m : model.materials)
    for (double& strain : m.initial_strain) strain = *value++;
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

}  // namespace palpate
