// A sphere that slides over a baked body at 1 kHz with an overlay under it.
//
//   overlay_study MODEL.palpate.hdf [RADIUS [DEPTH [MM_PER_S]]]
//
// In real time, with the thread that builds patches beside it: without an overlay, then for each refinement
// and number of rings, over the same tracks, each begun with no patch built. Printed are the tick's time,
// late ticks, how much the force changes from tick to tick, and how many ticks had to use an older patch or
// none. scripts/studies/sliding --overlay runs it.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "formats/model_file.h"
#include "runtime/background/patch_source.h"
#include "runtime/core/tick/step.h"
#include "runtime/loop/real_time.h"
#include "tests/bench/palpation_paths.h"

namespace palpate {
namespace {

constexpr std::int64_t second = 1'000'000'000;  // [ns]
constexpr std::int64_t period = second / 1000;
constexpr int tracks_laid = 12;
constexpr double track_length = 0.04;  // [m]

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

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0.0;
  const auto k = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)];
}

/// What is measured while the sphere slides.
struct Figures {
  std::vector<double> compute;  // [us] of each tick
  std::vector<double> change;   // of the hand's force from the tick before, as a share
  std::vector<double> force;    // [N]
  std::int64_t late = 0;        // ticks that ended after the next one was due
  std::int64_t late_wakes = 0;  // of them begun more than half a period late: the machine's doing
  std::int64_t older = 0;       // ticks with an older patch or none
  std::int64_t not_converged = 0;
  std::int64_t switches = 0, built = 0;
  double longest_build = 0.0;  // [s]
  std::size_t bytes = 0;
};

void slide(const Body& body, const test::Slide& slide, State state, PatchSource* source, Figures& figures) {
  Vec3 before = Vec3::Zero();
  const std::int64_t start = now() + period;
  for (std::size_t k = 0; k < slide.poses.size(); ++k) {
    const std::int64_t due = start + static_cast<std::int64_t>(k) * period;
    sleep_until(due);
    const std::int64_t begin = now();
    if (source != nullptr) source->serve(state);
    step(body, state, slide.poses[k]);
    const std::int64_t end = now();
    const Vec3 force = state.tools.front().wrench.force;
    if (k >= slide.first_slide) {
      figures.compute.push_back(1e-3 * static_cast<double>(end - begin));
      const double size = std::max(force.norm(), before.norm());
      figures.change.push_back(size > 0.0 ? (force - before).norm() / size : 0.0);
      figures.force.push_back(force.norm());
      figures.late += end > due + period ? 1 : 0;
      figures.late_wakes += end > due + period && begin > due + period / 2 ? 1 : 0;
      figures.older += has(state.status, StepStatus::older_patch) ? 1 : 0;
      figures.not_converged += has(state.status, StepStatus::not_converged) ? 1 : 0;
    }
    before = force;
  }
}

struct Overlaid {
  int refinement;  // 1: none
  int rings;
};

Figures measure(const Body& body, const std::vector<test::Track>& tracks, const Overlaid& overlay,
                double radius, double depth, double speed, const std::optional<double>& friction) {
  Figures figures;
  StateOptions options{.tools = {Tool{.radius = radius, .friction = friction}}};
  if (overlay.refinement > 1) options.patch_nodes = patch_room(body, overlay.rings, 1);
  const State start(body, options);
  for (const test::Track& track : tracks) {
    std::optional<PatchSource> source;
    if (overlay.refinement > 1) source.emplace(body, start, PatchSourceOptions{.rings = overlay.rings});
    const RealTimeRights rights;
    slide(body, test::slide_along(track, depth, speed), start, source ? &*source : nullptr, figures);
    if (!source) continue;
    figures.switches += source->counts().switches;
    figures.built += source->built();
    figures.longest_build = std::max(figures.longest_build, source->longest_build());
    figures.bytes = std::max(figures.bytes, source->bytes());
  }
  return figures;
}

void print_row(const Overlaid& overlay, const std::optional<double>& friction, const Figures& figures) {
  const auto ticks = static_cast<double>(figures.compute.size());
  const auto per_cent = [](const std::vector<double>& values, double fraction) {
    return 100.0 * quantile(values, fraction);
  };
  const auto over =
      std::count_if(figures.change.begin(), figures.change.end(), [](double c) { return c > 0.02; });
  fmt::print(
      "| {} | {} | {} | {:.1f} | {:.0f} | {:.0f} | {} ({}) | {:.2f} % | {:.2f} % | {:.2f} % | {:.1f} % | "
      "{:.2f} % | {} | "
      "{} | {:.1f} | {:.0f} | {} | {:.3f} |\n",
      overlay.refinement > 1 ? fmt::format("r={},rings={}", overlay.refinement, overlay.rings) : "none",
      friction ? fmt::format("{:g}", *friction) : "the material's", figures.compute.size(),
      quantile(figures.compute, 0.5), quantile(figures.compute, 0.999), quantile(figures.compute, 1.0),
      figures.late, figures.late_wakes, per_cent(figures.change, 1.0), per_cent(figures.change, 0.99),
      per_cent(figures.change, 0.5), 100.0 * static_cast<double>(over) / ticks,
      100.0 * static_cast<double>(figures.older) / ticks, figures.switches, figures.built,
      1e3 * figures.longest_build, 1e-6 * static_cast<double>(figures.bytes), figures.not_converged,
      quantile(figures.force, 0.5));
  std::fflush(stdout);
}

void study(const std::string& file, double radius, double depth, double speed) {
  const std::vector<Overlaid> overlays = {{1, 0}, {3, 1}, {2, 2}, {3, 2}, {4, 2}};
  std::vector<test::Track> tracks;
  for (const Overlaid& overlay : overlays) {
    const Body body(load_model(file), {}, overlay.refinement);
    if (tracks.empty()) {
      tracks = test::lay_tracks(body, radius, track_length, tracks_laid);
      fmt::print("{}: {} tracks of {:.0f} mm at {:.0f} mm/s, sphere of {:.1f} mm, {:.1f} mm deep\n\n",
                 body.model().name, tracks.size(), 1e3 * track_length, 1e3 * speed, 1e3 * radius,
                 1e3 * depth);
      fmt::print(
          "| overlay | friction | ticks | µs: median | 99.9 % | worst | late ticks (woken late) | change: "
          "largest | "
          "99 % | median | over 2 % | older patch or none | switches | built | longest build ms | MB | not "
          "converged "
          "| median force N |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    }
    for (const std::optional<double> friction : {std::optional<double>(0.0), std::optional<double>()})
      print_row(overlay, friction, measure(body, tracks, overlay, radius, depth, speed, friction));
  }
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  if (argc < 2 || argc > 5) {
    fmt::print(stderr, "usage: overlay_study MODEL.palpate.hdf [RADIUS [DEPTH [MM_PER_S]]]\n");
    return 2;
  }
  const auto number = [&](int k, double otherwise) {
    return argc > k ? std::strtod(argv[k], nullptr) : otherwise;
  };
  try {
    palpate::study(argv[1], number(2, 0.005), number(3, 0.003), 1e-3 * number(4, 50.0));
  } catch (const palpate::Error& error) {
    std::fputs(palpate::to_text(error).c_str(), stderr);
    return 1;
  }
}
