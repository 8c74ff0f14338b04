// Chooses the protocol of a device by its profile.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "runtime/devices/hid/hid_protocol.h"
#include "runtime/devices/reports/device_profile.h"
#include "runtime/devices/reports/hid_report_descriptor.h"

namespace palpate {

/// The protocol of a profile's kind. `device` is what messages call it. `last` is the last sequence number of
/// the time before. Throws Error when the report descriptor is not that of such a device.
[[nodiscard]] std::unique_ptr<HidProtocol> make_hid_protocol(const DeviceProfile& profile,
                                                             const HidReportDescriptor& descriptor,
                                                             const std::string& device, std::uint32_t last);

}  // namespace palpate
