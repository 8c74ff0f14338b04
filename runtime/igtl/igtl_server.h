// Server for OpenIGTLink clients.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/igtl/watched_picture.h"
#include "runtime/serving/listening_socket.h"

namespace palpate {

/// Largest number of connected clients.
constexpr std::size_t most_igtl_clients = 8;

class IgtlClient;

/// Sends surface, tool and force of the newest picture to all clients. For one more than `most_igtl_clients`
/// the newest of the address with the most connections, the new one counted, gives way to it: where each has
/// only one, the new one is turned away. Asks nothing and obeys nothing. For the thread of the context.
class IgtlServer {
 public:
  /// Serves who waits at the socket and who comes later. `context` must live as long.
  IgtlServer(boost::asio::io_context& context, ListeningSocket socket);
  ~IgtlServer();
  IgtlServer(const IgtlServer&) = delete;
  IgtlServer& operator=(const IgtlServer&) = delete;

  void show(const WatchedPicture& picture);
  /// Stops the context once all clients have taken the last picture, after half a second at the latest.
  void finish();

  /// Number of pictures shown.
  [[nodiscard]] std::int64_t pictures() const noexcept { return pictures_; }
  /// The last one as messages, which are made when the first client wants them.
  [[nodiscard]] const std::shared_ptr<const std::string>& message();

 private:
  void accept();
  void tick();
  void make_room();

  boost::asio::io_context& context_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer timer_;
  WatchedPicture picture_;
  std::int64_t pictures_ = 0;
  std::shared_ptr<const std::string> message_;
  std::vector<std::shared_ptr<IgtlClient>> clients_;
  bool accept_failed_ = false;
  std::optional<std::chrono::steady_clock::time_point> end_;  // at the latest
};

}  // namespace palpate
