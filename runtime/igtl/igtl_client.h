// A connection to an OpenIGTLink client.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "runtime/igtl/igtl_broadcast.h"

namespace palpate {

/// Sends what is newest whenever what was sent before is gone: a client that is slow misses pictures. What
/// the client says is read and thrown away, a little at a time. For the server's thread.
class IgtlClient : public std::enable_shared_from_this<IgtlClient> {
 public:
  using Clock = IgtlBroadcast::Clock;

  /// `broadcast` must live as long.
  IgtlClient(boost::asio::ip::tcp::socket socket, IgtlBroadcast& broadcast);

  /// Sends what is new, unless something is on its way.
  void send_news();
  /// Throws away some of what the client has said. To be called again and again: how often bounds how much.
  void read_some();
  /// It has closed the connection, or has taken nothing for seconds.
  [[nodiscard]] bool is_lost(Clock::time_point now) const;
  /// It has been sent all there is.
  [[nodiscard]] bool is_served() const;
  /// No call comes back to it afterwards.
  void cut();

 private:
  void take_sent(const boost::system::error_code& problem);

  boost::asio::ip::tcp::socket socket_;
  IgtlBroadcast& broadcast_;
  std::int64_t pictures_ = 0;  // sent, of those of the broadcast
  std::int64_t surfaces_ = 0;
  std::array<IgtlBroadcast::Bytes, 2> sending_;  // null: nothing
  bool is_sending_ = false;
  bool is_reading_ = false;
  bool is_gone_ = false;
  Clock::time_point progress_;  // when it took something last
  std::array<char, 4096> said_{};
};

}  // namespace palpate
