#include "runtime/devices/hid/hid_space_mouse.h"

#include <algorithm>

namespace palpate {

bool HidSpaceMouse::take(std::span<const std::uint8_t> report) noexcept {
  const auto said = decode_space_mouse(report);
  if (!said) return false;
  mouse_.take(*said);
  return true;
}

bool HidSpaceMouse::tell(bool /*heard*/, std::int64_t now, DeviceState& state) noexcept {
  constexpr std::int64_t longest = 20'000'000;  // limits the jump after a delayed read [ns]
  const std::int64_t passed = advanced_ == 0 ? 0 : std::min(now - advanced_, longest);
  advanced_ = now;
  state = mouse_.advance(1e-9 * static_cast<double>(passed));
  state.sequence = ++sequence_;
  return true;
}

}  // namespace palpate
