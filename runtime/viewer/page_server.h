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

#include "runtime/viewer/http_answers.h"
#include "runtime/viewer/mailbox.h"
#include "runtime/viewer/page_word.h"
#include "runtime/viewer/show.h"
#include "runtime/viewer/viewer_server.h"

namespace palpate {

class PageConnection;

/// Listens, knows all connections and which page controls, and takes what is posted to the pages.
class PageServer {
 public:
  /// As ViewerServer.
  PageServer(const ViewerOptions& options, ViewedRun& run);
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
  [[nodiscard]] Show& show() noexcept { return show_; }
  [[nodiscard]] PageRole role(const PageConnection& page) const {
    return {controller_ == &page, controller_ != nullptr, open_.size()};
  }
  /// It is a socket now: the only one of all has control.
  void join(PageConnection& page);
  /// It is gone, and its control with it.
  void leave(PageConnection& page);
  /// What the controller wants is done, others are told why not.
  void obey(PageConnection& page, const PageWord& word);

 private:
  void listen(const ViewerOptions& options);
  void accept();
  void tick();
  void work();
  void stop();
  void cut(PageConnection& page);
  void take_mail();
  void show_state_anew();
  void show_all();
  void hand_over(PageConnection& page, bool take);
  void release();

  ViewedRun& run_;
  bool is_replay_;
  ServedAddress served_;
  std::string url_;
  boost::asio::io_context context_{1};
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer retry_;
  Show show_;
  std::set<std::shared_ptr<PageConnection>> connections_;
  std::set<PageConnection*> open_;  // those that are sockets
  PageConnection* controller_ = nullptr;
  std::uint64_t joined_ = 0;
  Mailbox mailbox_;
  std::thread thread_;
};

}  // namespace palpate
