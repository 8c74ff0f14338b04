// Feed of all ticks to a viewer.
#pragma once

#include <atomic>
#include <functional>
#include <span>
#include <thread>

#include "runtime/loop/monitor.h"

namespace palpate {

/// Passes the notes of all ticks on, about 30 times per second, from a thread of its own. If it falls behind,
/// notes are lost, visible as gaps in their numbers.
class TickFeed {
 public:
  /// Receives ticks with consecutive numbers.
  using Sink = std::function<void(std::span<const TickNote>)>;

  /// `sink` is called by one thread and must not throw.
  explicit TickFeed(Sink sink);
  ~TickFeed();  ///< passes the last notes on first
  TickFeed(const TickFeed&) = delete;
  TickFeed& operator=(const TickFeed&) = delete;

  /// Passes a tick from the loop; never waits.
  void push(TickNote note) noexcept { notes_.push(note); }

 private:
  void run();

  Sink sink_;
  Ring<TickNote> notes_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace palpate
