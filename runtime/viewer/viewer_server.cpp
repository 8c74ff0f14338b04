#include "runtime/viewer/viewer_server.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "runtime/scene/drawn_picture.h"
#include "runtime/viewer/page_connection.h"

namespace palpate {
namespace {

namespace asio = boost::asio;

constexpr std::size_t most_waiting = 1024;  // calls of show_ticks not yet taken
constexpr auto tick_period = std::chrono::milliseconds(500);
constexpr int niceness = 5;

}  // namespace

/// The server's thread answers connections, and has each run take what is posted to its pages.
struct ViewerServer::Impl {
  Impl(ViewerPort port, const std::vector<RunToShow>& runs)
      : shown(runs.size()),
        url(port.url(runs.size() > 1 ? "beside" : "")),
        served{.address = port.served(), .runs = {}},
        reception(context, served.address.address, port.release(), [this](asio::ip::tcp::socket socket) {
          return std::make_shared<PageConnection>(std::move(socket), served);
        }) {
    served.address.runs = runs.size();
    for (const RunToShow& one : runs)
      served.runs.push_back(std::make_unique<ShownRun>(one.run, one.is_replay, !served.address.book.empty()));
    tick();
    thread = std::thread([this] { work(); });
  }
  ~Impl() {
    asio::post(context, [this] {
      reception.cut_all();
      context.stop();
    });
    thread.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void tick() {
    timer.expires_after(tick_period);
    timer.async_wait([this](const boost::system::error_code& problem) {
      if (problem) return;
      reception.cut_stalled();
      for (const auto& run : served.runs) run->repeat_state();
      tick();
    });
  }

  void work() {
    // It may have been started by the loop's thread.
    const sched_param ordinary{};
    pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
    pthread_setname_np(pthread_self(), "viewer");
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
    context.run();
  }

  /// `put` puts something into the mail of a run.
  template <class Put>
  void post(std::size_t run, Put&& put) {
    ShownRun& shown_run = *served.runs[run];
    if (shown_run.post(std::forward<Put>(put))) asio::post(context, [&shown_run] { shown_run.take_mail(); });
  }

  std::mutex mutex;                   // guards `shown`
  std::vector<PictureDrawing> shown;  // one per run
  std::string url;
  asio::io_context context{1};
  asio::steady_timer timer{context};
  PageConnection::Served served;
  Reception reception;
  std::thread thread;
};

ViewerServer::ViewerServer(ViewerPort port, const std::vector<RunToShow>& runs)
    : impl_(std::make_unique<Impl>(std::move(port), runs)) {}

ViewerServer::~ViewerServer() = default;

const std::string& ViewerServer::url() const noexcept {
  return impl_->url;
}

void ViewerServer::show_scene(std::shared_ptr<const Scene> scene, std::size_t run) {
  const std::lock_guard lock(impl_->mutex);
  impl_->shown[run].set_scene(scene);
  impl_->post(run, [&](Mail& mail) {
    mail.scene = std::move(scene);
    mail.picture.reset();
    mail.ticks.clear();
  });
}

void ViewerServer::show_picture(SurfacePicture picture, const Body* body, std::size_t run) {
  const std::lock_guard lock(impl_->mutex);
  std::optional<DrawnPicture> drawn = impl_->shown[run].draw(std::move(picture), body);
  if (drawn) impl_->post(run, [&](Mail& mail) { mail.picture = std::move(drawn); });
}

void ViewerServer::show_ticks(std::span<const TickNote> ticks, std::int64_t stride, std::size_t run) {
  if (ticks.empty()) return;
  Mail::Ticks copy{{ticks.begin(), ticks.end()}, stride};
  impl_->post(run, [&](Mail& mail) {
    mail.ticks.push_back(std::move(copy));
    if (mail.ticks.size() > most_waiting) mail.ticks.pop_front();
  });
}

void ViewerServer::show_state(const std::string& json, std::size_t run) {
  StateWord state(json);
  impl_->post(run, [&](Mail& mail) {
    if (!state.times().is_null()) mail.times = state.times();
    mail.state = std::move(state);
  });
}

}  // namespace palpate
