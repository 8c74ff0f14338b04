#include "formats/recording_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace palpate {
namespace {

/// Builds the definition of a tick's message.
class Definition {
 public:
  std::string text =
      "# One tick of a tool. SI units, in the body's frame; handle and shown in the device's own\n";

  template <class T>
  void number(const char* type, const char* name, const T&) {
    add(type, name);
  }
  void vector(const char* name, const double (&)[3]) { add("geometry_msgs/Vector3", name); }
  void pose(const char* name, const double (&)[3], const double (&)[4]) { add("geometry_msgs/Pose", name); }
  void wrench(const char* name, const double (&)[3], const double (&)[3]) {
    add("geometry_msgs/Wrench", name);
  }
  void numbers(const char* name, const double (&)[6]) { add("float64[6]", name); }

 private:
  void add(const std::string& type, const char* name) { text += type + ' ' + name + '\n'; }
};

constexpr const char* rule =
    "================================================================================\n";
constexpr const char* geometry[][2] = {
    {"geometry_msgs/Pose", "Point position\nQuaternion orientation\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    {"geometry_msgs/Wrench", "Vector3 force\nVector3 torque\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
};

std::string with_parts(std::string definition, std::span<const char* const[2]> parts) {
  for (const auto& [name, text] : parts) definition += std::string(rule) + "MSG: " + name + '\n' + text;
  return definition;
}

std::string tick_definition() {
  Definition definition;
  const TickRecord any;
  for_each_tick_field(any, definition);
  return with_parts(std::move(definition.text), geometry);
}

constexpr const char* contacts_definition =
    "# What contacts put on the surface. With the model, all of the picture follows from it.\n"
    "int64 tick\n"
    "float64 time      # since the start of the run [s]\n"
    "int32[] node      # loaded nodes of the surface\n"
    "float32[] force   # x, y, z of each: on the body [N]\n"
    "float32[] press   # what contact points press with along their normals [N]\n"
    "float32[] field   # coarse field of a body that bends far [m]; none: empty\n";
constexpr const char* picture_definition =
    "# The surface at one moment.\n"
    "int64 tick\n"
    "float64 time            # since the start of the run [s]\n"
    "float32[] displacement  # x, y, z of each node of the surface [m]\n"
    "float32[] von_mises     # stress [Pa]; not a number where it is not known\n"
    "float32[] pressure      # of the contact [Pa]\n";
constexpr const char* surface_definition =
    "# The surface that pictures displace.\n"
    "int32 corners      # of a simplex: 3 of a triangle, 2 of a line\n"
    "float64[] nodes    # x, y, z of each, without loads [m]\n"
    "int32[] simplices  # nodes of each\n"
    "uint8[] held       # of each node; bit 0, 1, 2: along x, y, z\n";
constexpr const char* settings_definition =
    "# Options of the run.\n"
    "string[] name\n"
    "string[] value\n";
constexpr const char* log_definition =
    "builtin_interfaces/Time stamp\n"
    "uint8 level\n"
    "string name\n"
    "string msg\n"
    "string file\n"
    "string function\n"
    "uint32 line\n";
constexpr const char* log_parts[][2] = {{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"}};
constexpr std::uint8_t log_info = 20;  // level of rcl_interfaces/Log

/// Encodes a tick.
struct TickWriter {
  CdrWriter& to;

  template <class T>
  void number(const char*, const char*, const T& value) {
    to.number(value);
  }
  template <std::size_t n>
  void numbers(const char*, const double (&values)[n]) {
    for (const double value : values) to.number(value);
  }
  void vector(const char* name, const double (&v)[3]) { numbers(name, v); }
  void pose(const char* name, const double (&position)[3], const double (&wxyz)[4]) {
    numbers(name, position);
    for (const std::size_t k : {1U, 2U, 3U, 0U}) to.number(wxyz[k]);
  }
  void wrench(const char* name, const double (&force)[3], const double (&torque)[3]) {
    numbers(name, force);
    numbers(name, torque);
  }
};

/// Decodes a tick.
struct TickReader {
  CdrReader& from;

  template <class T>
  void number(const char*, const char*, T& value) {
    value = from.number<T>();
  }
  template <std::size_t n>
  void numbers(const char*, double (&values)[n]) {
    for (double& value : values) value = from.number<double>();
  }
  void vector(const char* name, double (&v)[3]) { numbers(name, v); }
  void pose(const char* name, double (&position)[3], double (&wxyz)[4]) {
    numbers(name, position);
    for (const std::size_t k : {1U, 2U, 3U, 0U}) wxyz[k] = from.number<double>();
  }
  void wrench(const char* name, double (&force)[3], double (&torque)[3]) {
    numbers(name, force);
    numbers(name, torque);
  }
};

/// Message of these values, one after another.
std::string message_of(const auto&... values) {
  std::string message;
  CdrWriter to(message);
  (to.put(values), ...);
  return message;
}

/// Decodes these values; true if the message is exactly these.
bool is_read(std::string_view message, auto&... values) {
  CdrReader from(message);
  (from.get(values), ...);
  return from.is_whole();
}

}  // namespace

const std::array<ChannelKind, 6>& channel_kinds() {
  using enum RecordedChannel;
  static const std::array<ChannelKind, 6> kinds = {
      {{tick, "/tool/0/tick", "palpate_msgs/msg/Tick", tick_definition()},
       {contacts, "/contacts", "palpate_msgs/msg/Contacts", contacts_definition},
       {pictures, "/pictures", "palpate_msgs/msg/Picture", picture_definition},
       {events, "/events", "rcl_interfaces/msg/Log", with_parts(log_definition, log_parts)},
       {settings, "/settings", "palpate_msgs/msg/Settings", settings_definition},
       {surface, "/surface", "palpate_msgs/msg/Surface", surface_definition}}};
  return kinds;
}

std::string to_message(const TickRecord& tick) {
  std::string message;
  CdrWriter to(message);
  for_each_tick_field(tick, TickWriter{to});
  return message;
}

std::string to_message(const ContactLoads& loads) {
  return message_of(loads.tick, loads.time, loads.node, loads.force, loads.press, loads.field);
}

std::string to_message(const SurfaceFrame& frame) {
  const std::size_t nodes = frame.displacement.size() / 3;
  const auto or_absent = [nodes](const std::vector<float>& values, float absent) {
    return values.empty() ? std::vector<float>(nodes, absent) : values;
  };
  return message_of(frame.tick, frame.time, frame.displacement,
                    or_absent(frame.von_mises, std::numeric_limits<float>::quiet_NaN()),
                    or_absent(frame.pressure, 0.0F));
}

std::string to_message(const RecordedEvent& event) {
  const double seconds = std::floor(event.time);
  const std::string nowhere;
  return message_of(static_cast<std::int32_t>(seconds),
                    static_cast<std::uint32_t>(1e9 * (event.time - seconds)), log_info,
                    std::string("palpate"), event.text, nowhere, nowhere, std::uint32_t{0});
}

std::string to_message(const RecordedSurface& surface) {
  std::vector<double> nodes;
  nodes.reserve(3 * (surface.nodes.size() + surface.finer.size()));
  for (const auto* of : {&surface.nodes, &surface.finer})
    for (const Vec3& node : *of) nodes.insert(nodes.end(), node.begin(), node.end());
  std::vector<std::uint8_t> held = surface.held;
  held.resize(surface.nodes.size());
  return message_of(std::int32_t{surface.corners}, nodes, surface.simplices, held);
}

std::string settings_message(std::string_view options) {
  std::vector<std::string> names, values;
  while (!options.empty()) {
    const std::string_view line = options.substr(0, options.find('\n'));
    options.remove_prefix(std::min(line.size() + 1, options.size()));
    const std::size_t sign = std::min(line.find('='), line.size());
    names.emplace_back(line.substr(0, sign));
    values.emplace_back(line.substr(std::min(sign + 1, line.size())));
  }
  return message_of(names, values);
}

bool from_message(std::string_view message, TickRecord& tick) {
  CdrReader from(message);
  for_each_tick_field(tick, TickReader{from});
  return from.is_whole();
}

bool from_message(std::string_view message, ContactLoads& loads) {
  return is_read(message, loads.tick, loads.time, loads.node, loads.force, loads.press, loads.field);
}

bool from_message(std::string_view message, SurfaceFrame& frame) {
  return is_read(message, frame.tick, frame.time, frame.displacement, frame.von_mises, frame.pressure);
}

bool from_message(std::string_view message, RecordedSurface& surface) {
  std::int32_t corners = 0;
  std::vector<double> nodes;
  const bool whole = is_read(message, corners, nodes, surface.simplices, surface.held);
  surface.corners = corners;
  surface.nodes.clear();
  surface.finer.clear();
  for (std::size_t k = 0; k + 3 <= nodes.size(); k += 3) {
    std::vector<Vec3>& of = surface.nodes.size() < surface.held.size() ? surface.nodes : surface.finer;
    of.emplace_back(nodes[k], nodes[k + 1], nodes[k + 2]);
  }
  return whole && nodes.size() % 3 == 0;
}

bool from_start(std::string_view start, PictureTime& time) {
  constexpr std::size_t bytes = cdr_head.size() + sizeof time.tick + sizeof time.time;
  return is_read(start.substr(0, bytes), time.tick, time.time);
}

}  // namespace palpate
