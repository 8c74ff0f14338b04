// Random palpation of a baked body at 1 kHz, and what its slowest ticks are made of.
//
//   palpation_study MODEL.palpate.hdf [--seconds S] [--seed N] [--radius M] [--depth M] [--turning RAD/S]
//                   [--friction MU] [--coupling N/M]
//
// A sphere (5 mm unless told otherwise) presses, slides, lifts and grabs all over the body in real time;
// every tick is timed. Then the same motion is played twice more without waiting, the same ticks to the bit,
// and the slowest ticks are repeated on copies of the state: one that stays slow is slow by its own work,
// else it was held up by the machine (other programs, or the host of a virtual machine that had taken its
// memory away). scripts/studies/palpation runs it beside cyclictest.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/body/met_surface.h"
#include "runtime/core/tick/step.h"
#include "runtime/loop/real_time.h"
#include "tests/bench/palpation_paths.h"
#include "tests/bench/tick_stages.h"

namespace palpate {
namespace {

constexpr std::int64_t second = 1'000'000'000;  // [ns]
constexpr std::int64_t period = second / 1000;
constexpr std::size_t shown = 20;  // ticks in each list of the slowest

std::int64_t now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * second + time.tv_nsec;
}

void sleep_until(std::int64_t due) {
  const timespec time{.tv_sec = due / second, .tv_nsec = due % second};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) != 0) {
  }
}

/// One playing of the whole motion.
struct Run {
  std::vector<std::int64_t> compute;   // [ns] of each tick
  std::vector<std::int64_t> lateness;  // [ns] from when a tick was due to when it began
  std::vector<Vec3> force;             // on the hand [N]
  std::vector<Vec3> torque;            // [N m]
  std::vector<StepStatus> status;
  Index closed = 0;  // at most

  explicit Run(std::size_t ticks)
      : compute(ticks), lateness(ticks), force(ticks), torque(ticks), status(ticks) {}
};

Run play(const Body& body, State state, const std::vector<ToolPose>& poses, bool real_time) {
  Run run(poses.size());
  const std::int64_t start = now() + period;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const std::int64_t due = start + static_cast<std::int64_t>(k) * period;
    if (real_time) sleep_until(due);
    const std::int64_t begin = now();
    run.status[k] = step(body, state, poses[k]);
    run.compute[k] = now() - begin;
    run.lateness[k] = real_time ? begin - due : 0;
    run.force[k] = state.tools.front().wrench.force;
    run.torque[k] = state.tools.front().wrench.torque;
    run.closed = std::max(run.closed, state.tools.front().contacts);
  }
  return run;
}

Run play_in_real_time(const Body& body, const State& state, const std::vector<ToolPose>& poses) {
  const RealTimeRights rights;
  if (!rights.refused().empty()) fmt::print("warning: {}\n", rights.refused());
  return play(body, state, poses, true);
}

double us(std::int64_t ns) {
  return 1e-3 * static_cast<double>(ns);
}

std::int64_t quantile(std::vector<std::int64_t> times, double fraction) {
  const auto k = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(times.size() - 1));
  std::nth_element(times.begin(), times.begin() + k, times.end());
  return times[static_cast<std::size_t>(k)];
}

std::int64_t over(const std::vector<std::int64_t>& times, std::int64_t bound) {
  return std::count_if(times.begin(), times.end(), [&](std::int64_t time) { return time > bound; });
}

void print_times(const char* what, const std::vector<std::int64_t>& times) {
  fmt::print("| {} | {:.1f} | {:.1f} | {:.1f} | {:.0f} | {} |\n", what, us(quantile(times, 0.5)),
             us(quantile(times, 0.999)), us(quantile(times, 0.99999)), us(quantile(times, 1.0)),
             over(times, period));
}

/// The `count` ticks of the largest times, slowest first.
std::vector<std::size_t> slowest(const std::vector<std::int64_t>& times, std::size_t count) {
  std::vector<std::size_t> ticks(times.size());
  std::iota(ticks.begin(), ticks.end(), std::size_t{0});
  count = std::min(count, ticks.size());
  std::partial_sort(ticks.begin(), ticks.begin() + static_cast<std::ptrdiff_t>(count), ticks.end(),
                    [&](std::size_t a, std::size_t b) { return times[a] > times[b]; });
  ticks.resize(count);
  return ticks;
}

