// What all pages of a viewer are to see.
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

/// Encoded once, sent to many.
struct Message {
  std::shared_ptr<const std::string> bytes;
  bool is_text = false;

  explicit operator bool() const noexcept { return bytes != nullptr; }
};
Message text_message(std::string text);

/// Encoded when the first page wants it. Counts tell a page whether it has been sent what there is. For the
/// server's thread.
class Broadcast {
 public:
  void set_scene(std::shared_ptr<const Scene> scene);
  /// Nothing, where it is of another scene.
  void set_picture(DrawnPicture picture);
  /// Adds ticks to those shown: of a `replay` all are kept, otherwise the last two seconds.
  void add_ticks(const std::vector<TickNote>& ticks, std::int64_t stride, bool replay);
  void set_state(StateWord state);
  void set_times(nlohmann::json times) { times_ = std::move(times); }
  /// Pages are to be sent the state again.
  void touch_state();
  /// Has the state sent to pages again where that was last half a second ago.
  void repeat_state();

  [[nodiscard]] std::int64_t scenes() const noexcept { return scenes_; }
  [[nodiscard]] std::int64_t pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::int64_t states() const noexcept { return state_ ? states_ : 0; }
  [[nodiscard]] const TickHistory& ticks() const noexcept { return ticks_; }
  [[nodiscard]] const std::optional<DrawnPicture>& picture() const noexcept { return picture_; }

  // Of what there is, see above.
  [[nodiscard]] const Message& scene_message() const noexcept { return scene_message_; }
  [[nodiscard]] const Message& patch_message();
  /// For a page that has `base`, which is null or of this scene. Pages that have the same share it.
  [[nodiscard]] const Message& frame_message(const WireValues* base);
  /// What a page has of the picture once it is sent.
  [[nodiscard]] const std::shared_ptr<const WireValues>& values();
  /// The message of the ticks from `place` on, which it moves on.
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
  std::shared_ptr<const WireValues> values_;  // of the picture, once a page wants it
  std::vector<Frame> frames_;                 // of the picture
  Message run_message_;                       // of the ticks that a page was sent last
  std::int64_t run_begin_ = 0;
  std::int64_t run_end_ = 0;
  std::int64_t run_last_ = 0;  // end of all ticks then
};

}  // namespace palpate
