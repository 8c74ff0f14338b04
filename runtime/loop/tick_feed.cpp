#include "runtime/loop/tick_feed.h"

#include <chrono>
#include <utility>
#include <vector>

namespace palpate {
namespace {

constexpr auto feed_pause = std::chrono::milliseconds(33);
constexpr std::size_t feed_room = 8192;  // queued ticks: more than a second of the fastest loop

}  // namespace

TickFeed::TickFeed(Sink sink) : sink_(std::move(sink)), notes_(feed_room), thread_([this] { run(); }) {}

TickFeed::~TickFeed() {
  stop_ = true;
  thread_.join();
}

void TickFeed::run() {
  std::vector<TickNote> batch;
  const auto hand_on = [&] {
    if (!batch.empty()) sink_(batch);
    batch.clear();
  };
  for (;;) {
    const bool last = stop_;  // read before the notes: none comes after stopping
    TickNote note;
    while (notes_.pop(note)) {
      if (!batch.empty() && note.number != batch.back().number + 1) hand_on();
      batch.push_back(note);
    }
    hand_on();
    if (last) return;
    std::this_thread::sleep_for(feed_pause);
  }
}

}  // namespace palpate
