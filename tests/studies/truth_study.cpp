// The runtime's contact forces along trajectories against contact over the whole surface.
//
//   truth_study BODY.palpate.hdf [--tools NAME,...] [--friction MU,MU,...] [--max-contacts N,N,...]
//               [--at X,Y,Z] [--along X,Y,Z] [--slide X,Y,Z] [--depth M] [--deeper M] [--speed M/S]
//               [--every N] [--dense N] [--ticks N] [--csv FILE.csv]
//
// A tool is s15, a sphere of 15 mm, or c20x80, a capsule of radius 20 mm and 80 mm between its ends' middles,
// across --along and --slide. It comes along --along through --at, presses in by --depth [m] (0.8 radii at
// most) at half of --speed and slides by --slide, then by half of it back and by --deeper deeper (0.2 radii
// at most), and back the whole way. The truth (tests/support/second_routes/surface_truth.h) goes the same way
// beside the runtime, with its own forces. Without friction it can be had in every --every-th tick alone;
// where a tool is deep enough for more than one equilibrium that may find another. Times are those of the
// tick's own thread (its processor time); the dense solver is timed in every
// --dense-th tick. A line of a table for each tool, friction and room. scripts/studies/truth runs it.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/core/tick/step.h"
#include "tests/support/second_routes/surface_truth.h"
#include "tests/support/study.h"

namespace palpate {
namespace {

constexpr double tick_time = 1e-3;        // [s]
constexpr double first_gap = 0.0005;      // [m]
constexpr double dense_tolerance = 1e-4;  // [largest force] as the tick's (tuning.many.tolerance)

struct Options {
  std::string body;
  std::vector<std::string> tools = {"s15", "s30", "s50", "s60", "c20x80"};
  std::vector<double> friction = {0.0, 0.2};
  std::vector<double> max_contacts = {256};
  Vec3 at{0.155, 0.0, 0.117};  // the middle of the demo's liver, from below
  Vec3 along{0.0, 1.0, 0.0};
  Vec3 slide{0.02, 0.0, 0.0};
  double depth = 0.02;
  double deeper = 0.01;
  double speed = 0.05;
  int every = 1;
  int dense = 10;
  int ticks = std::numeric_limits<int>::max();
  std::string csv;
};

Options read(int count, char** words) {
  Options options;
  const std::map<std::string, std::function<void(const std::string&)>> known = {
      {"--tools", [&](const std::string& text) { options.tools = test::words_of(text); }},
      {"--friction", [&](const std::string& text) { options.friction = test::numbers(text); }},
      {"--max-contacts", [&](const std::string& text) { options.max_contacts = test::numbers(text); }},
      {"--at", [&](const std::string& text) { options.at = test::vector(text); }},
      {"--along", [&](const std::string& text) { options.along = test::vector(text).normalized(); }},
      {"--slide", [&](const std::string& text) { options.slide = test::vector(text); }},
      {"--depth", [&](const std::string& text) { options.depth = test::number(text); }},
      {"--deeper", [&](const std::string& text) { options.deeper = test::number(text); }},
      {"--speed", [&](const std::string& text) { options.speed = test::number(text); }},
      {"--every", [&](const std::string& text) { options.every = std::max(1, std::atoi(text.c_str())); }},
      {"--dense", [&](const std::string& text) { options.dense = std::max(1, std::atoi(text.c_str())); }},
      {"--ticks", [&](const std::string& text) { options.ticks = std::atoi(text.c_str()); }},
      {"--csv", [&](const std::string& text) { options.csv = text; }}};
  options.body = test::read_options(count, words, known);
  return options;
}

/// A tool, how it is held, and its middle from its origin.
struct Shape {
  Tool tool;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Vec3 middle = Vec3::Zero();
};

Shape shape(const std::string& name, const Options& options) {
  const bool is_capsule = name.starts_with("c");
  if (!is_capsule && !name.starts_with("s"))
    throw Error("is no tool", name, "a sphere is s15 and a capsule c20x80");
  Shape made;
  made.tool.radius = 1e-3 * test::number(name.substr(1));
  made.tool.hand_over = std::numeric_limits<double>::infinity();
  const std::size_t by = name.find('x');
  if (is_capsule && by == std::string::npos) throw Error("is no capsule", name, "c20x80 is one");
  if (!is_capsule) return made;
  made.tool.length = 1e-3 * test::number(name.substr(by + 1));
  const Vec3 axis = options.along.cross(options.slide).normalized();
  made.orientation = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), axis);
  made.middle = 0.5 * made.tool.length * axis;
  return made;
}

/// Distance of a tool whose origin is at `place` from the nodes at rest [m].
double gap(const Body& body, const Shape& made, const Vec3& place) {
  double least = std::numeric_limits<double>::infinity();
  const Vec3 core = 2.0 * made.middle;
  for (const Vec3& node : body.surface_rest_positions()) {
    const double squared = core.squaredNorm();
    const double along = squared > 0.0 ? std::clamp(core.dot(node - place) / squared, 0.0, 1.0) : 0.0;
    least = std::min(least, (node - place - along * core).norm());
  }
  return least - made.tool.radius;
}

