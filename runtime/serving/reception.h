// Connections of a page server.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace palpate {

/// Connection accepted by a Reception.
class Received {
 public:
  Received() = default;
  virtual ~Received() = default;
  Received(const Received&) = delete;
  Received& operator=(const Received&) = delete;

  virtual void start() = 0;
  /// Closes it without a message.
  virtual void cut() = 0;
  /// True if the client does not read the data sent to it.
  [[nodiscard]] virtual bool is_stalled() const { return false; }
  /// True if it has shown the token and there was capacity for it.
  [[nodiscard]] bool is_admitted() const noexcept { return is_admitted_; }

 protected:
  bool is_admitted_ = false;
};

/// Accepts connections and bounds their number. Few may be without the token, and they give way: at the limit
/// the oldest of them is closed. A client without the token therefore cannot keep out one with it. Clients
/// with the token belong to this user and get an answer if there are too many. For use by one thread.
class Reception {
 public:
  using Receive = std::function<std::shared_ptr<Received>(boost::asio::ip::tcp::socket)>;

  /// Accepts on a listening socket of `address`, which it owns from now on. `context` must outlive this.
  Reception(boost::asio::io_context& context, const std::string& address, int socket, Receive receive);

  /// True if another connection with the token may be accepted.
  [[nodiscard]] bool has_room() const;
  /// Removes a closed connection.
  void leave(const Received& connection);
  void cut_stalled();
  void cut_all();

 private:
  void accept();
  void make_room();
  void cut(Received& connection);

  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  Receive receive_;
  std::vector<std::shared_ptr<Received>> connections_;  // in order of arrival
};

}  // namespace palpate
