// Which of the attached HID devices is played with, and by which profile.
#pragma once

#include <string>
#include <vector>

#include "runtime/devices/hid/hid_catalog.h"
#include "runtime/devices/reports/device_profile.h"

namespace palpate {

/// A profile and what a person writes to choose it: a built-in one's name, or a file.
struct NamedProfile {
  std::string key;
  DeviceProfile profile;
};

/// The built-in ones.
[[nodiscard]] std::vector<NamedProfile> known_profiles();

/// The built-in one of that name, or that of a file. Throws Error when it is neither, or the file is wrong.
[[nodiscard]] NamedProfile find_profile(const std::string& name_or_file);

/// The profiles that fit, in their order. Point into `profiles`.
[[nodiscard]] std::vector<const NamedProfile*> fitting_profiles(const AttachedDevice& device,
                                                                const std::vector<NamedProfile>& profiles);

struct HidChoice {
  AttachedDevice device;
  DeviceProfile profile;
};

/// `text` says which device: "" is the only one that a profile fits, else "VVVV:PPPP" (vendor and product in
/// hexadecimal numbers), "/dev/hidrawN" or a serial number. `profiles`: those that come into question, one
/// where the user named it. Throws Error that lists what there is and says how to choose: nothing is
/// attached, it is not there, no profile fits, several devices, several profiles, no access.
[[nodiscard]] HidChoice choose_hid_device(const std::vector<AttachedDevice>& attached,
                                          const std::vector<NamedProfile>& profiles, const std::string& text);

}  // namespace palpate
