// Which requests a viewer answers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace palpate {

bool is_any_address(const std::string& address);  ///< 0.0.0.0 or ::
/// Whether a host, as a browser writes it, is localhost, 127.x.x.x or [::1].
bool is_this_machine(const std::string& host);
/// As in a URL: IPv6 in brackets.
std::string url_host(const std::string& address);

/// Whether a request's `Host` names this machine (localhost, 127.0.0.0/8, [::1]) with whatever port, as that
/// of a tunnel is another one; or the address served, with its port; where all addresses are served, any IP
/// address with that port. No other name, even one that leads here: a foreign page could have made it do so.
bool is_served(std::string_view host, const std::string& address, std::uint16_t port);

/// Whether `Origin` is the page that `Host` serves.
bool is_own_page(std::string_view origin, std::string_view host);

/// 128 random bits as hexadecimal digits.
std::string random_token();
/// Whether it may be one: 32 of such digits.
bool is_token(std::string_view text) noexcept;
/// What only who has the token can answer to `nonce`: SHA-256 of both, as hexadecimal digits.
std::string proof_of(const std::string& token, std::string_view nonce);
/// Takes as long wherever they differ.
bool is_same_token(std::string_view given, std::string_view token) noexcept;

/// What stands before the `?` of a request's target, and the values of `token` and `nonce` behind it, empty
/// without.
struct Target {
  std::string_view path;
  std::string_view token, nonce;
};
Target split_target(std::string_view target);

}  // namespace palpate
