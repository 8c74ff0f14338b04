#include "tests/formats_sample.h"

#include <stdlib.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "meshes/error.h"
#include "meshes/generate.h"
#include "meshes/surface.h"

/// HDF5 loses memory of files that it refuses to open or cannot write.
extern "C" const char* __lsan_default_suppressions();   // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libhdf5";
}

namespace palpate::test {
namespace {

template <class T, class Entry>
bool same(const std::vector<T>& a, const std::vector<T>& b, Entry&& entry) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!entry(a[i], b[i])) return false;
  return true;
}

bool same_greens(const PackedGreens& a, const PackedGreens& b) {
  if (a.order() != b.order() || a.precision() != b.precision()) return false;
  const auto bytes = static_cast<std::size_t>(packed_size(a.order()) * bytes_per_scalar(a.precision()));
  return bytes == 0 || std::memcmp(a.data(), b.data(), bytes) == 0;
}

bool same_quality(const QualityReport& a, const QualityReport& b) {
  return a.min_dihedral == b.min_dihedral && a.max_dihedral == b.max_dihedral &&
         a.min_radius_ratio == b.min_radius_ratio && a.mean_radius_ratio == b.mean_radius_ratio &&
         a.min_edge == b.min_edge && a.max_edge == b.max_edge && a.volume == b.volume &&
         a.worst_element == b.worst_element && a.worst_centroid == b.worst_centroid &&
         a.dihedral_histogram == b.dihedral_histogram;
}

}  // namespace

Model sample_model(int cells) {
  Model model;
  model.name = "sample";
  model.generator = "formats_test 0";
  model.model_toml = "name = \"sample\"\n# Länge in m\n";
  model.mesh = generate(
      BoxShape{.origin = Vec3(0.1, 0.2, 0.3), .size = Vec3(1, 2, 3), .cells = {cells, cells, cells}});
  for (std::size_t e = 0; e < model.mesh.regions.size(); ++e)
    model.mesh.regions[e] = static_cast<Index>(e % 3) - 1;
  model.surface_triangles = extract_surface(model.mesh).triangles;
  model.material = {5000.0, 0.49, 1060.0};
  for (const Vec3& x : model.mesh.nodes) model.fixed.push_back(x.z() < 0.31 ? 1 : 0);
  for (std::size_t i = model.fixed.size(); i-- > 0;)
    if (model.fixed[i] == 0) model.stored_nodes.push_back(static_cast<Index>(i));
  model.scope = Scope::full;
  model.layers = 0;
  model.quality.min_dihedral = 45.0;
  model.quality.max_dihedral = 90.5;
  model.quality.min_radius_ratio = 0.5;
  model.quality.mean_radius_ratio = 0.6;
  model.quality.min_edge = 0.7;
  model.quality.max_edge = 1.8;
  model.quality.volume = 6.0;
  model.quality.worst_element = static_cast<Index>(model.mesh.tets.size()) - 1;
  model.quality.worst_centroid = Vec3(0.5, 1, 2);
  for (std::size_t i = 0; i < model.quality.dihedral_histogram.size(); ++i)
    model.quality.dihedral_histogram[i] = static_cast<std::int64_t>(i);
  model.sources = {{"model", "model.toml", 12, "00112233445566778899aabbccddeeff"},
                   {"geometry", "../with space/box.off", 345, "ffeeddccbbaa99887766554433221100"}};
  const auto n = static_cast<std::size_t>(model.stored_dofs());
  for (const double scale : {1.0, -2.5}) {
    Probe probe{std::vector<double>(n), std::vector<double>(n)};
    for (std::size_t i = 0; i < n; ++i) {
      probe.force[i] = scale * static_cast<double>(i % 7);
      probe.displacement[i] = scale * 1e-3 / (1.0 + static_cast<double>(i));
    }
    model.probes.push_back(std::move(probe));
  }
  return model;
}

double sample_entry(std::int64_t i, std::int64_t j) {
  return i == j ? 2e-3 + 1e-6 * static_cast<double>(i)
                : 1e-3 / (1.0 + static_cast<double>(i) + 1.1 * static_cast<double>(j));
}

std::vector<double> sample_columns(std::int64_t first, std::int64_t count, std::int64_t order) {
  std::vector<double> packed;
  for (std::int64_t j = first; j < first + count; ++j)
    for (std::int64_t i = j; i < order; ++i) packed.push_back(sample_entry(i, j));
  return packed;
}

Model write_sample(const std::filesystem::path& path, Precision precision, int cells) {
  Model model = sample_model(cells);
  const std::int64_t n = model.stored_dofs(), middle = n / 3;
  ModelWriter writer(path, model, precision);
  writer.write_columns(middle, n - middle, sample_columns(middle, n - middle, n));
  writer.write_columns(0, middle, sample_columns(0, middle, n));
  writer.finish(model.probes);
  return model;
}

Folder::Folder() {
  std::string name = (std::filesystem::temp_directory_path() / "palpate_test_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no folder for tests");
  path_ = name;
}

Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string refusal(const std::function<void()>& run) {
  try {
    run();
  } catch (const Error& error) {
    return error.where() + " | " + error.what() + " | " + error.hint();
  }
  return {};
}

std::string difference(const Model& a, const Model& b) {
  const auto equal = [](const auto& x, const auto& y) { return x == y; };
  if (a.name != b.name) return "name";
  if (a.generator != b.generator) return "generator";
  if (a.model_toml != b.model_toml) return "model_toml";
  if (!same(a.mesh.nodes, b.mesh.nodes, equal)) return "nodes";
  if (a.mesh.tets != b.mesh.tets) return "tets";
  if (a.mesh.regions != b.mesh.regions) return "regions";
  if (a.surface_triangles != b.surface_triangles) return "surface_triangles";
  if (a.material.youngs_modulus != b.material.youngs_modulus ||
      a.material.poissons_ratio != b.material.poissons_ratio || a.material.density != b.material.density)
    return "material";
  if (a.fixed != b.fixed) return "fixed";
  if (a.stored_nodes != b.stored_nodes) return "stored_nodes";
  if (a.scope != b.scope || a.layers != b.layers) return "scope";
  if (!same_quality(a.quality, b.quality)) return "quality";
  if (!same(a.sources, b.sources, [](const SourceFile& x, const SourceFile& y) {
        return x.role == y.role && x.path == y.path && x.bytes == y.bytes && x.checksum == y.checksum;
      }))
    return "sources";
  if (!same(a.probes, b.probes, [](const Probe& x, const Probe& y) {
        return x.force == y.force && x.displacement == y.displacement;
      }))
    return "probes";
  if (!same_greens(a.greens, b.greens)) return "greens";
  return {};
}

}  // namespace palpate::test
