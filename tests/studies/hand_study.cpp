// What contact of many points costs: a sphere is pressed into a body and slides over it.
//
//   hand_study BODY.palpate.hdf [--at X,Y,Z] [--along X,Y,Z] [--slide X,Y,Z] [--depth M] [--radius M,M,...]
//              [--friction MU,MU,...] [--coupling N/M] [--max-contacts N] [--repeat N] [--ticks FILE.csv]
//
// The sphere comes along --along through --at, presses in by --depth [m] from where it touches at 15 mm/s and
// then moves by --slide [m] at 50 mm/s. A line of a table for each radius and friction. Times are those of
// the tick's own thread (its processor time, not the clock's), each tick's the least of --repeat runs, which
// have to agree to the last bit. scripts/studies/hand runs it.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/core/tick/step.h"
#include "tests/bench/palpation_paths.h"
#include "tests/support/study.h"

namespace palpate {
namespace {

constexpr double pressing_speed = 0.015, sliding_speed = 0.05;  // [m/s]
constexpr double first_gap = 0.0005;                            // [m]

struct Options {
  std::string body;
  Vec3 at{0.155, 0.0, 0.117};  // the middle of the demo's liver, from below
  Vec3 along{0.0, 1.0, 0.0};
  Vec3 slide{0.04, 0.0, 0.0};
  double depth = 0.028;
  std::vector<double> radius = {0.015, 0.03, 0.05, 0.15, 0.5};
  std::vector<double> friction = {0.2};
  double coupling = std::numeric_limits<double>::infinity();
  Index max_contacts = 256;
  int repeat = 3;
  std::string ticks;
};

Options read(int count, char** words) {
  Options options;
  const std::map<std::string, std::function<void(const std::string&)>> known = {
      {"--at", [&](const std::string& text) { options.at = test::vector(text); }},
      {"--along", [&](const std::string& text) { options.along = test::vector(text).normalized(); }},
      {"--slide", [&](const std::string& text) { options.slide = test::vector(text); }},
      {"--depth", [&](const std::string& text) { options.depth = test::numbers(text)[0]; }},
      {"--radius", [&](const std::string& text) { options.radius = test::numbers(text); }},
      {"--friction", [&](const std::string& text) { options.friction = test::numbers(text); }},
      {"--coupling", [&](const std::string& text) { options.coupling = test::numbers(text)[0]; }},
      {"--max-contacts", [&](const std::string& text) { options.max_contacts = std::atoi(text.c_str()); }},
      {"--repeat", [&](const std::string& text) { options.repeat = std::atoi(text.c_str()); }},
      {"--ticks", [&](const std::string& text) { options.ticks = text; }}};
  options.body = test::read_options(count, words, known);
  return options;
}

std::vector<ToolPose> path(const Body& body, const Options& options, double radius) {
  const test::RestSurface surface(body);
  // From far outside towards the body until it all but touches.
  Vec3 place = options.at - options.along * options.along.dot(options.at - body.bounds().center());
  place -= options.along * (body.bounds().diagonal().norm() + radius);
  for (int k = 0; k < 10000; ++k) {
    const double gap = surface.distance(place) - radius;
    if (gap < 1.01 * first_gap) break;
    place += (gap - first_gap) * options.along;
  }
  std::vector<ToolPose> poses;
  const auto go = [&](const Vec3& way, double speed) {
    const auto ticks = static_cast<int>(way.norm() / (speed * test::tick));
    for (int k = 1; k <= ticks; ++k) {
      ToolPose pose;
      pose.position = place + way * k / ticks;
      poses.push_back(pose);
    }
    place += way;
  };
  go((options.depth + first_gap) * options.along, pressing_speed);
  go(options.slide, sliding_speed);
  return poses;
}

struct Tick {
  double seconds = std::numeric_limits<double>::infinity();
  Vec3 force = Vec3::Zero();
  StepStatus status = StepStatus::ok;
  Index points = 0;
  Index closed = 0;
  Index nodes = 0;  // that closed contact points press on
};

std::vector<Tick> play(const Body& body, const Options& options, const std::vector<ToolPose>& poses,
                       double radius, double friction) {
  const Tool tool{.radius = radius,
                  .coupling_stiffness = options.coupling,
                  .hand_over = std::numeric_limits<double>::infinity(),
                  .friction = friction};
  std::vector<Tick> ticks(poses.size());
  for (int run = 0; run < options.repeat; ++run) {
    State state(body, {.tools = {tool}, .max_contacts = options.max_contacts});
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const double begin = test::processor_time();
      const StepStatus status = step(body, state, poses[k]);
      Tick& tick = ticks[k];
      tick.seconds = std::min(tick.seconds, test::processor_time() - begin);
      const Vec3& force = state.tools.front().contact_wrench.force;
      if (run > 0 && tick.force != force)
        throw std::runtime_error(fmt::format("tick {} is not the same again", k));
      tick.force = force;
      tick.status = status;
      tick.points = state.contact_count;
      tick.closed = state.tools.front().contacts;
      tick.nodes = test::pressed_nodes(body, state);
    }
  }
  return ticks;
}

void print(const std::vector<Tick>& ticks, double radius, double friction) {
  std::vector<double> times;
  double largest_force = 0.0, jump = 0.0;
  Index points = 0, closed = 0, nodes = 0;
  int full = 0, rough = 0, late = 0;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    const Tick& tick = ticks[k];
    if (tick.closed > 0) times.push_back(1e6 * tick.seconds);
    largest_force = std::max(largest_force, tick.force.norm());
    if (k > 0) jump = std::max(jump, (tick.force - ticks[k - 1].force).norm());
    points = std::max(points, tick.points);
    closed = std::max(closed, tick.closed);
    nodes = std::max(nodes, tick.nodes);
    full += has(tick.status, StepStatus::capacity_full) ? 1 : 0;
    rough += has(tick.status, StepStatus::not_converged) ? 1 : 0;
    late += tick.seconds > 1e-3 ? 1 : 0;
  }
  std::ranges::sort(times);
  const auto quantile = [&](double share) {
    return times.empty() ? 0.0
                         : times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
  };
  fmt::print(
      "| {:.0f} | {:g} | {} / {} / {} | {:.4f} | {:.1f} | {} | {} | {:.0f} / {:.0f} / {:.0f} | {} of {} |\n",
      1e3 * radius, friction, nodes, closed, points, largest_force, 1e3 * jump, rough, full, quantile(0.5),
      quantile(0.999), quantile(1.0), late, ticks.size());
  std::fflush(stdout);
}

