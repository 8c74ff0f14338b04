// Overlays by a linear and by the neo-Hookean law against a body that is neo-Hookean everywhere.
//
//   overlay_law_study [--widths MM,...] [--rings N,...] [--levels SHARE,...] [--cells N]
//
// A block of 40 x 40 x 30 mm (tet4, N x N x 0.8 N cells, E = 5 kPa, nu = 0.45, clamped below) whose middle is
// pressed in by a flat square punch without friction, to shares of its height. The overlay is centred there,
// r = 2. Prints CSV: the punch's width [mm], rings, level, and the force [N] of the same mesh where all is
// neo-Hookean, where the patch is, and where nothing is. scripts/studies/overlay-law runs it.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "meshes/generate.h"
#include "tests/support/bodies/mixed_body.h"
#include "tests/support/study.h"

namespace palpate {
namespace {

constexpr double side = 0.04, height = 0.03;  // [m]
constexpr int refinement = 2;

struct Options {
  std::vector<double> widths = {8, 16};
  std::vector<double> rings = {1, 2, 3, 4};
  std::vector<double> levels = {0.05, 0.1, 0.15, 0.2, 0.25, 0.3};
  int cells = 10;
};

Options read(int count, char** words) {
  Options options;
  const std::map<std::string, std::function<void(const std::string&)>> known = {
      {"--widths", [&](const std::string& text) { options.widths = test::numbers(text); }},
      {"--rings", [&](const std::string& text) { options.rings = test::numbers(text); }},
      {"--levels", [&](const std::string& text) { options.levels = test::numbers(text); }},
      {"--cells", [&](const std::string& text) { options.cells = static_cast<int>(test::number(text)); }}};
  for (int k = 1; k + 1 < count; k += 2) {
    const auto option = known.find(words[k]);
    if (option == known.end()) throw Error("is no option", words[k], "see the head of the study's source");
    option->second(words[k + 1]);
  }
  return options;
}

Model block(int cells) {
  Model model;
  model.mesh = generate(BoxShape{Vec3::Zero(), {side, side, height}, {cells, cells, cells * 4 / 5}});
  model.materials = {Material{.youngs_modulus = 5e3, .poissons_ratio = 0.45, .density = 1000.0}};
  model.material_of_element.assign(static_cast<std::size_t>(model.mesh.elements()), 0);
  for (const Vec3& node : model.mesh.nodes) model.fixed.push_back(node.z() < 1e-9 ? 7 : 0);
  model.rest_displacement.assign(model.mesh.nodes.size(), Vec3::Zero());
  return model;
}

bool is_under(const Vec3& node, double width) {
  return node.z() > height - 1e-9 &&
         (node.head<2>() - Eigen::Vector2d::Constant(0.5 * side)).cwiseAbs().maxCoeff() < 0.5 * width + 1e-9;
}

/// The height of all nodes under the punch, by the body's unknowns: those of the patch, and of the body
/// beside it.
test::MixedBody::Sparse heights(const Model& model, const PatchMesh& patch, const test::MixedBody& mixed,
                                double width) {
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::Index rows = 0;
  const Eigen::SparseMatrix<double, Eigen::RowMajor> of_patch = mixed.of_patch(), of_body = mixed.of_body();
  const auto add = [&](const Eigen::SparseMatrix<double, Eigen::RowMajor>& Z, std::size_t node) {
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(
             Z, 3 * static_cast<Eigen::Index>(node) + 2);
         it; ++it)
      entries.emplace_back(rows, it.col(), it.value());
    ++rows;
  };
  for (std::size_t node = 0; node < patch.local.nodes.size(); ++node) {
    // On the border of the patch fine nodes follow the body's: they are no unknowns of their own.
    const bool is_own = patch.body_node[node] >= 0 || patch.free_dof[3 * node + 2] >= 0;
    if (is_own && is_under(patch.local.nodes[node], width)) add(of_patch, node);
  }
  for (std::size_t node = 0; node < model.mesh.nodes.size(); ++node) {
    const bool is_in_patch =
        std::binary_search(patch.nodes.begin(), patch.nodes.end(), static_cast<Index>(node));
    if (!is_in_patch && is_under(model.mesh.nodes[node], width)) add(of_body, node);
  }
  test::MixedBody::Sparse A(rows, mixed.dofs());
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

/// Forces on the punch [N] at all levels; those that are not found are not a number.
std::vector<double> press(const Model& model, const PatchMesh& patch, LiveLaw outside, LiveLaw inside,
                          double width, const std::vector<double>& levels) {
  test::MixedBody mixed(model, patch, outside, inside);
  const test::MixedBody::Sparse A = heights(model, patch, mixed, width);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(mixed.dofs()), multipliers;
  std::vector<double> forces;
  for (const double level : levels) {
    const bool is_found = mixed.find(Eigen::VectorXd::Zero(mixed.dofs()), A,
                                     Eigen::VectorXd::Constant(A.rows(), -level * height), q, multipliers);
    forces.push_back(is_found ? multipliers.sum() : std::nan(""));
    if (!is_found) q.setZero();
  }
  return forces;
}

void study(const Options& options) {
  const Model model = block(options.cells);
  const ElementsAtNodes at(model.mesh);
  Index centre = 0;
  const Vec3 top(0.5 * side, 0.5 * side, height);
  for (Index node = 0; node < std::ssize(model.mesh.nodes); ++node) {
    if ((model.mesh.nodes[static_cast<std::size_t>(node)] - top).norm() <
        (model.mesh.nodes[static_cast<std::size_t>(centre)] - top).norm())
      centre = node;
  }
  fmt::print("width_mm,rings,level,neo_hookean_N,patched_N,linear_N\n");
  for (const double width : options.widths) {
    for (const double rings : options.rings) {
      const PatchMesh patch = make_patch_mesh(
          model, at, rings_round(model.mesh, at, {&centre, 1}, static_cast<int>(rings)), refinement);
      const auto by = [&](LiveLaw outside, LiveLaw inside) {
        return press(model, patch, outside, inside, 1e-3 * width, options.levels);
      };
      const std::vector<double> truth = by(LiveLaw::neo_hookean, LiveLaw::neo_hookean);
      const std::vector<double> patched = by(LiveLaw::linear, LiveLaw::neo_hookean);
      const std::vector<double> linear = by(LiveLaw::linear, LiveLaw::linear);
      for (std::size_t k = 0; k < options.levels.size(); ++k)
        fmt::print("{},{},{},{:.9g},{:.9g},{:.9g}\n", width, rings, options.levels[k], truth[k], patched[k],
                   linear[k]);
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace palpate

int main(int count, char** words) {
  try {
    palpate::study(palpate::read(count, words));
  } catch (const palpate::Error& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 1;
  }
  return 0;
}
