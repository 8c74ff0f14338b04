#include "runtime/serving/http_guard.h"

#include <fmt/format.h>

#include "runtime/serving/admission.h"
#include "runtime/web/page.h"

namespace palpate {
namespace {

namespace http = boost::beast::http;

constexpr unsigned http_version = 11;  // 1.1

}  // namespace

std::string page_policy() {
  return fmt::format(
      "default-src 'none'; script-src {0}; style-src {0}; worker-src blob:; img-src data: blob:; "
      "base-uri 'none'; form-action 'none'",
      viewer_page_sources());
}

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
               fmt::format("{}; connect-src 'self' ws://{}; frame-src {}; frame-ancestors {}", page_policy(),
                           host, frames ? "'self'" : "'none'", ancestors));
  response.body() = viewer_page();
  return response;
}

std::optional<Response> foreign_refusal(const RequestHeader& request, const ServedAddress& served) {
  const std::string_view host = text_view(request[http::field::host]);
  if (request.count(http::field::host) != 1 || !is_served(host, served.address, served.port)) {
    return guarded(plain(
        http::status::forbidden,
        fmt::format(
            "The address that you opened names another host than the one that is served. Open localhost, "
            "an address 127.x.x.x or [::1], with any port, as through a tunnel, or {}:{}. Other names are "
            "refused, as a foreign page could have made them lead here.",
            is_any_address(served.address) ? "an IP address of this machine" : url_host(served.address),
            served.port)));
  }
  if (request.count(http::field::origin) > 0 && !is_own_page(text_view(request[http::field::origin]), host))
    return guarded(plain(http::status::forbidden, "Pages of other addresses may not ask."));
  return std::nullopt;
}

std::optional<Response> token_refusal(const RequestHeader& request, const ServedAddress& served) {
  if (is_same_token(split_target(text_view(request.target())).token, served.token)) return std::nullopt;
  return guarded(
      plain(http::status::forbidden, "Open the whole address that the runtime printed, with its token."));
}

Response full_house() {
  return guarded(plain(http::status::service_unavailable,
                       "Too many pages are open: close one, then load this one anew."));
}

Response method_refusal(const std::string& allowed) {
  Response response = guarded(plain(http::status::method_not_allowed, "Only " + allowed + " is answered."));
  response.set(http::field::allow, allowed);
  return response;
}

}  // namespace palpate
