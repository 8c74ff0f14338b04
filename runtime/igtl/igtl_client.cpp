#include "runtime/igtl/igtl_client.h"

#include <linux/sockios.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <utility>

namespace palpate {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr auto pace_time = std::chrono::seconds(5);
constexpr std::int64_t least_in_that = 80'000;   // [bytes]
constexpr int send_room = 256 << 10;             // data waiting in it arrives late [bytes]
constexpr std::int64_t most_at_once = 64 << 10;  // passed to the system before progress is measured [bytes]

asio::const_buffer buffer_of(const IgtlBroadcast::Bytes& bytes) {
  return bytes ? asio::buffer(*bytes) : asio::const_buffer();
}

/// Bytes that the system still holds because the other machine has not received them.
std::int64_t left_in_system(int socket) {
  int bytes = 0;
  return ::ioctl(socket, SIOCOUTQ, &bytes) == 0 ? bytes : 0;
}

}  // namespace

IgtlClient::IgtlClient(asio::ip::tcp::socket socket, IgtlBroadcast& broadcast)
    : socket_(std::move(socket)), broadcast_(broadcast), way_{0, Clock::now()}, pace_(way_) {
  error_code ignored;  // not essential
  address_ = socket_.remote_endpoint(ignored).address();
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  socket_.set_option(asio::socket_base::send_buffer_size(send_room), ignored);
}

void IgtlClient::send_news() {
  if (is_sending_ || is_gone_ || is_served()) return;
  sending_ = {};
  if (surfaces_ != broadcast_.surfaces()) sending_[0] = broadcast_.surface_message();
  if (pictures_ != broadcast_.pictures()) sending_[1] = broadcast_.hand_message();
  surfaces_ = broadcast_.surfaces();
  pictures_ = broadcast_.pictures();
  is_sending_ = true;
  const std::array<asio::const_buffer, 2> buffers = {buffer_of(sending_[0]), buffer_of(sending_[1])};
  begun_ = handed_ + static_cast<std::int64_t>(asio::buffer_size(buffers));
  asio::async_write(
      socket_, buffers,
      [self = shared_from_this(), before = handed_](const error_code& problem, std::size_t handed) {
        self->handed_ = before + static_cast<std::int64_t>(handed);
        return problem ? 0 : static_cast<std::size_t>(most_at_once);
      },
      [self = shared_from_this()](const error_code& problem, std::size_t) { self->take_sent(problem); });
}

void IgtlClient::take_sent(const error_code& problem) {
  is_sending_ = false;
  if (problem) {
    is_gone_ = true;
  } else {
    send_news();
  }
}

void IgtlClient::read_some() {
  if (is_reading_ || is_gone_) return;
  is_reading_ = true;
  socket_.async_read_some(asio::buffer(said_),
                          [self = shared_from_this()](const error_code& problem, std::size_t) {
                            self->is_reading_ = false;
                            if (problem) self->is_gone_ = true;
                          });
}

void IgtlClient::look(Clock::time_point now) {
  if (is_gone_) return;
  const std::int64_t most = std::min(begun_, handed_ + most_at_once);  // passed to the system
  const std::int64_t taken = most - left_in_system(socket_.native_handle());
  if (taken >= way_.bytes) {
    way_ = {handed_, now};
    pace_ = {taken, now};
  }
  if (now - pace_.since < pace_time) return;
  if (taken - pace_.bytes < least_in_that) is_gone_ = true;
  pace_ = {taken, now};
}

bool IgtlClient::is_served() const {
  return !is_sending_ && pictures_ == broadcast_.pictures() && surfaces_ == broadcast_.surfaces();
}

void IgtlClient::cut() {
  is_gone_ = true;
  error_code ignored;
  socket_.close(ignored);
}

}  // namespace palpate
