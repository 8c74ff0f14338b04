// HID protocol of a SpaceMouse.
#include <algorithm>

#include "runtime/devices/hid/make_hid_protocol.h"
#include "runtime/devices/reports/space_mouse.h"

namespace palpate {
namespace {

DeviceLimits without_force(DeviceLimits limits) {
  limits.max_force = limits.max_torque = 0.0;
  return limits;
}

/// Silent while its cap rests, which is not a fault: there is a state each millisecond, whether it said
/// something or not. It shows no force, whatever its profile says, so the engagement rule does not apply.
/// That it is gone is seen by the read that fails.
class HidSpaceMouse : public HidProtocol {
 public:
  HidSpaceMouse(const SpaceMouseConstants& constants, const DeviceLimits& limits, std::uint32_t last)
      : HidProtocol(without_force(limits)), sequence_(last), mouse_(constants, limits.workspace_radius) {}

  [[nodiscard]] std::size_t input_bytes() const noexcept override { return 13; }
  [[nodiscard]] int wait() const noexcept override { return 1; }

  bool take(std::span<const std::uint8_t> report) noexcept override {
    const auto said = decode_space_mouse(report);
    if (said) mouse_.take(*said);
    return said.has_value();
  }

  bool tell(bool /*heard*/, std::int64_t now, DeviceState& state) noexcept override {
    constexpr std::int64_t longest = 20'000'000;  // limits the jump after a delayed read [ns]
    const std::int64_t passed = advanced_ == 0 ? 0 : std::min(now - advanced_, longest);
    advanced_ = now;
    state = mouse_.advance(1e-9 * static_cast<double>(passed));
    state.sequence = ++sequence_;
    return true;
  }

 private:
  std::uint32_t sequence_;
  SpaceMouse mouse_;
  std::int64_t advanced_ = 0;  // time up to which the pose was integrated; 0: not yet [ns]
};

}  // namespace

std::unique_ptr<HidProtocol> make_hid_space_mouse(const SpaceMouseConstants& constants,
                                                  const DeviceLimits& limits, std::uint32_t last) {
  return std::make_unique<HidSpaceMouse>(constants, limits, last);
}

}  // namespace palpate
