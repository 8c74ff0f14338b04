// A recording that the viewer's page looks through.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "runtime/app/session_pictures.h"
#include "runtime/viewer/viewed_run.h"
#include "runtime/viewer/viewer_server.h"

namespace palpate {

/// Pages may look through it, and ask nothing else of it.
class SessionView : public ViewedRun {
 public:
  /// As SessionPictures.
  explicit SessionView(const std::filesystem::path& recording);

  [[nodiscard]] const SessionPictures& pictures() const noexcept { return pictures_; }
  /// Shows it as this run of a server, which must live as long as pages are served.
  void show(ViewerServer& server, std::size_t run);

  void seek(std::int64_t frame) override;
  std::optional<RecordedFrame> recorded_frame(std::int64_t frame) override;
  void point(const PointerPose&) override {}
  void lose_pointer() override {}
  void pause(bool paused) override;
  void step_once() override;
  void reset() override;
  void acknowledge() override;
  void change(const SettingsChange& settings) override;
  void record(bool on) override;

 private:
  [[nodiscard]] std::int64_t nearest(std::int64_t frame) const;

  SessionPictures pictures_;
  std::mutex mutex_;  // of what follows
  nlohmann::json state_;
  ViewerServer* server_ = nullptr;  // null: nothing is shown yet
  std::size_t run_ = 0;
};

}  // namespace palpate
