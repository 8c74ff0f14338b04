#include "runtime/gallery/gallery_server.h"

#include <boost/asio/post.hpp>
#include <memory>
#include <utility>

namespace palpate {

namespace asio = boost::asio;

GalleryServer::GalleryServer(const std::filesystem::path& folder, const ViewerOptions& options)
    : GalleryServer(ViewerPort(options), folder, options) {}

GalleryServer::GalleryServer(ViewerPort port, const std::filesystem::path& folder,
                             const ViewerOptions& options)
    : served_(port.served()),
      url_(port.url("gallery")),
      answers_(folder, options),
      reception_(context_, served_.address, port.release(), [this](asio::ip::tcp::socket socket) {
        return std::make_shared<GalleryConnection>(std::move(socket), *this);
      }) {
  thread_ = std::thread([this] { context_.run(); });
}

GalleryServer::~GalleryServer() {
  context_.stop();
  thread_.join();
  looker_.stop();
  looker_.join();
}

void GalleryServer::look_then(std::function<Response()> look, std::function<void(Response)> answer) {
  asio::post(looker_, [this, look = std::move(look), answer = std::move(answer)] {
    auto seen = std::make_shared<Response>(look());
    asio::post(context_, [answer, seen] { answer(std::move(*seen)); });
  });
}

}  // namespace palpate
