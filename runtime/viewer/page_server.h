// The viewer's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/viewer/broadcast.h"
#include "runtime/viewer/http_answers.h"
#include "runtime/viewer/mailbox.h"
#include "runtime/viewer/page_word.h"
#include "runtime/viewer/viewer_server.h"

namespace palpate {

class PageConnection;

/// Accepts connections, knows all of them and which page controls, and takes what is posted to the pages.
///
/// Connections that have not shown the token are few, and give way: when there is no room for another one,
/// the oldest of them is cut. So nobody without the token keeps out who has it, and all who have it are this
/// user's: they are told when there are too many of them.
class PageServer {
 public:
  /// As ViewerServer.
  PageServer(ViewerPort port, ViewedRun& run, bool is_replay);
  ~PageServer();  ///< closes all connections
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  [[nodiscard]] const std::string& url() const noexcept { return url_; }

  /// `put` puts something into the mail, by any thread.
  template <class Put>
  void post(Put&& put) {
    if (mailbox_.post(std::forward<Put>(put))) boost::asio::post(context_, [this] { take_mail(); });
  }

  // What follows is for connections, on the thread.
  [[nodiscard]] const ServedAddress& served() const noexcept { return served_; }
  [[nodiscard]] bool is_replay() const noexcept { return is_replay_; }
  [[nodiscard]] Broadcast& broadcast() noexcept { return broadcast_; }
  [[nodiscard]] PageRole role(const PageConnection& page) const;
  /// Whether another connection that has shown the token may be answered.
  [[nodiscard]] bool has_room() const;
  /// It is a socket now: the only one of all has control.
  void join(PageConnection& page);
  /// It is gone, and its control with it.
  void leave(PageConnection& page);
  /// What the controller wants is done, others are told why not.
  void obey(PageConnection& page, const PageWord& word);

 private:
  void accept();
  void make_room();
  void tick();
  void work();
  void stop();
  void cut(PageConnection& page);
  void take_mail();
  void show_state_anew();
  void show_all();
  void hand_over(PageConnection& page, bool take);
  void release();
  void show_alone(PageConnection& page, std::int64_t frame);

  ViewedRun& run_;
  bool is_replay_;
  ServedAddress served_;
  std::string url_;
  boost::asio::io_context context_{1};
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer retry_;
  Broadcast broadcast_;
  std::vector<std::shared_ptr<PageConnection>> connections_;  // as they came
  std::set<PageConnection*> open_;                            // those that are sockets
  PageConnection* controller_ = nullptr;
  std::uint64_t joined_ = 0;
  Mailbox mailbox_;
  std::thread thread_;
};

}  // namespace palpate
