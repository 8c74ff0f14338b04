// What a person at the viewer's page may ask of a run.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "base/error.h"
#include "runtime/safety/pointer_pose.h"
#include "runtime/scene/scene.h"

namespace palpate {

/// Options of play by name, as text; nothing: the default.
using SettingsChange = std::map<std::string, std::optional<std::string>>;

/// Why what a page asks for is not done.
enum class PageRefusal : std::uint8_t {
  value,    ///< it cannot be: a number out of its bounds, an option that does not exist
  control,  ///< another page steers, or none
  hand,     ///< a hand is in the device, and this is not a page's to change
  locked,   ///< not now: a recording is being made, or a session replayed
};

/// The refusals and their names in messages.
inline constexpr std::array<std::pair<PageRefusal, const char*>, 4> page_refusal_names = {{
    {PageRefusal::value, "value"},
    {PageRefusal::control, "control"},
    {PageRefusal::hand, "hand"},
    {PageRefusal::locked, "locked"},
}};

/// An Error of which the page is told the kind; any other Error is of kind `value`.
class PageError : public Error {
 public:
  PageError(PageRefusal reason, const std::string& what, std::string where, std::string hint)
      : Error(what, std::move(where), std::move(hint)), reason_(reason) {}

  [[nodiscard]] PageRefusal reason() const noexcept { return reason_; }

 private:
  PageRefusal reason_;
};

/// A frame of a recording.
struct RecordedFrame {
  std::int64_t frame = 0;
  SurfacePicture picture;
};

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
  /// The nearest frame that a replay has, for a page that looks through it by itself; all others see what
  /// they saw. Nothing where there is no replay.
  virtual std::optional<RecordedFrame> recorded_frame(std::int64_t frame) {
    static_cast<void>(frame);
    return std::nullopt;
  }
};

/// A run that is shown; `run` must live as long as it is. `is_replay`: of what was recorded, where all ticks
/// are kept for pages that come later.
struct RunToShow {
  ViewedRun& run;
  bool is_replay = false;
};

}  // namespace palpate
