// Spheres that come to rest on a body, with and without a grab: whether their force does, too.
//
//   rest_study BODY [CASES [FIRST]]
//     CASES random grabs, and as many rests without one; a line for each whose force changes at rest
//   rest_study BODY trace NUMBER grab|rest [TICKS]
//     the closed contacts of a case in its last ticks
//
// BODY: a .palpate.hdf file, or cube, hex or beam: made here. scripts/studies/rest runs it.
#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "meshes/generate.h"
#include "tests/support/bodies/rest_cases.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate {
namespace {

Model make_model(const std::string& name) {
  constexpr Precision precision = Precision::double_precision;
  if (name == "cube") return test::unit_model(ElementType::tet4, 7, Scope::surface, precision);
  if (name == "hex") return test::unit_model(ElementType::hex8, 7, Scope::surface, precision);
  if (name != "beam") return load_model(name);
  return test::bake(
      generate(BoxShape{.size = {6.0, 1.0, 1.0}, .cells = {24, 4, 4}}),
      [](const Vec3& node) { return node.x() < 1e-12; }, Scope::surface, precision);
}

void print_contacts(const State& state) {
  fmt::print("{} |F| {:.9g} status {:#x}\n", state.ticks, state.tools[0].contact_wrench.force.norm(),
             static_cast<unsigned>(state.status));
  for (const ContactPoint& contact : state.contacts()) {
    if (!contact.held && contact.force.isZero(0.0)) continue;
    fmt::print("    {} simplex {} nodes {} weights {:.4f} gap {:.3e} force {:.6g} along the normal {:.6g}\n",
               contact.held ? "held" : "free", contact.simplex, fmt::join(contact.nodes, " "),
               fmt::join(contact.weights, " "), contact.gap, contact.force.norm(),
               contact.force.dot(contact.frame.col(0)));
  }
}

void print_case(const std::string& kind, std::uint64_t number, const test::Rest& rest) {
  fmt::print("  {} {}: force {:.6g}, changes by {:.2e} of it, {} contacts, status {:#x}\n", kind, number,
             rest.force, rest.change, rest.contacts, static_cast<unsigned>(rest.status));
  std::fflush(stdout);
}

/// What became of all cases.
struct Counts {
  int touch = 0;
  int constant = 0;        // to 1e-9
  int rigid = 0;           // of the others: pressed on what cannot move
  int untold = 0;          // of the others: the status does not say that the force changes
  std::vector<int> ticks;  // to rest
  double worst = 0.0;
};

void add_rest(Counts& counts, const test::Rest& rest) {
  ++counts.touch;
  counts.ticks.push_back(rest.ticks);
  counts.worst = std::max(counts.worst, rest.change);
  if (rest.change <= 1e-9) {
    ++counts.constant;
    return;
  }
  if (has(rest.status, StepStatus::rigid_contact)) ++counts.rigid;
  if (!has(rest.status, StepStatus::unsettled)) ++counts.untold;
}

void run_all(const Body& body, const test::RestSurface& surface, bool grab, std::uint64_t first,
             std::uint64_t cases) {
  Counts counts;
  const std::string kind = grab ? "grab" : "rest";
  for (std::uint64_t k = first; k < first + cases; ++k) {
    const test::Rest rest = test::rest_of(body, test::rest_case(body, surface, k, grab));
    if (!rest.touched) continue;
    add_rest(counts, rest);
    if (rest.change > 1e-9) print_case(kind, k, rest);
  }
  if (counts.touch == 0) return;
  std::sort(counts.ticks.begin(), counts.ticks.end());
  const auto most = [&](double share) {
    return counts.ticks[static_cast<std::size_t>(share * static_cast<double>(counts.touch - 1))];
  };
  fmt::print(
      "{} {}s touch: {} constant to 1e-9, {} not, of which {} press on what is held and {} are not told; "
      "worst {:.1e}; ticks to rest: median {}, 99 % {}\n",
      counts.touch, kind, counts.constant, counts.touch - counts.constant, counts.rigid, counts.untold,
      counts.worst, most(0.5), most(0.99));
  std::fflush(stdout);
}

int study(const std::vector<std::string>& arguments) {
  const Body body(make_model(arguments.at(0)));
  const test::RestSurface surface(body);
  if (arguments.size() > 3 && arguments[1] == "trace") {
    const test::RestCase made =
        test::rest_case(body, surface, std::stoull(arguments[2]), arguments[3] == "grab");
    fmt::print("radius {:.4g} edges, friction {}\n", made.tool.radius / body.mean_surface_edge(),
               *made.tool.friction);
    test::rest_of(body, made, arguments.size() > 4 ? std::stoi(arguments[4]) : 12, print_contacts);
    return 0;
  }
  const std::uint64_t cases = arguments.size() > 1 ? std::stoull(arguments[1]) : 1000;
  const std::uint64_t first = arguments.size() > 2 ? std::stoull(arguments[2]) : 0;
  for (const bool grab : {true, false}) run_all(body, surface, grab, first, cases);
  return 0;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  try {
    return palpate::study({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