/// Places of the tool's origin, tick by tick.
std::vector<Vec3> path(const Body& body, const Options& options, const Shape& made) {
  Vec3 place = options.at - options.along * options.along.dot(options.at - body.bounds().center());
  place -= options.along * (body.bounds().diagonal().norm() + made.tool.radius) + made.middle;
  for (int k = 0; k < 10000 && gap(body, made, place) > 1.01 * first_gap; ++k)
    place += (gap(body, made, place) - first_gap) * options.along;
  std::vector<Vec3> places{place};
  const auto go = [&](const Vec3& way, double speed) {
    const auto ticks = static_cast<int>(std::lround(way.norm() / (speed * tick_time)));
    for (int k = 1; k <= ticks; ++k) places.push_back(place + way * k / ticks);
    place += way;
  };
  const double depth = std::min(options.depth, 0.8 * made.tool.radius);
  const double deeper = std::min(options.deeper, 0.2 * made.tool.radius);
  go((depth + first_gap) * options.along, 0.5 * options.speed);
  go(options.slide, options.speed);
  go(deeper * options.along - 0.5 * options.slide, options.speed);
  go(-0.5 * options.slide, options.speed);
  if (std::ssize(places) > options.ticks) places.resize(static_cast<std::size_t>(options.ticks));
  return places;
}

/// A tick of the runtime.
struct Tick {
  double seconds = 0.0;
  Wrench wrench;
  StepStatus status = StepStatus::ok;
  Index nodes = 0;  // that closed contact points press on
};

std::vector<Tick> play(const Body& body, const Shape& made, double friction, Index room,
                       const std::vector<Vec3>& places) {
  Tool tool = made.tool;
  tool.friction = friction;
  State state(body, {.tools = {tool}, .max_contacts = room});
  std::vector<Tick> ticks;
  for (const Vec3& place : places) {
    ToolPose pose;
    pose.position = place;
    pose.orientation = made.orientation;
    Tick tick;
    const double begin = test::processor_time();
    tick.status = step(body, state, pose);
    tick.seconds = test::processor_time() - begin;
    tick.wrench = state.tools.front().contact_wrench;
    tick.nodes = test::pressed_nodes(body, state);
    ticks.push_back(tick);
  }
  return ticks;
}

/// What the runtime's tick is compared with.
struct True {
  std::size_t tick = 0;
  Wrench wrench;
  double residual = 0.0;
  double move = 0.0;         // of the last pass [m]
  double penetration = 0.0;  // [m]
  double seconds = 0.0;      // of the dense solver; 0 where it was not timed
};

/// Whether the truth itself was found, to well within what is asked of the runtime.
bool is_known(const True& now) {
  return now.residual < 1e-7 && now.move < 1e-7;
}

std::vector<True> truths(const Body& body, const Options& options, const Shape& made, double friction,
                         const std::vector<Vec3>& places) {
  using test::SurfaceTruth;
  SurfaceTruth truth(body, made.tool, friction, made.orientation);
  std::vector<True> found;
  for (std::size_t k = 0; k < places.size(); ++k) {
    True now;
    now.tick = k;
    if (k % static_cast<std::size_t>(options.dense) == 0)
      now.seconds = truth.dense_seconds(places[k], dense_tolerance);
    if (friction == 0.0 && k % static_cast<std::size_t>(options.every) != 0) continue;
    now.wrench = truth.step(places[k]);
    now.residual = truth.residual();
    now.move = truth.last_move();
    now.penetration = truth.penetration();
    found.push_back(now);
  }
  return found;
}

struct Errors {
  std::vector<double> force, torque;
  void add(const Wrench& found, const Wrench& expected, double largest, double arm) {
    force.push_back((found.force - expected.force).norm() / largest);
    torque.push_back((found.torque - expected.torque).norm() / (largest * arm));
  }
};

/// Largest change of force from one compared tick to the next [N]: where nodes lose their hold, the truth
/// leaps to another equilibrium.
struct Jumps {
  double of_truth = 0.0, of_runtime = 0.0;
};

