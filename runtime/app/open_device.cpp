#include "runtime/app/open_device.h"

#include "runtime/devices/bridge/bridge_port.h"
#include "runtime/devices/hid/hid_choice.h"
#include "runtime/devices/hid/hid_port.h"

namespace palpate {

std::unique_ptr<DevicePort> make_port(const DeviceChoice& choice, const SafetyOptions& safety,
                                      Guardian* guardian) {
  if (choice.kind == DeviceChoice::Kind::bridge) {
    return std::make_unique<BridgePort>(BridgeOptions{
        .listen = parse_bridge_address(choice.text), .max_force = safety.max_force, .stale = safety.stale});
  }
  std::vector<NamedProfile> profiles = known_profiles();
  if (!choice.profile.empty()) profiles = {find_profile(choice.profile)};
  return std::make_unique<HidPort>(choose_hid_device(attached_devices(), profiles, choice.target), guardian);
}

}  // namespace palpate
