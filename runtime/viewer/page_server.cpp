#include "runtime/viewer/page_server.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <utility>

namespace palpate {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr auto tick_period = std::chrono::milliseconds(500);
constexpr int niceness = 5;

}  // namespace

PageServer::PageServer(ViewerPort port, const std::vector<RunToShow>& runs)
    : served_(port.served()),
      url_(port.url(runs.size() > 1 ? "beside" : "")),
      timer_(context_),
      reception_(context_, served_.address, port.release(), [this](asio::ip::tcp::socket socket) {
        return std::make_shared<PageConnection>(std::move(socket), *this);
      }) {
  served_.runs = runs.size();
  for (const RunToShow& shown : runs)
    runs_.push_back(std::make_unique<ShownRun>(shown.run, shown.is_replay, !served_.book.empty()));
  tick();
  thread_ = std::thread([this] { work(); });
}

PageServer::~PageServer() {
  asio::post(context_, [this] { stop(); });
  thread_.join();
}

void PageServer::tick() {
  timer_.expires_after(tick_period);
  timer_.async_wait([this](const error_code& problem) {
    if (problem) return;
    reception_.cut_stalled();
    for (const auto& run : runs_) run->repeat_state();
    tick();
  });
}

void PageServer::work() {
  // It may have been started by the loop's thread.
  const sched_param ordinary{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  pthread_setname_np(pthread_self(), "viewer");
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  context_.run();
}

void PageServer::stop() {
  reception_.cut_all();
  context_.stop();
}

void PageServer::take_mail() {
  for (const auto& run : runs_) run->take_mail();
}

void PageServer::leave(PageConnection& page) {
  if (page.run() != nullptr) page.run()->leave(page);
  reception_.leave(page);
}

}  // namespace palpate
