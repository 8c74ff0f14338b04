// Connection of a gallery, for one request.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>

#include "runtime/gallery/gallery_answers.h"
#include "runtime/serving/reception.h"

namespace palpate {

/// Server as its connections see it, on its thread.
class GalleryHost {
 public:
  virtual ~GalleryHost() = default;

  [[nodiscard]] virtual const ServedAddress& served() const noexcept = 0;
  [[nodiscard]] virtual GalleryAnswers& answers() noexcept = 0;
  [[nodiscard]] virtual Reception& reception() noexcept = 0;
  /// Runs `look` in another thread, one file at a time, and answers on this one.
  virtual void look_then(std::function<Response()> look, std::function<void(Response)> answer) = 0;
};

/// Reads one request, has it answered and closes. For the server's thread.
class GalleryConnection : public Received, public std::enable_shared_from_this<GalleryConnection> {
 public:
  /// `server` must outlive this.
  GalleryConnection(boost::asio::ip::tcp::socket socket, GalleryHost& server)
      : stream_(std::move(socket)), server_(server) {}
  ~GalleryConnection() override;  ///< removes a file that was not received completely
  GalleryConnection(const GalleryConnection&) = delete;
  GalleryConnection& operator=(const GalleryConnection&) = delete;

  void start() override;
  void cut() override { stream_.close(); }

 private:
  using ErrorCode = boost::system::error_code;
  using FileParser = boost::beast::http::request_parser<boost::beast::http::file_body>;

  void answer_request();
  void take_file();
  void keep_file(const ErrorCode& problem);
  void respond(Response response);

  boost::beast::tcp_stream stream_;
  GalleryHost& server_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
  std::optional<FileParser> file_;
  std::filesystem::path temporary_;  // file being received; empty: none
  std::optional<Response> response_;
};

}  // namespace palpate