/// A tick taken apart.
struct TickStudy {
  std::int64_t alone =
      0;  // [ns] the fastest of some repetitions at once: what it computes, without the machine
  Index points = 0, closed = 0, held = 0, rows = 0, near = 0, new_nodes = 0;
  int rounds = 0;  // of the solver in the last pass
  bool more_passes = false;
  test::TickStages stages;
  StepStatus status = StepStatus::ok;
};

/// Nodes that the tick took into the near field.
Index new_nodes(const State& before, const State& after) {
  Index count = 0;
  for (Index place = 0; place < after.surface.near.count(); ++place) {
    if (before.surface.near.place_of(after.surface.near.node(place)) < 0) ++count;
  }
  return count;
}

/// Whether more than one pass was made: then the contacts that the last pass began with are not those that
/// the tick began with.
bool more_passes(const State& before, const State& after) {
  if (after.scratch.last.count != before.contact_count) return true;
  for (Index k = 0; k < after.scratch.last.count; ++k) {
    const ContactPoint& last = after.scratch.last.contacts[static_cast<std::size_t>(k)];
    const ContactPoint& first = before.contact_points[static_cast<std::size_t>(k)];
    if (last.feature != first.feature || last.position != first.position) return true;
  }
  return false;
}

TickStudy take_apart(const Body& body, const State& before, const ToolPose& pose) {
  constexpr int repetitions = 7;
  TickStudy study;
  State state = before;
  study.alone = std::numeric_limits<std::int64_t>::max();
  for (int k = 0; k < repetitions; ++k) {
    state = before;
    const std::int64_t begin = now();
    step(body, state, pose);
    study.alone = std::min(study.alone, now() - begin);
  }
  study.points = state.contact_count;
  study.closed = state.tools.front().contacts;
  study.held = state.held_count;
  study.rows = state.scratch.problem.rows;
  study.near = state.surface.near.count();
  study.new_nodes = new_nodes(before, state);
  study.rounds = state.scratch.solver.rounds();
  study.more_passes = more_passes(before, state);
  study.status = state.status;
  state = before;
  study.stages = test::time_stages(body, state, pose);
  return study;
}

std::map<std::size_t, TickStudy> take_apart(const Body& body, State state, const std::vector<ToolPose>& poses,
                                            const std::vector<std::size_t>& ticks) {
  const std::set<std::size_t> wanted(ticks.begin(), ticks.end());
  std::map<std::size_t, TickStudy> studies;
  for (std::size_t k = 0; k < poses.size() && studies.size() < wanted.size(); ++k) {
    if (wanted.contains(k)) studies[k] = take_apart(body, state, poses[k]);
    step(body, state, poses[k]);
  }
  return studies;
}

std::string names_of(StepStatus status) {
  std::string names;
  for (const auto& [bit, name] : status_names) {
    if (has(status, bit)) names += fmt::format(" {}", name);
  }
  return names;
}

void print_studies(const std::vector<std::size_t>& ticks, const std::map<std::size_t, TickStudy>& studies,
                   const Run& real) {
  fmt::print(
      "| tick | in real time | by itself | points looked at | closed | held | rows | near nodes | new | "
      "rounds "
      "| passes | find | assemble | solve | displace | linearise | status |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const std::size_t k : ticks) {
    const TickStudy& s = studies.at(k);
    fmt::print(
        "| {} | {:.1f} | {:.1f} | {} | {} | {} | {} | {} | {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} "
        "| "
        "{:.1f} |{} |\n",
        k, us(real.compute[k]), us(s.alone), s.points, s.closed, s.held, s.rows, s.near, s.new_nodes,
        s.rounds, s.more_passes ? "2-3" : "1", 1e6 * s.stages.find, 1e6 * s.stages.assemble,
        1e6 * s.stages.solve, 1e6 * s.stages.displace, 1e6 * s.stages.linearise, names_of(s.status));
  }
}

/// Memory that is left alone, as large as the Green's functions: how long the machine takes to read a byte of
/// it. Virtual machines whose host takes idle memory away show it here, and in ticks that meet nodes which
/// were not met for long.
class IdleMemory {
 public:
  explicit IdleMemory(std::size_t bytes) : bytes_(bytes, 1) {}

