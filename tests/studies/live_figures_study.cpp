// What the ways to step and to model a live body are worth.
//
//   live_figures_study springs|keeps|limits [FOLDER]
//
//   springs: stiffness and Poisson's ratio of springs fitted to Young's modulus, against elements of the
//            same mesh
//   keeps:   energy and momenta of each integrator
//   limits:  over E and step, which explicit steps grow, and the limit from which they are refused
//
// Prints Markdown; what is drawn goes into FOLDER. scripts/studies/live-figures runs it.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

#include "runtime/live/live_stepper.h"
#include "statics/balance.h"
#include "tests/support/bodies/live_bodies.h"
#include "tests/support/bodies/springs.h"
#include "tests/support/bodies/thrown_bodies.h"

namespace palpate::test {
namespace {

using Eigen::VectorXd;

constexpr double E0 = 5e3, side = 0.03;

// --- springs ---

/// A cube of so many cells along each side; `shake`: inner nodes moved by up to that share of a cell.
Mesh cube(int cells, double shake) {
  Mesh mesh = generate(BoxShape{Vec3::Zero(), Vec3::Constant(side), {cells, cells, cells}});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> move(-shake * side / cells, shake * side / cells);
  for (Vec3& node : mesh.nodes) {
    const Vec3 by(move(random), move(random), move(random));
    for (int axis = 0; axis < 3; ++axis) {
      if (node[axis] > 1e-9 && node[axis] < side - 1e-9) node[axis] += by[axis];
    }
  }
  return mesh;
}

enum class Model { elements, springs };

/// E and nu that a cube shows which is pulled along an axis.
Eigen::Vector2d pulled(const Mesh& mesh, double nu, Model model, int axis) {
  LiveInput input = live_input_of(mesh, {.youngs_modulus = E0, .poissons_ratio = nu});
  for (int k = 0; k < 3; ++k) {
    hold(
        input, [k, axis](const Vec3& x) { return x[k] < 1e-9 || (k == axis && x[k] > side - 1e-9); },
        static_cast<std::uint8_t>(1U << static_cast<unsigned>(k)));
  }
  const LiveBody body(std::move(input), {.law = LiveLaw::corotational});
  VectorXd x = body.start(), f;
  const double e = 1e-6;
  for (Eigen::Index k = 0; k < x.size(); k += 3) {
    if (body.rest()[k + axis] > side - 1e-9) x[k + axis] += e * side;
  }
  if (model == Model::springs) {
    const std::vector<Spring> springs = fitted_springs(mesh, E0);
    find_balance(springs, body, VectorXd::Zero(x.size()), x);
    f = forces_of(springs, x).f;
  } else {
    find_balance(body, VectorXd::Zero(x.size()), {}, x, {.tolerance = 1e-8});
    internal_forces(body, x, {}, f);
  }
  double force = 0.0, across = 0.0;
  int count = 0;
  for (Eigen::Index k = 0; k < x.size(); k += 3) {
    if (body.rest()[k + axis] > side - 1e-9) force -= f[k + axis];
    for (int other = 0; other < 3; ++other) {
      if (other == axis || body.rest()[k + other] < side - 1e-9) continue;
      across += (x[k + other] - body.rest()[k + other]) / side;
      ++count;
    }
  }
  return {force / (side * side) / e, -across / count / e};
}

/// A cantilever that sinks under its weight: [d N] positions.
VectorXd sagging(Model model, double nu, LiveBody& body) {
  LiveInput input = live_input_of(generate(BoxShape{Vec3::Zero(), Vec3(0.08, 0.02, 0.02), {16, 4, 4}}),
                                  {.youngs_modulus = 30 * E0, .poissons_ratio = nu, .density = 1000.0});
  hold(
      input, [](const Vec3& x) { return x.x() < 1e-9; }, 7);
  body = LiveBody(std::move(input), {.law = LiveLaw::corotational, .gravity = Vec3(0, 0, -9.81)});
  VectorXd x = body.start();
  const std::vector<Spring> springs = fitted_springs(body.mesh(), 30 * E0);
  for (const double share : {0.25, 0.5, 0.75, 1.0}) {
    if (model == Model::springs) {
      find_balance(springs, body, share * body.load(), x);
    } else {
      find_balance(body, share * body.load(), {}, x);
    }
  }
  return x;
}

double sinking_of_end(const LiveBody& body, const VectorXd& x) {
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index k = 0; k < x.size(); k += 3) {
    if (body.rest()[k] < 0.08 - 1e-9) continue;
    sum += body.rest()[k + 2] - x[k + 2];
    ++count;
  }
  return sum / count;
}

/// The nodes of the side y = 0 row by row, for the picture.
void write_side(const LiveBody& body, const VectorXd& x, const char* name, std::ofstream& out) {
  for (Eigen::Index k = 0; k < x.size(); k += 3) {
    if (body.rest()[k + 1] < 1e-9)
      out << fmt::format("{},{:.6g},{:.6g},{:.8g},{:.8g}\n", name, body.rest()[k], body.rest()[k + 2], x[k],
                         x[k + 2]);
  }
}

void compare_springs(const std::string& folder) {
  fmt::print(
      "| mesh | ν of the material | elements: E, ν | springs pulled along x: E, ν | along z: E, ν |\n"
      "|---|---|---|---|---|\n");
  for (const auto& [name, cells, shake] : {std::tuple("2 × 2 × 2 cells", 2, 0.0),
                                           {"4 × 4 × 4", 4, 0.0},
                                           {"8 × 8 × 8", 8, 0.0},
                                           {"8 × 8 × 8, nodes shaken by 25 %", 8, 0.25}}) {
    for (const double nu : {0.0, 0.45}) {
      const Mesh mesh = cube(cells, shake);
      const Eigen::Vector2d elements = pulled(mesh, nu, Model::elements, 0),
                            along_x = pulled(mesh, nu, Model::springs, 0),
                            along_z = pulled(mesh, nu, Model::springs, 2);
      fmt::print("| {} | {:.2f} | {:.3f} E, {:.3f} | {:.3f} E, {:.3f} | {:.3f} E, {:.3f} |\n", name, nu,
                 elements[0] / E0, elements[1], along_x[0] / E0, along_x[1], along_z[0] / E0, along_z[1]);
    }
  }
  LiveBody body(live_block(ElementType::tet4), {});
  std::ofstream out(folder + "/springs.csv");
  out << "law,x0,z0,x,z\n";
  fmt::print(
      "\n| cantilever under its weight, ν | sinking by elements [mm] | by springs [mm] |\n|---|---|---|\n");
  for (const double nu : {0.0, 0.25, 0.45}) {
    const VectorXd elements = sagging(Model::elements, nu, body);
    const double by_elements = 1e3 * sinking_of_end(body, elements);
    if (nu == 0.45) write_side(body, elements, "elements", out);
    const VectorXd springs = sagging(Model::springs, nu, body);
    if (nu == 0.45) write_side(body, springs, "springs", out);
    fmt::print("| {:.2f} | {:.2f} | {:.2f} |\n", nu, by_elements, 1e3 * sinking_of_end(body, springs));
  }
}

// --- what is kept ---

LiveState thrown(const LiveBody& body) {
  LiveState state(body);
  for (Eigen::Index k = 0; k < state.x.size(); k += 3) {
    state.x[k] *= 1.05;
    state.x[k + 1] += 0.4 * body.rest()[k] * body.rest()[k];
  }
  throw_body(body, Mat3::Identity(), Vec3(1, 2, 0), Vec3(0.3, -0.2, 0.1), Vec3(4, 9, -7), state);
  return state;
}

/// Of a block that turns and swings in space for a second, without damping.
void table_of_what_is_kept() {
  fmt::print(
      "| integrator | step [ms] | energy after 1 s | momentum off by | angular momentum off by |\n"
      "|---|---|---|---|---|\n");
  const LiveBody body(live_block(ElementType::tet4), {.law = LiveLaw::corotational});
  for (const auto& [integrator, h] :
       {std::pair(Integrator::semi_implicit_euler, 4e-4), std::pair(Integrator::implicit_euler, 1e-3),
        std::pair(Integrator::implicit_euler, 5e-3), std::pair(Integrator::midpoint, 1e-3),
        std::pair(Integrator::midpoint, 5e-3)}) {
    LiveStepper stepper(
        body, {.time_step = h, .scheme = {.integrator = integrator, .tolerance = 1e-12, .most_newton = 60}});
    LiveState state = thrown(body);
    const Momenta before = momenta_of(body, state);
    for (int k = 0; k < std::lround(1.0 / h); ++k) stepper.step(state);
    const Momenta after = momenta_of(body, state);
    fmt::print("| {} | {} | {:.1f} % | {:.0e} | {:.0e} |\n", name_of(integrator), 1e3 * h,
               100.0 * after.energy() / before.energy(),
               (after.linear - before.linear).norm() / before.linear.norm(),
               (after.angular - before.angular).norm() / before.angular.norm());
  }
}

// --- stability ---

/// Whether a block that is shaken a little still swings as little after a thousand steps of semi-implicit
/// Euler.
bool stays_small(const LiveBody& body, double h) {
  VectorXd x = body.rest(), v = VectorXd::Zero(x.size()), f;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> move(-1e-7, 1e-7);
  for (const Index dof : body.dof_of_free()) x[dof] += move(random);
  for (int k = 0; k < 1000; ++k) {
    internal_forces(body, x, {}, f);
    add_damping_forces(body, x, v, {}, f);
    for (const Index dof : body.dof_of_free()) v[dof] += h * f[dof] / body.mass()[dof];
    x += h * v;
    if (!((x - body.rest()).cwiseAbs().maxCoeff() < 1e-4)) return false;
  }
  return true;
}

void map_of_limits(const std::string& folder) {
  std::ofstream map(folder + "/map.csv"), lines(folder + "/limits.csv");
  map << "E,h,stable\n";
  lines << "E,limit\n";
  fmt::print(
      "| longest stable step at E = 1 kPa [ms] | 10 kPa | 100 kPa | 1 MPa | steps above the limit that did "
      "not grow, below it that grew |\n|---|---|---|---|---|\n|");
  int above = 0, below = 0;
  for (int k = 0; k <= 12; ++k) {
    const double E = 1e3 * std::pow(10.0, k / 4.0);
    LiveInput input = live_block(ElementType::tet4);
    input.materials[0].youngs_modulus = E;
    hold(
        input, [](const Vec3& x) { return x.x() < 1e-9; }, 7);
    const LiveBody body(std::move(input),
                        {.law = LiveLaw::corotational, .damping = {.mass = 1.0, .stiffness = 1e-5}});
    const double limit = longest_step_at(body, LargestFrequency(body).estimate(body.rest(), {}, 300));
    lines << fmt::format("{:.6g},{:.6g}\n", E, limit);
    if (k % 4 == 0) fmt::print(" {:.3g} |", 1e3 * limit);
    for (int step = 0; step < 17; ++step) {
      const double h = 1e-5 * std::pow(10.0, step / 5.0);
      const bool stable = stays_small(body, h);
      map << fmt::format("{:.6g},{:.6g},{}\n", E, h, stable ? 1 : 0);
      above += stable && h > 1.001 * limit;
      below += !stable && h < 0.999 * limit;
    }
  }
  fmt::print(" {}, {} |\n", above, below);
}

}  // namespace
}  // namespace palpate::test

int main(int argc, char** argv) {
  using namespace palpate;
  const std::string_view what = argc > 1 ? argv[1] : "";
  const std::string folder = argc > 2 ? argv[2] : ".";
  if (what == "springs") {
    test::compare_springs(folder);
  } else if (what == "keeps") {
    test::table_of_what_is_kept();
  } else if (what == "limits") {
    test::map_of_limits(folder);
  } else {
    fmt::print(stderr, "usage: live_figures_study springs|keeps|limits [FOLDER]\n");
    return 2;
  }
}
