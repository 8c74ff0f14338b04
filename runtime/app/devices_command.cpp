#include "runtime/app/devices_command.h"

#include <fmt/core.h>

#include <algorithm>

#include "base/error.h"
#include "base/json_text.h"
#include "base/program.h"
#include "runtime/devices/hid/builtin_profiles.h"
#include "runtime/devices/hid/hid_choice.h"

namespace palpate {
namespace {

void print_device(const AttachedDevice& device, const std::vector<NamedProfile>& profiles) {
  say(stdout, "{}\n", device.name());
  if (!device.maker.empty()) say(stdout, "  maker    {}\n", device.maker);
  if (!device.serial.empty()) say(stdout, "  serial   {}\n", device.serial);
  const auto fitting = fitting_profiles(device, profiles);
  if (fitting.empty()) {
    say(stdout, "  profile  none fits{}\n",
        device.descriptor_problem.empty() ? "" : ": " + device.descriptor_problem);
  }
  for (const NamedProfile* profile : fitting) {
    say(stdout, "  profile  {}: {}\n", profile->key, profile->profile.name);
  }
  // A keyboard needs no rule.
  if (fitting.empty()) return;
  if (device.access == 0) {
    say(stdout, "  access   yes\n");
  } else {
    const AccessProblem problem = access_problem(device);
    say_lines(stdout, "  access   " + problem.what + "; " + problem.hint + "\n", "  ");
  }
  if (fitting.size() > 1) say(stdout, "  choose   with --profile NAME\n");
}

void print_text(const std::vector<AttachedDevice>& attached, const std::vector<NamedProfile>& profiles) {
  if (attached.empty()) {
    say(stdout,
        "No HID device is attached (none in /sys/class/hidraw).\n"
        "A container sees only the devices that it is given. Without a device a script moves the tool:\n"
        "palpate-runtime play FILE --device script:TOUCH.csv\n");
    return;
  }
  for (const AttachedDevice& device : attached) {
    print_device(device, profiles);
  }
}

nlohmann::ordered_json json_of(const AttachedDevice& device, const std::vector<NamedProfile>& profiles) {
  auto fitting = nlohmann::ordered_json::array();
  for (const NamedProfile* profile : fitting_profiles(device, profiles)) fitting.push_back(profile->key);
  std::string descriptor;
  for (const std::uint8_t byte : device.descriptor) {
    descriptor += fmt::format("{:02x}", byte);
  }
  const AccessProblem problem = device.access == 0 ? AccessProblem{} : access_problem(device);
  return {{"path", device.path},
          {"vendor", device.vendor},
          {"product", device.product},
          {"serial", device.serial},
          {"maker", device.maker},
          {"name", device.product_name},
          {"usage", {device.reports.usage.page, device.reports.usage.id}},
          {"profiles", fitting},
          {"accessible", device.access == 0},
          {"access_problem", problem.what},
          {"hint", problem.hint},
          {"descriptor", descriptor},
          {"descriptor_problem", device.descriptor_problem}};
}

void print_json(const std::vector<AttachedDevice>& attached, const std::vector<NamedProfile>& profiles) {
  nlohmann::ordered_json json = {{"devices", nlohmann::ordered_json::array()}};
  for (const AttachedDevice& device : attached) json["devices"].push_back(json_of(device, profiles));
  std::fputs(json_text(json, 2).c_str(), stdout);
}

int print_profile(const std::string& name) {
  std::string names;
  for (const BuiltinProfile& profile : builtin_profiles()) {
    if (profile.name == name) {
      std::fwrite(profile.text.data(), 1, profile.text.size(), stdout);
      return exit_ok;
    }
    names += (names.empty() ? "" : ", ") + std::string(profile.name);
  }
  throw Error("there is no built-in profile of this name", name, "the built-in ones are " + names);
}

}  // namespace

int devices(const DevicesOptions& options) {
  if (!options.print_profile.empty()) return print_profile(options.print_profile);
  std::vector<NamedProfile> profiles = known_profiles();
  if (!options.profile.empty()) profiles.push_back({options.profile, read_device_profile(options.profile)});
  const std::vector<AttachedDevice> attached = attached_devices();
  if (options.json) {
    print_json(attached, profiles);
  } else {
    print_text(attached, profiles);
  }
  return exit_ok;
}

}  // namespace palpate
