// What a person at the viewer's page may ask of a run.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "runtime/pointer_pose.h"

namespace palpate {

/// Options of play by name, as text; nothing: the default.
using SettingsChange = std::map<std::string, std::optional<std::string>>;

/// Called by the server's thread; no call waits for the loop. Those that can be wrong throw Error, whose text
/// the page is shown.
class ViewedRun {
 public:
  virtual ~ViewedRun() = default;

  virtual void point(const PointerPose& wanted) = 0;
  virtual void lose_pointer() = 0;  ///< the controller is gone
  virtual void pause(bool paused) = 0;
  virtual void step_once() = 0;  ///< a tick, while paused
  virtual void reset() = 0;      ///< the untouched body
  virtual void acknowledge() = 0;
  virtual void change(const SettingsChange& settings) = 0;
  virtual void record(bool on) = 0;
  virtual void seek(std::int64_t frame) = 0;  ///< in a replay
};

}  // namespace palpate
