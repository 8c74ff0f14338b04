// Loops run by several threads.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace palpate {

/// Calls work(item, worker) once for each item of [0, count) on `jobs` threads, which `worker` numbers in
/// [0, jobs). Items are taken in ascending order. Once a call throws, no more are begun, and its exception is
/// rethrown here.
template <class Work>
void parallel_for(std::int64_t count, int jobs, Work&& work) {
  std::atomic<std::int64_t> next{0};
  std::atomic<bool> failed{false};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto share = [&](int worker) {
    try {
      for (std::int64_t item = next++; item < count && !failed; item = next++) work(item, worker);
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!failed.exchange(true)) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int worker = 1; worker < jobs; ++worker) threads.emplace_back(share, worker);
    share(0);
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace palpate
