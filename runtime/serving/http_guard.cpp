#include "runtime/serving/http_guard.h"

#include <fmt/format.h>

#include "runtime/serving/admission.h"
#include "runtime/web/page.h"

namespace palpate {
namespace {

namespace http = boost::beast::http;

constexpr unsigned http_version = 11;  // 1.1

}  // namespace

Response plain(http::status status, const std::string& text) {
  Response response(status, http_version);
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.body() = text + "\n";
  return response;
}

Response guarded(Response response) {
  response.keep_alive(false);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  return response;
}

std::string ancestors(const ServedAddress& served, bool by_own) {
  if (served.framed) return "'self' http://localhost:* http://127.0.0.1:*";
  return by_own ? "'self'" : "'none'";
}

Response page_answer(std::string_view host, const std::string& ancestors, bool frames) {
  Response response(http::status::ok, http_version);
  response.set(http::field::content_type, "text/html; charset=utf-8");
  response.set("Content-Security-Policy",
               fmt::format("default-src 'none'; script-src 'unsafe-inline' blob:; worker-src blob:; "
                           "style-src 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; "
                           "connect-src 'self' ws://{} blob: data:; base-uri 'none'; form-action 'none'; "
                           "frame-src {}; frame-ancestors {}",
                           host, frames ? "'self'" : "'none'", ancestors));
  response.body() = viewer_page();
  return response;
}

std::optional<Response> foreign_refusal(const RequestHeader& request, const ServedAddress& served) {
  const std::string_view host = text_view(request[http::field::host]);
  if (request.count(http::field::host) != 1 || !is_served(host, served.address, served.port))
    return guarded(
        plain(http::status::forbidden, "Open the viewer at the address that the runtime printed."));
  if (request.count(http::field::origin) > 0 && !is_own_page(text_view(request[http::field::origin]), host))
    return guarded(plain(http::status::forbidden, "Pages of other addresses may not ask."));
  return std::nullopt;
}

std::optional<Response> token_refusal(const RequestHeader& request, const ServedAddress& served) {
  if (is_same_token(split_target(text_view(request.target())).token, served.token)) return std::nullopt;
  return guarded(
      plain(http::status::forbidden, "Open the whole address that the runtime printed, with its token."));
}

Response method_refusal(const std::string& allowed) {
  Response response = guarded(plain(http::status::method_not_allowed, "Only " + allowed + " is answered."));
  response.set(http::field::allow, allowed);
  return response;
}

}  // namespace palpate
