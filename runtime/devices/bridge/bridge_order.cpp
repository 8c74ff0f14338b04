#include "runtime/devices/bridge/bridge_order.h"

#include <algorithm>

namespace palpate {
namespace {

constexpr double drift = 1e-3;  // between two clocks: quartz has 1e-4

}  // namespace

Refusal BridgeOrder::see(std::uint32_t sequence, std::uint64_t time, std::int64_t arrived) noexcept {
  const double way = static_cast<double>(arrived) - static_cast<double>(time);
  if (!seen_any_) quickest_ = way;
  if (seen_any_) {
    if (static_cast<std::int32_t>(sequence - sequence_) <= 0) return Refusal::order;
    if (time <= time_) return Refusal::time;
    quickest_ = std::min(way, quickest_ + drift * static_cast<double>(arrived - arrived_));
    arrived_ = arrived;
    if (way - quickest_ > most_age * 1e9) return Refusal::age;
    skipped_ += sequence - sequence_ - 1;
  }
  seen_any_ = true;
  sequence_ = sequence;
  time_ = time;
  arrived_ = arrived;
  return Refusal::none;
}

}  // namespace palpate
