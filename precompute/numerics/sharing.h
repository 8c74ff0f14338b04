// Work divided among threads, or processes and their threads, all of which need the results.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>

#include "base/parallel.h"
#include "precompute/numerics/parcel.h"

namespace palpate {

/// Items that do not depend on each other.
struct SharedItems {
  std::int64_t count = 0;
  std::function<void(std::int64_t item, int worker)> work;        ///< called by any thread of any process
  std::function<void(std::int64_t item, Parcel& results)> carry;  ///< sends results to all other processes
  std::function<bool(double share)> done = [](double) { return true; };  ///< gets the finished fraction
                                                                         ///< (0..1); false stops
};

/// Executor of divided work. All processes make the same calls in the same order.
class Sharing {
 public:
  Sharing() = default;
  virtual ~Sharing() = default;
  Sharing(const Sharing&) = delete;
  Sharing& operator=(const Sharing&) = delete;

  /// Number of threads of this process: `worker` is in [0, jobs).
  [[nodiscard]] virtual int jobs() const = 0;

  /// Works on each item once and returns true when this process has the results of all, or false, in all
  /// processes, if stopped. `done` is called by one process, for one item at a time.
  virtual bool for_each(const SharedItems& items) = 0;
};

/// Threads of this process alone; nothing is carried.
class ThreadSharing : public Sharing {
 public:
  explicit ThreadSharing(int jobs) : jobs_(jobs) {}

  [[nodiscard]] int jobs() const override { return jobs_; }

  bool for_each(const SharedItems& items) override {
    std::mutex mutex;
    std::int64_t finished = 0;
    bool stopped = false;
    parallel_for(items.count, jobs_, [&](std::int64_t item, int worker) {
      {
        const std::scoped_lock lock(mutex);
        if (stopped) return;
      }
      items.work(item, worker);
      const std::scoped_lock lock(mutex);
      if (!items.done(static_cast<double>(++finished) / static_cast<double>(items.count))) stopped = true;
    });
    return !stopped;
  }

 private:
  int jobs_;
};

}  // namespace palpate
