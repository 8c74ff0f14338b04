#include "runtime/app/play_report.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "base/program.h"
#include "runtime/app/best_effort_report.h"
#include "runtime/background/live_motion.h"
#include "runtime/background/two_level_motion.h"
#include "runtime/live/live_model.h"
#include "runtime/loop/mesh_stiffening.h"
#include "runtime/loop/output.h"

namespace palpate {
namespace {

constexpr double most_patch_residual = 1e-3;  // largest one that is not reported

void print_tangents(const PatchTangentTelling& telling) {
  say(stderr, "overlay, neo-hookean: {} patches linearised (longest {:.1f} ms), steps cut in half {} times\n",
      telling.made, 1e3 * telling.longest, telling.cuts);
  if (telling.with_inverted > 0) {
    print_warning(
        fmt::format("in {} patches the tool turned elements inside out, {} points at most: the "
                    "elements are too large for a push so deep, or the overlay reaches too few "
                    "rings (take another --overlay)",
                    telling.with_inverted, telling.most_inverted));
  }
  if (telling.failed > 0) {
    print_warning(
        fmt::format("{} neo-Hookean patches could not be made: the one before, or a linear one, "
                    "was used",
                    telling.failed));
  }
  if (telling.last_residual > most_patch_residual) {
    print_warning(
        fmt::format("at the end the neo-Hookean patch was not in balance: {:.2g} of the forces were "
                    "left",
                    telling.last_residual));
  }
}

void print_overlays(const PatchSource& overlays) {
  const PatchCounts& counts = overlays.counts();
  const auto in_contact = static_cast<double>(std::max<std::int64_t>(counts.in_contact, 1));
  say(stderr,
      "overlay: {} patches built (longest {:.1f} ms, {:.0f} MB kept), {} switches, {:.2f} % of the ticks in "
      "contact on an older patch or none\n",
      overlays.built(), 1e3 * overlays.longest_build(), 1e-6 * static_cast<double>(overlays.bytes()),
      counts.switches, 100.0 * static_cast<double>(counts.older_in_contact) / in_contact);
  if (overlays.failed() > 0) {
    print_warning(
        fmt::format("{} overlays could not be made: the elements there are too flat, or those of the file do "
                    "not belong to its mesh (precompute it again)",
                    overlays.failed()));
  }
  if (overlays.tangents() != nullptr) print_tangents(overlays.tangents()->telling());
}

void print_loop(const LoopReport& report, bool fast) {
  say(stderr, "{} ticks{}, {} of them in contact, at most {} contact points\n", report.ticks,
      report.interrupted ? " until interrupted" : "", report.ticks_in_contact, report.most_contacts);
  const auto times = [](const char* what, const TimeHistogram& histogram) {
    say(stderr, "{}: median {:.2f} us, 99.9 % {:.2f} us, 99.99 % {:.2f} us, worst {:.2f} us\n", what,
        microseconds(histogram.percentile(0.5)), microseconds(histogram.percentile(0.999)),
        microseconds(histogram.percentile(0.9999)), microseconds(histogram.worst()));
  };
  times("step", report.compute);
  if (!fast) {
    times("late", report.lateness);
    say(stderr, "{} deadline misses at {} Hz\n", report.deadline_misses, report.rate);
  }
  say(stderr, "largest force {:.6g} N at {:.3f} s, largest jump between ticks {:.6g} N at {:.3f} s\n",
      report.largest_force, report.largest_force_time, report.largest_jump, report.largest_jump_time);
  if (report.largest_force_stiffening > noticed_stiffening) {
    say(stderr,
        "it pressed the surface in by {:.2g} m then, where the mesh is about {:.1f} times too stiff for so "
        "small a tool\n",
        report.largest_force_depth, report.largest_force_stiffening);
  }
  if (report.largest_greens_error > 0.0) {
    say(stderr, "compressed Green's functions: forces are off by at most {:.2g} N, at {:.3f} s\n",
        report.largest_greens_error, report.largest_greens_error_time);
  }
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    if (report.status_ticks[k] > 0)
      say(stderr, "{}: {} ticks\n", status_names[k].second, report.status_ticks[k]);
  }
}

/// Warns of a force that is not that of the body.
void warn_of_rigid_contact(const PlayedRun& run) {
  const auto bit = std::find_if(status_names.begin(), status_names.end(),
                                [](const auto& status) { return status.first == StepStatus::rigid_contact; });
  const std::int64_t ticks = run.report.status_ticks[static_cast<std::size_t>(bit - status_names.begin())];
  if (ticks == 0) return;
  const bool has_coupling = std::isfinite(run.tool.coupling_stiffness);
  print_warning(fmt::format("in {} ticks the tool pressed on what is held, or hardly moves: {}", ticks,
                            has_coupling ? "what is felt there is its coupling alone"
                                         : "the force there is that of a wall and not the body's; give the "
                                           "tool a --coupling, and a --max-force"));
}

/// Reports forces that are not exactly the contact's.
void tell_best_effort(const LoopReport& report) {
  const std::string words = in_words(report.best_effort, report.ticks);
  if (is_grave(report.best_effort, report.ticks)) {
    print_warning(words);
  } else if (!words.empty()) {
    say(stderr, "{}\n", words);
  }
}

void print_device(const PlayedRun& run) {
  const LoopReport& report = run.report;
  if (run.settings.safety) {
    say(stderr, "the hand was shown at most {:.6g} N", report.largest_shown);
    for (std::size_t k = 1; k < fault_names.size(); ++k) {
      if (report.faults[k] > 0) say(stderr, "; {} faults: {}", report.faults[k], fault_names[k].second);
    }
    say(stderr, "\n");
  }
  if (run.link != nullptr) {
    say(stderr,
        "device: {} reports heard, {} commands written (longest {:.2f} ms, {} without the loop), "
        "opened again {} times\n",
        run.link->reports(), run.link->writes(), 1e-6 * static_cast<double>(run.link->worst_write()),
        run.link->extrapolated(), report.opened_again);
    const std::string refusals = run.link->refusals();
    if (!refusals.empty()) print_warning("refused of the device: " + refusals);
  }
}

void print_replay(const ReplayDifference& replay) {
  if (replay.different == 0) {
    say(stderr, "replay: all forces of {} ticks are those of the session, bit by bit\n", replay.ticks);
  } else {
    say(stderr,
        "replay: {} of {} ticks differ from the session, most by {:.6g} N at {:.3f} s; the first is "
        "tick {}, in its {}\n",
        replay.different, replay.ticks, replay.largest, replay.largest_time, replay.first_tick,
        replay.first_field);
  }
}

std::string box_text(const Body& body) {
  Eigen::AlignedBox3d box;
  for (const Vec3& position : body.surface_rest_positions()) box.extend(position);
  const Vec3 low = box.min();
  const Vec3 high = box.max();
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g}) m", low.x(), low.y(), low.z(),
                     high.x(), high.y(), high.z());
}

