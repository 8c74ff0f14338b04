#include "runtime/viewer/http_answers.h"

#include <fmt/format.h>

#include <boost/beast/websocket.hpp>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "runtime/scene/seen_surface.h"
#include "runtime/serving/admission.h"
#include "runtime/serving/book_files.h"

namespace palpate {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

constexpr std::string_view book_path = "/book/";
constexpr std::string_view second_run = "/2/";
constexpr std::string_view both_runs = "/beside";

Target target_of(const Request& request) {
  return split_target(text_view(request.target()));
}

/// Path of a request within its run: for the second run without its prefix.
std::string_view path_in_run(const Request& request, const ServedAddress& served) {
  const std::string_view path = target_of(request).path;
  return run_of(request, served) == 0 ? path : path.substr(second_run.size() - 1);
}

bool wants_page(const Request& request, const ServedAddress& served) {
  return path_in_run(request, served) == "/" || (served.runs > 1 && target_of(request).path == both_runs);
}

Response surface_file(bool is_stl, const DrawnPicture& shown) {
  try {
    Response response;
    response.set(http::field::content_type, is_stl ? "model/stl" : "application/octet-stream");
    response.set(http::field::content_disposition,
                 fmt::format("attachment; filename=\"surface-tick-{}.{}\"", shown.picture.frame.tick,
                             is_stl ? "stl" : "vtu"));
    const auto file = is_stl ? surface_stl : surface_vtu;
    response.body() = file(shown.picture, *shown.scene, shown.patch.get());
    return response;
  } catch (const Error& error) {
    return plain(http::status::not_found, to_text(error));
  }
}

}  // namespace

bool wants_proof(const Request& request) {
  return target_of(request).path == "/proof";
}

Response proof_answer(const Request& request, const ServedAddress& served) {
  const std::string_view nonce = target_of(request).nonce;
  if (!is_token(nonce)) return guarded(plain(http::status::bad_request, "A nonce is 32 hexadecimal digits."));
  return guarded(plain(http::status::ok, proof_of(served.token, nonce)));
}

bool wants_book(const Request& request) {
  return target_of(request).path.starts_with(book_path);
}

std::size_t run_of(const Request& request, const ServedAddress& served) {
  return served.runs > 1 && target_of(request).path.starts_with(second_run) ? 1 : 0;
}

bool wants_socket(const Request& request, const ServedAddress& served) {
  return path_in_run(request, served) == "/socket" && beast::websocket::is_upgrade(request);
}

bool only_watches(const Request& request) {
  return target_of(request).watch;
}

std::optional<Response> refusal(const Request& request, const ServedAddress& served) {
  if (std::optional<Response> refused = foreign_refusal(request, served)) return refused;
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return method_refusal("GET, HEAD");
  if (!wants_book(request) && !wants_proof(request)) {
    if (std::optional<Response> refused = token_refusal(request, served)) {
      if (!wants_page(request, served)) return refused;
      Response page = answer(request, served, {});  // it explains what to do; the same for every client
      page.result(http::status::forbidden);
      return page;
    }
  }
  if (wants_socket(request, served)) {
    const auto offered = request.find(http::field::sec_websocket_protocol);
    if (offered != request.end() && !http::token_list(offered->value()).exists(subprotocol))
      return guarded(plain(http::status::bad_request, "The socket speaks palpate.2 only."));
  }
  return std::nullopt;
}

Response book_answer(const Request& request, const std::filesystem::path& book) {
  std::optional<BookFile> file = read_book_file(book, target_of(request).path.substr(book_path.size()));
  if (!file) return guarded(plain(http::status::not_found, "There is no such page in the book."));
  Response response;
  response.set(http::field::content_type, file->content_type);
  response.set(
      "Content-Security-Policy",
      "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; font-src 'self'; "
      "base-uri 'none'; form-action 'self'; frame-ancestors 'none'");
  response.body() = std::move(file->bytes);
  return guarded(std::move(response));
}

Response answer(const Request& request, const ServedAddress& served,
                const std::optional<DrawnPicture>& shown) {
  const std::string_view path = path_in_run(request, served);
  const std::string_view host = text_view(request[http::field::host]);
  const bool has_two = served.runs > 1;
  if (path == "/") return guarded(page_answer(host, ancestors(served, has_two), false));
  if (has_two && target_of(request).path == both_runs)
    return guarded(page_answer(host, ancestors(served, false), true));
  const bool is_stl = path == "/surface.stl";
  if (!is_stl && path != "/surface.vtu")
    return guarded(plain(http::status::not_found, "There is no such page."));
  if (!shown) return guarded(plain(http::status::not_found, "There is nothing to see yet."));
  return guarded(surface_file(is_stl, *shown));
}

}  // namespace palpate