Jumps jumps_of(const std::vector<Tick>& ticks, const std::vector<True>& known) {
  Jumps jumps;
  for (std::size_t k = 1; k < known.size(); ++k) {
    const True& now = known[k];
    const True& last = known[k - 1];
    if (!is_known(now) || !is_known(last)) continue;
    jumps.of_truth = std::max(jumps.of_truth, (now.wrench.force - last.wrench.force).norm());
    jumps.of_runtime =
        std::max(jumps.of_runtime, (ticks[now.tick].wrench.force - ticks[last.tick].wrench.force).norm());
  }
  return jumps;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

std::string three(const std::vector<double>& errors) {
  return fmt::format("{:.1e} / {:.1e} / {:.1e}", quantile(errors, 0.5), quantile(errors, 0.999),
                     quantile(errors, 1.0));
}

void print_head(const Body& body, const Options& options) {
  fmt::print("{}: {} surface nodes, edges of {:.2f} mm\n\n", options.body,
             body.surface_rest_positions().size(), 1e3 * body.mean_surface_edge());
  fmt::print(
      "| tool | friction | room | nodes pressed: median / most | force at most [N] | off: force (median / "
      "99.9 % / largest) | torque | change in a tick at most: truth / "
      "runtime | ticks | compared | not converged "
      "| "
      "capacity full | tick: median / 99.9 % [us] | dense: median / 99.9 % [us] | left over / moved [um] / "
      "inside [um] |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  std::fflush(stdout);
}

void print(const std::string& name, const Shape& made, double friction, Index room,
           const std::vector<Tick>& ticks, const std::vector<True>& known) {
  double largest = std::numeric_limits<double>::min();
  for (const True& now : known) {
    if (is_known(now)) largest = std::max(largest, now.wrench.force.norm());
  }
  Errors errors;
  std::vector<double> times, dense, nodes, left_over, move, inside;
  std::size_t unknown = 0;
  for (const True& now : known) {
    if (now.seconds > 0.0 && ticks[now.tick].nodes > 0) dense.push_back(1e6 * now.seconds);
    if (!is_known(now)) {
      ++unknown;
      continue;
    }
    errors.add(ticks[now.tick].wrench, now.wrench, largest, made.tool.radius);
    left_over.push_back(now.residual);
    move.push_back(now.move);
    inside.push_back(now.penetration);
  }
  const Jumps jumps = jumps_of(ticks, known);
  int rough = 0, full = 0;
  for (const Tick& tick : ticks) {
    rough += has(tick.status, StepStatus::not_converged) ? 1 : 0;
    full += has(tick.status, StepStatus::capacity_full) ? 1 : 0;
    if (tick.nodes == 0) continue;
    times.push_back(1e6 * tick.seconds);
    nodes.push_back(tick.nodes);
  }
  fmt::print(
      "| {} | {:g} | {} | {:.0f} / {:.0f} | {:.4f} | {} | {} | {:.1e} / {:.1e} | {} | {} of {} | {} | "
      "{} | {:.0f} / "
      "{:.0f} | "
      "{:.0f} / {:.0f} | {:.0e} / {:.0e} / {:.0e} |\n",
      name, friction, room, quantile(nodes, 0.5), quantile(nodes, 1.0), largest, three(errors.force),
      three(errors.torque), jumps.of_truth / largest, jumps.of_runtime / largest, ticks.size(),
      known.size() - unknown, known.size(), rough, full, quantile(times, 0.5), quantile(times, 0.999),
      quantile(dense, 0.5), quantile(dense, 0.999), quantile(left_over, 1.0), 1e6 * quantile(move, 1.0),
      1e6 * quantile(inside, 1.0));
  std::fflush(stdout);
}

std::string row_of(const Vec3& v) {
  return fmt::format("{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
}

void write(std::ofstream& csv, const std::string& name, double friction, Index room,
           const std::vector<Tick>& ticks, const std::vector<True>& known) {
  if (!csv) return;
  for (const True& now : known) {
    const Tick& tick = ticks[now.tick];
    csv << fmt::format("{},{},{},{},{},{:.2f},{:.2f},{},{},{},{},{},{:.1e},{:.1e},{:.1e}\n", name, friction,
                       room, now.tick, tick.nodes, 1e6 * tick.seconds, 1e6 * now.seconds,
                       static_cast<unsigned>(tick.status), row_of(tick.wrench.force),
                       row_of(tick.wrench.torque), row_of(now.wrench.force), row_of(now.wrench.torque),
                       now.residual, now.move, now.penetration);
  }
  csv.flush();
}

void study(const Options& options) {
  const Body body(load_model(options.body));
  std::ofstream csv;
  if (!options.csv.empty()) {
    csv.open(options.csv);
    csv << "tool,friction,room,tick,nodes,us,dense_us,status,fx,fy,fz,tx,ty,tz,true_fx,true_fy,true_fz,"
           "true_tx,true_ty,true_tz,left_over,moved,inside\n";
  }
  print_head(body, options);
  for (const std::string& name : options.tools) {
    const Shape made = shape(name, options);
    const std::vector<Vec3> places = path(body, options, made);
    for (const double friction : options.friction) {
      const std::vector<True> known = truths(body, options, made, friction, places);
      for (const double room : options.max_contacts) {
        const std::vector<Tick> ticks = play(body, made, friction, static_cast<Index>(room), places);
        print(name, made, friction, static_cast<Index>(room), ticks, known);
        write(csv, name, friction, static_cast<Index>(room), ticks, known);
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
