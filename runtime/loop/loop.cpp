#include "runtime/loop/loop.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "runtime/body/patch_maker.h"
#include "runtime/core/touch/contact_nodes.h"
#include "runtime/loop/mesh_stiffening.h"
#include "runtime/loop/tick_record.h"
#include "runtime/safety/monotonic_clock.h"

namespace palpate {
namespace {

constexpr std::int64_t second = 1'000'000'000;  // ns

/// Returns early on a signal.
void sleep_until(std::int64_t due) noexcept {
  const timespec time{.tv_sec = due / second, .tv_nsec = due % second};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr);
}

/// The loop over ticks: device, safety rules and requests of a person.
class Loop {
 public:
  Loop(const LoopParts& parts, const LoopOptions& options)
      : parts_(parts), options_(options), start_(options.fast ? 0 : monotonic_now() + second / options.rate) {
    report_.rate = options.rate;
    if (parts.safety != nullptr) fault_ = parts.safety->fault();  // counted when it occurred
  }

  LoopReport run(const std::atomic<bool>& stop) {
    for (std::int64_t number = 0; number < options_.ticks && !ends(stop); ++number) {
      tick_.number = number;
      set_due();
      if (!options_.fast) sleep_until(tick_.due);
      if (is_paused()) wait_paused(stop);
      if (ends(stop)) break;
      tick_.begun = options_.fast ? tick_.due : monotonic_now();
      tick();
    }
    if (parts_.safety != nullptr) parts_.safety->shut_down();
    parts_.device.display(DeviceCommand{}, news_.state, monotonic_now());
    report_.interrupted = stop;
    return report_;
  }

 private:
  [[nodiscard]] bool ends(const std::atomic<bool>& stop) const noexcept {
    return stop || (parts_.control != nullptr && parts_.control->leave) || replay_failed();
  }

  [[nodiscard]] bool replay_failed() const noexcept {
    return parts_.replayed != nullptr && parts_.replayed->failed();
  }

  void set_due() noexcept { tick_.due = start_ + tick_.number * second / options_.rate; }

  [[nodiscard]] bool is_paused() const noexcept {
    return parts_.control != nullptr && parts_.control->paused;
  }

  /// Waits until the pause ends or a single tick is requested. Shifts the loop's start by the waiting time,
  /// so that the clock of the ticks stands still.
  void wait_paused(const std::atomic<bool>& stop) noexcept {
    LoopControl& control = *parts_.control;
    if (!was_paused_) show_picture();
    was_paused_ = true;
    const DeviceCommand nothing;
    while (control.paused && !ends(stop)) {
      if (control.single_ticks > 0) {
        --control.single_ticks;
        return;
      }
      parts_.device.display(nothing, news_.state, monotonic_now());
      start_ += second / options_.rate;
      set_due();
      sleep_until(tick_.due);
    }
  }

  void show_picture() noexcept {
    if (parts_.viewed != nullptr && report_.ticks > 0)
      parts_.viewed->post(parts_.state, report_.ticks - 1, shown_time_);
  }

  [[nodiscard]] double time() const noexcept {
    return static_cast<double>(tick_.number) / static_cast<double>(options_.rate);
  }

  void tick() noexcept {
    const std::int64_t next_due = start_ + (tick_.number + 1) * second / options_.rate;
    news_ = parts_.device.poll(tick_);
    if (replay_failed()) return;
    if (news_.begun) tick_.begun = *news_.begun;
    poll_person();
    lift();
    in_body_ = parts_.workspace.in_body(news_.state);
    const Vec3 force_before = tool().wrench.force;

    if (options_.fast) serve();  // the threads compute missing results, untimed
    const std::int64_t begin = monotonic_now();
    if (!options_.fast) serve();
    step(parts_.body, parts_.state, in_body_.pose);
    if (parts_.motion != nullptr) parts_.motion->post(parts_.state);
    guard();
    parts_.device.display(shown_, news_.state, tick_.begun);
    const std::int64_t end = monotonic_now();

    compute_ns_ = end - begin;
    if (!options_.fast && end > next_due) ++report_.deadline_misses;
    count(force_before);
    tell();
    if (parts_.frames != nullptr) parts_.frames->post(parts_.state, tick_.number, time());
    shown_time_ = time();
    if (is_paused() || tick_.number % options_.ticks_per_view == 0) show_picture();
  }

  /// Reads events that come from outside the device. A replay takes them from its session.
  void poll_person() noexcept {
    const bool resumes = std::exchange(was_paused_, is_paused());
    if (parts_.replayed != nullptr) return;
    const bool seen = parts_.monitor != nullptr && parts_.monitor->acknowledged();
    const bool seen_in_viewer = parts_.control != nullptr && parts_.control->acknowledged.exchange(false);
    if (seen || seen_in_viewer) news_.events |= DeviceEvent::acknowledged;
    if (resumes) news_.events |= DeviceEvent::resumed;
  }

