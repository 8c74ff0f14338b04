// Factory of HID protocols.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/hid_report_descriptor.h"

namespace palpate {

/// Returns the protocol of the profile's kind. `device`: name in messages. `last`: sequence number of the
/// last state before this opening. Throws Error if the report descriptor does not belong to such a device.
[[nodiscard]] std::unique_ptr<HidProtocol> make_hid_protocol(const DeviceProfile& profile,
                                                             const HidReportDescriptor& descriptor,
                                                             const std::string& device, std::uint32_t last);

// Of one kind each, as above.

[[nodiscard]] std::unique_ptr<HidProtocol> make_hid_arm(const ArmConstants& arm, const DeviceLimits& limits,
                                                        const std::string& device, std::uint32_t last);
[[nodiscard]] std::unique_ptr<HidProtocol> make_hid_board(const DeviceLimits& limits,
                                                          const HidReportDescriptor& descriptor,
                                                          const std::string& device, std::uint32_t last);
[[nodiscard]] std::unique_ptr<HidProtocol> make_hid_joystick(const PidConstants& constants,
                                                             const DeviceLimits& limits,
                                                             const PidLayout& layout,
                                                             const std::string& device, std::uint32_t last);
[[nodiscard]] std::unique_ptr<HidProtocol> make_hid_space_mouse(const SpaceMouseConstants& constants,
                                                                const DeviceLimits& limits,
                                                                std::uint32_t last);

}  // namespace palpate
