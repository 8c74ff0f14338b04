#include "runtime/gallery/gallery_server.h"

#include <boost/asio/post.hpp>
#include <chrono>
#include <memory>
#include <utility>

#include "runtime/gallery/gallery_connection.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr auto retry_time = std::chrono::milliseconds(500);

tcp protocol_of(const std::string& address) {
  return asio::ip::make_address(address).is_v6() ? tcp::v6() : tcp::v4();
}

}  // namespace

GalleryServer::GalleryServer(const std::filesystem::path& folder, const ViewerOptions& options)
    : GalleryServer(ViewerPort(options), folder, options) {}

GalleryServer::GalleryServer(ViewerPort port, const std::filesystem::path& folder,
                             const ViewerOptions& options)
    : served_(port.served()),
      url_(port.url("gallery")),
      answers_(folder, options),
      acceptor_(context_, protocol_of(served_.address), port.release()),
      retry_(context_) {
  accept();
  thread_ = std::thread([this] { context_.run(); });
}

GalleryServer::~GalleryServer() {
  context_.stop();
  thread_.join();
}

void GalleryServer::accept() {
  acceptor_.async_accept([this](const error_code& problem, tcp::socket socket) {
    if (problem) {  // no file is left for a connection: later there may be
      retry_.expires_after(retry_time);
      retry_.async_wait([this](const error_code&) { accept(); });
      return;
    }
    std::make_shared<GalleryConnection>(std::move(socket), answers_, served_)->start();
    accept();
  });
}

}  // namespace palpate
