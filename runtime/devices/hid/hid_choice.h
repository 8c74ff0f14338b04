// Choice of an attached HID device and its profile.
#pragma once

#include <string>
#include <vector>

#include "runtime/devices/hid/hid_catalog.h"
#include "runtime/devices/reports/device_profile.h"

namespace palpate {

/// Profile with the key that selects it: a built-in name or a file.
struct NamedProfile {
  std::string key;
  DeviceProfile profile;
};

/// Returns the built-in profiles.
[[nodiscard]] std::vector<NamedProfile> known_profiles();

/// Returns the built-in profile of that name, or reads the file. Throws Error if it is neither, or the file
/// is invalid.
[[nodiscard]] NamedProfile find_profile(const std::string& name_or_file);

/// Returns the profiles that fit the device, in their order, as pointers into `profiles`.
[[nodiscard]] std::vector<const NamedProfile*> fitting_profiles(const AttachedDevice& device,
                                                                const std::vector<NamedProfile>& profiles);

struct HidChoice {
  AttachedDevice device;
  DeviceProfile profile;
};

/// Chooses a device and a profile. `text` selects the device: "" means the only one with a fitting profile,
/// otherwise "VVVV:PPPP" (vendor and product in hexadecimal), "/dev/hidrawN" or a serial number. `profiles`:
/// candidates; a single one if the user named it. Throws Error that lists the choices with a hint if nothing
/// is attached, the device is missing, no profile fits, several devices or profiles fit, or access is denied.
[[nodiscard]] HidChoice choose_hid_device(const std::vector<AttachedDevice>& attached,
                                          const std::vector<NamedProfile>& profiles, const std::string& text);

}  // namespace palpate
