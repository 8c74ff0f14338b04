// Input source of a run, and the settings that it needs.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>

#include "runtime/app/mouse_device.h"
#include "runtime/app/play_options.h"
#include "runtime/body/body.h"
#include "runtime/devices/hid/guardian.h"
#include "runtime/loop/device_link.h"
#include "runtime/loop/replay_device.h"

namespace palpate {

/// Input source: the device that moves the tool.
struct InputSource {
  std::unique_ptr<Device> device;
  DeviceLink* link = nullptr;                                     ///< the device, if it may be in a hand
  MouseDevice* mouse = nullptr;                                   ///< the device, if it is a viewer's pointer
  ReplayDevice* replay = nullptr;                                 ///< the device, if a session is replayed
  std::int64_t ticks = std::numeric_limits<std::int32_t>::max();  ///< number of ticks until its end
};

/// Creates any input source except the mouse, which starts above the body: see add_mouse. `guardian` may be
/// null. Throws Error.
[[nodiscard]] InputSource make_input_source(const PlayOptions& options, Guardian* guardian);

/// Adds the mouse, lifted above the body.
void add_mouse(InputSource& input, const PlayOptions& options, const Body& body);

/// Waits until the device has reported its position, or `stop`. Throws Error if an attached device stays
/// silent.
void wait_for(const DeviceLink& link, bool is_bridge, const std::atomic<bool>& stop);

/// Adds to the settings the needs of a hand: safety, an origin, and a coupling no stiffer than the device can
/// show. A mouse is not held by a force: its safety only detects its loss, and its coupling is fifty times
/// stiffer than a surface node, so that a grab gives no infinite force. Settings for scripts and replays are
/// unchanged.
[[nodiscard]] Settings apply_defaults(Settings settings, const InputSource& input, const Body& body);

/// Prints the device's position and limits.
void print_device(const InputSource& input, const Settings& settings);

/// Median over about a hundred surface nodes of 1 / mean diagonal of their block of Xi [N/m].
[[nodiscard]] double surface_stiffness(const Body& body);

}  // namespace palpate
