#include "runtime/viewer/page_server.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <variant>

#include "base/error.h"
#include "runtime/viewer/page_connection.h"
#include "runtime/viewer/run_words.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::ptrdiff_t most_strangers = 32;  // connections that have not shown the token
constexpr std::ptrdiff_t most_admitted = 32;   // and that have
constexpr auto tick_period = std::chrono::milliseconds(500);
constexpr int niceness = 5;

/// What a word asks of the run.
struct Ask {
  ViewedRun& run;
  void operator()(const PointWord& word) const { run.point(word.wanted); }
  void operator()(const PauseWord& word) const { run.pause(word.paused); }
  void operator()(const StepWord&) const { run.step_once(); }
  void operator()(const ResetWord&) const { run.reset(); }
  void operator()(const AcknowledgeWord&) const { run.acknowledge(); }
  void operator()(const ChangeWord& word) const { run.change(word.settings); }
  void operator()(const RecordWord& word) const { run.record(word.on); }
  void operator()(const ControlWord&) const {}  // is between pages
  void operator()(const SeekWord& word) const { run.seek(word.frame); }
  void operator()(const FollowWord&) const {}  // is the page's own
};

tcp protocol_of(const std::string& address) {
  return asio::ip::make_address(address).is_v6() ? tcp::v6() : tcp::v4();
}

}  // namespace

PageServer::PageServer(ViewerPort port, ViewedRun& run, bool is_replay)
    : run_(run),
      is_replay_(is_replay),
      served_(port.served()),
      url_(port.url()),
      acceptor_(context_, protocol_of(served_.address), port.release()),
      timer_(context_),
      retry_(context_) {
  accept();
  tick();
  thread_ = std::thread([this] { work(); });
}

PageServer::~PageServer() {
  asio::post(context_, [this] { stop(); });
  thread_.join();
}

void PageServer::accept() {
  acceptor_.async_accept([this](const error_code& problem, tcp::socket socket) {
    if (!acceptor_.is_open()) return;
    if (problem) {  // no file is left for a connection: later there may be
      retry_.expires_after(tick_period);
      retry_.async_wait([this](const error_code&) { accept(); });
      return;
    }
    make_room();
    connections_.push_back(std::make_shared<PageConnection>(std::move(socket), *this));
    connections_.back()->start();
    accept();
  });
}

/// Else strangers that hold connections would keep all others out.
void PageServer::make_room() {
  const auto is_stranger = [](const auto& page) { return !page->is_admitted(); };
  if (std::count_if(connections_.begin(), connections_.end(), is_stranger) < most_strangers) return;
  const std::shared_ptr<PageConnection> oldest =
      *std::find_if(connections_.begin(), connections_.end(), is_stranger);
  cut(*oldest);
}

bool PageServer::has_room() const {
  return std::count_if(connections_.begin(), connections_.end(),
                       [](const auto& page) { return page->is_admitted(); }) < most_admitted;
}

void PageServer::tick() {
  timer_.expires_after(tick_period);
  timer_.async_wait([this](const error_code& problem) {
    if (problem) return;
    const auto connections = connections_;
    for (const auto& page : connections) {
      if (page->is_stalled()) cut(*page);
    }
    broadcast_.repeat_state();
    show_all();
    tick();
  });
}

void PageServer::work() {
  // Its starter may be the loop's thread.
  const sched_param ordinary{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  pthread_setname_np(pthread_self(), "viewer");
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  context_.run();
}

void PageServer::stop() {
  const auto connections = connections_;
  for (const auto& page : connections) cut(*page);
  context_.stop();
}

void PageServer::cut(PageConnection& page) {
  page.cut();
  leave(page);
}

void PageServer::take_mail() {
  Mail mail = mailbox_.take();
  if (mail.scene) broadcast_.set_scene(std::move(mail.scene));
  if (!mail.times.is_null()) broadcast_.set_times(std::move(mail.times));
  if (mail.state) broadcast_.set_state(std::move(*mail.state));
  if (mail.picture) broadcast_.set_picture(std::move(*mail.picture));
  for (const Mail::Ticks& ticks : mail.ticks) broadcast_.add_ticks(ticks.notes, ticks.stride, is_replay_);
  show_all();
}

void PageServer::show_state_anew() {
  broadcast_.touch_state();
  show_all();
}

void PageServer::show_all() {
  const std::set<PageConnection*> pages = open_;
  for (PageConnection* page : pages) page->send_news();
}

PageRole PageServer::role(const PageConnection& page) const {
  return {controller_ == &page, controller_ != nullptr, open_.size(), page.own_frame()};
}

void PageServer::join(PageConnection& page) {
  open_.insert(&page);
  if (open_.size() == 1) controller_ = &page;
  broadcast_.touch_state();
  page.say(hello_word(is_replay_ ? "replay" : "live", ++joined_, !served_.book.empty()));
  show_all();
}

void PageServer::leave(PageConnection& page) {
  if (open_.erase(&page) > 0) {
    if (controller_ == &page) {
      release();
    } else {
      show_state_anew();
    }
  }
  std::erase(connections_, page.shared_from_this());
}

void PageServer::release() {
  controller_ = nullptr;
  run_.lose_pointer();
  show_state_anew();
}

void PageServer::hand_over(PageConnection& page, bool take) {
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

/// Who only watches a replay still looks at what it likes.
void PageServer::show_alone(PageConnection& page, std::int64_t frame) {
  std::optional<RecordedFrame> recorded = run_.recorded_frame(frame);
  if (recorded && broadcast_.picture()) {
    page.look_alone({broadcast_.picture()->scene, nullptr, std::move(recorded->picture)}, recorded->frame);
  }
}

void PageServer::obey(PageConnection& page, const PageWord& word) {
  if (const auto* control = std::get_if<ControlWord>(&word)) return hand_over(page, control->take);
  if (std::holds_alternative<FollowWord>(word)) return page.follow();
  const char* name = name_of(word);
  const auto* seek = std::get_if<SeekWord>(&word);
  const bool looks_alone = is_replay_ && seek != nullptr && controller_ != &page;
  if (controller_ != &page && !looks_alone) {
    page.say(error_word(
        name, PageError(PageRefusal::control, "this page only watches", "",
                        controller_ == nullptr ? "take control first" : "another page has control")));
    return;
  }
  try {
    if (looks_alone) {
      show_alone(page, seek->frame);
    } else {
      std::visit(Ask{run_}, word);
    }
  } catch (const Error& error) {
    page.say(error_word(name, error));
  } catch (const std::exception& error) {  // no memory, say: the run goes on
    page.say(error_word(name, Error(error.what(), "", "")));
  }
}

}  // namespace palpate