  /// Moves a lifted tool directly to the pointer in each tick, without contact. It is felt there only once it
  /// is clear of the body; where it is lowered it need not be quite clear.
  void lift() noexcept {
    ToolState& lifted = parts_.state.tools.front();
    const bool is_lifted = has(news_.events, DeviceEvent::lifted);
    if (is_lifted) {
      lifted.placed = false;
      lifted.has_been_clear = false;
    } else if (is_lifted_) {
      lifted.has_been_clear = true;
    }
    is_lifted_ = is_lifted;
  }

  /// Takes the overlay and the free motion of this tick.
  void serve() noexcept {
    const TickRecord* then = nullptr;
    if (parts_.replayed != nullptr) then = &parts_.replayed->then();
    if (parts_.overlays != nullptr) {
      if (then == nullptr) {
        parts_.overlays->serve(parts_.state);
      } else {
        const Index centre = centre_of_record(parts_.body, then->patch);
        const bool older = has(static_cast<StepStatus>(then->status), StepStatus::older_patch);
        parts_.overlays->serve(parts_.state, centre, older);
      }
    }
    if (parts_.motion != nullptr) {
      if (then == nullptr) {
        parts_.motion->receive(parts_.state);
      } else {
        parts_.motion->receive(parts_.state, then->motion_step);
      }
    }
  }

  /// Passes the computed force through the safety layer to the device. Times count from the loop's start, so
  /// that a replay has the same numbers.
  void guard() noexcept {
    const DeviceCommand computed = parts_.workspace.in_device({tool().wrench, tool().local});
    if (parts_.safety == nullptr) {
      shown_ = computed;
      return;
    }
    tell_safety(*parts_.safety);
    DeviceState said = news_.state;
    said.arrived -= start_;
    const std::int64_t begun = tick_.begun - start_;
    shown_ = parts_.safety->filter(said, computed,
                                   {.now = begun,
                                    .due = tick_.due - start_,
                                    .solved = begun,
                                    .inside_body = has(parts_.state.status, StepStatus::inside_body)});
    const Fault fault = parts_.safety->fault();
    if (fault != fault_ && fault != Fault::none) ++report_.faults[static_cast<std::size_t>(fault)];
    fault_ = fault;
  }

  void tell_safety(Safety& safety) noexcept {
    if (has(news_.events, DeviceEvent::lost)) safety.fail(Fault::device_lost);
    if (has(news_.events, DeviceEvent::input_lost)) safety.fail(Fault::input_lost);
    if (has(news_.events, DeviceEvent::opened_again)) {
      // A person who plugs it in again has noticed the loss.
      ++report_.opened_again;
      const bool was_gone = safety.fault() == Fault::device_lost || safety.fault() == Fault::device_silent;
      if (was_gone) safety.acknowledge();
      safety.restart();
    }
    if (has(news_.events, DeviceEvent::acknowledged)) safety.acknowledge();
    if (has(news_.events, DeviceEvent::resumed)) safety.restart();
  }

  void count(const Vec3& force_before) noexcept {
    const State& state = parts_.state;
    if (report_.ticks_begun_inside == report_.ticks && has(state.status, StepStatus::inside_body))
      ++report_.ticks_begun_inside;
    ++report_.ticks;
    if (tool().contacts > 0) ++report_.ticks_in_contact;
    report_.most_contacts = std::max(report_.most_contacts, tool().contacts);
    report_.compute.add(compute_ns_);
    if (!options_.fast) report_.lateness.add(tick_.begun - tick_.due);
    const Vec3& force = tool().wrench.force;
    if (force.stableNorm() > report_.largest_force) {
      report_.largest_force = force.stableNorm();
      report_.largest_force_time = time();
      report_.largest_force_depth = depth();
      const bool grabs = std::ranges::any_of(state.contacts(), &ContactPoint::held);
      report_.largest_force_stiffening =
          grabs ? 1.0 : mesh_stiffening(parts_.body, tool().tool, report_.largest_force_depth);
    }
    note_largest((force - force_before).stableNorm(), time(), report_.largest_jump,
                 report_.largest_jump_time);
    note_largest(tool().greens_error, time(), report_.largest_greens_error,
                 report_.largest_greens_error_time);
    report_.largest_shown = std::max(report_.largest_shown, shown_.wrench.force.stableNorm());
    for (std::size_t k = 0; k < status_names.size(); ++k) {
      if (has(state.status, status_names[k].first)) ++report_.status_ticks[k];
    }
    report_.best_effort.add(state.status, force.stableNorm(), tool().force_error, tool().left_out, time());
  }

