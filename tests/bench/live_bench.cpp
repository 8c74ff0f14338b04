// What a step of a live body costs, and the largest bodies that step at 60 Hz and at 1 kHz.
//
// Boxes of soft tissue, 100 x 60 x 50 mm, of tet4, clamped below; a patch of the top is pushed to and fro.
// For each law and way to step, boxes grow until a step takes longer than a picture (1/60 s); the nodes that
// fit into 1/60 s and into 1 ms are interpolated between boxes. A step is as long as the time that it may
// take. Processor time of one thread: a busy machine does not matter.
//
//   factor:    implicit Euler, LDL^T of each tangent, one step of Newton's
//   converged: the same, Newton's method to 1e-5
//   gradients: one step of Newton's by conjugate gradients (Fagerholt's method), preconditioned by an older
//   factor explicit:  semi-implicit Euler in as many steps as are stable selective: Fagerholt's selective
//   product, K^-1 f with f on 12 nodes: what small strain takes for the same
//
// Prints Markdown.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <optional>
#include <string>
#include <vector>

#include "runtime/live/live_stepper.h"
#include "tests/support/bodies/live_bodies.h"

namespace palpate::test {
namespace {

using Eigen::VectorXd;

double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

LiveInput box(int cells) {
  const Material material{.youngs_modulus = 5e3, .poissons_ratio = 0.45, .density = 1000.0};
  const std::array<int, 3> counts = {cells, std::max(cells * 3 / 5, 1), std::max(cells / 2, 1)};
  LiveInput input = live_input_of(generate(BoxShape{Vec3::Zero(), Vec3(0.1, 0.06, 0.05), counts}), material);
  hold(
      input, [](const Vec3& x) { return x.z() < 1e-9; }, 7);
  return input;
}

/// A push on the middle of the top [N].
VectorXd push_on(const LiveBody& body, double force) {
  VectorXd push = VectorXd::Zero(body.dofs());
  std::vector<Eigen::Index> nodes;
  for (Eigen::Index k = 0; k < push.size(); k += 3) {
    const Vec3 x = body.rest().segment<3>(k);
    if (x.z() > 0.05 - 1e-9 && (x - Vec3(0.05, 0.03, 0.05)).norm() < 0.016) nodes.push_back(k);
  }
  for (const Eigen::Index k : nodes) push[k + 2] = -force / static_cast<double>(nodes.size());
  return push;
}

enum class Way { factor, converged, gradients, explicit_steps };

/// Processor time of a step of h [s] of a body that is pushed, its median.
double step_time(const LiveBody& body, Way way, double h) {
  StepperOptions options{.time_step = h, .scheme = {.tolerance = 1e-5}};
  if (way == Way::factor || way == Way::gradients) options.scheme.most_newton = 1;
  if (way == Way::gradients) {
    options.scheme.solver = {
        .kind = SolverKind::conjugate_gradient, .tolerance = 1e-3, .most_iterations = 20};
  }
  int parts = 1;
  if (way == Way::explicit_steps) {
    options.scheme.integrator = Integrator::semi_implicit_euler;
    const double limit = longest_step_at(body, LargestFrequency(body).estimate(body.rest(), {}, 100));
    parts = static_cast<int>(std::ceil(h / (0.7 * limit)));
    options.time_step = h / parts;
  }
  LiveStepper stepper(body, options);
  LiveState state(body);
  const VectorXd push = push_on(body, 0.3);
  std::vector<double> times;
  for (int k = 0; k < 12; ++k) {
    const double begin = processor_seconds();
    const VectorXd now = std::sin(0.5 * k) * push;
    for (int part = 0; part < parts; ++part) stepper.step(state, now);
    if (k >= 3) times.push_back(processor_seconds() - begin);
  }
  std::nth_element(times.begin(), times.begin() + 4, times.end());
  return times[4];
}

/// u = K^-1 f of all surface dofs, f on 12 nodes: 36 columns of a dense matrix.
double selective_time(const LiveBody& body) {
  const Eigen::Index surface =
      6 * static_cast<Eigen::Index>(std::pow(static_cast<double>(body.dofs()) / 3.0, 2.0 / 3.0));
  const Eigen::MatrixXd columns = Eigen::MatrixXd::Random(3 * surface, 36);
  const VectorXd f = VectorXd::Random(36);
  VectorXd u;
  const double begin = processor_seconds();
  for (int k = 0; k < 100; ++k) {
    u.noalias() = columns * f;
    u[0] += static_cast<double>(k);
  }
  return (processor_seconds() - begin) / 100.0;
}

struct Sample {
  double nodes, seconds;
};

/// Nodes at which a step takes `seconds`, between the samples by powers.
std::string nodes_at(const std::vector<Sample>& samples, double seconds) {
  if (samples.empty() || samples.front().seconds > seconds) return "fewer";
  for (std::size_t k = 1; k < samples.size(); ++k) {
    if (samples[k].seconds < seconds) continue;
    const Sample &a = samples[k - 1], &b = samples[k];
    const double share = std::log(seconds / a.seconds) / std::log(b.seconds / a.seconds);
    return fmt::format("{:.0f}", a.nodes * std::pow(b.nodes / a.nodes, share));
  }
  return fmt::format("more than {:.0f}", samples.back().nodes);
}

void table_of(LiveLaw law, Way way, const char* name) {
  std::vector<std::string> largest;
  std::string at_1000 = "-";
  for (const double h : {1.0 / 60.0, 1e-3}) {
    std::vector<Sample> samples;
    for (const int cells : {2, 3, 4, 5, 6, 8, 10, 12, 15, 18, 21, 24, 28}) {
      const LiveBody body(box(cells), {.law = law, .damping = {.mass = 1.0}});
      samples.push_back({static_cast<double>(body.dofs()) / 3.0, step_time(body, way, h)});
      if (h > 0.01 && cells == 15) at_1000 = fmt::format("{:.2f}", 1e3 * samples.back().seconds);
      if (samples.back().seconds > h) break;
    }
    largest.push_back(nodes_at(samples, h));
  }
  fmt::print("| {} | {} | {} | {} | {} |\n", name_of(law), name, largest[0], largest[1], at_1000);
  std::fflush(stdout);
}

}  // namespace
}  // namespace palpate::test

int main() {
  using namespace palpate;
  using test::Way;
  fmt::print(
      "| law | step | nodes at 60 Hz | nodes at 1 kHz | ms a step of 1 280 nodes at 60 Hz "
      "|\n|---|---|---|---|---|\n");
  for (const LiveLaw law : {LiveLaw::linear, LiveLaw::corotational, LiveLaw::neo_hookean}) {
    test::table_of(law, Way::factor, "factor");
    test::table_of(law, Way::converged, "converged");
    test::table_of(law, Way::gradients, "gradients");
    test::table_of(law, Way::explicit_steps, "explicit");
  }
  const LiveBody body(test::box(15), {});
  fmt::print("\nselective product, {} nodes, 12 of them loaded: {:.3f} ms\n", body.dofs() / 3,
             1e3 * test::selective_time(body));
}
