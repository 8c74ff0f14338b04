// A run and the pages that see it.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "runtime/viewer/broadcast.h"
#include "runtime/viewer/mailbox.h"
#include "runtime/viewer/page_word.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// A page as its run sees it.
class Page {
 public:
  virtual ~Page() = default;

  /// Sends what there is that the page has not been sent, one message after the other.
  virtual void send_news() = 0;
  /// A text that it must not miss.
  virtual void say(std::string text) = 0;
  /// It sees this from now on, whatever is shown to all.
  virtual void look_alone(DrawnPicture picture, std::int64_t frame) = 0;
  /// It sees what is shown to all.
  virtual void follow() = 0;
  /// The frame that it sees alone.
  [[nodiscard]] virtual std::optional<std::int64_t> own_frame() const noexcept = 0;
};

/// Knows which pages see the run and which of them controls it, and takes what is posted to them. All except
/// `post` is for the server's thread.
class ShownRun {
 public:
  /// `run` must live as long. `has_book`: pages may open the book.
  ShownRun(ViewedRun& run, bool is_replay, bool has_book)
      : run_(run), is_replay_(is_replay), has_book_(has_book) {}
  ShownRun(const ShownRun&) = delete;
  ShownRun& operator=(const ShownRun&) = delete;

  /// `put` puts something into the mail, by any thread. True where the server's thread is to be woken.
  template <class Put>
  [[nodiscard]] bool post(Put&& put) {
    return mailbox_.post(std::forward<Put>(put));
  }

  [[nodiscard]] bool is_replay() const noexcept { return is_replay_; }
  [[nodiscard]] Broadcast& broadcast() noexcept { return broadcast_; }
  [[nodiscard]] PageRole role(const Page& page) const;
  /// It is a socket now: the only one of all has control.
  void join(Page& page);
  /// It is gone, and its control with it.
  void leave(Page& page);
  /// What the controller wants is done, others are told why not.
  void obey(Page& page, const PageWord& word);
  /// Shows what was posted.
  void take_mail();
  /// Has the state sent again where that was last half a second ago.
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
  std::set<Page*> open_;  // those that are sockets
  Page* controller_ = nullptr;
  std::uint64_t joined_ = 0;
  Mailbox mailbox_;
};

}  // namespace palpate
