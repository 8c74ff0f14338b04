#include "runtime/devices/hid/make_hid_protocol.h"

#include <algorithm>

#include "base/error.h"

namespace palpate {
namespace {

/// Length of the longest report of a type in the descriptor, including its id [byte].
int longest(const HidReportDescriptor& descriptor, HidReportType type) {
  int bytes = 0;
  for (const HidReportDescriptor::ReportSize& report : descriptor.sizes) {
    if (report.type == type) {
      bytes =
          std::max(bytes, descriptor.report_bytes(type, report.report_id) + (descriptor.numbered ? 1 : 0));
    }
  }
  return bytes;
}

void check_length(const HidReportDescriptor& descriptor, HidReportType type, int said, const char* name,
                  const std::string& device) {
  const int bytes = longest(descriptor, type);
  if (said != 0 && bytes != said) {
    throw Error("its longest " + std::string(name) + " report has " + std::to_string(bytes) +
                    " bytes, the profile says " + std::to_string(said),
                device, "it speaks another protocol; choose another profile, or correct [reports]");
  }
}

}  // namespace

std::unique_ptr<HidProtocol> make_hid_protocol(const DeviceProfile& profile,
                                               const HidReportDescriptor& descriptor,
                                               const std::string& device, std::uint32_t last) {
  if (std::holds_alternative<BoardConstants>(profile.kind)) {
    return make_hid_board(profile.limits, descriptor, device, last);
  }
  check_length(descriptor, HidReportType::input, profile.reports.input, "input", device);
  check_length(descriptor, HidReportType::output, profile.reports.output, "output", device);
  check_length(descriptor, HidReportType::feature, profile.reports.feature, "feature", device);
  if (const auto* arm = std::get_if<ArmConstants>(&profile.kind)) {
    return make_hid_arm(*arm, profile.limits, device, last);
  }
  if (const auto* joystick = std::get_if<PidConstants>(&profile.kind)) {
    return make_hid_joystick(*joystick, profile.limits, find_pid_layout(descriptor, device), device, last);
  }
  return make_hid_space_mouse(std::get<SpaceMouseConstants>(profile.kind), profile.limits, last);
}

}  // namespace palpate
