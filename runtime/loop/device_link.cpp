#include "runtime/loop/device_link.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <ctime>
#include <exception>

#include "runtime/loop/real_time.h"
#include "runtime/safety/monotonic_clock.h"
#include "runtime/safety/plausible.h"

namespace palpate {
namespace {

constexpr std::int64_t patience = 2'000'000;            // ns; maximum age of a command
constexpr std::int64_t wait = 1'000'000;                // ns; waiting time for a new command
constexpr auto retry = std::chrono::milliseconds(100);  // between attempts to open a lost device

}  // namespace

DeviceLink::DeviceLink(std::unique_ptr<DevicePort> port, const DeviceLinkOptions& options)
    : port_(std::move(port)),
      options_(options),
      heard_(DeviceState{}),
      heard_by_writer_(DeviceState{}),
      shown_(Shown{}),
      stale_(options.stale),
      rate_(options.max_force_rate) {
  port_->open();
  options_.max_force = std::min(options_.max_force, port_->limits().max_force);
  name_ = port_->name();
  sem_init(&is_shown_, 0, 0);
  // A signal that interrupts a wait for the device would look like a lost device.
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  reader_ = std::thread([this] { read_reports(); });
  writer_ = std::thread([this] { write_commands(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

DeviceLink::~DeviceLink() {
  stop_ = true;
  reader_.join();
  writer_.join();
  port_->close();
  sem_destroy(&is_shown_);
}

DeviceNews DeviceLink::poll(const TickTime&) noexcept {
  DeviceNews news;
  const std::int64_t losses = losses_;
  const std::int64_t openings = openings_;
  if (losses != losses_told_) news.events |= DeviceEvent::lost;
  if (openings != openings_told_) news.events |= DeviceEvent::opened_again;
  losses_told_ = losses;
  openings_told_ = openings;
  news.state = heard_.read();
  return news;
}

void DeviceLink::display(const DeviceCommand& command, const DeviceState& state,
                         std::int64_t begun) noexcept {
  shown_.next() = {.command = command, .state = state, .begun = begun};
  shown_.publish();
  sem_post(&is_shown_);
}

void DeviceLink::read_reports() noexcept {
  ask_for_priority(wire_priority);
  bool is_open = true;   // state left by this thread
  bool is_back = false;  // open again, but no report yet
  while (!stop_) {
    if (!is_open) {
      std::this_thread::sleep_for(retry);
      try_to_open();
      const std::lock_guard lock(wire_);
      is_open = is_back = is_open_;
      continue;
    }
    DeviceState state;
    const DevicePort::ReadResult heard = port_->read(state);
    if (heard == DevicePort::ReadResult::lost || broken_) {
      lose();
      is_open = false;
    } else if (heard == DevicePort::ReadResult::report) {
      heard_.next() = state;
      heard_.publish();
      heard_by_writer_.next() = state;
      heard_by_writer_.publish();
      ++reports_;
      if (is_back) ++openings_;
      is_back = false;
    }
  }
}

void DeviceLink::lose() noexcept {
  const std::lock_guard lock(wire_);
  port_->close();
  is_open_ = false;
  broken_ = false;
  ++losses_;
}

void DeviceLink::try_to_open() noexcept {
  const std::lock_guard lock(wire_);
  try {
    port_->open();
  } catch (const std::exception&) {
    return;  // not back yet
  }
  is_open_ = true;
}

void DeviceLink::write_commands() noexcept {
  ask_for_priority(wire_priority);
  std::int64_t last_shown = 0;
  std::int64_t last_write = monotonic_now();
  while (!stop_) {
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += wait;
    until.tv_sec += until.tv_nsec / 1'000'000'000;
    until.tv_nsec %= 1'000'000'000;
    if (sem_clockwait(&is_shown_, CLOCK_MONOTONIC, &until) == 0) {
      while (sem_trywait(&is_shown_) == 0) {
      }
    }
    const Shown& shown = shown_.read();
    const std::int64_t begin = monotonic_now();
    const bool is_old = begin - shown.begun > patience;
    if (shown.begun == 0 || (shown.begun == last_shown && !is_old)) continue;
    if (is_old) {
      const DeviceState& state = heard_by_writer_.read();
      write(extrapolate(shown, state, begin, seconds_between(last_write, begin)), state);
      ++extrapolated_;
    } else {
      stale_.reset();
      constexpr double at_once = 1e9;  // the safety layer has already limited the rate
      rate_.follow(shown.command.wrench.force, at_once);
      write(shown.command, shown.state);
    }
    last_shown = shown.begun;
    last_write = begin;
  }
}

DeviceCommand DeviceLink::extrapolate(const Shown& shown, const DeviceState& state, std::int64_t now,
                                      double elapsed) noexcept {
  Vec3 field = stale_.force(shown.command, state.pose.position, state.velocity,
                            seconds_between(shown.begun, now), elapsed);
  if (shown.command.wrench.force.isZero(0.0)) field.setZero();  // no damping either without a force to feel
  DeviceCommand command;
  command.wrench.force = rate_.follow(clamped(stale_.share() * field, options_.max_force), elapsed);
  command.wrench.torque = stale_.share() * shown.command.wrench.torque;
  command.local.force = command.wrench.force;
  command.local.point = state.pose.position;
  return command;
}

void DeviceLink::write(const DeviceCommand& command, const DeviceState& state) noexcept {
  const std::lock_guard lock(wire_);
  if (!is_open_ || broken_) return;
  const std::int64_t begin = monotonic_now();
  if (!port_->write(command, state)) broken_ = true;
  worst_write_ = std::max<std::int64_t>(worst_write_, monotonic_now() - begin);
  ++writes_;
}

}  // namespace palpate
