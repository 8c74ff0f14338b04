// Large deformation by the live laws, and as input of CalculiX.
//
//   live_study FOLDER
//
// Writes to FOLDER, for each case, NAME.inp for CalculiX and NAME.csv with our figures: a row a level and
// law; and for tet10 curves/NAME.csv, with levels in small steps and without CalculiX.
// scripts/studies/live-truth runs it and CalculiX.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/bodies/live_cases.h"

namespace palpate::test {
namespace {

void write_nodes_and_elements(const LargeCase& large, std::ofstream& out) {
  const Mesh& mesh = large.input.mesh;
  out << "*NODE, NSET=ALL\n";
  for (std::size_t k = 0; k < mesh.nodes.size(); ++k) {
    const Vec3& x = mesh.nodes[k];
    out << fmt::format("{}, {:.17g}, {:.17g}, {:.17g}\n", k + 1, x.x(), x.y(), x.z());
  }
  out << fmt::format("*ELEMENT, TYPE={}, ELSET=BODY\n",
                     mesh.element == ElementType::tet10 ? "C3D10" : "C3D4");
  for (Index e = 0; e < mesh.elements(); ++e) {
    out << e + 1;
    for (const Index node : mesh.element_nodes(e)) out << ", " << node + 1;
    out << '\n';
  }
  out << "*NSET, NSET=MOVED\n";
  for (const Index node : large.moved) out << node + 1 << ",\n";
}

/// Nodes that are held and do not move.
void write_held(const LargeCase& large, std::ofstream& out) {
  std::vector<bool> is_moved(large.input.mesh.nodes.size());
  for (const Index node : large.moved) is_moved[static_cast<std::size_t>(node)] = true;
  out << "*BOUNDARY\n";
  for (std::size_t k = 0; k < large.input.fixed.size(); ++k) {
    if (large.input.fixed[k] != 0 && !is_moved[k]) out << fmt::format("{}, 1, 3\n", k + 1);
  }
}

/// A step to a level from the one before.
void write_step(const LargeCase& large, double level, std::ofstream& out) {
  out << "*STEP, NLGEOM, INC=200\n*STATIC\n0.2, 1., 1e-5, 0.5\n*BOUNDARY\n";
  for (const Index node : large.moved) {
    const Vec3& rest = large.input.mesh.nodes[static_cast<std::size_t>(node)];
    const Vec3 u = large.place(rest, level) - rest;
    for (int axis = 0; axis < 3; ++axis) {
      if ((large.moved_axes >> axis) & 1)
        out << fmt::format("{}, {}, {}, {:.11e}\n", node + 1, axis + 1, axis + 1, u[axis]);
    }
  }
  out << "*NODE PRINT, NSET=MOVED, FREQUENCY=999\nU, RF\n*END STEP\n";
}

void write_case(const LargeCase& large, const std::string& folder) {
  const double E = large_material.youngs_modulus, nu = large_material.poissons_ratio;
  std::ofstream out(folder + "/" + large.name + ".inp");
  write_nodes_and_elements(large, out);
  // C10 = mu / 2, D1 = 2 / kappa.
  out << fmt::format("*MATERIAL, NAME=TISSUE\n*HYPERELASTIC, NEO HOOKE\n{:.17g}, {:.17g}\n",
                     E / (4 * (1 + nu)), 6 * (1 - 2 * nu) / E);
  out << "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE\n";
  write_held(large, out);
  double reached = 0.0;
  for (const double level : large.levels) {
    // An arc is not a straight way: half way there first.
    if (large.name.starts_with("bending")) {
      for (double at = reached + 7.5; at < level - 1.0; at += 7.5) write_step(large, at, out);
    }
    if (large.name.starts_with("bar") && level == 1.25) write_step(large, 1.0, out);
    write_step(large, level, out);
    reached = level;
  }
}

/// Figures of a case by each law.
void write_figures(const LargeCase& large, const std::string& file) {
  std::ofstream out(file);
  out << "law,level,figure\n";
  for (const LiveLaw law : {LiveLaw::neo_hookean, LiveLaw::corotational, LiveLaw::linear}) {
    const std::vector<double> figures = solve_large(large, law);
    for (std::size_t k = 0; k < figures.size(); ++k)
      out << fmt::format("{},{},{:.10g}\n", name_of(law), large.levels[k], figures[k]);
  }
}

/// The case in small steps.
LargeCase in_small_steps(LargeCase large) {
  large.parts = 4;
  if (large.name.starts_with("bending")) {
    large.levels = {1, 2, 3, 4, 5, 6, 8, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85, 90};
  } else if (large.name.starts_with("bar")) {
    large.levels = {1.02, 1.04, 1.06, 1.08, 1.1, 1.15, 1.2, 1.3, 1.4, 1.5};
  } else {
    large.levels = {0.01, 0.02, 0.04, 0.06, 0.08, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25, 0.275, 0.3};
  }
  return large;
}

}  // namespace
}  // namespace palpate::test

int main(int argc, char** argv) {
  using namespace palpate;
  if (argc != 2) {
    fmt::print(stderr, "usage: live_study FOLDER\n");
    return 2;
  }
  const std::string folder = argv[1];
  std::filesystem::create_directory(folder + "/curves");
  for (const test::LargeCase& large : test::large_cases()) {
    test::write_case(large, folder);
    test::write_figures(large, folder + "/" + large.name + ".csv");
    if (large.input.mesh.element == ElementType::tet10)
      test::write_figures(test::in_small_steps(large), folder + "/curves/" + large.name + ".csv");
  }
}
