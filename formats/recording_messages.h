// The messages of a recording: their definitions, and how they are written and read. docs/recording-format.md
// has their layout.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/cdr.h"
#include "formats/recording.h"

namespace palpate {

/// Visits the fields of a tick in the order of its message: `number(type, name, member)`, or for what has
/// several numbers `vector(name, member)`, `pose(name, position, orientation)`, `wrench(name, force, torque)`
/// and `numbers(name, member)`. `Tick` may be const.
template <class Tick, class Visitor>
void for_each_tick_field(Tick& tick, Visitor&& visit) {
  visit.number("float64", "time", tick.time);
  visit.pose("device", tick.device_position, tick.device_orientation);
  visit.pose("tool", tick.tool_position, tick.tool_orientation);
  visit.wrench("wrench", tick.force, tick.torque);
  visit.numbers("stiffness", tick.stiffness);
  visit.pose("handle", tick.handle_position, tick.handle_orientation);
  visit.vector("handle_velocity", tick.handle_velocity);
  visit.wrench("shown", tick.shown_force, tick.shown_torque);
  visit.number("float64", "share", tick.share);
  visit.number("int64", "arrived_ns", tick.arrived_ns);
  visit.number("int64", "begun_ns", tick.begun_ns);
  visit.number("int64", "motion_step", tick.motion_step);
  visit.number("uint32", "status", tick.status);
  visit.number("uint32", "compute_ns", tick.compute_ns);
  visit.number("uint32", "buttons", tick.buttons);
  visit.number("uint32", "sequence", tick.sequence);
  visit.number("int32", "contacts", tick.contacts);
  visit.number("int32", "patch", tick.patch);
  visit.number("int32", "left_out", tick.left_out);
  visit.number("float32", "force_error", tick.force_error);
  visit.number("float32", "greens_error", tick.greens_error);
  visit.number("uint8", "grab", tick.grab);
  visit.number("uint8", "phase", tick.phase);
  visit.number("uint8", "fault", tick.fault);
  visit.number("uint8", "event", tick.event);
}

/// The channels of a recording, which have these numbers in the files that we write.
enum class RecordedChannel : std::uint16_t { tick = 1, contacts, pictures, events, settings, surface };

/// A channel, and the messages on it.
struct ChannelKind {
  RecordedChannel channel;
  const char* topic;
  const char* schema;
  std::string definition;  ///< ros2msg, with all that it needs
};

/// All channels.
[[nodiscard]] const std::array<ChannelKind, 6>& channel_kinds();

[[nodiscard]] std::string to_message(const TickRecord& tick);
[[nodiscard]] std::string to_message(const ContactLoads& loads);
/// Without stress or pressure (empty): not a number, and none.
[[nodiscard]] std::string to_message(const SurfaceFrame& frame);
[[nodiscard]] std::string to_message(const RecordedEvent& event);
[[nodiscard]] std::string to_message(const RecordedSurface& surface);
/// The lines "name=value".
[[nodiscard]] std::string settings_message(std::string_view options);

// Bytes from anywhere do no harm. False, and what was read is of no use, unless they are one whole message.
[[nodiscard]] bool from_message(std::string_view message, TickRecord& tick);
[[nodiscard]] bool from_message(std::string_view message, ContactLoads& loads);
[[nodiscard]] bool from_message(std::string_view message, SurfaceFrame& frame);
[[nodiscard]] bool from_message(std::string_view message, RecordedSurface& surface);
/// The tick and time that messages on contacts and pictures begin with; `start` is cut off anywhere.
[[nodiscard]] bool from_start(std::string_view start, PictureTime& time);

}  // namespace palpate
