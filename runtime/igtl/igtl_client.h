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
  /// Looks how far it has come. To be called again and again, and before `is_lost` and `lag`: what it took
  /// while this server did not run is seen only here.
  void look(Clock::time_point now);
  /// It has closed the connection, or took less than 16 kB/s in five seconds in which there was more for it.
  [[nodiscard]] bool is_lost() const noexcept { return is_gone_; }
  /// How long something that the system was handed for it has been on its way, at least.
  [[nodiscard]] Clock::duration lag(Clock::time_point now) const noexcept { return now - way_.since; }
  /// Where it is.
  [[nodiscard]] const boost::asio::ip::address& address() const noexcept { return address_; }
  /// It has been sent all there is.
  [[nodiscard]] bool is_served() const;
  /// No call comes back to it afterwards.
  void cut();

 private:
  void take_sent(const boost::system::error_code& problem);

  boost::asio::ip::tcp::socket socket_;
  boost::asio::ip::address address_;
  IgtlBroadcast& broadcast_;
  std::int64_t pictures_ = 0;  // sent, of those of the broadcast
  std::int64_t surfaces_ = 0;
  std::array<IgtlBroadcast::Bytes, 2> sending_;  // null: nothing
  bool is_sending_ = false;
  bool is_reading_ = false;
  bool is_gone_ = false;
  // Of all bytes for it: sent or being sent, and handed to the system, as far as that has been told.
  std::int64_t begun_ = 0, handed_ = 0;
  struct Place {
    std::int64_t bytes = 0;
    Clock::time_point since;
  };
  Place way_;   // what it is to take, and since when the system has had that
  Place pace_;  // how far it was when its rate was looked at last, or when it had come so far
  std::array<char, 4096> said_{};
};

}  // namespace palpate