  [[nodiscard]] std::vector<std::int64_t> read() const {
    constexpr std::size_t page = 4096;
    std::mt19937_64 random(1);
    std::vector<std::int64_t> times(2000);
    for (std::int64_t& time : times) {
      const volatile std::uint8_t* byte = bytes_.data() + random() % (bytes_.size() / page) * page;
      const std::int64_t begin = now();
      [[maybe_unused]] const std::uint8_t value = *byte;
      time = now() - begin;
    }
    return times;
  }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Of the body's free surface nodes, those that were near the tool in some tick.
double touched_share(const Body& body, const std::vector<ToolPose>& poses, double reach) {
  std::vector<std::uint8_t> touched(static_cast<std::size_t>(body.greens().nodes()), 0);
  for (std::size_t k = 0; k < poses.size(); k += 10) {
    const NearestNode node = body.nearest_surface_node(poses[k].position);
    if (node.distance < reach) touched[static_cast<std::size_t>(node.node)] = 1;
  }
  return static_cast<double>(std::count(touched.begin(), touched.end(), 1)) /
         static_cast<double>(body.free_surface_nodes().size());
}

/// What was felt: the largest force, how many contacts, and how often the status said what.
void print_statuses(const Run& run) {
  double largest = 0.0;
  for (const Vec3& force : run.force) largest = std::max(largest, force.norm());
  fmt::print("\nforce at most {:.3g} N, closed contacts at most {}; ticks by status:", largest, run.closed);
  for (const auto& [bit, name] : status_names) {
    const StepStatus of_name = bit;
    const auto count = std::count_if(run.status.begin(), run.status.end(),
                                     [of_name](StepStatus status) { return has(status, of_name); });
    if (count > 0) fmt::print(" {} {}", name, count);
  }
  fmt::print("\n");
}

/// What the hand does between two times at which it feels nothing: work [J] of its own, and without regard to
/// the direction.
struct Touch {
  double work = 0.0;
  double turnover = 0.0;
  bool was_lost = false;  // the tool got so deep in a tick that no contact brought it out
};

/// All touches of a run, by the mean of a tick's forces at its two ends. The body is at rest before and after
/// one, so whatever the way, it cannot have given work away.
std::vector<Touch> touches(const Run& run, const std::vector<ToolPose>& poses) {
  std::vector<Touch> found;
  bool was_touched = false;
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const bool is_touched = !run.force[k].isZero(0.0) || !run.torque[k].isZero(0.0);
    if (is_touched && !was_touched) found.emplace_back();
    if (is_touched || was_touched) {
      const Eigen::AngleAxisd turned(poses[k].orientation * poses[k - 1].orientation.conjugate());
      const double work =
          -0.5 * (run.force[k] + run.force[k - 1]).dot(poses[k].position - poses[k - 1].position) -
          0.5 * (run.torque[k] + run.torque[k - 1]).dot(turned.angle() * turned.axis());
      found.back().work += work;
      found.back().turnover += std::abs(work);
      for (const std::size_t tick : {k - 1, k}) {
        if (has(run.status[tick], StepStatus::inside_body)) found.back().was_lost = true;
      }
    }
    was_touched = is_touched;
  }
  if (was_touched) found.pop_back();  // it does not end
  return found;
}

void print_touches(const std::vector<Touch>& found) {
  double least = std::numeric_limits<double>::infinity();
  double least_share = least;
  double sum = 0.0;
  std::int64_t negative = 0;
  std::int64_t lost = 0;
  for (const Touch& touch : found) {
    if (touch.was_lost) {
      ++lost;
      continue;
    }
    least = std::min(least, touch.work);
    least_share = std::min(least_share, touch.work / touch.turnover);
    sum += touch.work;
    negative += touch.work < 0.0 ? 1 : 0;
  }
  fmt::print(
      "\n{} touches from free to free: the hand's work is {:.3g} J in all, {:.3g} J at least in one ({:.2g} "
      "of "
      "what went to and fro there), negative in {}; not counted: {} in which the tool was lost in the body\n",
      std::ssize(found) - lost, sum, least, least_share, negative, lost);
}

struct Arguments {
  std::string model;
  double seconds = 600.0;
  test::Palpation palpation;
  std::optional<double> friction;
  double coupling = std::numeric_limits<double>::infinity();  // [N/m]
};

