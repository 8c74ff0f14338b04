// Messages of a recording: definitions, encoding and decoding, in CDR as used by ROS 2: numbers one after
// another, little-endian, each aligned to its own size, counted from the end of the first four bytes.
// docs/recording-format.md has their layout.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "formats/recorded.h"

namespace palpate {

static_assert(std::endian::native == std::endian::little, "numbers are written as memory has them");

inline constexpr std::string_view cdr_head{"\0\1\0\0", 4};  ///< head of a message: little-endian

/// Encoder that appends a message to a text.
class CdrWriter {
 public:
  explicit CdrWriter(std::string& text) : text_(text) {
    text_ += cdr_head;
    origin_ = text_.size();
  }

  template <class T>
  void number(T value) {
    align(sizeof value);
    text_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(const T& value) { number(value); }
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(const std::vector<T>& values) {  ///< preceded by their count
    number(static_cast<std::uint32_t>(values.size()));
    if (values.empty()) return;
    align(sizeof(T));
    text_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  void put(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    text_.append(text).push_back('\0');
  }
  void put(const std::vector<std::string>& texts) {
    number(static_cast<std::uint32_t>(texts.size()));
    for (const std::string& text : texts) put(text);
  }

 private:
  void align(std::size_t size) { text_.append((origin_ - text_.size()) % size, '\0'); }

  std::string& text_;
  std::size_t origin_;
};

/// Decoder of an untrusted message. Missing data read as zero or empty, and `is_whole` is then false. Never
/// allocates more memory than the message takes.
class CdrReader {
 public:
  explicit CdrReader(std::string_view message) : rest_(message), whole_(message.starts_with(cdr_head)) {
    take(cdr_head.size());
    size_ = rest_.size();
  }

  template <class T>
  [[nodiscard]] T number() {
    align(sizeof(T));
    T value{};
    const std::string_view bytes = take(sizeof(T));
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
  template <class T>
  void get(T& value) {
    value = number<T>();
  }
  template <class T>
  void get(std::vector<T>& values) {  ///< preceded by their count
    values.clear();
    const std::size_t count = number<std::uint32_t>();
    if (count == 0) return;
    align(sizeof(T));
    const std::string_view bytes = take(count * sizeof(T));
    values.resize(bytes.size() / sizeof(T));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  }

  /// True if all requested data were present and nothing is left.
  [[nodiscard]] bool is_whole() const noexcept { return whole_ && rest_.empty(); }

 private:
  std::string_view take(std::size_t count) {
    if (count > rest_.size()) {
      whole_ = false;
      rest_ = {};
      return {};
    }
    const std::string_view bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }
  void align(std::size_t size) { take((rest_.size() - size_) % size); }

  std::string_view rest_;
  std::size_t size_ = 0;  // of the message after its head
  bool whole_;
};

/// Visits the fields of a tick in the order of its message: `number(type, name, member)`, and for several
/// numbers `vector(name, member)`, `pose(name, position, orientation)`, `wrench(name, force, torque)` and
/// `numbers(name, member)`. `Tick` may be const.
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
  visit.number("float32", "small_strain", tick.small_strain);
  visit.number("uint8", "grab", tick.grab);
  visit.number("uint8", "phase", tick.phase);
  visit.number("uint8", "fault", tick.fault);
  visit.number("uint8", "event", tick.event);
}

/// Channels of a recording, with their numbers in the files that we write.
enum class RecordedChannel : std::uint16_t { tick = 1, contacts, pictures, events, settings, surface };

/// A channel and the type of its messages.
struct ChannelKind {
  RecordedChannel channel;
  const char* topic;
  const char* schema;
  std::string definition;  ///< ros2msg, with all dependencies
};

/// All channels.
[[nodiscard]] const std::array<ChannelKind, 6>& channel_kinds();

[[nodiscard]] std::string to_message(const TickRecord& tick);
[[nodiscard]] std::string to_message(const ContactLoads& loads);
/// Empty stress or pressure is written as NaN or as none.
[[nodiscard]] std::string to_message(const SurfaceFrame& frame);
[[nodiscard]] std::string to_message(const RecordedEvent& event);
[[nodiscard]] std::string to_message(const RecordedSurface& surface);
/// Message of the lines "name=value".
[[nodiscard]] std::string settings_message(std::string_view options);

// The bytes are untrusted. Returns false, with unusable contents, unless they are one whole message.
[[nodiscard]] bool from_message(std::string_view message, TickRecord& tick);
[[nodiscard]] bool from_message(std::string_view message, ContactLoads& loads);
[[nodiscard]] bool from_message(std::string_view message, SurfaceFrame& frame);
[[nodiscard]] bool from_message(std::string_view message, RecordedSurface& surface);
/// Reads the tick and time at the beginning of messages on contacts and pictures; `start` may be truncated
/// anywhere.
[[nodiscard]] bool from_start(std::string_view start, PictureTime& time);

}  // namespace palpate
