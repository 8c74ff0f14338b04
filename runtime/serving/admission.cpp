#include "runtime/serving/admission.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <optional>
#include <system_error>

#include "base/error.h"
#include "runtime/serving/sha256.h"

namespace palpate {
namespace {

constexpr std::string_view http_port = "80";  // omitted from Host

bool is_ipv4(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

bool is_ipv6(const std::string& text) {
  in6_addr address{};
  return inet_pton(AF_INET6, text.c_str(), &address) == 1;
}

/// Parses a port in digits; empty unless it is at least 1.
std::optional<std::uint16_t> port_of(const std::string& text) {
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [last, bad] = std::from_chars(text.data(), end, port);
  if (bad != std::errc() || last != end || port == 0) return std::nullopt;
  return port;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return lower;
}

}  // namespace

bool is_this_machine(const std::string& name) {
  return name == "localhost" || name == "[::1]" || (name.starts_with("127") && is_ipv4(name));
}

bool is_any_address(const std::string& address) {
  return address == "0.0.0.0" || address == "::";
}

std::string url_host(const std::string& address) {
  return is_ipv6(address) ? "[" + address + "]" : address;
}

bool is_served(std::string_view host, const std::string& address, std::uint16_t port) {
  const std::size_t bracket = host.rfind(']');  // colons before it belong to an IPv6 address
  const std::size_t colon = host.find(':', bracket == std::string_view::npos ? 0 : bracket);
  const std::string name = lower_case(host.substr(0, colon));
  const std::string number(colon == std::string_view::npos ? http_port : host.substr(colon + 1));
  const std::optional<std::uint16_t> asked = port_of(number);
  if (!asked) return false;
  if (is_this_machine(name)) return true;
  if (*asked != port) return false;
  const bool in_brackets = name.size() > 2 && name.front() == '[' && name.back() == ']';
  const bool is_address = in_brackets ? is_ipv6(name.substr(1, name.size() - 2)) : is_ipv4(name);
  return name == url_host(address) || (is_any_address(address) && is_address);
}

bool is_own_page(std::string_view origin, std::string_view host) {
  return lower_case(origin) == "http://" + lower_case(host);
}

std::string random_token() {
  std::array<std::uint8_t, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != std::ssize(bytes)) {
    throw Error("no random numbers: " + std::system_category().message(errno), "getrandom",
                "see why the kernel has none");
  }
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

bool is_token(std::string_view text) noexcept {
  constexpr std::size_t digits = 32;
  return text.size() == digits && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::string proof_of(const std::string& token, std::string_view nonce) {
  return fmt::format("{:02x}", fmt::join(sha256(token + std::string(nonce)), ""));
}

bool is_same_token(std::string_view given, std::string_view token) noexcept {
  if (given.size() != token.size()) return false;
  unsigned difference = 0;
  for (std::size_t k = 0; k < token.size(); ++k)
    difference |=
        static_cast<unsigned>(static_cast<unsigned char>(given[k]) ^ static_cast<unsigned char>(token[k]));
  return difference == 0;
}

Target split_target(std::string_view target) {
  const std::size_t question = target.find('?');
  Target result{target.substr(0, question), {}, {}, false};
  if (question == std::string_view::npos) return result;
  std::string_view rest = target.substr(question + 1);
  constexpr std::string_view token = "token=", nonce = "nonce=";
  while (!rest.empty()) {
    const std::size_t end = rest.find('&');
    const std::string_view part = rest.substr(0, end);
    if (part.starts_with(token)) result.token = part.substr(token.size());
    if (part == "watch") result.watch = true;
    if (part.starts_with(nonce)) result.nonce = part.substr(nonce.size());
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  }
  return result;
}

}  // namespace palpate
