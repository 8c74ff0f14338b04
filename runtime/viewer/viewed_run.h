// Requests that a person at the viewer's page can make of a run.
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

/// Options of play by name, as text; empty: the default.
using SettingsChange = std::map<std::string, std::optional<std::string>>;

/// Reason why a request of a page is refused.
enum class PageRefusal : std::uint8_t {
  value,    ///< invalid: a number out of bounds, an option that does not exist
  control,  ///< another page has control, or none
  hand,     ///< a hand is in the device, and the page must not change this
  locked,   ///< not possible during a recording or a replay
};

/// The refusals and their names in messages.
inline constexpr std::array<std::pair<PageRefusal, const char*>, 4> page_refusal_names = {{
    {PageRefusal::value, "value"},
    {PageRefusal::control, "control"},
    {PageRefusal::hand, "hand"},
    {PageRefusal::locked, "locked"},
}};

/// Error with the kind that the page receives; any other Error has the kind `value`.
class PageError : public Error {
 public:
  PageError(PageRefusal reason, const std::string& what, std::string where, std::string hint)
      : Error(what, std::move(where), std::move(hint)), reason_(reason) {}

  [[nodiscard]] PageRefusal reason() const noexcept { return reason_; }

 private:
  PageRefusal reason_;
};

/// Frame of a recording.
struct RecordedFrame {
  std::int64_t frame = 0;
  SurfacePicture picture;
};

/// Called by the server's thread; no call waits for the loop. Those that can be wrong throw Error, whose text
/// the page is shown. What is not overridden is refused, as it is by a recording.
class ViewedRun {
 public:
  virtual ~ViewedRun() = default;

  virtual void point(const PointerPose& /*wanted*/) {}
  virtual void lose_pointer() {}  ///< the controlling page is gone
  virtual void pause(bool /*paused*/) { refuse(); }
  virtual void step_once() { refuse(); }  ///< one tick, while paused
  virtual void reset() { refuse(); }      ///< restores the untouched body
  virtual void acknowledge() { refuse(); }
  virtual void change(const SettingsChange& /*settings*/) { refuse(); }
  virtual void record(bool /*on*/) { refuse(); }
  virtual void seek(std::int64_t frame) = 0;  ///< in a replay only
  /// Returns the nearest frame of a replay, for a page that views it by itself; the other pages are
  /// unaffected. Empty if there is no replay.
  virtual std::optional<RecordedFrame> recorded_frame(std::int64_t /*frame*/) { return std::nullopt; }

 private:
  [[noreturn]] static void refuse() {
    throw Error("cannot be done with a recording", "palpate-runtime view",
                "touch the body itself: palpate-runtime play MODEL.palpate.hdf --view");
  }
};

/// Run that is shown; `run` must outlive this. `is_replay`: recorded, so that all ticks are kept for pages
/// that join later.
struct RunToShow {
  ViewedRun& run;
  bool is_replay = false;
};

}  // namespace palpate