/// Warns of tool positions at which nothing is felt.
void warn_of_places(const PlayedRun& run) {
  const LoopReport& report = run.report;
  const std::string place = "the body rests in " + box_text(run.body);
  if (report.ticks_begun_inside > 0) {
    const bool all = report.ticks_begun_inside == report.ticks;
    const double seconds = static_cast<double>(report.ticks_begun_inside) / static_cast<double>(report.rate);
    print_warning(fmt::format("the tool began inside the body and felt nothing {}: start outside ({})",
                              all ? "at all" : fmt::format("until it was out at {} s", seconds), place));
  } else if (report.ticks > 0 && report.ticks_in_contact == 0) {
    const Vec3& end = run.state.tools.front().pose.position;
    const char* advice = run.link != nullptr
                             ? "move the device on, or the body to it (--origin, --motion-scale)"
                             : "check the script's positions, which are metres, and the tool's size";
    print_warning(
        fmt::format("the tool never touched the body: {} (the tool ended at ({:.4g}, {:.4g}, {:.4g}) m; {})",
                    advice, end.x(), end.y(), end.z(), place));
  }
}

constexpr double most_residual = 1e-3;  // largest one that is not reported

void print_depth(const DepthTelling& depth) {
  say(stderr, "depth: the body turned by up to {:.3g} degrees, its compliance {} times",
      degrees_a_radian * depth.largest_rotation, depth.turns);
  if (depth.largest_force > 0.0)
    say(stderr, "; for its largest force in balance, {:.3g} N, small strain has {:.3g} % {}",
        depth.largest_force, 100.0 * std::abs(depth.small_strain_at_largest),
        depth.small_strain_at_largest < 0.0 ? "less" : "more");
  say(stderr, "\n");
  if (depth.last_residual > most_residual) {
    print_warning(fmt::format(
        "at the end the body was not in balance: its next step would have changed it by {:.2g} of "
        "its coarse displacement, or it was still moving",
        depth.last_residual));
  }
}

