#include "runtime/viewer/shown_run.h"

#include <algorithm>
#include <optional>

#include "base/error.h"

namespace palpate {
void ShownRun::take_mail() {
  Mail mail;
  {
    const std::lock_guard lock(mutex_);
    is_posted_ = false;
    mail = std::exchange(mail_, {});
  }
  if (mail.scene) broadcast_.set_scene(std::move(mail.scene));
  if (!mail.times.is_null()) broadcast_.set_times(std::move(mail.times));
  if (mail.state) broadcast_.set_state(std::move(*mail.state));
  if (mail.picture) broadcast_.set_picture(std::move(*mail.picture));
  for (const Mail::Ticks& ticks : mail.ticks) broadcast_.add_ticks(ticks.notes, ticks.stride, is_replay_);
  show_all();
}

void ShownRun::repeat_state() {
  broadcast_.repeat_state();
  show_all();
}

void ShownRun::show_state_anew() {
  broadcast_.touch_state();
  show_all();
}

void ShownRun::show_all() {
  const std::set<Page*> pages = open_;
  for (Page* page : pages) page->send_news();
}

PageRole ShownRun::role(const Page& page) const {
  return {controller_ == &page, controller_ != nullptr, open_.size(), page.own_frame()};
}

void ShownRun::join(Page& page) {
  open_.insert(&page);
  if (!page.only_watches() && std::ranges::count(open_, false, &Page::only_watches) == 1) controller_ = &page;
  broadcast_.touch_state();
  page.say(hello_word(is_replay_ ? "replay" : "live", ++joined_, has_book_));
  show_all();
}

void ShownRun::leave(Page& page) {
  if (open_.erase(&page) == 0) return;
  if (controller_ == &page) {
    release();
  } else {
    show_state_anew();
  }
}

void ShownRun::release() {
  controller_ = nullptr;
  run_.lose_pointer();
  show_state_anew();
}

void ShownRun::hand_over(Page& page, bool take) {
  if (!take) {
    if (controller_ == &page) release();
  } else if (controller_ == nullptr) {
    controller_ = &page;
    page.follow();
    show_state_anew();
  } else if (controller_ != &page) {
    page.say(error_word("control", PageError(PageRefusal::control, "another page has control", "",
                                             "ask for it when that page has given it up")));
  }
}

/// A page without control may view any frame of a replay by itself.
void ShownRun::show_alone(Page& page, std::int64_t frame) {
  std::optional<RecordedFrame> recorded = run_.recorded_frame(frame);
  if (recorded && broadcast_.picture()) {
    page.look_alone({broadcast_.picture()->scene, nullptr, std::move(recorded->picture)}, recorded->frame);
  }
}

void ShownRun::obey(Page& page, const PageWord& word) {
  if (word.type == "control") return hand_over(page, word.take);
  if (word.type == "follow") return page.follow();
  const bool looks_alone = is_replay_ && word.frame && controller_ != &page;
  if (controller_ != &page && !looks_alone) {
    page.say(error_word(
        word.type, PageError(PageRefusal::control, "this page only watches", "",
                             controller_ == nullptr ? "take control first" : "another page has control")));
    return;
  }
  try {
    if (looks_alone) {
      show_alone(page, *word.frame);
    } else {
      word.ask(run_);
    }
  } catch (const Error& error) {
    page.say(error_word(word.type, error));
  } catch (const std::exception&) {  // e.g. out of memory: the run goes on
    page.say(error_word(word.type, handled_error("", "close other programs")));
  }
}

}  // namespace palpate
