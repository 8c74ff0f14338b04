#include "runtime/loop/settings.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/error.h"
#include "runtime/loop/numbers.h"

namespace palpate {
namespace {

/// A part NAME=VALUE.
struct Part {
  std::string_view name;
  std::string_view value;
};

Part split_part(std::string_view part) {
  const std::size_t equals = std::min(part.find('='), part.size());
  return {part.substr(0, equals), part.substr(std::min(equals + 1, part.size()))};
}

/// Visits each safety option: name, unit, meaning, reference to the number.
template <class Options, class Visitor>
void for_each_safety_option(Options& o, Visitor&& visit) {
  visit("max_force", "N", "largest force on the hand", o.max_force);
  visit("max_torque", "N m", "largest torque on the hand", o.max_torque);
  visit("max_force_rate", "N/s", "how fast the force may change", o.max_force_rate);
  visit("max_torque_rate", "N m/s", "how fast the torque may change", o.max_torque_rate);
  visit("max_stiffness", "N/m", "largest stiffness of the local model", o.max_stiffness);
  visit("max_damping", "N s/m", "most that the passivity controller adds; 0: it only observes",
        o.max_damping);
  visit("max_speed", "m/s", "of the device; faster is a fault", o.max_speed);
  visit("ramp", "s", "from no to whole force, at the start and after a fault", o.ramp);
  visit("small_force", "N", "force begins only where it was below this", o.small_force);
  visit("calm_time", "s", "for so long", o.calm_time);
  visit("late", "s", "a tick that begins so much late is a miss", o.deadline.tolerance);
  visit("late_fade", "s", "from whole to no force while ticks are late", o.deadline.fade);
  visit("late_recovery", "s", "and back, while they are in time", o.deadline.recovery);
  visit("most_late", "ticks", "misses that are a fault", o.deadline.most);
  visit("forgiveness", "ticks", "misses that a tick in time makes good", o.deadline.forgiveness);
  visit("silence", "s", "without a report of the device: a fault", o.silence.most);
  visit("silence_fade", "s", "the force fades from here on, to nothing at silence", o.silence.fade_from);
  visit("frozen", "s", "with the same numbers in every report: a fault", o.silence.frozen);
  visit("frozen_force", "N", "but only while the force is above this", o.silence.frozen_force);
  visit("stale", "s", "up to this age a solution is of this tick", o.stale.fresh);
  visit("stale_life", "s", "up to this age an older one is extrapolated", o.stale.time_to_live);
  visit("stale_fade", "s", "then from whole to no force", o.stale.fade);
  visit("stale_damping", "N s/m", "damping of a solution that is not fresh", o.stale.damping);
  visit("buzz_speed", "m/s", "amplitude of the device's speed that counts as buzzing", o.buzz.speed);
  visit("buzz_force", "N", "amplitude of the force about its mean that counts", o.buzz.force);
  visit("buzz_mean", "s", "of that mean", o.buzz.mean_time);
  visit("buzz_window", "s", "in which changes of sign are counted", o.buzz.window);
  visit("buzz_flips", "", "so many in the window are buzzing", o.buzz.flips);
  visit("buzz_fade", "s", "from whole to no force while it buzzes; then a fault", o.buzz.fade);
  visit("buzz_recovery", "s", "and back, while it does not", o.buzz.recovery);
}

std::string shape_text(const Tool& tool) {
  if (tool.length > 0.0) return fmt::format("capsule:{},{}", tool.radius, tool.length);
  return tool.radius > 0.0 ? fmt::format("sphere:{}", tool.radius) : "point";
}

std::string safety_text(const SafetyOptions& options) {
  std::string text;
  for_each_safety_option(options, [&](const char* name, const char*, const char*, const auto& value) {
    text += fmt::format("{}{}={}", text.empty() ? "" : ",", name, value);
  });
  return text;
}

[[noreturn]] void refuse(const std::string& name, const std::string& what, const std::string& hint) {
  throw Error(what, "--" + name, hint);
}

double read_positive(const std::string& name, const std::string& text, const std::string& unit) {
  const std::optional<double> number = parse_number(text);
  if (!number || *number <= 0.0)
    refuse(name, "'" + text + "' is not a positive number of " + unit, "write for instance 2.5");
  return *number;
}

double read_from_zero(const std::string& name, const std::string& text) {
  const std::optional<double> number = parse_number(text);
  if (!number || *number < 0.0)
    refuse(name, "'" + text + "' is not a number from 0 on", "write for instance 0.3");
  return *number;
}

double read_hand_over(const std::string& text) {
  if (text == "inf") return std::numeric_limits<double>::infinity();
  return read_positive("hand-over", text, "the force, or inf");
}

std::int64_t read_whole(const std::string& name, const std::string& text, Index least, Index most) {
  const std::optional<Index> number = parse_index(text);
  if (!number || *number < least || *number > most) {
    refuse(name, fmt::format("'{}' is not a whole number from {} to {}", text, least, most),
           fmt::format("write for instance {}", least));
  }
  return *number;
}

std::size_t read_megabytes(const std::string& text) {
  const std::optional<Index> megabytes = parse_index(text);
  if (!megabytes || *megabytes < 1)
    refuse("overlay-memory", "'" + text + "' is not a whole number of megabytes", "write for instance 512");
  return static_cast<std::size_t>(*megabytes) << 20;
}

ContactModel read_contact(const std::string& text) {
  if (text == "dynamic") return ContactModel::dynamic;
  if (text != "quasi-static")
    refuse("contact", "'" + text + "' is neither quasi-static nor dynamic", "write one of them");
  return ContactModel::quasi_static;
}

Vec3 read_place(const std::string& text) {
  const std::optional<std::vector<double>> place = parse_vector(text);
  if (!place) refuse("origin", "'" + text + "' is not finite numbers X,Y,Z", "write for instance 0,0,0.1");
  return {(*place)[0], (*place)[1], place->size() == 3 ? (*place)[2] : 0.0};
}

void read_shape(Settings& settings, const std::string& text) {
  const Tool shape = parse_shape(text);
  settings.tool.radius = shape.radius;
  settings.tool.length = shape.length;
}

void read_axes(Settings& settings, const std::string& text) {
  static_cast<void>(parse_axes(text));
  settings.axes = text;
}

/// How each option is read.
struct SettingReader {
  std::string_view name;
  void (*read)(Settings& settings, const std::string& text);
};

constexpr Index most_contacts = 1000;  // a factor of so many fits into a gigabyte

constexpr std::array<SettingReader, 19> setting_readers = {{
    {"tool", read_shape},
    {"friction", [](Settings& s, const std::string& t) { s.tool.friction = read_from_zero("friction", t); }},
    {"coupling",
     [](Settings& s, const std::string& t) {
       s.tool.coupling_stiffness = read_positive("coupling", t, "N/m");
     }},
    {"coupling-torsion",
     [](Settings& s, const std::string& t) {
       s.tool.coupling_torsion = read_positive("coupling-torsion", t, "N m/rad");
     }},
    {"max-force",
     [](Settings& s, const std::string& t) { s.tool.max_force = read_positive("max-force", t, "newtons"); }},
    {"hand-over", [](Settings& s, const std::string& t) { s.tool.hand_over = read_hand_over(t); }},
    {"reach", [](Settings& s, const std::string& t) { s.reach = read_positive("reach", t, "metres"); }},
    {"max-contacts",
     [](Settings& s, const std::string& t) {
       s.max_contacts = static_cast<Index>(read_whole("max-contacts", t, 1, most_contacts));
     }},
    {"contact", [](Settings& s, const std::string& t) { s.contact = read_contact(t); }},
    {"load-scale", [](Settings& s, const std::string& t) { s.load_scale = read_from_zero("load-scale", t); }},
    {"stiffness-scale",
     [](Settings& s, const std::string& t) {
       s.stiffness_scale = read_positive("stiffness-scale", t, "Young's moduli for one");
     }},
    {"overlay", [](Settings& s, const std::string& t) { s.overlay = parse_overlay(t, "--overlay"); }},
    {"overlay-memory", [](Settings& s, const std::string& t) { s.overlay_memory = read_megabytes(t); }},
    {"rate",
     [](Settings& s, const std::string& t) { s.rate = read_whole("rate", t, least_rate, most_rate); }},
    {"motion-scale",
     [](Settings& s, const std::string& t) {
       s.motion_scale = read_positive("motion-scale", t, "metres for one");
     }},
    {"force-scale",
     [](Settings& s,
        const std::string& t) { s.force_scale = read_positive("force-scale", t, "newtons for one"); }},
    {"origin", [](Settings& s, const std::string& t) { s.origin = read_place(t); }},
    {"axes", read_axes},
    {"safety", [](Settings& s, const std::string& t) { s.safety = parse_safety(t); }},
}};

bool is_setting(std::string_view name) {
  return std::any_of(setting_readers.begin(), setting_readers.end(),
                     [name](const SettingReader& reader) { return reader.name == name; });
}

}  // namespace

Settings read_settings(const SettingsText& text) {
  for (const auto& [name, value] : text) {
    if (!is_setting(name)) refuse(name, "there is no such option", "palpate-runtime play --help lists them");
  }
  Settings settings;
  for (const SettingReader& reader : setting_readers) {
    const auto found = text.find(std::string(reader.name));
    if (found != text.end()) reader.read(settings, found->second);
  }
  return settings;
}

SettingsText split_settings(std::string_view lines) {
  SettingsText settings;
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    const Part line = split_part(lines.substr(0, end));
    lines.remove_prefix(std::min(end + 1, lines.size()));
    if (is_setting(line.name)) settings.emplace(line.name, line.value);
  }
  return settings;
}

