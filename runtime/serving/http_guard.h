// Headers common to all answers to a browser, and refusals of requests.
#pragma once

#include <boost/beast/http.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/serving/viewer_port.h"

namespace palpate {

using Response = boost::beast::http::response<boost::beast::http::string_body>;
using RequestHeader = boost::beast::http::request_header<>;
using Request = boost::beast::http::request<boost::beast::http::empty_body>;

/// Returns the same text as a std::string_view.
[[nodiscard]] inline std::string_view text_view(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

/// Returns a sentence as plain text.
[[nodiscard]] Response plain(boost::beast::http::status status, const std::string& text);

/// Adds the headers common to all answers: other pages can use no part of it, and the token in the address
/// stays here.
[[nodiscard]] Response guarded(Response response);

/// Content security policy of the viewer's page: its own scripts and styles, and nothing injected into it.
/// The worker for the socket starts from a blob; images are made by the page.
[[nodiscard]] std::string page_policy();

/// Sources of pages that may frame one. `by_own`: those of this server. Notebooks are served by this machine.
[[nodiscard]] std::string ancestors(const ServedAddress& served, bool by_own);

/// Returns the viewer's page. `frames`: it contains frames of this server.
[[nodiscard]] Response page_answer(std::string_view host, const std::string& ancestors, bool frames);

/// Refusal of a request from a client without the address, judged by its host or origin; empty if it is
/// accepted.
[[nodiscard]] std::optional<Response> foreign_refusal(const RequestHeader& request,
                                                      const ServedAddress& served);

/// Refusal of a request without the server's token; empty if it has it.
[[nodiscard]] std::optional<Response> token_refusal(const RequestHeader& request,
                                                    const ServedAddress& served);

/// Answer to a valid request when there are too many connections.
[[nodiscard]] Response full_house();

/// Answer to a method other than the `allowed` ones ("GET, HEAD").
[[nodiscard]] Response method_refusal(const std::string& allowed);

}  // namespace palpate
