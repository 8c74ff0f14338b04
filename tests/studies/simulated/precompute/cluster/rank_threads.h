// Threads and time of simulated nodes, in place of those of this machine: SimGrid's.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <simgrid/s4u.hpp>
#include <utility>

namespace palpate {

class RankThread {
 public:
  explicit RankThread(std::function<void()> work)
      : actor_(simgrid::s4u::Actor::create("thread", simgrid::s4u::this_actor::get_host(), std::move(work))) {
  }
  RankThread(RankThread&& other) noexcept : actor_(std::exchange(other.actor_, nullptr)) {}
  RankThread(const RankThread&) = delete;
  RankThread& operator=(const RankThread&) = delete;
  ~RankThread() {
    if (actor_ != nullptr) actor_->join();
  }

 private:
  simgrid::s4u::ActorPtr actor_;
};

class RankMutex {
 public:
  void lock() { mutex_->lock(); }
  void unlock() { mutex_->unlock(); }
  bool try_lock() { return mutex_->try_lock(); }

 private:
  friend class RankCondition;
  simgrid::s4u::MutexPtr mutex_ = simgrid::s4u::Mutex::create();
};

class RankCondition {
 public:
  template <class Predicate>
  void wait(std::unique_lock<RankMutex>& lock, Predicate ready) {
    while (!ready()) condition_->wait(lock.mutex()->mutex_);
  }
  void notify_one() { condition_->notify_one(); }
  void notify_all() { condition_->notify_all(); }

 private:
  simgrid::s4u::ConditionVariablePtr condition_ = simgrid::s4u::ConditionVariable::create();
};

struct RankClock {
  using duration = std::chrono::nanoseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<RankClock>;
  static constexpr bool is_steady = true;
  static time_point now() {  // never 0, which says that a rank was not heard of
    return time_point(duration(static_cast<std::int64_t>(1e9 * simgrid::s4u::Engine::get_clock()) + 1));
  }
};

inline void pause_for(std::chrono::microseconds pause) {
  simgrid::s4u::this_actor::sleep_for(1e-6 * static_cast<double>(pause.count()));
}

}  // namespace palpate
