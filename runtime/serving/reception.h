// Connections of a page server.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/serving/http_guard.h"

namespace palpate {

class Reception;

/// A connection that a Reception has taken in: reads the header of one request and sends one answer. For the
/// server's thread.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  explicit Connection(boost::asio::ip::tcp::socket socket) : stream_(std::move(socket)) { parser_.emplace(); }
  virtual ~Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Reads the header. `reception` must live as long.
  void start(Reception& reception);
  /// Closes it without a message.
  virtual void cut() { stream_.close(); }
  /// True if the client does not read the data sent to it.
  [[nodiscard]] virtual bool is_stalled() const { return false; }
  /// True if it has shown the token and there was capacity for it.
  [[nodiscard]] bool is_admitted() const noexcept { return is_admitted_; }

 protected:
  using ErrorCode = boost::system::error_code;
  using Parser = boost::beast::http::request_parser<boost::beast::http::empty_body>;

  /// The header has come.
  virtual void answer_request() = 0;
  /// It has not.
  virtual void fail(const ErrorCode& /*problem*/) { leave(); }
  /// The connection is over.
  virtual void leave();

  [[nodiscard]] const Request& request() const { return parser_->get(); }
  [[nodiscard]] Reception& reception() const noexcept { return *reception_; }
  /// Answers, of a HEAD by the header alone, and leaves.
  void respond(Response response);

  boost::beast::tcp_stream stream_;
  boost::beast::flat_buffer buffer_;
  std::optional<Parser> parser_;
  bool is_admitted_ = false;

 private:
  Reception* reception_ = nullptr;
  bool is_head_ = false;
  std::optional<Response> response_;
};

/// Accepts connections and bounds their number. Few may be without the token, and they give way: at the limit
/// the oldest of them is closed. A client without the token therefore cannot keep out one with it. Clients
/// with the token belong to this user and get an answer if there are too many. For use by one thread.
class Reception {
 public:
  using Receive = std::function<std::shared_ptr<Connection>(boost::asio::ip::tcp::socket)>;

  /// Accepts on a listening socket of `address`, which it owns from now on. `context` must outlive this.
  Reception(boost::asio::io_context& context, const std::string& address, int socket, Receive receive);

  /// True if another connection with the token may be accepted.
  [[nodiscard]] bool has_room() const;
  /// Removes a closed connection.
  void leave(const Connection& connection);
  void cut_stalled();
  void cut_all();

 private:
  void accept();
  void make_room();
  void cut(Connection& connection);

  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  Receive receive_;
  std::vector<std::shared_ptr<Connection>> connections_;  // in order of arrival
};

}  // namespace palpate
