#include "runtime/open_device.h"

#include "runtime/devices/hid_choice.h"
#include "runtime/devices/hid_port.h"

namespace palpate {

std::unique_ptr<DevicePort> make_port(const DeviceChoice& choice, const SafetyOptions& safety,
                                      Guardian* guardian) {
  static_cast<void>(safety);
  std::vector<NamedProfile> profiles = known_profiles();
  if (!choice.profile.empty()) profiles = {find_profile(choice.profile)};
  return std::make_unique<HidPort>(choose_hid_device(attached_devices(), profiles, choice.target), guardian);
}

}  // namespace palpate
