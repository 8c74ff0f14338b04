// Clock of the loop and of the device threads.
#pragma once

#include <cstdint>
#include <ctime>

namespace palpate {

/// Returns CLOCK_MONOTONIC [ns].
inline std::int64_t monotonic_now() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

}  // namespace palpate
