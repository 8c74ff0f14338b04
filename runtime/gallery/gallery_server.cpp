#include "runtime/gallery/gallery_server.h"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/http/file_body.hpp>
#include <chrono>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include "base/error.h"
#include "base/file_io.h"
#include "runtime/gallery/gallery_answers.h"
#include "runtime/serving/reception.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr auto file_time = std::chrono::hours(1);  // for a file to come

}  // namespace

/// Data that connections and threads share.
struct Gallery {
  ServedAddress served;
  std::string url;
  GalleryAnswers answers;
  asio::io_context context{1};
  asio::thread_pool looker{1};  // one file after the other
};

/// Connection of a gallery, for one request.
class GalleryConnection : public Connection {
 public:
  /// `gallery` must live as long.
  GalleryConnection(tcp::socket socket, Gallery& gallery) : Connection(std::move(socket)), gallery_(gallery) {
    parser_->body_limit(largest_drop);
  }
  /// A file that has not come whole is removed.
  ~GalleryConnection() override {
    if (temporary_.empty()) return;
    file_.reset();
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
  }
  GalleryConnection(const GalleryConnection&) = delete;
  GalleryConnection& operator=(const GalleryConnection&) = delete;

 private:
  void fail(const ErrorCode& problem) override {
    if (problem != http::error::body_limit) return leave();
    respond(guarded(plain(http::status::payload_too_large, "A file that is dropped has at most 8 GiB.")));
  }

  void answer_request() override {
    GalleryAnswers& answers = gallery_.answers;
    if (std::optional<Response> refused = GalleryAnswers::refusal(request(), gallery_.served))
      return respond(std::move(*refused));
    if (GalleryAnswers::wants_page(request()))
      return respond(GalleryAnswers::page(request(), gallery_.served));
    if (!reception().has_room()) return respond(full_house());
    is_admitted_ = true;
    if (GalleryAnswers::wants_scene(request())) return look();
    if (!GalleryAnswers::brings_file(request())) return respond(answers.answer(request(), gallery_.served));
    if (std::optional<Response> refused = GalleryAnswers::drop_refusal(request()))
      return respond(std::move(*refused));
    try {
      take_file();
    } catch (const Error& error) {
      respond(guarded(plain(http::status::insufficient_storage, to_text(error))));
    }
  }

  /// Has the other thread look, and answers on this one.
  void look() {
    asio::post(gallery_.looker, [this, self = shared_from_this()] {
      auto seen = std::make_shared<Response>(gallery_.answers.scene(request()));
      asio::post(gallery_.context, [this, self, seen] { respond(std::move(*seen)); });
    });
  }

  void take_file() {
    static int number = 0;
    temporary_ = gallery_.answers.folder() / fmt::format(".dropped-{}-{}", ::getpid(), ++number);
    check_free_space(temporary_, static_cast<std::int64_t>(parser_->content_length().value_or(0)));
    make_anew(temporary_);
    file_.emplace(std::move(*parser_));
    ErrorCode problem;
    file_->get().body().open(temporary_.c_str(), beast::file_mode::write, problem);
    if (problem) return keep_file(problem);
    stream_.expires_after(file_time);
    http::async_read(
        stream_, buffer_, *file_,
        [this, self = shared_from_this()](const ErrorCode& failed, std::size_t) { keep_file(failed); });
  }

  void keep_file(const ErrorCode& problem) {
    file_->get().body().close();
    try {
      if (problem)
        throw Error("it has not come whole: " + problem.message(), temporary_.string(), "drop it again");
      Response kept = gallery_.answers.keep_file(file_->get(), temporary_);
      temporary_.clear();
      respond(std::move(kept));
    } catch (const Error& error) {
      respond(guarded(plain(http::status::insufficient_storage, to_text(error))));
    }
  }

  Gallery& gallery_;
  std::optional<http::request_parser<http::file_body>> file_;
  std::filesystem::path temporary_;  // file being received; empty: none
};

struct GalleryServer::Impl {
  Impl(ViewerPort port, const std::filesystem::path& folder, const ViewerOptions& options)
      : gallery{.served = port.served(), .url = port.url("gallery"), .answers = {folder, options}},
        reception(gallery.context, gallery.served.address, port.release(),
                  [this](tcp::socket socket) {
                    return std::make_shared<GalleryConnection>(std::move(socket), gallery);
                  }),
        thread([this] { gallery.context.run(); }) {}
  ~Impl() {
    gallery.context.stop();
    thread.join();
    gallery.looker.stop();
    gallery.looker.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  Gallery gallery;
  Reception reception;
  std::thread thread;
};

GalleryServer::GalleryServer(const std::filesystem::path& folder, const ViewerOptions& options)
    : impl_(std::make_unique<Impl>(ViewerPort(options), folder, options)) {}

GalleryServer::~GalleryServer() = default;

const ServedAddress& GalleryServer::served() const noexcept {
  return impl_->gallery.served;
}

const std::string& GalleryServer::url() const noexcept {
  return impl_->gallery.url;
}

}  // namespace palpate
