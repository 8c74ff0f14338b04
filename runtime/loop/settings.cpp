#include "runtime/loop/settings.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <concepts>
#include <initializer_list>
#include <limits>
#include <vector>

#include "base/error.h"
#include "runtime/loop/numbers.h"

namespace palpate {
namespace {

/// The compliance between the nodes of so many contacts fits into a gigabyte.
constexpr NumberRange contact_counts{1.0, 1000.0, true, true, "from 1 to 1000"};

constexpr NumberRange live_steps{0.0, 0.1, false, true, "greater than 0 and at most 0.1"};

constexpr NumberRange poissons_ratios{-1.0, 0.5, false, false, "between -1 and 1/2, both excluded"};

constexpr NumberRange megabytes{1.0, 1e9, true, true, "of megabytes, from 1 on"};
constexpr NumberRange positive_or_infinite{0.0, std::numeric_limits<double>::infinity(), false, true,
                                           "greater than 0, or inf"};
constexpr bool protects_hand = true;

[[noreturn]] void refuse(std::string_view name, const std::string& what, const std::string& hint) {
  throw Error(what, "--" + std::string(name), hint);
}

/// One of some values that have names.
template <class Value>
concept Named = requires(Value value) {
  { name_of(value) } -> std::convertible_to<std::string>;
};

// Text form of each kind of setting.

std::string text_of(const auto& value) {
  return fmt::format("{}", value);
}
std::string text_of(const Named auto& value) {
  return name_of(value);
}
std::string text_of(std::size_t bytes) {
  return std::to_string(bytes >> 20);
}
std::string text_of(const Tool& tool) {
  if (tool.disc_radius > 0.0) return fmt::format("disc:{},{}", tool.disc_radius, tool.radius);
  if (tool.length > 0.0) return fmt::format("capsule:{},{}", tool.radius, tool.length);
  return tool.radius > 0.0 ? fmt::format("sphere:{}", tool.radius) : "point";
}
std::string text_of(ContactModel contact) {
  return contact == ContactModel::dynamic ? "dynamic" : "quasi-static";
}
std::string text_of(bool yes) {
  return yes ? "yes" : "no";
}
std::string text_of(const OverlayOptions& overlay) {
  if (overlay.kind == OverlayKind::none) return "no";
  if (overlay.kind == OverlayKind::local) return "auto";
  if (overlay.kind == OverlayKind::graded) return "graded";
  return fmt::format("r={},rings={}", overlay.refinement, overlay.rings);
}
std::string text_of(const Vec3& place) {
  return fmt::format("{},{},{}", place.x(), place.y(), place.z());
}
std::string text_of(const AxisBox& box) {
  return text_of(box.low) + "," + text_of(box.high);
}
std::string text_of(const SafetyOptions& options) {
  std::string text;
  for_each_safety_field(options, [&](const SafetyField& field, const auto& value) {
    text += fmt::format("{}{}={}", text.empty() ? "" : ",", field.name, value);
  });
  return text;
}
template <class Value>
std::string text_of(const std::optional<Value>& value) {
  return value ? text_of(*value) : "";
}

void read_value(const Setting& setting, const std::string& text, double& value) {
  const std::optional<double> number =
      text == "inf" ? std::numeric_limits<double>::infinity() : parse_number(text);
  if (!number || !setting.range.contains(*number)) {
    const std::string unit = setting.unit[0] == '\0' ? "" : fmt::format(" [{}]", setting.unit);
    refuse(setting.name, fmt::format("'{}' is not a number that is {}{}", text, setting.range.words, unit),
           "write for instance 2.5");
  }
  value = *number;
}

template <std::integral Whole>
void read_value(const Setting& setting, const std::string& text, Whole& value) {
  const std::optional<Index> number = parse_index(text);
  if (!number || !setting.range.contains(*number)) {
    refuse(setting.name, fmt::format("'{}' is not a whole number {}", text, setting.range.words),
           fmt::format("write for instance {}", setting.otherwise));
  }
  value = static_cast<Whole>(*number);
}

void read_value(const Setting& setting, const std::string& text, std::size_t& bytes) {
  Index count = 0;
  read_value(setting, text, count);
  bytes = static_cast<std::size_t>(count) << 20;
}

void read_value(const Setting&, const std::string& text, Tool& tool) {
  const Tool shape = parse_shape(text);
  tool.radius = shape.radius;
  tool.length = shape.length;
  tool.disc_radius = shape.disc_radius;
}

void read_value(const Setting& setting, const std::string& text, ContactModel& contact) {
  contact = text == "dynamic" ? ContactModel::dynamic : ContactModel::quasi_static;
  if (text != text_of(contact))
    refuse(setting.name, "'" + text + "' is neither quasi-static nor dynamic", "write one of them");
}

/// Returns the value with this name.
template <class Value>
Value read_name(const Setting& setting, const std::string& text, std::initializer_list<Value> values) {
  std::string names;
  for (const Value value : values) {
    if (text == text_of(value)) return value;
    names += (names.empty() ? "" : ", ") + text_of(value);
  }
  refuse(setting.name, "'" + text + "' is none of " + names, "write one of them");
}

void read_value(const Setting& setting, const std::string& text, LiveLaw& law) {
  law = read_name(setting, text,
                  {LiveLaw::linear, LiveLaw::corotational, LiveLaw::corotational_qr, LiveLaw::neo_hookean});
}

void read_value(const Setting& setting, const std::string& text, Integrator& integrator) {
  integrator = read_name(setting, text,
                         {Integrator::implicit_euler, Integrator::midpoint, Integrator::semi_implicit_euler});
}

void read_value(const Setting& setting, const std::string& text, SolverKind& kind) {
  kind = read_name(setting, text, {SolverKind::factor, SolverKind::conjugate_gradient});
}

void read_value(const Setting& setting, const std::string& text, bool& yes) {
  yes = read_name(setting, text, {true, false});
}

void read_value(const Setting& setting, const std::string& text, Depth& depth) {
  depth = read_name(setting, text, {Depth::automatic, Depth::yes, Depth::no});
}

void read_value(const Setting& setting, const std::string& text, PatchLaw& law) {
  law = read_name(setting, text, {PatchLaw::linear, PatchLaw::neo_hookean});
}

void read_value(const Setting&, const std::string& text, OverlayOptions& overlay) {
  overlay = parse_overlay(text, "--overlay");
}

void read_value(const Setting& setting, const std::string& text, Vec3& place) {
  const std::optional<std::vector<double>> numbers = parse_vector(text);
  if (!numbers)
    refuse(setting.name, "'" + text + "' is not finite numbers X,Y,Z", "write for instance 0,0,0.1");
  place = {(*numbers)[0], (*numbers)[1], numbers->size() == 3 ? (*numbers)[2] : 0.0};
}

void read_value(const Setting& setting, const std::string& text, AxisBox& box) {
  const std::optional<std::vector<double>> numbers = parse_numbers(text);
  if (!numbers || numbers->size() != 6)
    refuse(setting.name, "'" + text + "' is not two corners X,Y,Z,X,Y,Z",
           "write for instance 0,0,0,0.2,0.2,0.1");
  box = {Vec3(numbers->data()), Vec3(numbers->data() + 3)};
}

void read_value(const Setting&, const std::string& text, std::string& axes) {
  static_cast<void>(parse_axes(text));
  axes = text;
}

void read_value(const Setting&, const std::string& text, SafetyOptions& options) {
  options = parse_safety(text);
}

template <class Value>
void read_value(const Setting& setting, const std::string& text, std::optional<Value>& value) {
  read_value(setting, text, value.emplace());
}

/// Visits the settings that are members of the tool; its reach is that of the settings.
template <class SomeTool, class Visitor>
void for_each_tool_setting(SomeTool& tool, Visitor&& visit) {
  auto& [radius, length, disc_radius, coupling, torsion, max_force, hand_over, reach, friction] = tool;
  constexpr SettingGroup group = SettingGroup::tool;
  visit(Setting{"tool", group, "point|sphere:RADIUS|capsule:RADIUS,LENGTH|disc:RADIUS[,EDGE]", "m",
                "for a pointer or a device a sphere sized to the body, for a script a point",
                "shape: a point; a sphere around the tool's origin; a capsule, all points within RADIUS of a "
                "segment of LENGTH that starts at the origin and runs along the tool's z axis (y for bodies "
                "in the plane); or a disc, a flat punch normal to that axis with its rim rounded by EDGE, "
                "half its thickness (a tenth of the radius unless given)"},
        tool);
  visit(Setting{"friction", group, "MU", "", "the material's", "Coulomb friction coefficient",
                number_from_zero, friction.has_value()},
        friction);
  visit(Setting{"coupling", group, "N_PER_M", "N/m",
                "none; with a device, the largest stiffness that it can render",
                "stiffness of the spring between device and tool, in series with the body: the hand never "
                "feels more than this",
                positive_number, std::isfinite(coupling), protects_hand},
        coupling);
  visit(Setting{"coupling-torsion", group, "NM_PER_RAD", "N m/rad", "none",
                "torsional stiffness of that spring", positive_number, std::isfinite(torsion), protects_hand},
        torsion);
  visit(Setting{"max-force", group, "N", "N", "unlimited", "largest force on the hand", positive_number,
                std::isfinite(max_force), protects_hand},
        max_force);
  visit(Setting{"hand-over", group, "SHARE", "", "0.005",
                "share of the force by which it may change per millisecond beyond what the tool's motion "
                "explains; smaller values smooth contacts that slip, inf passes on every jump",
                positive_or_infinite, true, protects_hand},
        hand_over);
}

/// Visits the settings of the body.
template <class SomeSettings, class Visitor>
void for_each_body_setting(SomeSettings& s, Visitor&& visit) {
  constexpr SettingGroup group = SettingGroup::body;
  visit(Setting{"contact", group, "quasi-static|dynamic", "", "quasi-static",
                "quasi-static: the tool meets the body's stiffness; dynamic: also its inertia and damping, "
                "for files with [dynamics] and a time step of one tick"},
        s.contact);
  visit(Setting{"load-scale", group, "S", "", "1",
                "fraction of the file's loads (forces, prescribed displacements, initial strains) under "
                "which the body rests; 0: none",
                number_from_zero, s.load_scale != 1.0},
        s.load_scale);
  visit(Setting{"stiffness-scale", group, "S", "", "1",
                "factor on all Young's moduli, exact, without precomputing again", positive_number,
                s.stiffness_scale != 1.0},
        s.stiffness_scale);
  visit(Setting{"overlay", group, "auto|no|graded|r=R,rings=N", "", "auto",
                fmt::format(
                    "what a tool feels that is small for the mesh: auto, the body's own compliance close to "
                    "the tool in place of its mesh's, on a round surface; no, the mesh's; graded, besides "
                    "auto a finer mesh under the tool (s-FEM) that is graded by its radius and quadratic; or "
                    "each element within N rings, from 1 to {}, cut into R to the power of the dimension, R "
                    "from {} to {}",
                    most_rings, least_refinement, most_refinement),
                any_number, s.overlay.kind != OverlayKind::local},
        s.overlay);
  visit(Setting{"overlay-law", group, "linear|neo-hookean", "", "linear",
                "how the finer mesh answers deformation: linear, as the body around it, or neo-hookean, for "
                "large strain under the tool",
                any_number, s.overlay_law != PatchLaw::linear},
        s.overlay_law);
  visit(Setting{"overlay-memory", group, "MB", "MB", "512", "most memory that overlays may use", megabytes,
                s.overlay.has_patches()},
        s.overlay_memory);
  visit(
      Setting{
          "depth", group, "auto|yes|no", "", "auto",
          "presses as deep as a hand's: the body turns and bends far, by a coarse body of large strain under "
          "its Green's functions; auto: static bodies in space; no: small strain",
          any_number, s.depth != Depth::automatic},
      s.depth);
}

/// Visits the settings of the live solver.
template <class SomeSettings, class Visitor>
// NOLINTNEXTLINE(readability-function-size): a table
void for_each_live_setting(SomeSettings& live, Visitor&& visit) {
  auto& [solver, poissons_ratio, step, integrator, step_solver, gravity, mass_damping, stiffness_damping,
         yield, creep, most_plastic, free, floor, room, obstacle, wall_friction] = live;
  constexpr SettingGroup group = SettingGroup::live;
  const bool is_told = live.solver.has_value();
  visit(
      Setting{
          "solver", group, "linear|corotational|corotational-qr|neo-hookean", "",
          "none: the file's Green's functions",
          "solve the body anew in each step, beside the tick, for large deformation and bodies that move; "
          "the tool meets the compliance of one step",
          any_number, is_told},
      solver);
  visit(Setting{"poissons-ratio", group, "NU", "", "that of the model",
                "Poisson's ratio of all materials of a live body", poissons_ratios,
                is_told && poissons_ratio.has_value()},
        poissons_ratio);
  visit(Setting{"live-step", group, "S", "s", "0.005", "time step of the solver, a whole number of ticks",
                live_steps, is_told},
        step);
  visit(
      Setting{
          "integrator", group, "implicit-euler|midpoint|semi-implicit-euler", "", "implicit-euler",
          "how the solver steps; implicit-euler damps fast motion, midpoint keeps energy; "
          "semi-implicit-euler is explicit: steps cost little, and are refused where they are longer than "
          "is stable",
          any_number, is_told},
      integrator);
  visit(Setting{"step-solver", group, "factor|cg", "", "factor",
                "how an implicit step is solved: by a factor, or by conjugate gradients, which is faster for "
                "large bodies",
                any_number, is_told},
        step_solver);
  visit(Setting{"gravity", group, "X,Y,Z", "m/s^2", "0,0,0", "acceleration of gravity on a live body",
                any_number, is_told},
        gravity);
  visit(Setting{"mass-damping", group, "A", "1/s", "0",
                "part of the damping that is A times the mass: it slows a falling body too", number_from_zero,
                is_told},
        mass_damping);
  visit(Setting{"stiffness-damping", group, "B", "s", "0.001",
                "part of the damping that is B times the stiffness", number_from_zero, is_told},
        stiffness_damping);
  visit(Setting{"yield", group, "STRAIN", "", "inf",
                "elastic strain (norm) above which a body keeps dents; inf: never", positive_or_infinite,
                is_told},
        yield);
  visit(Setting{"creep", group, "RATE", "1/s", "10", "rate at which strain above the yield becomes plastic",
                number_from_zero, is_told},
        creep);
  visit(Setting{"most-plastic", group, "STRAIN", "", "inf", "largest plastic strain (norm)",
                positive_or_infinite, is_told},
        most_plastic);
  visit(Setting{"free", group, "yes|no", "", "no", "lets go of what the model holds: the body moves in space",
                any_number, is_told},
        free);
  visit(Setting{"floor", group, "HEIGHT", "m", "none", "height of a floor along z, in the plane along y",
                any_number, is_told && floor.has_value()},
        floor);
  visit(Setting{"room", group, "X,Y,Z,X,Y,Z", "m", "none",
                "walls and a floor around the body: the lowest and the highest corner of the room, which is "
                "open above",
                any_number, is_told && room.has_value()},
        room);
  visit(Setting{"obstacle", group, "X,Y,Z,X,Y,Z", "m", "none",
                "a box that the body stays out of: its lowest and its highest corner", any_number,
                is_told && obstacle.has_value()},
        obstacle);
  visit(Setting{"wall-friction", group, "MU", "", "0.5",
                "Coulomb friction coefficient of floor, room and obstacle", number_from_zero, is_told},
        wall_friction);
}

/// Visits the settings of the loop and of the device's frame in the body's.
template <class SomeSettings, class Visitor>
void for_each_frame_setting(SomeSettings& s, Visitor&& visit) {
  constexpr SettingGroup group = SettingGroup::workspace;
  visit(
      Setting{"rate", SettingGroup::loop, "HZ", "1/s", "1000", "ticks per second, 1000 to 5000", tick_rates},
      s.rate);
  visit(Setting{"motion-scale", group, "S", "", "1", "metres of tool motion per metre of device motion",
                positive_number},
        s.motion_scale);
  visit(Setting{"force-scale", group, "C", "", "1",
                "newtons on the hand per newton on the tool; the limits of the device are scaled with both",
                positive_number},
        s.force_scale);
  visit(Setting{"origin", group, "X,Y,Z", "m",
                "0,0,0; with a device, above the body, half the radius of the workspace from touching it",
                "position of the device's origin in the body's frame", any_number, s.origin.has_value()},
        s.origin);
  visit(Setting{"axes", group, "AXES", "", "x,y,z",
                "axes of the body along which the device's right, away-from-you and up point"},
        s.axes);
}

/// Calls visit(setting, value) for each setting. A new member of Settings must be named here, otherwise this
/// does not compile.
template <class SomeSettings, class Visitor>
void for_each_setting(SomeSettings&& settings, Visitor&& visit) {
  auto& [tool, reach, max_contacts, contact, load_scale, stiffness_scale, overlay, overlay_law,
         overlay_memory, depth, live, rate, motion_scale, force_scale, origin, axes, safety] = settings;
  for_each_tool_setting(tool, visit);
  visit(Setting{"reach", SettingGroup::tool, "METRES", "m", "the longest edge of the surface",
                "a grab that touches nothing takes hold of the nearest surface within this distance of the "
                "tool's origin",
                positive_number, reach.has_value()},
        reach);
  visit(Setting{"max-contacts", SettingGroup::tool, "N", "", "256",
                "most contact points; when there are nearly as many, neighbours are merged, and beyond that "
                "the deepest are kept",
                contact_counts},
        max_contacts);
  for_each_body_setting(settings, visit);
  for_each_live_setting(live, visit);
  for_each_frame_setting(settings, visit);
  visit(Setting{"safety", SettingGroup::safety, "NAME=VALUE,...", "",
                "on for devices held by a hand, off for scripts",
                "changes bounds of the safety rules by name; the word default turns the rules on with all "
                "their defaults",
                any_number, safety.has_value(), protects_hand},
        safety);
}

}  // namespace

const std::vector<Setting>& settings_table() {
  static const std::vector<Setting> table = [] {
    std::vector<Setting> settings;
    for_each_setting(Settings{}, [&](const Setting& setting, const auto&) { settings.push_back(setting); });
    return settings;
  }();
  return table;
}

const Setting* find_setting(std::string_view name) {
  const auto found = std::ranges::find(settings_table(), name, &Setting::name);
  return found == settings_table().end() ? nullptr : &*found;
}

Settings read_settings(const SettingsText& text) {
  for (const auto& [name, value] : text) {
    if (find_setting(name) == nullptr)
      refuse(name, "there is no such option", "palpate-runtime play --help lists them");
  }
  Settings settings;
  for_each_setting(settings, [&](const Setting& setting, auto& value) {
    if (const auto found = text.find(setting.name); found != text.end())
      read_value(setting, found->second, value);
  });
  return settings;
}

SettingsText split_settings(std::string_view lines) {
  SettingsText settings;
  while (!lines.empty()) {
    const std::size_t end = std::min(lines.find('\n'), lines.size());
    const NamedText line = split_named(lines.substr(0, end));
    lines.remove_prefix(std::min(end + 1, lines.size()));
    if (find_setting(line.name) != nullptr) settings.emplace(line.name, line.value);
  }
  return settings;
}

std::string to_text(const Settings& settings) {
  std::string text;
  for_each_setting(settings, [&](const Setting& setting, const auto& value) {
    if (setting.is_told) text += fmt::format("{}={}\n", setting.name, text_of(value));
  });
  return text;
}

}  // namespace palpate
