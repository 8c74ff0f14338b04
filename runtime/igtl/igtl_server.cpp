#include "runtime/igtl/igtl_server.h"

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <iterator>
#include <mutex>
#include <optional>
#include <ranges>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/igtl/igtl_broadcast.h"
#include "runtime/igtl/igtl_client.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = IgtlBroadcast::Clock;

constexpr auto tick_period = std::chrono::milliseconds(20);
constexpr auto long_lag = std::chrono::milliseconds(500);  // lag at which a client gives way to a new one
constexpr auto farewell = std::chrono::milliseconds(500);
constexpr int niceness = 5;

tcp protocol_of(const ListenAddress& address) {
  return asio::ip::make_address(address.address).is_v6() ? tcp::v6() : tcp::v4();
}

}  // namespace

struct IgtlServer::Impl {
  explicit Impl(ListeningSocket socket)
      : acceptor(context, protocol_of(socket.address()), socket.release()), timer(context) {
    accept();
    tick();
    thread = std::thread([this] { work(); });
  }

  void accept();
  void tick();
  void work();
  void take_mail();
  void drop_lost(Clock::time_point now);
  void make_room(Clock::time_point now);
  [[nodiscard]] bool is_over(Clock::time_point now) const;

  // Written by any thread.
  std::mutex mutex;
  PictureDrawing drawing;
  std::optional<DrawnPicture> mail;

  // Used by the thread alone.
  asio::io_context context{1};
  tcp::acceptor acceptor;
  asio::steady_timer timer;
  IgtlBroadcast broadcast;
  std::vector<std::shared_ptr<IgtlClient>> clients;
  bool accept_failed = false;
  std::optional<Clock::time_point> end;  // latest time to end, once requested
  std::thread thread;
};

void IgtlServer::Impl::accept() {
  acceptor.async_accept([this](const error_code& problem, tcp::socket socket) {
    accept_failed = problem.failed();  // out of file descriptors: retry at the next tick
    if (problem) return;
    const Clock::time_point now = Clock::now();
    drop_lost(now);  // the tick may be late
    clients.push_back(std::make_shared<IgtlClient>(std::move(socket), broadcast));
    if (clients.size() > most_igtl_clients) make_room(now);
    clients.back()->send_news();
    accept();
  });
}

/// Reads from clients, removes lost ones, and sends deferred content.
void IgtlServer::Impl::tick() {
  timer.expires_after(tick_period);
  timer.async_wait([this](const error_code&) {
    const Clock::time_point now = Clock::now();
    broadcast.catch_up(now);
    drop_lost(now);
    for (const auto& client : clients) {
      client->read_some();
      client->send_news();
    }
    if (is_over(now)) {
      for (const auto& client : clients) client->cut();
      context.stop();
      return;
    }
    if (std::exchange(accept_failed, false)) accept();
    tick();
  });
}

void IgtlServer::Impl::drop_lost(Clock::time_point now) {
  std::erase_if(clients, [now](const auto& client) {
    client->look(now);
    if (!client->is_lost()) return false;
    client->cut();
    return true;
  });
}

/// Closes the connection of the slowest client. If none is slow, closes the newest but one of the address
/// with the most connections: one address cannot keep the others out, and clients connected for long stay.
void IgtlServer::Impl::make_room(Clock::time_point now) {
  auto out = std::ranges::max_element(clients, {}, [now](const auto& client) { return client->lag(now); });
  if ((*out)->lag(now) < long_lag) {
    const auto places = [this](const auto& client) {
      return std::ranges::count(clients, client->address(), &IgtlClient::address);
    };
    const auto newest_first = std::views::reverse(clients);
    const auto& most =
        (*std::ranges::max_element(newest_first, {}, places))->address();  // in a tie, that of the last one
    const auto newest =
        std::ranges::find(newest_first.begin() + 1, newest_first.end(), most, &IgtlClient::address);
    out = newest == newest_first.end() ? std::prev(clients.end()) : std::prev(newest.base());
  }
  (*out)->cut();
  clients.erase(out);
}

bool IgtlServer::Impl::is_over(Clock::time_point now) const {
  return end && (now >= *end || std::ranges::all_of(clients, &IgtlClient::is_served));
}

void IgtlServer::Impl::work() {
  // It may have been started by the loop's thread.
  const sched_param ordinary{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  pthread_setname_np(pthread_self(), "igtl");
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  context.run();
}

void IgtlServer::Impl::take_mail() {
  std::optional<DrawnPicture> picture;
  {
    const std::lock_guard lock(mutex);
    picture = std::exchange(mail, std::nullopt);
  }
  if (!picture) return;
  broadcast.set_picture(std::move(*picture), Clock::now());
  for (const auto& client : clients) client->send_news();
}

IgtlServer::IgtlServer(ListeningSocket socket) : impl_(std::make_unique<Impl>(std::move(socket))) {}

IgtlServer::~IgtlServer() {
  asio::post(impl_->context, [impl = impl_.get()] {
    impl->broadcast.catch_up();
    impl->end = Clock::now() + farewell;
  });
  impl_->thread.join();
}

void IgtlServer::show_scene(std::shared_ptr<const Scene> scene) {
  const std::lock_guard lock(impl_->mutex);
  impl_->drawing.set_scene(std::move(scene));
}

void IgtlServer::show_picture(SurfacePicture picture, const Body& body) {
  {
    const std::lock_guard lock(impl_->mutex);
    std::optional<DrawnPicture> drawn = impl_->drawing.draw(std::move(picture), &body);
    if (!drawn) return;
    impl_->mail = std::move(drawn);
  }
  asio::post(impl_->context, [impl = impl_.get()] { impl->take_mail(); });
}

}  // namespace palpate
