// Content that all pages of a viewer see.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/scene/drawn_picture.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/tick_history.h"
#include "runtime/viewer/wire_values.h"

namespace palpate {

/// Message that is encoded once and sent to many pages.
struct Message {
  std::shared_ptr<const std::string> bytes;
  bool is_text = false;

  explicit operator bool() const noexcept { return bytes != nullptr; }
};
Message text_message(std::string text);

/// Content of the pages, encoded when the first page needs it. By its counters a page knows whether it has
/// received the latest. For the server's thread.
class Broadcast {
 public:
  void set_scene(std::shared_ptr<const Scene> scene);
  /// Ignores a picture of another scene.
  void set_picture(DrawnPicture picture);
  /// Adds ticks. A `replay` keeps all of them (up to a large bound), otherwise the last two seconds are kept.
  void add_ticks(const std::vector<TickNote>& ticks, std::int64_t stride, bool replay);
  void set_state(StateWord state);
  void set_times(nlohmann::json times) { times_ = std::move(times); }
  /// Marks the state as new, so that it is sent to the pages again.
  void touch_state();
  /// Marks the state as new if that was last done half a second ago.
  void repeat_state();

  [[nodiscard]] std::int64_t scenes() const noexcept { return scenes_; }
  [[nodiscard]] std::int64_t pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::int64_t states() const noexcept { return state_ ? states_ : 0; }
  [[nodiscard]] const TickHistory& ticks() const noexcept { return ticks_; }
  [[nodiscard]] const std::optional<DrawnPicture>& picture() const noexcept { return picture_; }

  // Messages of the current content.
  [[nodiscard]] const Message& scene_message() const noexcept { return scene_message_; }
  [[nodiscard]] const Message& patch_message();
  /// Frame for a page that has `base`, which is null or of this scene. Pages with the same base get the same
  /// message.
  [[nodiscard]] const Message& frame_message(const WireValues* base);
  /// Values that a page has once it has received the picture.
  [[nodiscard]] const std::shared_ptr<const WireValues>& values();
  /// Returns the message of the ticks from `place` on, and advances `place`.
  [[nodiscard]] Message ticks_message(std::int64_t& place);
  [[nodiscard]] Message state_message(const PageRole& role, bool is_first) const;

 private:
  struct Frame {
    std::uint32_t base;  // 0: none
    Message message;
  };

  void forget_frames();

  std::shared_ptr<const Scene> scene_;
  std::optional<DrawnPicture> picture_;
  TickHistory ticks_;
  std::optional<StateWord> state_;
  nlohmann::json times_;
  std::int64_t scenes_ = 0;
  std::int64_t pictures_ = 0;
  std::int64_t states_ = 0;
  std::chrono::steady_clock::time_point state_touched_;
  Message scene_message_;
  Message patch_message_;
  std::shared_ptr<const WireValues> values_;  // values of the picture, once a page needs them
  std::vector<Frame> frames_;                 // frames of the picture, by their base
  Message run_message_;                       // last message of ticks
  std::int64_t run_begin_ = 0;
  std::int64_t run_end_ = 0;
  std::int64_t run_last_ = 0;  // end of all ticks when it was made
};

}  // namespace palpate
