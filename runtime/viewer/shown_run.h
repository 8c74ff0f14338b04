// Run with the pages that watch it.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "runtime/viewer/broadcast.h"
#include "runtime/viewer/page_word.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// Ticks and pictures shown of a run since the server's thread last looked.
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

/// Page as its run sees it.
class Page {
 public:
  virtual ~Page() = default;

  /// Sends the content that the page has not received yet, one message at a time.
  virtual void send_news() = 0;
  /// Queues a text that must not be dropped.
  virtual void say(std::string text) = 0;
  /// Shows this picture to the page alone from now on.
  virtual void look_alone(DrawnPicture picture, std::int64_t frame) = 0;
  /// Returns to the picture shown to all.
  virtual void follow() = 0;
  /// Frame that it sees by itself.
  [[nodiscard]] virtual std::optional<std::int64_t> own_frame() const noexcept = 0;
  /// It is a program's, to which control is not given unasked.
  [[nodiscard]] virtual bool only_watches() const noexcept = 0;
};

/// Knows the pages that watch a run and the one that controls it, and takes the content posted to them. All
/// except `post` is for the server's thread.
class ShownRun {
 public:
  /// `run` must outlive this. `has_book`: pages may open the book.
  ShownRun(ViewedRun& run, bool is_replay, bool has_book)
      : run_(run), is_replay_(is_replay), has_book_(has_book) {}
  ShownRun(const ShownRun&) = delete;
  ShownRun& operator=(const ShownRun&) = delete;

  /// `put` puts something into the mail, by any thread. True where it was empty: the server's thread is to be
  /// woken.
  template <class Put>
  [[nodiscard]] bool post(Put&& put) {
    const std::lock_guard lock(mutex_);
    put(mail_);
    return !std::exchange(is_posted_, true);
  }

  [[nodiscard]] bool is_replay() const noexcept { return is_replay_; }
  [[nodiscard]] Broadcast& broadcast() noexcept { return broadcast_; }
  [[nodiscard]] PageRole role(const Page& page) const;
  /// It is a socket now: the only one of those that do not only watch has control.
  void join(Page& page);
  /// Removes a closed page, with its control.
  void leave(Page& page);
  /// Executes a message of the controlling page; sends other pages the reason for refusing it.
  void obey(Page& page, const PageWord& word);
  /// Shows the posted content.
  void take_mail();
  /// Sends the state again if that was last done half a second ago.
  void repeat_state();

 private:
  void show_state_anew();
  void show_all();
  void hand_over(Page& page, bool take);
  void release();
  void show_alone(Page& page, std::int64_t frame);

  ViewedRun& run_;
  bool is_replay_;
  bool has_book_;
  Broadcast broadcast_;
  std::set<Page*> open_;  // pages with an open WebSocket
  Page* controller_ = nullptr;
  std::uint64_t joined_ = 0;
  std::mutex mutex_;  // guards the following
  Mail mail_;
  bool is_posted_ = false;
};

}  // namespace palpate
