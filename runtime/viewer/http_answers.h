// What a viewer answers by HTTP.
#pragma once

#include <boost/beast/http.hpp>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "runtime/serving/http_guard.h"
#include "runtime/serving/viewer_port.h"
#include "runtime/viewer/broadcast.h"

namespace palpate {

using Request = boost::beast::http::request<boost::beast::http::empty_body>;

/// Subprotocol of the WebSocket.
inline constexpr const char* subprotocol = "palpate.2";

/// Why a request is not answered at all: its host, page, method, token or subprotocol.
std::optional<Response> refusal(const Request& request, const ServedAddress& served);

/// Which of the runs it is about: the second one's addresses begin with /2/, all others are the first one's.
std::size_t run_of(const Request& request, const ServedAddress& served);

/// Whether it wants to go on as a WebSocket.
bool wants_socket(const Request& request, const ServedAddress& served);

/// Whether it asks for a proof that the server has the token, before it shows its own.
bool wants_proof(const Request& request);

/// The proof.
Response proof_answer(const Request& request, const ServedAddress& served);

/// Whether it asks for the book, which is the same for everybody and needs no token.
bool wants_book(const Request& request);

/// A file of the book, or that it is not there.
Response book_answer(const Request& request, const std::filesystem::path& book);

/// To all other requests that are not refused: the page, the surface as it is seen in the run that it asks
/// for, or that it is not there.
Response answer(const Request& request, const ServedAddress& served,
                const std::optional<DrawnPicture>& shown);

}  // namespace palpate
