// What the outcome of a session follows from, beside the model and the hand; as text too.
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
#include "runtime/live/live_settings.h"
#include "runtime/loop/loading.h"
#include "runtime/safety/safety_options.h"
#include "runtime/safety/workspace.h"
#include "runtime/touch/tool.h"

namespace palpate {

inline constexpr NumberRange tick_rates{1000.0, 5000.0, true, true, "from 1000 to 5000"};  ///< ticks a second

/// Each is an option of `palpate-runtime play`, by whose name it stands in a recording; settings_table has
/// them.
struct Settings {
  Tool tool;                    ///< but for its reach
  std::optional<double> reach;  ///< [m]; else the longest edge of the surface
  Index max_contacts = 256;
  ContactModel contact = ContactModel::quasi_static;
  double load_scale = 1.0;                ///< of the file's loads
  double stiffness_scale = 1.0;           ///< of all Young's moduli
  std::optional<OverlayOptions> overlay;  ///< none: the body's own mesh
  PatchLaw overlay_law = PatchLaw::linear;
  std::size_t overlay_memory = PatchSourceOptions{}.memory;  ///< [bytes]
  bool warp = false;                                         ///< Green's functions turn with the body
  LiveSettings live;                                         ///< a solver in place of Green's functions
  std::int64_t rate = 1000;                                  ///< ticks a second
  double motion_scale = 1.0;                                 ///< as in WorkspaceOptions
  double force_scale = 1.0;
  std::optional<Vec3> origin;           ///< where the device's origin lies in the body's frame [m]
  std::string axes = "x,y,z";           ///< the body's axes along the device's
  std::optional<SafetyOptions> safety;  ///< none: off where nobody feels it, else the defaults

  [[nodiscard]] WorkspaceOptions workspace() const;
  [[nodiscard]] BodyOptions body() const;
};

/// What a setting is of: its place in the help. The loop's and the workspace's stay as they are in a run.
enum class SettingGroup : std::uint8_t { tool, body, live, loop, workspace, safety };

/// A setting as options, recordings, pages and the documentation have it.
struct Setting {
  const char* name;  ///< of the option, without dashes
  SettingGroup group;
  const char* value;      ///< what is written for it
  const char* unit;       ///< of a number, "" where it has none
  std::string otherwise;  ///< what holds where it is left out
  std::string meaning;
  NumberRange range{};         ///< of a number
  bool is_told = true;         ///< in recordings of the settings that it was made for
  bool protects_hand = false;  ///< it decides how strong and how sudden the force on a hand may be
};

/// All settings, in the order of recordings.
[[nodiscard]] const std::vector<Setting>& settings_table();

/// The setting of a name, null for none.
[[nodiscard]] const Setting* find_setting(std::string_view name);

/// A line NAME=VALUE for each that is told; numbers read back to the same bits.
[[nodiscard]] std::string to_text(const Settings& settings);

/// Options by name, as they are written.
using SettingsText = std::map<std::string, std::string>;

/// What they mean; what is left out has its default. Throws Error whose `where` is the option, also for one
/// that there is not.
[[nodiscard]] Settings read_settings(const SettingsText& text);

/// The lines of `to_text` that are options; others, of a later version, are left out.
[[nodiscard]] SettingsText split_settings(std::string_view lines);

// Of one option each; they throw Error whose `where` is the option.

/// "point", "sphere:RADIUS", "capsule:RADIUS,LENGTH", "disc:RADIUS" or "disc:RADIUS,EDGE" [m].
[[nodiscard]] Tool parse_shape(const std::string& text);
/// "r=3,rings=2", either part with its default when it is left out. `where`: the option.
[[nodiscard]] OverlayOptions parse_overlay(const std::string& text, const std::string& where);
/// "x,-z,y": the body's axes along which the device's x, y and z point. Gives the rotation.
[[nodiscard]] Eigen::Quaterniond parse_axes(const std::string& text);
/// "max_force=5,ramp=0.5": what is not named has its default; "default" changes nothing.
[[nodiscard]] SafetyOptions parse_safety(const std::string& text);
/// The names that parse_safety knows, with defaults, units and meanings, a line each.
[[nodiscard]] std::string safety_help();

}  // namespace palpate
