// Checks of the requests to a viewer: host, origin and token.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace palpate {

bool is_any_address(const std::string& address);  ///< true for 0.0.0.0 and ::
/// True if a host, as written by a browser, is localhost, 127.x.x.x or [::1].
bool is_this_machine(const std::string& host);
/// Returns the address as in a URL: IPv6 in brackets.
std::string url_host(const std::string& address);

/// True if a request's `Host` names this machine (localhost, 127.0.0.0/8, [::1]) with any port, since that of
/// a tunnel differs; or the served address with its port; or, if all addresses are served, any IP address
/// with that port. Other names are refused even if they resolve to this machine: a foreign page could have
/// arranged that.
bool is_served(std::string_view host, const std::string& address, std::uint16_t port);

/// True if `Origin` is the page served by `Host`.
bool is_own_page(std::string_view origin, std::string_view host);

/// Returns 128 random bits as hexadecimal digits.
std::string random_token();
/// True if the text has the form of a token: 32 hexadecimal digits.
bool is_token(std::string_view text) noexcept;
/// Proof of knowing the token, for `nonce`: SHA-256 of both, as hexadecimal digits.
std::string proof_of(const std::string& token, std::string_view nonce);
/// Compares in constant time.
bool is_same_token(std::string_view given, std::string_view token) noexcept;

/// Path before the `?` of a request's target, and behind it the values of `token` and `nonce`, empty
/// without, and whether `watch` is there.
struct Target {
  std::string_view path;
  std::string_view token, nonce;
  bool watch = false;
};
Target split_target(std::string_view target);

}  // namespace palpate
