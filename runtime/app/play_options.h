// Options of palpate-runtime play.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "formats/recording.h"
#include "runtime/loop/settings.h"
#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Choice of the device that moves the tool.
struct DeviceChoice {
  enum class Kind {
    script,  ///< a CSV file: `target`
    replay,  ///< replay of a session
    hid,     ///< HID device `target`, empty: the only one; `profile`: its profile
    bridge,  ///< another process, at the socket `target`; empty: the default one
    mouse,   ///< pointer of a viewer
  };
  Kind kind = Kind::script;
  std::string target;
  std::string profile;
  std::string text;  ///< text on the command line

  /// True if a person moves it, which cannot be paused.
  [[nodiscard]] bool is_live() const noexcept {
    return kind == Kind::hid || kind == Kind::bridge || kind == Kind::mouse;
  }
};

struct PlayOptions {
  std::filesystem::path file;        ///< baked model
  std::filesystem::path model_toml;  ///< description that it must have been made from; empty: not checked
  DeviceChoice device;
  std::shared_ptr<const RecordingFile> session;  ///< session to replay
  SettingsText settings_text;                    ///< settings as given, or as in the session
  Settings settings;                             ///< parsed settings
  std::optional<double> duration;  ///< [s]; default: to the end of script or session, or until interrupted
  std::optional<int> processor;    ///< processor reserved for the loop
  bool fast = false;
  std::optional<ViewerOptions> view;  ///< viewer in a browser
  std::filesystem::path beside;       ///< recording that the viewer shows beside it; empty: none
  std::filesystem::path record;       ///< empty: no recording
  double record_frames = 60.0;        ///< surface pictures per second; 0: none
  std::filesystem::path report;       ///< JSON; "-": to the standard output; empty: none
  std::filesystem::path surface;      ///< grid of the surface after the last tick, .vtu; empty: none
  std::filesystem::path contacts;     ///< CSV of the contact points after the last tick; empty: none
  bool force = false;                 ///< outputs may replace any file that is not an input
};

/// palpate-runtime play: the loop, its recording and its report. Runs to the end or to SIGINT, SIGTERM or
/// SIGHUP, which leave a complete recording, report and table of contacts, and the device without force. With
/// a viewer it goes on until then, unless there is a duration. Returns the exit code; throws Error.
int play(PlayOptions options);

}  // namespace palpate
