// The connections of a server of pages.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace palpate {

/// A connection that a Reception has taken in.
class Received {
 public:
  Received() = default;
  virtual ~Received() = default;
  Received(const Received&) = delete;
  Received& operator=(const Received&) = delete;

  virtual void start() = 0;
  /// Closes it, without a word.
  virtual void cut() = 0;
  /// It does not read what it is sent.
  [[nodiscard]] virtual bool is_stalled() const { return false; }
  /// It has shown the token, and there is room for it.
  [[nodiscard]] bool is_admitted() const noexcept { return is_admitted_; }

 protected:
  bool is_admitted_ = false;
};

/// Accepts connections and bounds their number. Those that have not shown the token are few, and give way:
/// when there is no room for another one, the oldest of them is cut. So nobody without the token keeps out
/// who has it, and all who have it are this user's: they are told when there are too many of them. For one
/// thread.
class Reception {
 public:
  using Receive = std::function<std::shared_ptr<Received>(boost::asio::ip::tcp::socket)>;

  /// Accepts at a listening socket of `address`, which is its own from now on. `context` must live as long.
  Reception(boost::asio::io_context& context, const std::string& address, int socket, Receive receive);

  /// Whether another connection that has shown the token may be answered.
  [[nodiscard]] bool has_room() const;
  /// It is gone.
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
  std::vector<std::shared_ptr<Received>> connections_;  // as they came
};

}  // namespace palpate
