// A file of the gallery that is shown.
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "runtime/gallery/gallery_folder.h"
#include "runtime/push/other_program.h"
#include "runtime/serving/viewer_port.h"

namespace palpate {

/// Shown by a palpate-runtime of its own at a port of its own: a body is played, a recording is viewed, and
/// of a source a body is made first. So a body that is large, or ends badly, leaves the gallery as it is.
class OpenedItem {
 public:
  /// `name` is one of `folder`, in which what is recorded and made lands; it is shown as `options` say.
  OpenedItem(const std::filesystem::path& folder, std::string name, const ViewerOptions& options);
  ~OpenedItem();  ///< ends it; what it records is whole then
  OpenedItem(const OpenedItem&) = delete;
  OpenedItem& operator=(const OpenedItem&) = delete;

  /// How far it is.
  struct State {
    std::string name;
    std::deque<std::string> said;  ///< its last lines
    std::string url;               ///< where it is shown; empty: not yet
    bool has_ended = false;        ///< `said` tells why, where it has never been shown
  };
  [[nodiscard]] State state() const;

 private:
  void watch(const OtherProgram::Start& start);
  void hear(const std::string& line);
  [[nodiscard]] bool begin(std::unique_ptr<OtherProgram> program);

  mutable std::mutex mutex_;  // of what follows
  State state_;
  std::unique_ptr<OtherProgram> program_;
  bool is_over_ = false;  // it is not to begin any more
  std::thread watcher_;
};

}  // namespace palpate
