// What ranks take from the system besides MPI: threads and time. A simulation of a cluster has its own.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace palpate {

using RankThread = std::jthread;
using RankMutex = std::mutex;
using RankCondition = std::condition_variable;
using RankClock = std::chrono::steady_clock;

inline void pause_for(std::chrono::microseconds pause) {
  std::this_thread::sleep_for(pause);
}

}  // namespace palpate
