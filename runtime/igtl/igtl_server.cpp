#include "runtime/igtl/igtl_server.h"

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <cstdint>
#include <utility>

#include "runtime/igtl/igtl_messages.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;

constexpr auto tick_period = std::chrono::milliseconds(20);
constexpr int pace_ticks = 250;                // 5 s
constexpr std::size_t least_in_them = 80'000;  // [bytes]
constexpr auto farewell = std::chrono::milliseconds(500);
constexpr int send_room = 256 << 10;              // data waiting in it arrives late [bytes]
constexpr std::size_t most_at_once = 64U << 10U;  // passed to the system before progress is measured [bytes]

}  // namespace

/// Sends the newest picture whenever the one before is gone: a client that is slow misses pictures. What
/// the client says is read and thrown away.
class IgtlClient : public std::enable_shared_from_this<IgtlClient> {
 public:
  /// `server` must outlive this.
  IgtlClient(tcp::socket socket, IgtlServer& server) : socket_(std::move(socket)), server_(server) {
    error_code ignored;  // not essential
    address_ = socket_.remote_endpoint(ignored).address();
    socket_.set_option(tcp::no_delay(true), ignored);
    socket_.set_option(asio::socket_base::send_buffer_size(send_room), ignored);
  }

  void send_news() {
    if (is_sending_ || is_lost_ || is_served()) return;
    sending_ = server_.message();
    pictures_ = server_.pictures();
    is_sending_ = true;
    asio::async_write(
        socket_, asio::buffer(*sending_),
        [self = shared_from_this(), before = handed_](const error_code& problem, std::size_t handed) {
          self->handed_ = before + handed;
          return problem ? 0 : most_at_once;
        },
        [self = shared_from_this()](const error_code& problem, std::size_t) {
          self->is_sending_ = false;
          self->is_lost_ |= problem.failed();
          self->send_news();
        });
  }

  void read() {
    socket_.async_read_some(asio::buffer(said_),
                            [self = shared_from_this()](const error_code& problem, std::size_t) {
                              self->is_lost_ |= problem.failed();
                              if (!self->is_lost_) self->read();
                            });
  }

  /// Counts a tick of the server, in whose number time is in which the server itself did not run.
  void count_tick() {
    if (is_sending_ && ++late_ticks_ < pace_ticks) return;
    if (is_sending_ && handed_ - paced_ < least_in_them) is_lost_ = true;
    late_ticks_ = 0;
    paced_ = handed_;
  }

  /// True if it has closed the connection, or received less than 16 kB/s for five seconds with data pending.
  [[nodiscard]] bool is_lost() const noexcept { return is_lost_; }
  [[nodiscard]] const asio::ip::address& address() const noexcept { return address_; }
  /// True if it has been sent all content.
  [[nodiscard]] bool is_served() const { return !is_sending_ && pictures_ == server_.pictures(); }
  void cut() {
    is_lost_ = true;
    error_code ignored;
    socket_.close(ignored);
  }

 private:
  tcp::socket socket_;
  asio::ip::address address_;
  IgtlServer& server_;
  std::int64_t pictures_ = 0;  // of the server, when it was sent one last
  std::shared_ptr<const std::string> sending_;
  bool is_sending_ = false;
  bool is_lost_ = false;
  std::size_t handed_ = 0;  // bytes that the system took
  std::size_t paced_ = 0;   // that it had when the pace was measured last
  int late_ticks_ = 0;      // since then
  std::array<char, 4096> said_{};
};

IgtlServer::IgtlServer(asio::io_context& context, ListeningSocket socket)
    : context_(context),
      acceptor_(context, asio::ip::make_address(socket.address().address).is_v6() ? tcp::v6() : tcp::v4(),
                socket.release()),
      timer_(context) {
  accept();
  tick();
}

IgtlServer::~IgtlServer() = default;

void IgtlServer::accept() {
  acceptor_.async_accept([this](const error_code& problem, tcp::socket socket) {
    accept_failed_ = problem.failed();  // out of file descriptors: retry at the next tick
    if (problem) return;
    clients_.push_back(std::make_shared<IgtlClient>(std::move(socket), *this));
    clients_.back()->read();
    if (clients_.size() > most_igtl_clients) make_room();
    for (const auto& client : clients_) client->send_news();
    accept();
  });
}

void IgtlServer::tick() {
  timer_.expires_after(tick_period);
  timer_.async_wait([this](const error_code&) {
    const Clock::time_point now = Clock::now();
    std::erase_if(clients_, [](const auto& client) {
      client->count_tick();
      if (client->is_lost()) client->cut();
      return client->is_lost();
    });
    if (end_ && (now >= *end_ || std::ranges::all_of(clients_, &IgtlClient::is_served)))
      return context_.stop();
    if (std::exchange(accept_failed_, false)) accept();
    tick();
  });
}

/// Cuts the newest client before the last of the address that has most, so that no address keeps the others
/// out, and clients that have watched long stay.
void IgtlServer::make_room() {
  const auto clients_of = [this](const asio::ip::address& address) {
    return std::ranges::count(clients_, address, &IgtlClient::address);
  };
  const auto most = std::max_element(  // newest first; a tie: the newest
      clients_.rbegin(), clients_.rend(),
      [&](const auto& a, const auto& b) { return clients_of(a->address()) < clients_of(b->address()); });
  const auto out = std::find_if(clients_.rbegin() + 1, clients_.rend(),
                                [&](const auto& client) { return client->address() == (*most)->address(); });
  const auto gone = out == clients_.rend() ? std::prev(clients_.end()) : std::prev(out.base());
  (*gone)->cut();
  clients_.erase(gone);
}

void IgtlServer::show(const WatchedPicture& picture) {
  picture_ = picture;
  ++pictures_;
  message_.reset();
  for (const auto& client : clients_) client->send_news();
}

const std::shared_ptr<const std::string>& IgtlServer::message() {
  if (!message_)
    message_ = std::make_shared<const std::string>(igtl_surface(picture_) + igtl_tool(picture_) +
                                                   igtl_force(picture_));
  return message_;
}

void IgtlServer::finish() {
  end_ = Clock::now() + farewell;
}

}  // namespace palpate
