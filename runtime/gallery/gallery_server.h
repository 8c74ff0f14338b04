// Serves the gallery.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <filesystem>
#include <string>
#include <thread>

#include "runtime/gallery/gallery_answers.h"
#include "runtime/serving/viewer_port.h"

namespace palpate {

/// HTTP in a thread of its own.
class GalleryServer {
 public:
  /// Serves `folder` at the port that `options` ask for. Throws Error (port in use, address unknown).
  GalleryServer(const std::filesystem::path& folder, const ViewerOptions& options);
  ~GalleryServer();  ///< closes all connections, and ends what is shown
  GalleryServer(const GalleryServer&) = delete;
  GalleryServer& operator=(const GalleryServer&) = delete;

  [[nodiscard]] const std::string& url() const noexcept { return url_; }

 private:
  GalleryServer(ViewerPort port, const std::filesystem::path& folder, const ViewerOptions& options);
  void accept();

  ServedAddress served_;
  std::string url_;
  GalleryAnswers answers_;
  boost::asio::io_context context_{1};
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  std::thread thread_;
};

}  // namespace palpate
