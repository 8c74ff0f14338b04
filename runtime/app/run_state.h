// What a viewer's page is told of a run beside its pictures.
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

/// The run's members of the message `state` (web/PROTOCOL.md).
struct RunState {
  std::uint32_t scene = 0;
  nlohmann::json model;     ///< of describe_model
  nlohmann::json defaults;  ///< of describe_defaults
  std::string device;       ///< what moves the tool
  bool pointer = false;     ///< it is a page's pointer
  bool hand = false;        ///< a hand is in it, whose safety is not a page's to change
  std::int64_t rate = 1000;
  std::int64_t ticks = 0;   ///< since the session began
  std::int64_t misses = 0;  ///< of deadlines
  bool paused = false;
  std::optional<std::string> recording;   ///< file
  std::optional<Error> recording_failed;  ///< why nothing is kept in it any more
  std::optional<std::string> busy;        ///< what is being made
  std::optional<Error> refused;           ///< why the last request could not be met
  std::optional<std::string> locked;      ///< why settings cannot be changed
  SafetyPhase phase = SafetyPhase::active;
  Fault fault = Fault::none;
  std::optional<SurfaceChange> change{};  ///< of the surface that was shown half a second ago, or less
  SettingsText settings;
  std::string tool_note;  ///< of too_small (fitting_tool.h); empty where the tool is not
};

[[nodiscard]] nlohmann::json to_json(const RunState& state);

/// Name, file, size and kind of a model.
[[nodiscard]] nlohmann::json describe_model(const Body& body, const std::string& file);

/// What suits it: radius of a tool, reach of a grab, friction, and how deep to press.
[[nodiscard]] nlohmann::json describe_defaults(const Body& body);

}  // namespace palpate