WorkspaceOptions Settings::workspace() const {
  return {.device_origin = Vec3::Zero(),
          .body_origin = origin.value_or(Vec3::Zero()),
          .axes = parse_axes(axes),
          .motion_scale = motion_scale,
          .force_scale = force_scale};
}

BodyOptions Settings::body() const {
  return {.refinement = overlay ? overlay->refinement : 1,
          .contact = contact,
          .load_scale = load_scale,
          .stiffness_scale = stiffness_scale};
}

std::string to_text(const Settings& settings) {
  std::string text;
  const auto add = [&](const char* name, const auto& value) { text += fmt::format("{}={}\n", name, value); };
  const auto add_finite = [&](const char* name, double value) {
    if (std::isfinite(value)) add(name, value);
  };
  const Tool& tool = settings.tool;
  add("tool", shape_text(tool));
  if (tool.friction) add("friction", *tool.friction);
  add_finite("coupling", tool.coupling_stiffness);
  add_finite("coupling-torsion", tool.coupling_torsion);
  add_finite("max-force", tool.max_force);
  add("hand-over", tool.hand_over);
  if (settings.reach) add("reach", *settings.reach);
  add("max-contacts", settings.max_contacts);
  add("contact", settings.contact == ContactModel::dynamic ? "dynamic" : "quasi-static");
  if (settings.load_scale != 1.0) add("load-scale", settings.load_scale);
  if (settings.stiffness_scale != 1.0) add("stiffness-scale", settings.stiffness_scale);
  if (settings.overlay) {
    add("overlay", fmt::format("r={},rings={}", settings.overlay->refinement, settings.overlay->rings));
    add("overlay-memory", settings.overlay_memory >> 20);
  }
  add("rate", settings.rate);
  add("motion-scale", settings.motion_scale);
  add("force-scale", settings.force_scale);
  if (settings.origin)
    add("origin", fmt::format("{},{},{}", settings.origin->x(), settings.origin->y(), settings.origin->z()));
  add("axes", settings.axes);
  if (settings.safety) add("safety", safety_text(*settings.safety));
  return text;
}

