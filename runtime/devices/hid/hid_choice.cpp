#include "runtime/devices/hid/hid_choice.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "base/error.h"
#include "runtime/devices/hid/builtin_profiles.h"

namespace palpate {
namespace {

bool same_letters(const std::string& a, const std::string& b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

bool is_meant(const AttachedDevice& device, const std::string& text) {
  return text.empty() || device.path == text || device.serial == text ||
         same_letters(fmt::format("{:04X}:{:04X}", device.vendor, device.product), text);
}

std::string list(const std::vector<AttachedDevice>& devices) {
  std::string text;
  for (const AttachedDevice& device : devices) {
    text += "\n  " + device.name() + (device.serial.empty() ? "" : ", serial " + device.serial);
  }
  return text;
}

std::string built_in_names() {
  std::string names;
  for (const BuiltinProfile& profile : builtin_profiles()) {
    names += (names.empty() ? "" : ", ") + std::string(profile.name);
  }
  return names;
}

[[noreturn]] void fail_unknown(const std::vector<AttachedDevice>& meant,
                               const std::vector<NamedProfile>& profiles) {
  const std::string who =
      profiles.size() == 1 ? "the profile " + profiles.front().key + " does not fit" : "no profile fits";
  if (meant.size() == 1) {
    const AttachedDevice& device = meant.front();
    throw Error(who + " this device; its reports are\n" + describe_reports(device), device.name(),
                "copy the nearest profile (palpate-runtime devices --print-profile NAME), edit [[match]] and "
                "the rest, and give it with --profile FILE");
  }
  throw Error(who + " any of the attached devices" + list(meant), "HID",
              "name one as VVVV:PPPP to see its reports, or write a profile for it");
}

}  // namespace

std::vector<NamedProfile> known_profiles() {
  std::vector<NamedProfile> profiles;
  for (const BuiltinProfile& profile : builtin_profiles()) {
    const std::string name(profile.name);
    profiles.push_back({name, parse_device_profile(profile.text, name + ".toml (built in)")});
  }
  return profiles;
}

NamedProfile find_profile(const std::string& name_or_file) {
  for (NamedProfile& profile : known_profiles()) {
    if (profile.key == name_or_file) return std::move(profile);
  }
  if (!std::filesystem::exists(name_or_file)) {
    throw Error("there is no such file, and no such built-in profile", name_or_file,
                "the built-in ones are " + built_in_names());
  }
  return {name_or_file, read_device_profile(name_or_file)};
}

std::vector<const NamedProfile*> fitting_profiles(const AttachedDevice& device,
                                                  const std::vector<NamedProfile>& profiles) {
  std::vector<const NamedProfile*> fitting;
  for (const NamedProfile& profile : profiles) {
    if (profile.profile.fits(device.id())) fitting.push_back(&profile);
  }
  return fitting;
}

HidChoice choose_hid_device(const std::vector<AttachedDevice>& attached,
                            const std::vector<NamedProfile>& profiles, const std::string& text) {
  if (attached.empty()) {
    throw Error("no HID device is attached", "HID",
                "plug one in; if it is, look for /dev/hidraw* and /sys/class/hidraw (a container sees only "
                "the devices that it is given)");
  }
  std::vector<AttachedDevice> meant;
  std::ranges::copy_if(attached, std::back_inserter(meant),
                       [&](const AttachedDevice& device) { return is_meant(device, text); });
  if (meant.empty()) {
    throw Error("no such HID device is attached; there are" + list(attached), text,
                "give VVVV:PPPP, /dev/hidrawN or a serial number of these");
  }
  std::vector<AttachedDevice> fitting;
  std::ranges::copy_if(meant, std::back_inserter(fitting), [&](const AttachedDevice& device) {
    return !fitting_profiles(device, profiles).empty();
  });
  if (fitting.empty()) fail_unknown(meant, profiles);
  if (fitting.size() > 1) {
    throw Error("several devices could be meant" + list(fitting), text.empty() ? "HID" : text,
                "choose one by VVVV:PPPP, by /dev/hidrawN or by its serial number");
  }
  const AttachedDevice& device = fitting.front();
  const auto candidates = fitting_profiles(device, profiles);
  if (candidates.size() > 1) {
    std::string names;
    for (const NamedProfile* profile : candidates) {
      names += fmt::format("\n  --profile {}  {}", profile->key, profile->profile.name);
    }
    throw Error("several profiles fit this device" + names, device.name(),
                "say which device it is with --profile NAME, or give a profile of your own with --profile "
                "FILE");
  }
  if (device.access != 0) {
    const AccessProblem problem = access_problem(device);
    throw Error(problem.what, device.name(), problem.hint);
  }
  return {device, candidates.front()->profile};
}

}  // namespace palpate
