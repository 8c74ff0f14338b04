// What all answers to a browser have in common, and which requests are answered at all.
#pragma once

#include <boost/beast/http.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "runtime/serving/viewer_port.h"

namespace palpate {

using Response = boost::beast::http::response<boost::beast::http::string_body>;
using RequestHeader = boost::beast::http::request_header<>;

/// As std::string_view.
[[nodiscard]] inline std::string_view text_view(boost::beast::string_view text) {
  return {text.data(), text.size()};
}

/// A sentence, as text.
[[nodiscard]] Response plain(boost::beast::http::status status, const std::string& text);

/// `response` with what every answer has: nothing of it is for other pages, and the token in the address
/// stays here.
[[nodiscard]] Response guarded(Response response);

/// What the viewer's page may load and run, wherever it stands: its own scripts and styles and nothing else
/// that could be written into it. Its thread for the socket begins as a blob; pictures are made by the page.
[[nodiscard]] std::string page_policy();

/// Whose pages may have one in a frame. `by_own`: those of this server. Notebooks are served by this machine.
[[nodiscard]] std::string ancestors(const ServedAddress& served, bool by_own);

/// The viewer's page. `frames`: it has others of this server in it.
[[nodiscard]] Response page_answer(std::string_view host, const std::string& ancestors, bool frames);

/// Why a request by somebody who was not given the address is not answered: its host or page.
[[nodiscard]] std::optional<Response> foreign_refusal(const RequestHeader& request,
                                                      const ServedAddress& served);

/// Why a request is not answered whose token is not the server's.
[[nodiscard]] std::optional<Response> token_refusal(const RequestHeader& request,
                                                    const ServedAddress& served);

/// What is said to a request that may be answered, but there are too many of them.
[[nodiscard]] Response full_house();

/// Only `allowed` ("GET, HEAD") are answered.
[[nodiscard]] Response method_refusal(const std::string& allowed);

}  // namespace palpate
