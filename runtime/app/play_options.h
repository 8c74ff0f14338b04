// Options of palpate-runtime play.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "formats/recording.h"
#include "runtime/loop/settings.h"
#include "runtime/serving/listening_socket.h"
#include "runtime/serving/viewer_port.h"

namespace palpate {

/// What moves the tool.
struct DeviceChoice {
  enum class Kind {
    script,  ///< a CSV file: `target`
    replay,  ///< a session
    hid,     ///< a HID device: `target` says which, empty where there is only one; `profile` how to treat it
    bridge,  ///< another process, at the socket `target`; empty: at the usual one
    mouse,   ///< the pointer of a viewer
  };
  Kind kind = Kind::script;
  std::string target;
  std::string profile;
  std::string text;  ///< as it was written

  /// Whether it is in the hand of a person, who waits for nobody.
  [[nodiscard]] bool is_live() const noexcept {
    return kind == Kind::hid || kind == Kind::bridge || kind == Kind::mouse;
  }
};

struct PlayOptions {
  std::filesystem::path file;        ///< baked model
  std::filesystem::path model_toml;  ///< that it must have been made from; empty: not asked
  DeviceChoice device;
  std::shared_ptr<const RecordingFile> session;  ///< that is replayed
  SettingsText settings_text;                    ///< as they were written, or are in the session
  Settings settings;                             ///< what they mean
  std::optional<double> duration;  ///< [s]; else to the end of the script or session, or until interrupted
  std::optional<int> processor;    ///< that the loop is to have for itself
  bool fast = false;
  std::optional<ViewerOptions> view;  ///< where it is shown in a browser
  std::optional<ListenAddress> igtl;  ///< where OpenIGTLink clients are sent it
  std::filesystem::path beside;       ///< recording that the browser shows beside it; empty: none
  std::filesystem::path record;       ///< empty: nothing is recorded
  double record_frames = 60.0;        ///< of the surface a second; 0: none
  std::filesystem::path report;       ///< JSON; "-": on the standard output; empty: none
  std::filesystem::path surface;      ///< grid of the surface after the last tick, .vtu; empty: none
  std::filesystem::path contacts;     ///< CSV of the contact points after the last tick; empty: none
  bool force = false;                 ///< these may take the place of any files that are not read
};

}  // namespace palpate