Tool parse_shape(const std::string& text) {
  Tool tool;
  if (text == "point") return tool;
  const std::string_view rest = std::string_view(text).substr(std::min(text.find(':') + 1, text.size()));
  const std::vector<std::string_view> sizes = split_commas(rest);
  const bool sphere = text.starts_with("sphere:") && sizes.size() == 1;
  const bool capsule = text.starts_with("capsule:") && sizes.size() == 2;
  if (!sphere && !capsule) {
    throw Error("'" + text + "' is none of point, sphere:RADIUS and capsule:RADIUS,LENGTH", "--tool",
                "lengths are metres");
  }
  const auto size = [&](std::string_view number) {
    const std::optional<double> metres = parse_number(number);
    if (metres && *metres > 0.0) return *metres;
    throw Error(fmt::format("'{}' of '{}' is not a positive number of metres", number, text), "--tool",
                "write for instance sphere:0.005");
  };
  tool.radius = size(sizes[0]);
  if (capsule) tool.length = size(sizes[1]);
  return tool;
}

OverlayOptions parse_overlay(const std::string& text, const std::string& where) {
  OverlayOptions overlay;
  for (const std::string_view part : split_commas(text)) {
    const auto [name, number] = split_part(part);
    const std::optional<Index> value = parse_index(std::string(number));
    if (name == "r" && value && *value >= 2 && *value <= 16) {
      overlay.refinement = *value;
    } else if (name == "rings" && value && *value >= 1 && *value <= 16) {
      overlay.rings = *value;
    } else {
      throw Error(fmt::format("'{}' is neither r=2 to r=16 nor rings=1 to rings=16", part), where,
                  "write for instance r=3,rings=2");
    }
  }
  return overlay;
}

