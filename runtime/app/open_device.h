// The wire to the device that was chosen.
#pragma once

#include <memory>

#include "runtime/app/play.h"
#include "runtime/devices/hid/guardian.h"
#include "runtime/safety/device_port.h"

namespace palpate {

/// The port of `hid` or `bridge`; not open yet. `guardian` may be null. Throws Error that says what there is
/// and how to choose, when it is not clear which device is meant or it cannot be had.
[[nodiscard]] std::unique_ptr<DevicePort> make_port(const DeviceChoice& choice, const SafetyOptions& safety,
                                                    Guardian* guardian);

}  // namespace palpate
