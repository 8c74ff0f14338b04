#include "tests/support/files/formats_sample.h"

#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>

#include "base/error.h"
#include "formats/writer/model_writer.h"
#include "matrices/hierarchical.h"
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
  return a.min_angle == b.min_angle && a.max_angle == b.max_angle && a.min_shape == b.min_shape &&
         a.mean_shape == b.mean_shape && a.min_edge == b.min_edge && a.max_edge == b.max_edge &&
         a.volume == b.volume && a.worst_element == b.worst_element && a.worst_centroid == b.worst_centroid &&
         a.angle_histogram == b.angle_histogram;
}

bool same_material(const Material& a, const Material& b) {
  return a.youngs_modulus == b.youngs_modulus && a.poissons_ratio == b.poissons_ratio &&
         a.density == b.density && a.friction == b.friction && a.initial_strain == b.initial_strain;
}

bool same_overlay(const StoredOverlay& a, const StoredOverlay& b) {
  return a.refinement == b.refinement && a.rings == b.rings && a.centres == b.centres &&
         same(a.patches, b.patches, [](const CondensedPatch& x, const CondensedPatch& y) {
           return x.surface == y.surface && x.G == y.G && x.T == y.T && x.compliance == y.compliance;
         });
}

/// Made-up numbers, no two alike in a patch, of a size that depends on the number of nodes.
CondensedPatch sample_patch(int dimension, Index nodes, Index surface_nodes) {
  CondensedPatch patch;
  for (Index k = 0; k < surface_nodes; ++k) patch.surface.push_back(2 * k + 1);
  const Index g = dimension * nodes, m = dimension * surface_nodes;
  const auto symmetric = [](Eigen::Index i, Eigen::Index j) {
    return 1.0 / static_cast<double>(1 + i + j) + static_cast<double>(i * j);
  };
  patch.G = Eigen::MatrixXd::NullaryExpr(g, g, symmetric);
  patch.T = Eigen::MatrixXd::NullaryExpr(m, g, [](Eigen::Index i, Eigen::Index j) {
    return static_cast<double>(i) - 0.01 * static_cast<double>(j);
  });
  patch.compliance = 1e-3 * Eigen::MatrixXd::NullaryExpr(m, m, symmetric);
  return patch;
}

bool same_dynamics(const StoredDynamics& a, const StoredDynamics& b) {
  return a.method == b.method && a.lumped == b.lumped && a.newmark.alpha == b.newmark.alpha &&
         a.newmark.delta == b.newmark.delta && a.newmark.time_step == b.newmark.time_step &&
         a.damping.mass == b.damping.mass && a.damping.stiffness == b.damping.stiffness &&
         a.matrices.start == b.matrices.start && a.matrices.row == b.matrices.row &&
         a.matrices.mass == b.matrices.mass && a.matrices.damping == b.matrices.damping &&
         a.omega == b.omega && a.shapes == b.shapes && same_greens(a.inverse, b.inverse);
}

Mesh sample_mesh(ElementType element, int cells) {
  if (traits(element).dimension == 2)
    return generate(RectangleShape{.origin = {0.1, 0.2, 0.0}, .size = {1, 2, 0}, .cells = {cells, cells}},
                    element);
  const BoxShape box{.origin = {0.1, 0.2, 0.3}, .size = {1, 2, 3}, .cells = {cells, cells, cells}};
  return element == ElementType::hex8 ? generate(box, element)
                                      : with_elements(generate(box), element, "sample");
}

/// The first and the last stored node of the surface.
std::vector<Index> sample_centres(const Model& model) {
  std::vector<Index> nodes = model.surface;
  std::erase_if(nodes, [&](Index node) { return model.fixed[static_cast<std::size_t>(node)] != 0; });
  const auto [first, last] = std::minmax_element(nodes.begin(), nodes.end());
  return {*first, *last};
}

}  // namespace

