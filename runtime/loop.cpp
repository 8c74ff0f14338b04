#include "runtime/loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

#include "runtime/devices/fault.h"

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

void set(double (&vector)[3], const Vec3& value) noexcept {
  std::copy_n(value.data(), 3, vector);
}

void set(double (&wxyz)[4], const Eigen::Quaterniond& value) noexcept {
  const std::array<double, 4> numbers = {value.w(), value.x(), value.y(), value.z()};
  std::copy(numbers.begin(), numbers.end(), wxyz);
}

void set(double (&symmetric)[6], const Eigen::Matrix3d& value) noexcept {
  const std::array<double, 6> numbers = {value(0, 0), value(1, 1), value(2, 2),
                                         value(0, 1), value(1, 2), value(2, 0)};
  std::copy(numbers.begin(), numbers.end(), symmetric);
}

TickRecord make_record(const Body& body, const State& state, const PatchSource* overlays,
                       const ToolPose& device, double time, std::int64_t compute_ns) noexcept {
  const ToolState& tool = state.tools.front();
  TickRecord record;
  record.time = time;
  set(record.device_position, device.position);
  set(record.device_orientation, device.orientation);
  set(record.tool_position, tool.pose.position);
  set(record.tool_orientation, tool.pose.orientation);
  set(record.force, -tool.wrench.force);
  set(record.torque, -tool.wrench.torque);
  set(record.stiffness, tool.local.stiffness);
  record.contacts = tool.contacts;
  record.status = static_cast<std::uint32_t>(state.status);
  record.compute_ns = static_cast<std::uint32_t>(std::min<std::int64_t>(compute_ns, UINT32_MAX));
  record.grab = device.grab ? 1 : 0;
  set(record.handle_position, device.position);
  set(record.handle_orientation, device.orientation);
  record.buttons = record.grab;
  set(record.shown_force, tool.wrench.force);
  set(record.shown_torque, tool.wrench.torque);
  record.share = 1.0;
  record.phase = static_cast<std::uint8_t>(SafetyPhase::active);
  if (overlays != nullptr && overlays->centre() >= 0) record.patch = body.mesh_node(overlays->centre());
  return record;
}

void note_largest(double value, double time, double& largest, double& largest_time) noexcept {
  if (!(value > largest)) return;
  largest = value;
  largest_time = time;
}

/// `force_before`: on the hand in the tick before [N].
void count_step(LoopReport& report, const State& state, const Vec3& force_before, double time,
                std::int64_t compute_ns) noexcept {
  const ToolState& tool = state.tools.front();
  if (report.ticks_begun_inside == report.ticks && has(state.status, StepStatus::inside_body))
    ++report.ticks_begun_inside;
  ++report.ticks;
  if (tool.contacts > 0) ++report.ticks_in_contact;
  report.most_contacts = std::max(report.most_contacts, tool.contacts);
  report.compute.add(compute_ns);
  const Vec3& force = tool.wrench.force;
  note_largest(force.stableNorm(), time, report.largest_force, report.largest_force_time);
  note_largest((force - force_before).stableNorm(), time, report.largest_jump, report.largest_jump_time);
  for (std::size_t k = 0; k < status_names.size(); ++k) {
    if (has(state.status, status_names[k].first)) ++report.status_ticks[k];
  }
}

}  // namespace

std::int64_t count_ticks(const ScriptDevice& device) {
  constexpr double rounding = 1e-6;  // of a tick: 0.003 s is tick 3 although 0.003 * 1000 is not 3
  return static_cast<std::int64_t>(std::floor(device.end_time() * ticks_per_second + rounding)) + 1;
}

LoopReport run_loop(const Body& body, State& state, const ScriptDevice& device, PatchSource* overlays,
                    MotionSource* motion, Recorder* recorder, bool fast, const std::atomic<bool>& stop,
                    SurfaceFrames* frames) {
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
    const ToolPose pose = device.pose(time);
    const Vec3 force_before = state.tools.front().wrench.force;
    const auto serve = [&] {
      if (overlays != nullptr) overlays->serve(state);
      if (motion != nullptr) motion->receive(state);
    };
    if (fast) serve();  // they do what is missing, untimed
    const std::int64_t begin = now();
    if (!fast) serve();
    step(body, state, pose);
    if (motion != nullptr) motion->post(state);
    const std::int64_t end = now();

    if (!fast && end > due + period) ++report.deadline_misses;
    count_step(report, state, force_before, time, end - begin);
    if (frames != nullptr) frames->post(state, tick, time);
    if (recorder == nullptr) continue;
    TickRecord record = make_record(body, state, overlays, pose, time, fast ? 0 : end - begin);
    record.begun_ns = fast ? tick * period : begin - start;
    if (fast) {
      recorder->push_waiting(record);
    } else {
      recorder->push(record);
    }
  }
  report.interrupted = stop;
  return report;
}

}  // namespace palpate
