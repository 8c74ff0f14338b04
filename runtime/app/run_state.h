// State of a run as sent to a viewer's page, beside its pictures.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/error.h"
#include "runtime/body/body.h"
#include "runtime/loop/settings.h"
#include "runtime/safety/fault.h"
#include "statics/surface_change.h"

namespace palpate {

/// Members of the message `state` that belong to the run (web/PROTOCOL.md).
struct RunState {
  std::uint32_t scene = 0;
  nlohmann::json model;     ///< from describe_model
  nlohmann::json defaults;  ///< from describe_defaults
  std::string device;       ///< name of the device that moves the tool
  bool pointer = false;     ///< the device is a page's pointer
  bool hand = false;        ///< the device is in a hand, so a page must not change safety
  std::int64_t rate = 1000;
  std::int64_t ticks = 0;   ///< since the start of the session
  std::int64_t misses = 0;  ///< missed deadlines
  bool paused = false;
  std::optional<std::string> recording;   ///< file
  std::optional<Error> recording_failed;  ///< reason if recording has failed
  std::optional<std::string> busy;        ///< work in progress, for example loading
  std::optional<Error> refused;           ///< reason for refusing the last request
  std::optional<std::string> locked;      ///< reason if settings cannot be changed
  SafetyPhase phase = SafetyPhase::active;
  Fault fault = Fault::none;
  std::optional<SurfaceChange> change{};  ///< change of the surface shown at most half a second ago
  double small_strain = 0.0;              ///< TickNote::small_strain
  SettingsText settings;
  std::string tool_note;  ///< from too_small (fitting_tool.h); empty if the tool is large enough
};

[[nodiscard]] nlohmann::json to_json(const RunState& state);

/// Returns name, file, size and kind of a model.
[[nodiscard]] nlohmann::json describe_model(const Body& body, const std::string& file);

/// Returns suitable values: radius of a tool, reach of a grab, friction, and depth of a press.
[[nodiscard]] nlohmann::json describe_defaults(const Body& body);

}  // namespace palpate
