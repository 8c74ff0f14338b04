// The viewer's thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/viewer/http_answers.h"
#include "runtime/viewer/shown_run.h"
#include "runtime/viewer/viewer_server.h"

namespace palpate {

class PageConnection;

/// Accepts connections, knows all of them, and has each run take what is posted to its pages.
///
/// Connections that have not shown the token are few, and give way: when there is no room for another one,
/// the oldest of them is cut. So nobody without the token keeps out who has it, and all who have it are this
/// user's: they are told when there are too many of them.
class PageServer {
 public:
  /// As ViewerServer.
  PageServer(ViewerPort port, const std::vector<RunToShow>& runs);
  ~PageServer();  ///< closes all connections
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  [[nodiscard]] const std::string& url() const noexcept { return url_; }

  /// `put` puts something into the mail of a run, by any thread.
  template <class Put>
  void post(std::size_t run, Put&& put) {
    if (runs_[run]->post(std::forward<Put>(put))) boost::asio::post(context_, [this] { take_mail(); });
  }

  // What follows is for connections, on the thread.
  [[nodiscard]] const ServedAddress& served() const noexcept { return served_; }
  [[nodiscard]] ShownRun& run(std::size_t number) { return *runs_[number]; }
  /// Whether another connection that has shown the token may be answered.
  [[nodiscard]] bool has_room() const;
  /// It is gone, and its control with it.
  void leave(PageConnection& page);

 private:
  void accept();
  void make_room();
  void tick();
  void work();
  void stop();
  void cut(PageConnection& page);
  void take_mail();

  ServedAddress served_;
  std::string url_;
  boost::asio::io_context context_{1};
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer timer_;
  boost::asio::steady_timer retry_;
  std::vector<std::unique_ptr<ShownRun>> runs_;
  std::vector<std::shared_ptr<PageConnection>> connections_;  // as they came
  std::thread thread_;
};

}  // namespace palpate
