// Work whose results all need who share it: threads, or processes and their threads.
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
  std::function<void(std::int64_t item, int worker)> work;        ///< by any thread of any process
  std::function<void(std::int64_t item, Parcel& results)> carry;  ///< between who worked and all others
  std::function<bool(double share)> done = [](double) { return true; };  ///< (0..1); false stops
};

/// Who shares work. All processes make the same calls in the same order.
class Sharing {
 public:
  Sharing() = default;
  virtual ~Sharing() = default;
  Sharing(const Sharing&) = delete;
  Sharing& operator=(const Sharing&) = delete;

  /// Threads of this process: `worker` is in [0, jobs).
  [[nodiscard]] virtual int jobs() const = 0;

  /// Works on each item once and returns when this process has the results of all, or false, in all
  /// processes, when it was stopped. `done` is called by one process, for one item at a time.
  virtual bool for_each(const SharedItems& items) = 0;
};

/// Threads of this process alone: nothing is carried.
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
