#include "runtime/play.h"

#include <fmt/core.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>

#include "meshes/error.h"
#include "runtime/loading.h"
#include "runtime/loop.h"
#include "runtime/output.h"
#include "runtime/real_time.h"

namespace palpate {
namespace {

std::atomic<bool> stop_asked = false;
static_assert(std::atomic<bool>::is_always_lock_free, "it is set by a signal handler");

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_asked = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

void print_loaded(const Body& body, double seconds) {
  fmt::print(stderr, "{}: {} free surface nodes, {} dofs in {} precision, loaded in {:.2f} s\n",
             body.model().name, body.free_surface_nodes().size(), body.greens().order(),
             body.greens().precision() == Precision::single_precision ? "single" : "double", seconds);
  if (!body.greens().unfolded()) {
    print_warning(
        "the Green's functions do not fit into half of the free memory as a full square; used packed, which "
        "is slower");
  }
}

double microseconds(std::int64_t nanoseconds) {
  return static_cast<double>(nanoseconds) * 1e-3;
}

void print_report(const LoopReport& report, const PlayOptions& options, std::int64_t dropped) {
  fmt::print(stderr, "{} ticks{}, {} of them holding a node", report.ticks,
             report.interrupted ? " until interrupted" : "", report.ticks_held);
  if (!options.fast) {
    fmt::print(stderr, "; {} deadline misses, at most {:.1f} us late", report.deadline_misses,
               microseconds(report.worst_lateness));
  }
  fmt::print(stderr, "\nstep: median {:.2f} us, 99.9 % {:.2f} us, worst {:.2f} us\n",
             microseconds(report.compute.percentile(0.5)), microseconds(report.compute.percentile(0.999)),
             microseconds(report.compute.worst()));
  fmt::print(stderr, "largest force {:.6g} N at {:.3f} s\n", report.largest_force, report.largest_force_time);
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    if (report.status_ticks[k] > 0)
      fmt::print(stderr, "{}: {} ticks\n", status_names[k].second, report.status_ticks[k]);
  }
  if (!options.record.empty())
    fmt::print(stderr, "recording {}: {} ticks dropped\n", options.record.string(), dropped);
  if (report.ticks_held == 0)
    print_warning(
        "the tool never held a node: check the script's positions and grab, or give a larger --reach");
}

std::string json_report(const LoopReport& report, const PlayOptions& options, const Body& body, double reach,
                        std::int64_t dropped) {
  std::string status;
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    status += fmt::format("{}\"{}\": {}", k == 0 ? "" : ", ", status_names[k].second, report.status_ticks[k]);
  }
  std::string json = "{\n";
  json += fmt::format("  \"file\": {},\n  \"model\": {},\n", json_string(options.file.string()),
                      json_string(body.model().name));
  json += fmt::format("  \"fast\": {},\n  \"interrupted\": {},\n  \"reach_m\": {},\n", options.fast,
                      report.interrupted, reach);
  json += fmt::format("  \"ticks\": {},\n  \"ticks_held\": {},\n", report.ticks, report.ticks_held);
  json += fmt::format("  \"deadline_misses\": {},\n  \"worst_lateness_ns\": {},\n", report.deadline_misses,
                      report.worst_lateness);
  json +=
      fmt::format("  \"compute_ns\": {{\"median\": {}, \"p99_9\": {}, \"worst\": {}}},\n",
                  report.compute.percentile(0.5), report.compute.percentile(0.999), report.compute.worst());
  json += fmt::format("  \"largest_force_N\": {},\n  \"largest_force_time_s\": {},\n", report.largest_force,
                      report.largest_force_time);
  json += fmt::format("  \"status_ticks\": {{{}}},\n", status);
  if (!options.record.empty())
    json += fmt::format("  \"recording\": {},\n", json_string(options.record.string()));
  json += fmt::format("  \"dropped_ticks\": {}\n}}\n", dropped);
  return json;
}

/// The loop with the rights it needs, which the recorder's thread, started before, does not inherit.
LoopReport run(const Body& body, State& state, const ScriptDevice& device, Recorder* recorder, bool fast) {
  if (fast) return run_loop(body, state, device, recorder, fast, stop_asked);
  const RealTimeRights rights;
  if (!rights.refused().empty()) print_warning(rights.refused());
  return run_loop(body, state, device, recorder, fast, stop_asked);
}

}  // namespace

int play(const PlayOptions& options) {
  const ScriptDevice device = ScriptDevice::read(options.script);
  const auto start = std::chrono::steady_clock::now();
  const Body body = load_body(options.file, options.model_toml);
  print_loaded(body, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());

  const double reach = options.reach.value_or(body.longest_surface_edge());
  State state(body, {.reach = reach, .max_nodes = 1});
  std::optional<Recorder> recorder;
  if (!options.record.empty())
    recorder.emplace(options.record, options.file.string(), body.model().content_hash);

  stop_on_signals();
  const LoopReport report = run(body, state, device, recorder ? &*recorder : nullptr, options.fast);
  if (recorder) recorder->finish();

  const std::int64_t dropped = recorder ? recorder->dropped() : 0;
  print_report(report, options, dropped);
  const std::string json = json_report(report, options, body, reach, dropped);
  if (options.report.empty()) {
    fmt::print("{}", json);
  } else {
    write_text_file(options.report, json);
  }
  return report.interrupted ? exit_interrupted : exit_ok;
}

}  // namespace palpate