void study(const Options& options) {
  const Body body(load_model(options.body));
  fmt::print("{}: {} surface nodes, edges of {:.2f} mm\n\n", options.body,
             body.surface_rest_positions().size(), 1e3 * body.mean_surface_edge());
  fmt::print(
      "| R [mm] | friction | nodes pressed / closed / points at most | force at most [N] | largest change in "
      "a tick [mN] | "
      "not converged "
      "| capacity full | tick: median / 99.9 % / largest [us] | over 1 ms "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  std::ofstream csv;
  if (!options.ticks.empty()) csv.open(options.ticks);
  if (csv) csv << "radius,friction,tick,us,fx,fy,fz,status,points,closed\n";
  for (const double friction : options.friction) {
    for (const double radius : options.radius) {
      const std::vector<Tick> ticks = play(body, options, path(body, options, radius), radius, friction);
      print(ticks, radius, friction);
      for (std::size_t k = 0; csv && k < ticks.size(); ++k) {
        const Tick& tick = ticks[k];
        csv << fmt::format("{},{},{},{:.2f},{:.9g},{:.9g},{:.9g},{},{},{}\n", radius, friction, k,
                           1e6 * tick.seconds, tick.force.x(), tick.force.y(), tick.force.z(),
                           static_cast<unsigned>(tick.status), tick.points, tick.closed);
      }
    }
  }
}

}  // namespace
}  // namespace palpate

int main(int count, char** words) {
  try {
    palpate::study(palpate::read(count, words));
    return 0;
  } catch (const palpate::Error& error) {
    std::fputs(palpate::to_text(error).c_str(), stderr);
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
