#include "runtime/devices/reports/device_profile.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/regular_file.h"
#include "base/toml_table.h"
#include "base/toml_text.h"
#include "runtime/devices/reports/palpate_board.h"
#include "runtime/devices/reports/woodenhaptics_report.h"

namespace palpate {
namespace {

constexpr int longest_report = 4096;  // bytes; limit of Linux's hidraw

/// Reads a usage given as [page, number].
std::optional<HidUsage> read_usage(const TomlTable& table, std::string_view key) {
  if (!table.has(key)) return std::nullopt;
  const auto pair = table.integers(key, 2, 0, 0xFFFF);
  return HidUsage{static_cast<std::uint16_t>(pair[0]), static_cast<std::uint16_t>(pair[1])};
}

std::optional<std::uint16_t> read_id(const TomlTable& table, std::string_view key) {
  if (!table.has(key)) return std::nullopt;
  return static_cast<std::uint16_t>(table.integer(key, 0, 0xFFFF));
}

DeviceMatch read_match(const TomlTable& table) {
  DeviceMatch match{read_id(table, "vendor"), read_id(table, "product"), read_usage(table, "usage"),
                    read_usage(table, "collection")};
  if (match.product && !match.vendor) {
    table.fail("product", "[[match]] has a product without a vendor",
               "add the vendor's number, as lsusb shows it");
  }
  if (!match.vendor && !match.usage && !match.collection) {
    table.fail("", "[[match]] fits every device", "give vendor and product, or a usage = [page, number]");
  }
  return match;
}

ReportLengths read_reports(const TomlTable& table) {
  const auto length = [&](std::string_view key) { return table.integer(key, 1, longest_report, 0); };
  return {length("input"), length("output"), length("feature")};
}

DeviceLimits read_limits(const TomlTable& table) {
  DeviceLimits limits;
  const auto read = [&](std::string_view key, double& limit) { limit = table.positive(key, limit); };
  read("max_force", limits.max_force);
  read("max_torque", limits.max_torque);
  read("max_stiffness", limits.max_stiffness);
  read("max_damping", limits.max_damping);
  read("workspace_radius", limits.workspace_radius);
  return limits;
}

const Keys arm_keys = {"lengths",     "capstan_diameters", "body_diameters", "torque_constants",
                       "max_current", "counts_per_turn",   "motor_aligned",  "encoder_aligned",
                       "calibration", "workspace_origin"};

ArmConstants read_arm(const TomlTable& table) {
  ArmConstants arm;
  arm.lengths = table.positive_vector("lengths", 3);
  arm.capstan_diameters = table.positive_vector("capstan_diameters", 3);
  arm.body_diameters = table.positive_vector("body_diameters", 3);
  arm.torque_constants = table.positive_vector("torque_constants", 3);
  arm.max_current = table.positive("max_current");
  const auto counts = table.numbers("counts_per_turn", 6);
  std::copy(counts.begin(), counts.end(), arm.counts_per_turn.begin());
  const auto zeros = std::count(counts.begin() + 3, counts.end(), 0.0);
  if (*std::min_element(counts.begin(), counts.begin() + 3) <= 0.0 ||
      *std::min_element(counts.begin() + 3, counts.end()) < 0.0 || (zeros != 0 && zeros != 3)) {
    table.fail("counts_per_turn", "[arm] counts_per_turn must be positive for encoders a, b, c",
               "give six numbers, where the last three are all 0 without a wrist and none is 0 with one");
  }
  const auto motors = table.booleans("motor_aligned", 3);
  std::copy(motors.begin(), motors.end(), arm.motor_aligned.begin());
  const auto encoders = table.booleans("encoder_aligned", 3);
  std::copy(encoders.begin(), encoders.end(), arm.encoder_aligned.begin());
  const auto calibration = table.integers("calibration", 6, -32768, 32767);
  std::transform(calibration.begin(), calibration.end(), arm.calibration.begin(),
                 [](std::int32_t counter) { return static_cast<std::int16_t>(counter); });
  arm.workspace_origin = table.vector("workspace_origin", 3);
  return arm;
}

const Keys space_mouse_keys = {"full_scale",        "dead_zone",      "speed",  "turning_speed",
                               "translation_signs", "rotation_signs", "silence"};

Vec3 read_signs(const TomlTable& table, std::string_view key) {
  const auto signs = table.integers(key, 3, -1, 1);
  return {static_cast<double>(signs[0]), static_cast<double>(signs[1]), static_cast<double>(signs[2])};
}

SpaceMouseConstants read_space_mouse(const TomlTable& table) {
  SpaceMouseConstants constants;
  constants.full_scale = table.positive("full_scale");
  constants.dead_zone = table.within("dead_zone", 0.0, 0.5 * constants.full_scale);
  constants.speed = table.positive("speed");
  constants.turning_speed = table.within("turning_speed", 0.0, 100.0);
  constants.translation_signs = read_signs(table, "translation_signs");
  constants.rotation_signs = read_signs(table, "rotation_signs");
  constants.silence = table.positive("silence");
  return constants;
}

const Keys pid_keys = {"half_travel", "full_force", "directions"};

PidConstants read_pid(const TomlTable& table) {
  PidConstants constants;
  const auto read = [](const std::vector<double>& values, std::array<double, pid_axes>& pair) {
    std::copy(values.begin(), values.end(), pair.begin());
  };
  read(table.positives("half_travel", pid_axes), constants.half_travel);
  read(table.positives("full_force", pid_axes), constants.full_force);
  read(table.numbers("directions", pid_axes), constants.directions);
  return constants;
}

/// Kind of profile and the name of its table.
struct Kind {
  std::string_view name;
  std::string_view table;  // empty: none
};
constexpr std::array kinds = {Kind{"woodenhaptics", "arm"}, Kind{"spacemouse", "spacemouse"},
                              Kind{"pid", "joystick"}, Kind{"palpate_board", ""}};

const Kind& read_kind(const toml::table& root, const std::string& name) {
  Keys known = {"name", "kind", "match", "reports", "limits"};
  for (const Kind& kind : kinds) {
    if (!kind.table.empty()) known.push_back(kind.table);
  }
  const TomlTable table(root, "", name, known);
  Keys names;
  for (const Kind& kind : kinds) names.push_back(kind.name);
  const std::string text = table.choice("kind", names);
  return *std::find_if(kinds.begin(), kinds.end(), [&](const Kind& kind) { return kind.name == text; });
}

}  // namespace

bool DeviceMatch::fits(const DeviceId& device) const noexcept {
  const auto& all = device.collections;
  return (!vendor || *vendor == device.vendor) && (!product || *product == device.product) &&
         (!usage || *usage == device.usage) &&
         (!collection || std::find(all.begin(), all.end(), *collection) != all.end());
}

bool DeviceProfile::fits(const DeviceId& device) const noexcept {
  return std::any_of(matches.begin(), matches.end(),
                     [&](const DeviceMatch& match) { return match.fits(device); });
}

DeviceProfile read_device_profile(const std::filesystem::path& file) {
  return parse_device_profile(read_all(file, "Check the path", largest_description), file.string());
}

DeviceProfile parse_device_profile(std::string_view text, const std::string& name) {
  const toml::table root = parse_toml(text, name);
  const Kind& kind = read_kind(root, name);
  Keys known = {"name", "kind", "match", "reports", "limits"};
  if (!kind.table.empty()) known.push_back(kind.table);
  const TomlTable table(root, "", name, known);

  DeviceProfile profile;
  profile.name = table.text("name");
  if (profile.name.empty()) table.fail("name", "name is empty", "give the name that is shown");
  for (const TomlTable& match : table.tables("match", {"vendor", "product", "usage", "collection"},
                                             "write for example\n[[match]]\nvendor = 0x256f")) {
    profile.matches.push_back(read_match(match));
  }
  if (table.has("reports")) {
    profile.reports = read_reports(table.table("reports", {"input", "output", "feature"}));
  }
  if (table.has("limits")) {
    profile.limits = read_limits(table.table(
        "limits", {"max_force", "max_torque", "max_stiffness", "max_damping", "workspace_radius"}));
  }
  if (kind.name == "woodenhaptics") {
    profile.kind = read_arm(table.table("arm", arm_keys));
    constexpr int bytes = woodenhaptics_report_bytes;
    if (profile.reports.input != bytes || profile.reports.output != bytes) {
      table.fail("reports", "[reports] of this kind are input = 14 and output = 14",
                 "write so; boards with other reports speak another protocol");
    }
  } else if (kind.name == "spacemouse") {
    profile.kind = read_space_mouse(table.table("spacemouse", space_mouse_keys));
    if (!std::isfinite(profile.limits.workspace_radius)) {
      table.fail("limits", "[limits] workspace_radius is missing",
                 "say within how many metres of its start the tool stays");
    }
  } else if (kind.name == "pid") {
    profile.kind = read_pid(table.table("joystick", pid_keys));
  } else {
    profile.kind = BoardConstants{};
  }
  return profile;
}

}  // namespace palpate
