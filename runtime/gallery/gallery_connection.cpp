#include "runtime/gallery/gallery_connection.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/file_io.h"

namespace palpate {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using boost::asio::ip::tcp;
using namespace std::chrono_literals;

constexpr std::uint32_t longest_header = 8192;  // [bytes]
constexpr auto request_time = 10s;              // to receive a header
constexpr auto response_time = 30s;             // for the client to read an answer
constexpr auto file_time = 1h;                  // to receive a file

}  // namespace

GalleryConnection::~GalleryConnection() {
  if (temporary_.empty()) return;
  file_.reset();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void GalleryConnection::start() {
  parser_.emplace();
  parser_->header_limit(longest_header);
  parser_->body_limit(largest_drop);
  stream_.expires_after(request_time);
  http::async_read_header(
      stream_, buffer_, *parser_, [self = shared_from_this()](const ErrorCode& problem, std::size_t) {
        if (!problem) return self->answer_request();
        if (problem != http::error::body_limit) return self->server_.reception().leave(*self);
        self->respond(
            guarded(plain(http::status::payload_too_large, "A file that is dropped has at most 8 GiB.")));
      });
}

void GalleryConnection::answer_request() {
  const RequestHeader& request = parser_->get();
  GalleryAnswers& answers = server_.answers();
  if (std::optional<Response> refused = GalleryAnswers::refusal(request, server_.served()))
    return respond(std::move(*refused));
  if (GalleryAnswers::wants_page(request)) return respond(GalleryAnswers::page(request, server_.served()));
  if (!server_.reception().has_room()) return respond(full_house());
  is_admitted_ = true;
  if (GalleryAnswers::wants_scene(request)) {
    server_.look_then([header = RequestHeader(request), &answers] { return answers.scene(header); },
                      [self = shared_from_this()](Response seen) { self->respond(std::move(seen)); });
    return;
  }
  if (!GalleryAnswers::brings_file(request)) return respond(answers.answer(request, server_.served()));
  if (std::optional<Response> refused = GalleryAnswers::drop_refusal(request))
    return respond(std::move(*refused));
  try {
    take_file();
  } catch (const Error& error) {
    respond(guarded(plain(http::status::insufficient_storage, to_text(error))));
  }
}

void GalleryConnection::take_file() {
  static int number = 0;
  temporary_ = server_.answers().folder() / fmt::format(".dropped-{}-{}", ::getpid(), ++number);
  check_free_space(temporary_, static_cast<std::int64_t>(parser_->content_length().value_or(0)));
  make_anew(temporary_);
  file_.emplace(std::move(*parser_));
  ErrorCode problem;
  file_->get().body().open(temporary_.c_str(), beast::file_mode::write, problem);
  if (problem) return keep_file(problem);
  stream_.expires_after(file_time);
  http::async_read(
      stream_, buffer_, *file_,
      [self = shared_from_this()](const ErrorCode& failed, std::size_t) { self->keep_file(failed); });
}

void GalleryConnection::keep_file(const ErrorCode& problem) {
  file_->get().body().close();
  try {
    if (problem)
      throw Error("it has not come whole: " + problem.message(), temporary_.string(), "drop it again");
    Response kept = server_.answers().keep_file(file_->get(), temporary_);
    temporary_.clear();
    respond(std::move(kept));
  } catch (const Error& error) {
    respond(guarded(plain(http::status::insufficient_storage, to_text(error))));
  }
}

void GalleryConnection::respond(Response response) {
  stream_.expires_after(response_time);
  response_.emplace(std::move(response));
  response_->prepare_payload();
  http::async_write(stream_, *response_, [self = shared_from_this()](const ErrorCode&, std::size_t) {
    ErrorCode ignored;
    self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    self->server_.reception().leave(*self);
  });
}

}  // namespace palpate
