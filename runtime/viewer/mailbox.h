// Handover of new content to the viewer's thread.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/viewer/broadcast.h"

namespace palpate {

/// Content posted since the viewer's thread last took it.
struct Mail {
  struct Ticks {
    std::vector<TickNote> notes;
    std::int64_t stride = 1;
  };

  std::shared_ptr<const Scene> scene;
  std::optional<DrawnPicture> picture;
  std::deque<Ticks> ticks;
  std::optional<StateWord> state;
  nlohmann::json times;  ///< times from the last state that had any
};

class Mailbox {
 public:
  /// Calls `put` with the mail; for any thread. Returns true if it was empty: wake the viewer's thread.
  template <class Put>
  [[nodiscard]] bool post(Put&& put) {
    const std::lock_guard lock(mutex_);
    put(mail_);
    return !std::exchange(is_posted_, true);
  }
  [[nodiscard]] Mail take() {
    const std::lock_guard lock(mutex_);
    is_posted_ = false;
    return std::exchange(mail_, {});
  }

 private:
  std::mutex mutex_;
  Mail mail_;
  bool is_posted_ = false;
};

}  // namespace palpate
