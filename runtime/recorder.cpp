#include "runtime/recorder.h"

#include <algorithm>
#include <chrono>
#include <span>

namespace palpate {
namespace {

constexpr std::size_t ring_size = 65536;  // a minute at 1 kHz
constexpr std::size_t batch =
    4096;  // always written whole but for the last, so that equal runs leave equal bytes
constexpr auto pause = std::chrono::milliseconds(1);
static_assert(ring_size % batch == 0);

}  // namespace

Recorder::Recorder(const std::filesystem::path& path, const SessionInfo& info)
    : writer_(path, info), ring_(ring_size), thread_([this] { write_ticks(); }) {}

Recorder::~Recorder() {
  closing_ = true;
  if (thread_.joinable()) thread_.join();
}

bool Recorder::try_push(const TickRecord& tick) noexcept {
  const std::size_t pushed = pushed_.load(std::memory_order_relaxed);
  if (pushed - written_.load(std::memory_order_acquire) == ring_size) return false;
  ring_[pushed % ring_size] = tick;
  pushed_.store(pushed + 1, std::memory_order_release);
  return true;
}

void Recorder::push(const TickRecord& tick) noexcept {
  if (!try_push(tick)) ++dropped_;
}

void Recorder::push_waiting(const TickRecord& tick) noexcept {
  while (!try_push(tick)) {
    if (failed_) return;
    std::this_thread::sleep_for(pause);
  }
}

void Recorder::finish() {
  closing_ = true;
  thread_.join();
  if (failed_) std::rethrow_exception(failure_);
  writer_.finish();
}

void Recorder::write_ticks() noexcept {
  try {
    for (;;) {
      const bool last = closing_;  // read before `pushed_`: nothing is pushed after closing
      const std::size_t written = written_.load(std::memory_order_relaxed);
      const std::size_t waiting = pushed_.load(std::memory_order_acquire) - written;
      if (waiting >= batch || (last && waiting > 0)) {
        const std::size_t count = std::min(waiting, batch);
        writer_.append(std::span(ring_).subspan(written % ring_size, count));
        written_.store(written + count, std::memory_order_release);
      } else if (last) {
        return;
      } else {
        std::this_thread::sleep_for(pause);
      }
    }
  } catch (...) {
    failure_ = std::current_exception();
    failed_ = true;
  }
}

}  // namespace palpate
