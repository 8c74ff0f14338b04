#include "runtime/loop.h"

#include <algorithm>
#include <cmath>
#include <ctime>

namespace palpate {
namespace {

constexpr std::int64_t second = 1'000'000'000;              // ns
constexpr std::int64_t period = second / ticks_per_second;  // ns

std::int64_t now() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * second + time.tv_nsec;
}

/// Returns early when a signal comes.
void sleep_until(std::int64_t due) noexcept {
  const timespec time{.tv_sec = due / second, .tv_nsec = due % second};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr);
}

TickRecord make_record(const Body& body, const State& state, const ToolPose& tool, double time,
                       std::int64_t compute_ns) noexcept {
  TickRecord record;
  record.time = time;
  record.node = state.tool_node < 0 ? -1 : body.mesh_node(state.tool_node);
  for (int axis = 0; axis < 3; ++axis) {
    record.tool_position[axis] = tool.position[axis];
    record.force[axis] = state.tool_force[axis];
    record.displacement[axis] = state.tool_node_displacement[axis];
  }
  record.status = static_cast<std::uint32_t>(state.status);
  record.compute_ns = static_cast<std::uint32_t>(std::min<std::int64_t>(compute_ns, UINT32_MAX));
  record.grab = tool.grab ? 1 : 0;
  return record;
}

void count_step(LoopReport& report, const State& state, double time, std::int64_t compute_ns) noexcept {
  ++report.ticks;
  if (state.tool_node >= 0) ++report.ticks_held;
  report.compute.add(compute_ns);
  const double force = state.tool_force.stableNorm();
  if (force > report.largest_force) {
    report.largest_force = force;
    report.largest_force_time = time;
  }
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    if (has(state.status, status_names[k].first)) ++report.status_ticks[k];
  }
}

}  // namespace

std::int64_t count_ticks(const ScriptDevice& device) {
  constexpr double rounding = 1e-6;  // of a tick: 0.003 s is tick 3 although 0.003 * 1000 is not 3
  return static_cast<std::int64_t>(std::floor(device.end_time() * ticks_per_second + rounding)) + 1;
}

LoopReport run_loop(const Body& body, State& state, const ScriptDevice& device, Recorder* recorder, bool fast,
                    const std::atomic<bool>& stop) {
  LoopReport report;
  const std::int64_t ticks = count_ticks(device);
  const std::int64_t start = now() + period;
  for (std::int64_t tick = 0; tick < ticks && !stop; ++tick) {
    const std::int64_t due = start + tick * period;
    if (!fast) {
      sleep_until(due);
      if (stop) break;
      report.worst_lateness = std::max(report.worst_lateness, now() - due);
    }

    const double time = static_cast<double>(tick) / ticks_per_second;
    const ToolPose tool = device.pose(time);
    const std::int64_t begin = now();
    step(body, state, tool);
    const std::int64_t end = now();

    if (!fast && end > due + period) ++report.deadline_misses;
    count_step(report, state, time, end - begin);
    if (recorder != nullptr && fast) recorder->push_waiting(make_record(body, state, tool, time, 0));
    if (recorder != nullptr && !fast) recorder->push(make_record(body, state, tool, time, end - begin));
  }
  report.interrupted = stop;
  return report;
}

}  // namespace palpate
