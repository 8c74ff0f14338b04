// Server thread of the viewer.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "runtime/serving/reception.h"
#include "runtime/serving/viewer_port.h"
#include "runtime/viewer/http_answers.h"
#include "runtime/viewer/page_connection.h"
#include "runtime/viewer/shown_run.h"
#include "runtime/viewer/viewed_run.h"

namespace palpate {

/// Answers connections, and passes posted content to each run.
class PageServer : public PageHost {
 public:
  /// See ViewerServer.
  PageServer(ViewerPort port, const std::vector<RunToShow>& runs);
  ~PageServer() override;  ///< closes all connections
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  [[nodiscard]] const std::string& url() const noexcept { return url_; }

  /// Calls `put` with the mail of a run; for any thread.
  template <class Put>
  void post(std::size_t run, Put&& put) {
    if (runs_[run]->post(std::forward<Put>(put))) boost::asio::post(context_, [this] { take_mail(); });
  }

  [[nodiscard]] const ServedAddress& served() const noexcept override { return served_; }
  [[nodiscard]] ShownRun& run(std::size_t number) override { return *runs_[number]; }
  [[nodiscard]] bool has_room() const override { return reception_.has_room(); }
  void leave(PageConnection& page) override;

 private:
  void tick();
  void work();
  void stop();
  void take_mail();

  ServedAddress served_;
  std::string url_;
  boost::asio::io_context context_{1};
  boost::asio::steady_timer timer_;
  std::vector<std::unique_ptr<ShownRun>> runs_;
  Reception reception_;
  std::thread thread_;
};

}  // namespace palpate
