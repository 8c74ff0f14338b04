#include "runtime/loop/monitor.h"

#include <fmt/core.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdio>
#include <string_view>

#include "base/program.h"
#include "runtime/loop/best_effort.h"

namespace palpate {
namespace {

constexpr auto pause = std::chrono::milliseconds(20);
constexpr int pauses_a_line = 25;         // half a second
constexpr std::size_t most_notes = 8192;  // queued ticks: more than a second of the fastest loop

sigset_t acknowledging_signal() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGUSR1);
  return signals;
}

/// True if reading cannot stop this process, as it does in the background of a terminal.
bool may_read_input() {
  const pid_t foreground = tcgetpgrp(STDIN_FILENO);  // below 0: not our terminal
  return foreground < 0 || foreground == getpgrp();
}

}  // namespace

void block_acknowledging_signal() {
  const sigset_t signals = acknowledging_signal();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

std::string_view fault_remedy(Fault fault) {
  switch (fault) {
    case Fault::too_fast:
      return "the handle moved faster than max_speed";
    case Fault::device_silent:
      return "the device stopped reporting";
    case Fault::device_frozen:
      return "the device reports the same numbers again and again";
    case Fault::deadline_missed:
      return "too many ticks were late: close other programs, or give real-time rights";
    case Fault::buzzing:
      return "force and hand chattered: lower --coupling or --force-scale";
    case Fault::device_lost:
      return "the device was unplugged; force begins again when it is back";
    case Fault::input_lost:
      return "the page that moved the tool was closed, or silent for 5 s; the tool was lifted";
    case Fault::stopped:
      return "emergency stop";
    case Fault::none:
      break;
  }
  return "";
}

std::string histogram_bars(const TimeHistogram& histogram) {
  constexpr std::array<std::string_view, 9> levels = {"·", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr std::int64_t shortest = 1000;  // ns
  constexpr int classes = 12;
  std::string bars;
  std::int64_t lower = 0;
  for (int k = 0; k < classes; ++k) {
    const std::int64_t upper = k + 1 < classes ? shortest << k : INT64_MAX;
    const std::int64_t count = histogram.total_between(lower, upper);
    const auto level = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(count)));
    bars += levels[std::min(level, levels.size() - 1)];
    lower = upper;
  }
  return bars;
}

Monitor::Monitor(const MonitorOptions& options)
    : options_(options), notes_(most_notes), thread_([this] { run(); }) {}

Monitor::~Monitor() {
  stop_ = true;
  thread_.join();
}

void Monitor::run() {
  for (int pauses = 0;; ++pauses) {
    const bool last = stop_;
    TickNote note;
    while (notes_.pop(note)) take(note);
    if (options_.acknowledges) ask();
    if (options_.line && (last || pauses % pauses_a_line == 0)) draw();
    if (last) break;
    std::this_thread::sleep_for(pause);
  }
  if (drawn_) std::fputs("\n", stderr);
}

void Monitor::take(const TickNote& note) {
  lateness_.add(note.lateness_ns);
  compute_.add(note.compute_ns);
  if (note.lateness_ns + note.compute_ns > 1'000'000'000 / options_.rate) ++misses_;
  const double time = static_cast<double>(note.number) / static_cast<double>(options_.rate);
  if (has(note.events, DeviceEvent::opened_again)) say(fmt::format("{:.3f} s: the device is back", time));
  if (note.fault != last_.fault) {
    if (note.fault == Fault::none) {
      say(fmt::format("{:.3f} s: acknowledged; force begins again out of contact", time));
    } else {
      const auto& name = fault_names[static_cast<std::size_t>(note.fault)].second;
      say(fmt::format("{:.3f} s: no force, {}: {}.{}", time, name, fault_remedy(note.fault),
                      options_.acknowledges && note.fault != Fault::device_lost
                          ? fmt::format(" Press Enter to go on, or: kill -USR1 {}", getpid())
                          : ""));
    }
  }
  last_ = note;
}

void Monitor::ask() {
  const sigset_t signals = acknowledging_signal();
  const timespec at_once{};
  if (sigtimedwait(&signals, nullptr, &at_once) == SIGUSR1) acknowledged_ = true;
  if (!may_read_input()) return;
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  if (!asks_ || poll(&input, 1, 0) <= 0) return;
  char text[256];
  const ssize_t got = read(STDIN_FILENO, text, sizeof text);
  asks_ = got > 0;  // at the end of the input no more answers come
  if (got > 0 && std::string_view(text, static_cast<std::size_t>(got)).find('\n') != std::string_view::npos)
    acknowledged_ = true;
}

/// Prints a line of its own, above the one that is renewed.
void Monitor::say(const std::string& text) {
  if (drawn_) std::fputs("\r\x1b[K", stderr);
  palpate::say(stderr, "{}\n", text);
  drawn_ = false;
}

void Monitor::draw() {
  if (lateness_.total() == 0) return;
  const double time = static_cast<double>(last_.number) / static_cast<double>(options_.rate);
  std::string line = fmt::format("{:7.1f} s  {:6.3f} N  {:2d} contacts{}", time, last_.force.norm(),
                                 last_.contacts, last_.rigid ? " on what is held" : "");
  if (is_best_effort(last_.status, last_.left_out, last_.force_error))
    line += fmt::format("  best effort, within {:.2g} N", last_.force_error);
  if (options_.shows_safety) {
    line += fmt::format("  shown {:5.2f} N {}", last_.shown,
                        safety_phase_names[static_cast<std::size_t>(last_.phase)].second);
  }
  const auto spread = [&](std::string_view name, const TimeHistogram& histogram) {
    line += fmt::format("  {} {} {:.0f}/{:.0f}/{:.0f} us", name, histogram_bars(histogram),
                        microseconds(histogram.percentile(0.5)), microseconds(histogram.percentile(0.999)),
                        microseconds(histogram.worst()));
  };
  spread("late", lateness_);
  spread("step", compute_);
  line += fmt::format("  missed {}", misses_);
  palpate::say(stderr, "\r{}\x1b[K", line);
  std::fflush(stderr);
  drawn_ = true;
  lateness_.clear();
  compute_.clear();
}

}  // namespace palpate
