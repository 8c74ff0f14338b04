#include "runtime/viewer/page_server.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "runtime/viewer/page_connection.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::ptrdiff_t most_strangers = 32;  // connections that have not shown the token
constexpr std::ptrdiff_t most_admitted = 32;   // and that have
constexpr auto tick_period = std::chrono::milliseconds(500);
constexpr int niceness = 5;

tcp protocol_of(const std::string& address) {
  return asio::ip::make_address(address).is_v6() ? tcp::v6() : tcp::v4();
}

}  // namespace

PageServer::PageServer(ViewerPort port, const std::vector<RunToShow>& runs)
    : served_(port.served()),
      url_(port.url(runs.size() > 1 ? "beside" : "")),
      acceptor_(context_, protocol_of(served_.address), port.release()),
      timer_(context_),
      retry_(context_) {
  served_.runs = runs.size();
  for (const RunToShow& shown : runs)
    runs_.push_back(std::make_unique<ShownRun>(shown.run, shown.is_replay, !served_.book.empty()));
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
    for (const auto& run : runs_) run->repeat_state();
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
  for (const auto& run : runs_) run->take_mail();
}

void PageServer::leave(PageConnection& page) {
  if (page.run() != nullptr) page.run()->leave(page);
  std::erase(connections_, page.shared_from_this());
}

}  // namespace palpate
