// palpate-runtime devices: attached devices and their profiles.
#pragma once

#include <string>

namespace palpate {

struct DevicesOptions {
  bool json = false;
  std::string profile;        ///< additional profile file; empty: only the built-in ones
  std::string print_profile;  ///< name of a built-in profile to print instead; empty: list devices
};

/// Prints the HID devices, the profiles that fit them and the reason if one cannot be opened. Returns the
/// exit code; throws Error for a missing or invalid profile.
int devices(const DevicesOptions& options);

}  // namespace palpate
