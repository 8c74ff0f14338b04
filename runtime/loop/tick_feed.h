// What is told of every tick, to whoever draws it.
#pragma once

#include <atomic>
#include <functional>
#include <span>
#include <thread>

#include "runtime/loop/monitor.h"

namespace palpate {

/// Hands the notes of all ticks on, about 30 times a second, from a thread of its own. Where it does not keep
/// up, notes are lost, as their numbers tell.
class TickFeed {
 public:
  /// Takes ticks whose numbers follow one another.
  using Sink = std::function<void(std::span<const TickNote>)>;

  /// `sink` is called by one thread and does not throw.
  explicit TickFeed(Sink sink);
  ~TickFeed();  ///< after the last note
  TickFeed(const TickFeed&) = delete;
  TickFeed& operator=(const TickFeed&) = delete;

  /// By the loop after each tick; never waits.
  void push(TickNote note) noexcept { notes_.push(note); }

 private:
  void run();

  Sink sink_;
  Ring<TickNote> notes_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace palpate
