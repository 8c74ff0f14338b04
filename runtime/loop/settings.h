// Settings that, beside the model and the hand, determine a session; with their text form.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/number_range.h"
#include "runtime/background/patch_source.h"
#include "runtime/body/body.h"
#include "runtime/core/touch/tool.h"
#include "runtime/live/live_settings.h"
#include "runtime/loop/loading.h"
#include "runtime/safety/safety_options.h"
#include "runtime/safety/workspace.h"

namespace palpate {

inline constexpr NumberRange tick_rates{1000.0, 5000.0, true, true, "from 1000 to 5000"};  ///< [ticks/s]

/// Settings of a session. Each is an option of `palpate-runtime play` and has the same name in a recording;
/// settings_table lists them.
struct Settings {
  Tool tool;                    ///< tool, except its reach
  std::optional<double> reach;  ///< [m]; default: the longest edge of the surface
  Index max_contacts = 256;
  ContactModel contact = ContactModel::quasi_static;
  double load_scale = 1.0;       ///< factor on the file's loads
  double stiffness_scale = 1.0;  ///< factor on all Young's moduli
  OverlayOptions overlay;
  PatchLaw overlay_law = PatchLaw::linear;
  std::size_t overlay_memory = PatchSourceOptions{}.memory;  ///< [bytes]
  Depth depth = Depth::automatic;
  LiveSettings live;          ///< a solver in place of Green's functions
  std::int64_t rate = 1000;   ///< ticks per second
  double motion_scale = 1.0;  ///< see WorkspaceOptions
  double force_scale = 1.0;
  std::optional<Vec3> origin;           ///< origin of the device in the body's frame [m]
  std::string axes = "x,y,z";           ///< the body's axes along the device's axes
  std::optional<SafetyOptions> safety;  ///< empty: off if no person feels it, otherwise the defaults

  [[nodiscard]] WorkspaceOptions workspace() const;
  [[nodiscard]] BodyOptions body() const;
  /// Radius by which the tool is large or small [m]; 0 of a point.
  [[nodiscard]] double radius() const;
  /// Longest edge of graded overlays where the tool touches [m]; 0 if there are none.
  [[nodiscard]] double finest() const;
};

/// Section of the help. Settings of the loop and the workspace are constant during a run.
enum class SettingGroup : std::uint8_t { tool, body, live, loop, workspace, safety };

/// Description of a setting for options, recordings, pages and the documentation.
struct Setting {
  const char* name;  ///< name of the option, without dashes
  SettingGroup group;
  const char* value;      ///< placeholder of the value in the help
  const char* unit;       ///< unit of a number; empty if it has none
  std::string otherwise;  ///< default
  std::string meaning;
  NumberRange range{};         ///< for a number
  bool is_told = true;         ///< stored in recordings' settings
  bool protects_hand = false;  ///< it bounds the size or rate of the force on a hand
};

/// All settings, in the order of recordings.
[[nodiscard]] const std::vector<Setting>& settings_table();

/// Returns the setting with this name; null if there is none.
[[nodiscard]] const Setting* find_setting(std::string_view name);

/// Returns a line NAME=VALUE for each stored setting; numbers read back exactly.
[[nodiscard]] std::string to_text(const Settings& settings);

/// Options by name, as text.
using SettingsText = std::map<std::string, std::string>;

/// Parses settings; missing ones have their defaults. Throws Error whose `where` is the option, also for an
/// unknown option.
[[nodiscard]] Settings read_settings(const SettingsText& text);

/// Returns the lines of `to_text` that are options; others, from a later version, are dropped.
[[nodiscard]] SettingsText split_settings(std::string_view lines);

// Parsers of single options; they throw Error whose `where` is the option.

/// Parses "point", "sphere:RADIUS", "capsule:RADIUS,LENGTH", "disc:RADIUS" or "disc:RADIUS,EDGE" [m].
[[nodiscard]] Tool parse_shape(const std::string& text);
/// Parses "r=3,rings=2"; a missing part has its default. `where`: the option.
[[nodiscard]] OverlayOptions parse_overlay(const std::string& text, const std::string& where);
/// Parses "x,-z,y": the body's axes along which the device's x, y and z point. Returns the rotation.
[[nodiscard]] Eigen::Quaterniond parse_axes(const std::string& text);
/// Parses "max_force=5,ramp=0.5"; missing bounds have their defaults; "default" changes nothing.
[[nodiscard]] SafetyOptions parse_safety(const std::string& text);
/// Returns the names for parse_safety, with defaults, units and meanings, a line each.
[[nodiscard]] std::string safety_help();

}  // namespace palpate