Eigen::Quaterniond parse_axes(const std::string& text) {
  const std::string hint = "write three of x, y, z, -x, -y, -z, each axis once, for instance x,-z,y";
  const std::vector<std::string_view> names = split_commas(text);
  if (names.size() != 3) throw Error("'" + text + "' is not three axes", "--axes", hint);
  Mat3 axes = Mat3::Zero();
  for (Eigen::Index column = 0; column < 3; ++column) {
    std::string_view name = names[static_cast<std::size_t>(column)];
    const double sign = name.starts_with('-') ? -1.0 : 1.0;
    if (name.starts_with('-') || name.starts_with('+')) name.remove_prefix(1);
    if (name.size() != 1 || name[0] < 'x' || name[0] > 'z')
      throw Error("'" + text + "' is not three axes", "--axes", hint);
    axes(name[0] - 'x', column) = sign;
  }
  const double determinant = axes.determinant();
  if (determinant < 0.0)
    throw Error("'" + text + "' is a mirror image", "--axes", "turn the sign of one axis round");
  if (determinant == 0.0) throw Error("'" + text + "' names an axis twice", "--axes", hint);
  return Eigen::Quaterniond(axes);
}

SafetyOptions parse_safety(const std::string& text) {
  SafetyOptions options;
  if (text == "default") return options;
  for (const std::string_view part : split_commas(text)) {
    const auto [wanted, number] = split_part(part);
    const std::optional<double> parsed = parse_number(number);
    if (!parsed || *parsed < 0.0)
      throw Error(fmt::format("'{}' is not NAME=NUMBER, from 0 on", part), "--safety",
                  "write max_force=2,ramp=3");
    bool known = false;
    for_each_safety_option(options, [&, name_wanted = wanted, value_wanted = *parsed](
                                        const char* name, const char*, const char*, auto& value) {
      if (name_wanted != name) return;
      value = static_cast<std::remove_reference_t<decltype(value)>>(value_wanted);
      known = true;
    });
    if (!known)
      throw Error(fmt::format("there is no safety option '{}'", wanted), "--safety",
                  "palpate-runtime play --help lists them");
  }
  return options;
}

std::string safety_help() {
  std::string text;
  const SafetyOptions defaults;
  for_each_safety_option(defaults,
                         [&](const char* name, const char* unit, const char* meaning, const auto& value) {
                           text += fmt::format("    {:<16} {:>7} {:<6} {}\n", name, value, unit, meaning);
                         });
  return text;
}

}  // namespace palpate
