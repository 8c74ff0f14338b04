// What moves the tool of a run, and what it needs.
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

/// What moves the tool.
struct InputSource {
  std::unique_ptr<Device> device;
  DeviceLink* link = nullptr;      ///< the device, where a hand may be in it
  MouseDevice* mouse = nullptr;    ///< the device, where it is a viewer's pointer
  ReplayDevice* replay = nullptr;  ///< the device, where a session is replayed
  std::int64_t ticks = std::numeric_limits<std::int32_t>::max();  ///< how long it goes on
};

/// Input sources of all kinds except the mouse, which begins above the body: see add_mouse. `guardian` may be
/// null. Throws Error.
[[nodiscard]] InputSource make_input_source(const PlayOptions& options, Guardian* guardian);

/// The mouse, lifted above the body.
void add_mouse(InputSource& input, const PlayOptions& options, const Body& body);

/// Until the device says where it is, or `stop`. Throws Error when one that is plugged in stays silent.
void wait_for(const DeviceLink& link, bool is_bridge, const std::atomic<bool>& stop);

/// What a hand needs beside what was asked for: safety, a place, and a coupling no stiffer than the device
/// can show. No hand is in a mouse: all that its safety does is to notice that it is gone, and its coupling
/// is fifty times stiffer than a node of the surface, that what is held gives no infinite force. Scripts and
/// replays get what was asked for.
[[nodiscard]] Settings apply_defaults(Settings settings, const InputSource& input, const Body& body);

/// Where the device is and how strong.
void print_device(const InputSource& input, const Settings& settings);

/// Median over some hundred nodes of the surface of 1 / mean diagonal of their block of Xi [N/m].
[[nodiscard]] double surface_stiffness(const Body& body);

}  // namespace palpate
