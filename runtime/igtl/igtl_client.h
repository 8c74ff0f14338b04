// Connection to an OpenIGTLink client.
#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "runtime/igtl/igtl_broadcast.h"

namespace palpate {

/// Sends the latest content whenever the previous message is out: a slow client misses pictures. Input from
/// the client is read and discarded, a little at a time. For the server's thread.
class IgtlClient : public std::enable_shared_from_this<IgtlClient> {
 public:
  using Clock = IgtlBroadcast::Clock;

  /// `broadcast` must outlive this.
  IgtlClient(boost::asio::ip::tcp::socket socket, IgtlBroadcast& broadcast);

  /// Sends new content unless a message is in progress.
  void send_news();
  /// Discards some input of the client. Call it periodically: its rate bounds the amount.
  void read_some();
  /// Measures the progress of the data. Call it periodically, and before `is_lost` and `lag`: progress while
  /// this server did not run is seen only here.
  void look(Clock::time_point now);
  /// True if it has closed the connection, or received less than 16 kB/s for five seconds with data pending.
  [[nodiscard]] bool is_lost() const noexcept { return is_gone_; }
  /// Minimum time for which data passed to the system has been in transit.
  [[nodiscard]] Clock::duration lag(Clock::time_point now) const noexcept { return now - way_.since; }
  /// Address of the client.
  [[nodiscard]] const boost::asio::ip::address& address() const noexcept { return address_; }
  /// True if it has been sent all content.
  [[nodiscard]] bool is_served() const;
  /// Closes the connection; no callback follows.
  void cut();

 private:
  void take_sent(const boost::system::error_code& problem);

  boost::asio::ip::tcp::socket socket_;
  boost::asio::ip::address address_;
  IgtlBroadcast& broadcast_;
  std::int64_t pictures_ = 0;  // sent pictures, as counted by the broadcast
  std::int64_t surfaces_ = 0;
  std::array<IgtlBroadcast::Bytes, 2> sending_;  // null: none
  bool is_sending_ = false;
  bool is_reading_ = false;
  bool is_gone_ = false;
  // Bytes for the client: sent or being sent, and passed to the system as far as known.
  std::int64_t begun_ = 0, handed_ = 0;
  struct Place {
    std::int64_t bytes = 0;
    Clock::time_point since;
  };
  Place way_;   // bytes to be received next, and since when the system has had them
  Place pace_;  // progress when its rate was last checked, or the time of reaching it
  std::array<char, 4096> said_{};
};

}  // namespace palpate
