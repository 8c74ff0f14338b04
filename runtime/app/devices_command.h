// palpate-runtime devices: what is attached, and what can be played with.
#pragma once

#include <string>

namespace palpate {

struct DevicesOptions {
  bool json = false;
  std::string profile;        ///< file of a profile beside the built-in ones; empty: none
  std::string print_profile;  ///< name of a built-in profile to print instead; empty: list devices
};

/// Prints the HID devices, the profiles that fit them and why one cannot be opened. Returns the exit code;
/// throws Error for profiles that are not there or wrong.
int devices(const DevicesOptions& options);

}  // namespace palpate
