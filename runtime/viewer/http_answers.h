// HTTP answers of a viewer.
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

/// Subprotocol of the WebSocket.
inline constexpr const char* subprotocol = "palpate.2";

/// Refusal of a request by host, origin, method, token or subprotocol; empty if it is accepted.
std::optional<Response> refusal(const Request& request, const ServedAddress& served);

/// Index of the run that a request is about: addresses of the second begin with /2/, all others belong to the
/// first.
std::size_t run_of(const Request& request, const ServedAddress& served);

/// True for a request to upgrade to a WebSocket.
bool wants_socket(const Request& request, const ServedAddress& served);

/// True if the request only watches, and never steers.
bool only_watches(const Request& request);

/// True for a request that asks the server to prove that it has the token, before it shows its own.
bool wants_proof(const Request& request);

/// Returns the proof.
Response proof_answer(const Request& request, const ServedAddress& served);

/// True for a request for the book, which is public and needs no token.
bool wants_book(const Request& request);

/// Returns a file of the book, or "not found".
Response book_answer(const Request& request, const std::filesystem::path& book);

/// Answers all other accepted requests: the page, the visible surface of the run asked for, or "not found".
Response answer(const Request& request, const ServedAddress& served,
                const std::optional<DrawnPicture>& shown);

}  // namespace palpate
