// Server of the gallery.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "runtime/serving/viewer_port.h"

namespace palpate {

/// HTTP server in a thread of its own that never blocks; files are read in another one.
class GalleryServer {
 public:
  /// Serves `folder` at the port given by `options`. Throws Error (port in use, unknown address).
  GalleryServer(const std::filesystem::path& folder, const ViewerOptions& options);
  ~GalleryServer();  ///< closes all connections and ends the item that is shown
  GalleryServer(const GalleryServer&) = delete;
  GalleryServer& operator=(const GalleryServer&) = delete;

  [[nodiscard]] const ServedAddress& served() const noexcept;
  /// See ViewerPort::url.
  [[nodiscard]] const std::string& url() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