void print_live(const Body& body, const LiveTelling& live, const LoopReport& report) {
  const LiveCounts& counts = live.counts;
  say(stderr,
      "solver: {}, {} steps by {}; {} were cut as they diverged or would have, {} could not be made, {} had "
      "inverted "
      "elements (at most {})\n",
      name_of(body.live()->body.options().law), counts.steps, name_of(body.live()->stepper.scheme.integrator),
      counts.halved, counts.stopped, counts.inverted, counts.most_inverted);
  say(stderr,
      "the tool met the compliance of {:.3g} s ago, renewed {} times and turned {} times; against the solver "
      "it was off by {:.2g} m and {:.2g} N at most, of forces up to {:.3g} N\n",
      live.compliance_age, live.renewals, live.turns, live.largest_error,
      std::max(live.largest_force_error, report.best_effort.largest_late_error), live.largest_force);
  if (counts.stopped > 0) {
    print_warning(
        fmt::format("in {} steps the solver found no solution however short they were, and stopped the body "
                    "where it was: give it a shorter --live-step, more damping or less load",
                    counts.stopped));
  }
}

}  // namespace

const LiveMotion* PlayedRun::live() const {
  return motion != nullptr ? dynamic_cast<const LiveMotion*>(&motion->stepper()) : nullptr;
}

const TwoLevelMotion* PlayedRun::deep() const {
  return motion != nullptr ? dynamic_cast<const TwoLevelMotion*>(&motion->stepper()) : nullptr;
}

void print_report(const PlayedRun& run) {
  print_loop(run.report, run.options.fast);
  warn_of_rigid_contact(run);
  tell_best_effort(run.report);
  print_device(run);
  if (!run.options.record.empty())
    say(stderr, "recording {}: {} ticks and {} frames dropped\n", run.options.record, run.dropped,
        run.dropped_frames);
  if (run.recording_failure) print_warning("the recording failed: " + in_one_line(*run.recording_failure));
  if (run.overlays != nullptr) print_overlays(*run.overlays);
  if (run.motion != nullptr) {
    say(stderr, "motion: {} steps of {:.3g} ms, longest {:.2f} ms\n", run.motion->steps(),
        1e3 * run.body.swing().newmark.time_step, 1e3 * run.motion->longest_step());
  }
  if (const LiveMotion* live = run.live()) print_live(run.body, live->telling(), run.report);
  if (const TwoLevelMotion* deep = run.deep()) print_depth(deep->telling());
  if (run.options.device.kind == DeviceChoice::Kind::replay) print_replay(run.report.replay);
  if (run.options.device.kind == DeviceChoice::Kind::script || run.link != nullptr) warn_of_places(run);
}

}  // namespace palpate