  /// Reports the tick to recorder and monitor.
  void tell() noexcept {
    if (parts_.monitor != nullptr || parts_.feed != nullptr) {
      const TickNote note = {.number = tick_.number,
                             .lateness_ns = tick_.begun - tick_.due,
                             .compute_ns = compute_ns_,
                             .force = -tool().wrench.force,
                             .shown = shown_.wrench.force.norm(),
                             .depth = parts_.feed != nullptr ? depth() : 0.0,
                             .contacts = tool().contacts,
                             .rigid = has(parts_.state.status, StepStatus::rigid_contact),
                             .status = parts_.state.status,
                             .force_error = tool().force_error,
                             .left_out = tool().left_out,
                             .small_strain = parts_.state.surface.motion.small_strain(),
                             .phase = phase(),
                             .fault = fault_,
                             .events = news_.events};
      if (parts_.monitor != nullptr) parts_.monitor->push(note);
      if (parts_.feed != nullptr) parts_.feed->push(note);
    }
    if (parts_.recorder == nullptr && parts_.replayed == nullptr) return;
    const TickRecord tick = record();
    if (parts_.replayed != nullptr) compare(tick, parts_.replayed->then(), report_.replay);
    if (parts_.recorder == nullptr) return;
    if (options_.fast) {
      parts_.recorder->push_waiting(tick);
    } else {
      parts_.recorder->push(tick);
    }
  }

  /// Largest depth to which closed contacts press the surface in, relative to the surface without the tool
  /// [m].
  [[nodiscard]] double depth() const noexcept {
    double deepest = 0.0;
    for (const ContactPoint& contact : parts_.state.contacts()) {
      if (contact.force.squaredNorm() == 0.0) continue;
      Vec3 moved = Vec3::Zero();  // displacement inward
      for_each_node(parts_.body, parts_.state.surface.near, contact, [&](Index node, double weight) {
        const Vec3 untouched = parts_.body.surface_rest_positions()[static_cast<std::size_t>(node)] +
                               parts_.state.surface.motion.untouched(parts_.body, node);
        moved += weight * (untouched - parts_.state.surface.tree.position(node));
      });
      deepest =
          std::max(deepest, moved.dot(contact.held ? outward_normal(parts_.state.surface.tree,
                                                                    nodes_of(parts_.body, contact.simplex))
                                                   : Vec3(contact.frame.col(0))));
    }
    return deepest;
  }

  [[nodiscard]] TickRecord record() const noexcept {
    TickRecord record;
    record.time = time();
    record_tool(record, parts_.body, parts_.state, tool(), in_body_.pose,
                parts_.overlays != nullptr ? parts_.overlays->centre() : -1);
    const std::int64_t compute = options_.fast ? 0 : compute_ns_;
    record.compute_ns = static_cast<std::uint32_t>(std::min<std::int64_t>(compute, UINT32_MAX));

    set(record.handle_position, news_.state.pose.position);
    set(record.handle_orientation, news_.state.pose.orientation);
    set(record.handle_velocity, news_.state.velocity);
    record.buttons = news_.state.buttons;
    record.sequence = news_.state.sequence;
    record.arrived_ns = news_.state.arrived - start_;
    record.begun_ns = tick_.begun - start_;
    set(record.shown_force, shown_.wrench.force);
    set(record.shown_torque, shown_.wrench.torque);
    record.share = parts_.safety != nullptr ? parts_.safety->share() : 1.0;
    record.phase = static_cast<std::uint8_t>(phase());
    record.fault = static_cast<std::uint8_t>(fault_);
    record.event = static_cast<std::uint8_t>(news_.events);
    return record;
  }

  [[nodiscard]] const ToolState& tool() const noexcept { return parts_.state.tools.front(); }
  [[nodiscard]] SafetyPhase phase() const noexcept {
    return parts_.safety != nullptr ? parts_.safety->phase() : SafetyPhase::active;
  }

  LoopParts parts_;
  LoopOptions options_;
  LoopReport report_;
  std::int64_t start_;  // time at which tick 0 is due [ns]
  TickTime tick_;
  DeviceNews news_;
  DeviceState in_body_;  // last state in the body's frame
  DeviceCommand shown_;
  std::int64_t compute_ns_ = 0;
  Fault fault_ = Fault::none;
  bool was_paused_ = false;
  bool is_lifted_ = false;   // in the previous tick
  double shown_time_ = 0.0;  // time of the last tick [s]
};

}  // namespace

LoopReport run_loop(const LoopParts& parts, const LoopOptions& options, const std::atomic<bool>& stop) {
  return Loop(parts, options).run(stop);
}

}  // namespace palpate
