// Which requests a viewer answers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace palpate {

bool is_any_address(const std::string& address);  ///< 0.0.0.0 or ::
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
/// Takes as long wherever they differ.
bool is_same_token(std::string_view given, std::string_view token) noexcept;

/// What stands before the `?` of a request's target, and the value of `token` behind it, empty without.
struct Target {
  std::string_view path;
  std::string_view token;
};
Target split_target(std::string_view target);

}  // namespace palpate
