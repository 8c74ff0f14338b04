// Connection to a viewer.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/serving/reception.h"
#include "runtime/viewer/broadcast.h"
#include "runtime/viewer/http_answers.h"
#include "runtime/viewer/shown_run.h"

namespace palpate {

/// HTTP connection: one request, after which it may become a WebSocket, that is, a page. For the server's
/// thread.
class PageConnection : public Connection, public Page {
 public:
  /// Data that connections are served; must live as long.
  struct Served {
    ServedAddress address;
    std::vector<std::unique_ptr<ShownRun>> runs;
  };

  PageConnection(boost::asio::ip::tcp::socket socket, const Served& served);

  void cut() override;
  void send_news() override;
  void say(std::string text) override;
  void look_alone(DrawnPicture picture, std::int64_t frame) override;
  void follow() override;
  [[nodiscard]] std::optional<std::int64_t> own_frame() const noexcept override;
  [[nodiscard]] bool only_watches() const noexcept override { return only_watches_; }
  /// Run that it asked for; null before it has shown the token.
  [[nodiscard]] ShownRun* run() const noexcept { return run_; }
  [[nodiscard]] bool is_stalled() const override;

 private:
  void answer_request() override;
  void leave() override;
  void open_socket();
  void read();
  void receive(const ErrorCode& problem);
  void close(boost::beast::websocket::close_code code, std::string reason);
  Message next_message();
  Message next_picture();
  Message own_picture();
  void note_picture(const Message& message);
  void wait_for_picture();

  // false: without compression, which nothing turned on
  std::optional<boost::beast::websocket::stream<boost::beast::tcp_stream, false>> socket_;
  const Served& served_;
  ShownRun* run_ = nullptr;  // that it asks for; null before it has shown the token

  bool only_watches_ = false;
  bool is_open_ = false;
  std::deque<std::string> said_;
  std::size_t said_bytes_ = 0;
  Message writing_;
  std::chrono::steady_clock::time_point writing_since_;
  // Content that was sent to the page.
  std::int64_t scenes_ = 0;
  std::int64_t pictures_ = 0;
  std::int64_t states_ = 0;
  std::int64_t ticks_ = 0;
  std::uint32_t patch_ = 0;
  std::shared_ptr<const WireValues> base_;  // values of the last picture; null: none of this scene
  struct Alone {
    DrawnPicture picture;
    std::int64_t frame = 0;
    bool is_sent = false;
  };
  std::optional<Alone> alone_;  // picture that it sees instead of the common one
  bool is_role_sent_ = true;
  boost::asio::steady_timer picture_timer_;
  std::chrono::steady_clock::time_point picture_due_;  // earliest next picture, for the data rate
  bool ticks_first_ = true;                            // next in turn: ticks, otherwise pictures
};

}  // namespace palpate
