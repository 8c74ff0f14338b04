// Recording that a viewer's page can view.
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

/// Recording shown in pages, which may seek and make no other request.
class SessionView : public ViewedRun {
 public:
  /// See SessionPictures.
  explicit SessionView(const std::filesystem::path& recording);

  [[nodiscard]] const SessionPictures& pictures() const noexcept { return pictures_; }
  /// Shows it as this run of a server, which must outlive the pages.
  void show(ViewerServer& server, std::size_t run);

  void seek(std::int64_t frame) override;
  std::optional<RecordedFrame> recorded_frame(std::int64_t frame) override;

 private:
  [[nodiscard]] std::int64_t nearest(std::int64_t frame) const;

  SessionPictures pictures_;
  std::mutex mutex_;  // guards the following
  nlohmann::json state_;
  ViewerServer* server_ = nullptr;  // null: not shown yet
  std::size_t run_ = 0;
};

}  // namespace palpate