Model sample_model(ElementType element, int cells) {
  Model model;
  model.name = "sample";
  model.generator = "formats_test 0";
  model.model_toml = "name = \"sample\"\n# Länge in m\n";
  model.mesh = sample_mesh(element, cells);
  const int d = model.dimension();
  for (std::size_t e = 0; e < model.mesh.regions.size(); ++e) {
    model.mesh.regions[e] = static_cast<Index>(e % 3) - 1;
    model.material_of_element.push_back(static_cast<Index>(e % 2));
  }
  model.surface = surface_simplices(extract_surface(model.mesh));
  if (d == 2) {
    model.analysis = element == ElementType::quad4 ? Analysis::plane_stress : Analysis::plane_strain;
    model.thickness = 0.02;
  }
  model.materials = {{5000.0, 0.49, 1060.0, 0.25, {}},
                     {2e4, 0.3, 1100.0, 0.5, {1e-3, 2e-3, 3e-3, -1e-3, -2e-3, -3e-3}}};
  const double bottom = model.mesh.nodes.front()[d - 1];
  for (std::size_t i = 0; i < model.mesh.nodes.size(); ++i) {
    const Vec3& x = model.mesh.nodes[i];
    const std::size_t masks = (std::size_t{1} << d) - 1;
    model.fixed.push_back(static_cast<std::uint8_t>(x[d - 1] < bottom + 0.01 ? masks - i % masks : 0));
    model.rest_force.emplace_back(x.y(), -x.x(), d == 3 ? 0.5 : 0.0);
    model.rest_displacement.emplace_back(1e-3 * x.x(), 2e-3 * x.y(), d == 3 ? 3e-3 * x.z() : 0.0);
  }
  for (std::size_t i = model.fixed.size(); i-- > 0;)
    if (model.fixed[i] == 0) model.stored_nodes.push_back(static_cast<Index>(i));
  model.overlay = {3, 2, sample_centres(model), {sample_patch(d, 2, 3), sample_patch(d, 3, 1)}};
  model.scope = Scope::full;
  model.layers = 0;
  model.quality.min_angle = 45.0;
  model.quality.max_angle = 90.5;
  model.quality.min_shape = 0.5;
  model.quality.mean_shape = 0.6;
  model.quality.min_edge = 0.7;
  model.quality.max_edge = 1.8;
  model.quality.volume = 6.0;
  model.quality.worst_element = model.mesh.elements() - 1;
  model.quality.worst_centroid = Vec3(0.5, 1, 2);
  for (std::size_t i = 0; i < model.quality.angle_histogram.size(); ++i)
    model.quality.angle_histogram[i] = static_cast<std::int64_t>(i % 4);
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

Model write_sample(const std::filesystem::path& path, Precision precision, ElementType element, int cells) {
  Model model = sample_model(element, cells);
  const std::int64_t n = model.stored_dofs(), middle = n / 3;
  ModelWriter writer(path, model, precision);
  writer.write_columns(middle, n - middle, sample_columns(middle, n - middle, n));
  writer.write_columns(0, middle, sample_columns(0, middle, n));
  writer.finish(model.probes);
  return model;
}

Model swinging_sample(DynamicsMethod method, ElementType element, Index modes) {
  Model model = sample_model(element);
  const auto all_axes = static_cast<std::uint8_t>((1 << model.dimension()) - 1);
  for (std::uint8_t& fixed : model.fixed) fixed = fixed == 0 ? std::uint8_t{0} : all_axes;
  const std::int64_t n = model.stored_dofs();
  StoredDynamics& dynamics = model.dynamics;
  dynamics.method = method;
  dynamics.newmark = {.alpha = 0.3025, .delta = 0.6, .time_step = 0.002};
  dynamics.damping = {.mass = 0.5, .stiffness = 1e-4};
  if (method == DynamicsMethod::modal) {
    for (Index i = 0; i < modes; ++i) {
      dynamics.omega.push_back(10.0 + i / 2);  // NOLINT(bugprone-integer-division): pairs of equal ones
      for (std::int64_t dof = 0; dof < n; ++dof)
        dynamics.shapes.push_back(std::cos(0.1 * static_cast<double>((i + 1) * dof)));
    }
    dynamics.omega.push_back(modes == n ? std::numeric_limits<double>::infinity() : 1e3);
    return model;
  }
  MassAndDamping& matrices = dynamics.matrices;
  matrices.start = {0};
  for (std::int64_t j = 0; j < n; ++j) {
    for (std::int64_t i = j; i < std::min(j + 2, n); ++i) {
      matrices.row.push_back(static_cast<Index>(i));
      matrices.mass.push_back(i == j ? 0.1 + 1e-3 * static_cast<double>(j) : 0.01);
      matrices.damping.push_back(i == j ? 0.5 + 1e-3 * static_cast<double>(j) : -0.02);
    }
    matrices.start.push_back(std::ssize(matrices.row));
  }
  return model;
}

std::vector<double> sample_inverse_columns(std::int64_t first, std::int64_t count, std::int64_t order) {
  std::vector<double> packed = sample_columns(first, count, order);
  for (double& entry : packed) entry *= 0.125;
  return packed;
}

Model write_swinging_sample(const std::filesystem::path& path, DynamicsMethod method, Precision precision,
                            ElementType element) {
  Model model = swinging_sample(method, element);
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(path, model, precision);
  writer.write_columns(0, n, sample_columns(0, n, n));
  if (method == DynamicsMethod::packed)
    writer.write_columns(0, n, sample_inverse_columns(0, n, n), PackedMatrix::inverse);
  writer.finish(model.probes);
  return model;
}

SmoothPart sample_smooth(const Model& model) {
  const std::int64_t d = model.dimension();
  SmoothPart smooth{.terms = 3, .rows = {}};
  for (std::int64_t dof = 0; dof < model.stored_dofs(); ++dof) {
    const Index node = model.stored_nodes[static_cast<std::size_t>(dof / d)];
    const bool held = (model.fixed[static_cast<std::size_t>(node)] >> dof % d & 1) != 0;
    for (int k = 1; k <= 3; ++k)
      smooth.rows.push_back(held ? 0.0 : 1e-2 * std::cos(0.1 * static_cast<double>(k * dof)));
  }
  return smooth;
}

Model split_sample(DynamicsMethod method) {
  Model model = method == DynamicsMethod::none ? sample_model() : swinging_sample(method);
  const auto with_smooth = [&] {
    return PackedGreens(nullptr, model.stored_dofs(), Precision::split_precision,
                        std::make_shared<const SmoothPart>(sample_smooth(model)));
  };
  model.greens = with_smooth();
  model.force_errors = {{1e-2, 3e-6, ForceErrors::not_measured}};
  if (method == DynamicsMethod::packed) {
    model.dynamics.inverse = with_smooth();
    model.dynamics.force_errors = {{std::numeric_limits<double>::infinity(), 2e-5, 0.0}};
  }
  return model;
}

Model write_split_sample(const std::filesystem::path& path, DynamicsMethod method) {
  Model model = split_sample(method);
  const std::int64_t n = model.stored_dofs();
  ModelWriter writer(path, model, Precision::split_precision);
  writer.write_columns(0, n, sample_columns(0, n, n));
  if (method == DynamicsMethod::packed)
    writer.write_columns(0, n, sample_inverse_columns(0, n, n), PackedMatrix::inverse);
  writer.finish(model.probes);
  return model;
}

Model compressed_sample() {
  Model model = sample_model();
  auto matrix = std::make_shared<HierarchicalMatrix>();
  matrix->tree = {static_cast<Index>(model.stored_nodes.size()), 1};
  matrix->near_pair = {{1, 1}, {2, 2}};
  matrix->far_pair = {{2, 1}};
  matrix->rank = {0, 2, 3};
  matrix->tolerance = 0.01;
  matrix->pair_error = {2e-3};
  matrix->certificate = {1, 10, 1e-4, 2e-4, 3e-4, 0.0, 5, 20, 2e-4, 3e-4, 4e-4, 0.3};
  matrix->index();
  const auto fill = [](std::int64_t count, auto&& entry) {
    const std::shared_ptr<float[]> values(new float[static_cast<std::size_t>(count)]);
    for (std::int64_t k = 0; k < count; ++k) values[k] = static_cast<float>(entry(k));
    return values;
  };
  const std::int64_t half = matrix->order() / 2;
  matrix->near = fill(matrix->near_at.back(), [&](std::int64_t k) {
    const std::int64_t leaf = k / (half * half), i = k / half % half, j = k % half;
    return sample_entry(leaf * half + std::max(i, j), leaf * half + std::min(i, j));
  });
  matrix->basis = fill(matrix->basis_at.back(), [](std::int64_t k) { return std::cos(0.3 * double(k)); });
  matrix->transfer = fill(0, [](std::int64_t) { return 0.0; });
  matrix->coupling = fill(matrix->coupling_at.back(), [](std::int64_t k) { return 1e-5 * double(k + 1); });
  model.compressed = matrix;
  return model;
}

Model write_compressed_sample(const std::filesystem::path& path) {
  Model model = compressed_sample();
  const HierarchicalMatrix& matrix = *model.compressed;
  ModelWriter writer(path, model, Precision::single_precision);
  for (Index leaf = 0; leaf < 2; ++leaf)
    writer.write_near(leaf, {matrix.near.get() + matrix.near_at[static_cast<std::size_t>(leaf)],
                             static_cast<std::size_t>(matrix.near_at.back() / 2)});
  writer.finish(model.probes, model.compressed);
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
  if (a.mesh.element != b.mesh.element) return "element";
  if (a.mesh.connectivity != b.mesh.connectivity) return "connectivity";
  if (a.mesh.regions != b.mesh.regions) return "regions";
  if (a.surface != b.surface) return "surface";
  if (a.analysis != b.analysis || a.thickness != b.thickness) return "analysis";
  if (!same(a.materials, b.materials, same_material)) return "materials";
  if (a.material_of_element != b.material_of_element) return "material_of_element";
  if (a.fixed != b.fixed) return "fixed";
  if (!same(a.rest_force, b.rest_force, equal)) return "rest_force";
  if (!same(a.rest_displacement, b.rest_displacement, equal)) return "rest_displacement";
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
  if (!same_overlay(a.overlay, b.overlay)) return "overlay";
  if (!same_dynamics(a.dynamics, b.dynamics)) return "dynamics";
  if (!same_greens(a.greens, b.greens)) return "greens";
  return {};
}

}  // namespace palpate::test