void study(const Arguments& arguments) {
  const double radius = arguments.palpation.radius;
  Model model = load_model(arguments.model);
  const MetSurface met = met_surface(model, radius);  // as `play` by default
  const Body body(std::move(model), {}, met.refinement, ContactModel::quasi_static, met.is_local);
  const Body of_mesh(load_model(arguments.model));  // for the path, whatever the surface
  const auto poses = test::palpation_poses(of_mesh, arguments.palpation,
                                           static_cast<std::int64_t>(arguments.seconds / test::tick));
  const State start(body, {.tools = {Tool{.radius = radius,
                                          .coupling_stiffness = arguments.coupling,
                                          .friction = arguments.friction}}});
  double way = 0.0;
  std::int64_t grabs = 0;
  for (std::size_t k = 1; k < poses.size(); ++k) {
    way += (poses[k].position - poses[k - 1].position).norm();
    grabs += poses[k].grab && !poses[k - 1].grab ? 1 : 0;
  }
  fmt::print(
      "{}: sphere of {:.1f} mm, {} ticks, seed {}, {:.1f} m of way, {} grabs, {:.0f} % of the free "
      "surface\n\n",
      body.model().name, 1e3 * radius, poses.size(), arguments.palpation.seed, way, grabs,
      100.0 * touched_share(of_mesh, poses, 2.0 * radius));
  std::fflush(stdout);

  const IdleMemory idle(static_cast<std::size_t>(body.greens().order() * body.greens().order() *
                                                 bytes_per_scalar(body.greens().precision())));
  const Run real = play_in_real_time(body, start, poses);
  const std::vector<std::int64_t> idle_memory = idle.read();
  const Run first = play(body, start, poses, false);
  const Run again = play(body, start, poses, false);
  std::vector<std::int64_t> replayed(poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) replayed[k] = std::min(first.compute[k], again.compute[k]);

  const std::vector<std::size_t> slow = slowest(real.compute, shown);
  std::vector<std::size_t> suspects = slowest(replayed, 10 * shown);
  suspects.insert(suspects.end(), slow.begin(), slow.end());
  const std::map<std::size_t, TickStudy> studies = take_apart(body, start, poses, suspects);
  std::vector<std::int64_t> alone(poses.size(), 0);
  for (const auto& [k, tick_study] : studies) alone[k] = tick_study.alone;

  fmt::print("| µs | median | 99.9 % | 99.999 % | worst | over 1 ms |\n|---|---|---|---|---|---|\n");
  print_times("tick, in real time", real.compute);
  print_times("tick, replayed without waiting (the faster of two)", replayed);
  fmt::print("| tick by itself (the fastest of 7 at once) | | | | {:.0f} | {} |\n", us(quantile(alone, 1.0)),
             over(alone, period));
  print_times("lateness of the loop's wake-up", real.lateness);
  print_times("reading a byte that was left alone meanwhile", idle_memory);
  fmt::print("\nreplay: {}\n", real.force == first.force && real.force == again.force
                                   ? "the same forces to the last bit"
                                   : "FORCES DIFFER");
  print_statuses(first);
  print_touches(touches(first, poses));

  const auto own =
      std::count_if(slow.begin(), slow.end(), [&](std::size_t k) { return 2 * alone[k] > real.compute[k]; });
  fmt::print("\nThe {} slowest ticks in real time; {} of them are slow by their own work [µs]:\n\n",
             slow.size(), own);
  print_studies(slow, studies, real);
  const std::vector<std::size_t> heaviest = slowest(alone, shown);
  fmt::print("\nThe {} ticks with most work [µs]:\n\n", heaviest.size());
  print_studies(heaviest, studies, real);
}

Arguments read_arguments(int argc, char** argv) {
  if (argc < 2 || argc % 2 != 0)
    throw Error("there is no body, or an option without a value", "palpation_study",
                "see the head of palpation_study.cpp");
  Arguments arguments;
  arguments.model = argv[1];
  for (int k = 2; k < argc; k += 2) {
    const std::string name = argv[k];
    const double value = std::strtod(argv[k + 1], nullptr);
    if (name == "--seconds") {
      arguments.seconds = value;
    } else if (name == "--seed") {
      arguments.palpation.seed = static_cast<std::uint64_t>(value);
    } else if (name == "--radius") {
      arguments.palpation.radius = value;
    } else if (name == "--depth") {
      arguments.palpation.most_depth = value;
    } else if (name == "--turning") {
      arguments.palpation.turning = value;
    } else if (name == "--friction") {
      arguments.friction = value;
    } else if (name == "--coupling") {
      arguments.coupling = value;
    } else {
      throw Error("is no option", name, "see the head of palpation_study.cpp");
    }
  }
  return arguments;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  try {
    palpate::study(palpate::read_arguments(argc, argv));
  } catch (const palpate::Error& error) {
    std::fputs(palpate::to_text(error).c_str(), stderr);
    return 1;
  }
}
