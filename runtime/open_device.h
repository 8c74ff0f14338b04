// The wire to the device that was chosen.
#pragma once

#include <memory>

#include "runtime/devices/device_port.h"
#include "runtime/devices/guardian.h"
#include "runtime/play.h"

namespace palpate {

/// Of `hid` or `bridge`; not open yet. `guardian` may be null. Throws Error that says what there is and how
/// to choose, when it is not clear which device is meant or it cannot be had.
[[nodiscard]] std::unique_ptr<DevicePort> make_port(const DeviceChoice& choice, const SafetyOptions& safety,
                                                    Guardian* guardian);

}  // namespace palpate
