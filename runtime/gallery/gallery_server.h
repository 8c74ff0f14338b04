// Server of the gallery.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>

#include "runtime/gallery/gallery_answers.h"
#include "runtime/gallery/gallery_connection.h"
#include "runtime/serving/reception.h"
#include "runtime/serving/viewer_port.h"

namespace palpate {

/// HTTP server in a thread of its own that never blocks; files are read in another one.
class GalleryServer : public GalleryHost {
 public:
  /// Serves `folder` at the port given by `options`. Throws Error (port in use, unknown address).
  GalleryServer(const std::filesystem::path& folder, const ViewerOptions& options);
  ~GalleryServer() override;  ///< closes all connections and ends the item that is shown
  GalleryServer(const GalleryServer&) = delete;
  GalleryServer& operator=(const GalleryServer&) = delete;

  [[nodiscard]] const ServedAddress& served() const noexcept override { return served_; }
  [[nodiscard]] const std::string& url() const noexcept { return url_; }

  [[nodiscard]] GalleryAnswers& answers() noexcept override { return answers_; }
  [[nodiscard]] Reception& reception() noexcept override { return reception_; }
  void look_then(std::function<Response()> look, std::function<void(Response)> answer) override;

 private:
  GalleryServer(ViewerPort port, const std::filesystem::path& folder, const ViewerOptions& options);

  ServedAddress served_;
  std::string url_;
  GalleryAnswers answers_;
  boost::asio::io_context context_{1};
  Reception reception_;
  boost::asio::thread_pool looker_{1};
  std::thread thread_;
};

}  // namespace palpate
