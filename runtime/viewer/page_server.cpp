#include "runtime/viewer/page_server.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <variant>

#include "meshes/error.h"
#include "runtime/viewer/admission.h"
#include "runtime/viewer/page_connection.h"
#include "runtime/viewer/run_words.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t most_connections = 32;
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
};

std::string seen_from_here(const std::string& address) {
  if (!is_any_address(address)) return url_host(address);
  return address == "::" ? "[::1]" : "127.0.0.1";
}

}  // namespace

PageServer::PageServer(const ViewerOptions& options, ViewedRun& run)
    : run_(run), is_replay_(options.replay), acceptor_(context_), timer_(context_), retry_(context_) {
  listen(options);
  accept();
  tick();
  thread_ = std::thread([this] { work(); });
}

PageServer::~PageServer() {
  asio::post(context_, [this] { stop(); });
  thread_.join();
}

void PageServer::listen(const ViewerOptions& options) {
  error_code problem;
  const asio::ip::address address = asio::ip::make_address(options.address, problem);
  if (problem) {
    throw Error("'" + options.address + "' is not an IP address", "viewer",
                "give one of this machine, such as 127.0.0.1, or 0.0.0.0 for all of them");
  }
  const tcp::endpoint wanted(address, options.port);
  acceptor_.open(wanted.protocol(), problem);
  if (!problem) acceptor_.set_option(asio::socket_base::reuse_address(true), problem);
  if (!problem) acceptor_.bind(wanted, problem);
  if (!problem) acceptor_.listen(asio::socket_base::max_listen_connections, problem);
  if (problem) {
    throw Error(
        "cannot listen: " + problem.message(), fmt::format("{}:{}", url_host(options.address), options.port),
        problem == asio::error::address_in_use ? "choose another port, or end the program that has it"
                                               : "choose an address of this machine and another port");
  }
  served_ = {.address = options.address,
             .port = acceptor_.local_endpoint().port(),
             .token = is_loopback(options.address) ? "" : random_token()};
  url_ = fmt::format("http://{}:{}/{}{}", seen_from_here(served_.address), served_.port,
                     served_.token.empty() ? "" : "?token=", served_.token);
}

void PageServer::accept() {
  acceptor_.async_accept([this](const error_code& problem, tcp::socket socket) {
    if (!acceptor_.is_open()) return;
    if (problem) {  // no file is left for a connection: later there may be
      retry_.expires_after(tick_period);
      retry_.async_wait([this](const error_code&) { accept(); });
      return;
    }
    if (connections_.size() < most_connections) {
      const auto page = std::make_shared<PageConnection>(std::move(socket), *this);
      connections_.insert(page);
      page->start();
    }
    accept();
  });
}

void PageServer::tick() {
  timer_.expires_after(tick_period);
  timer_.async_wait([this](const error_code& problem) {
    if (problem) return;
    const auto connections = connections_;
    for (const auto& page : connections) {
      if (page->is_stalled()) cut(*page);
    }
    show_.repeat_state();
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
  if (mail.scene) show_.set_scene(std::move(mail.scene));
  if (!mail.times.is_null()) show_.set_times(std::move(mail.times));
  if (mail.state) show_.set_state(std::move(*mail.state));
  if (mail.picture) show_.set_picture(std::move(*mail.picture));
  for (const Mail::Ticks& ticks : mail.ticks) show_.add_ticks(ticks.notes, ticks.stride, is_replay_);
  show_all();
}

void PageServer::show_state_anew() {
  show_.touch_state();
  show_all();
}

void PageServer::show_all() {
  const std::set<PageConnection*> pages = open_;
  for (PageConnection* page : pages) page->show();
}

void PageServer::join(PageConnection& page) {
  open_.insert(&page);
  if (open_.size() == 1) controller_ = &page;
  show_.touch_state();
  page.say(hello_word(is_replay_ ? "replay" : "live", ++joined_));
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
  connections_.erase(page.shared_from_this());
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
    show_state_anew();
  } else if (controller_ != &page) {
    page.say(error_word("control", "another page has control", "ask for it when that page has given it up"));
  }
}

void PageServer::obey(PageConnection& page, const PageWord& word) {
  if (const auto* control = std::get_if<ControlWord>(&word)) return hand_over(page, control->take);
  const char* name = name_of(word);
  if (controller_ != &page) {
    page.say(error_word(name, "this page only watches",
                        controller_ == nullptr ? "take control first" : "another page has control"));
    return;
  }
  try {
    std::visit(Ask{run_}, word);
  } catch (const Error& error) {
    page.say(error_word(name, error));
  } catch (const std::exception& error) {  // no memory, say: the run goes on
    page.say(error_word(name, error.what(), ""));
  }
}

}  // namespace palpate
