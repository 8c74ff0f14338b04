// Listening socket that is opened before a run begins, so that later steps cannot fail because of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace palpate {

struct ListenAddress {
  std::string address = "127.0.0.1";  ///< IPv4 or IPv6
  std::uint16_t port = 0;             ///< 0: any free port
};

/// [ADDRESS:]PORT as a person writes it; nothing for all else.
[[nodiscard]] std::optional<ListenAddress> parse_listen_address(const std::string& text);

/// Listening socket. A client that connects waits until a server takes the socket over, and is disconnected
/// if the socket is destroyed instead.
class ListeningSocket {
 public:
  /// Throws Error (port in use, unknown address), in which `who` names the listener.
  ListeningSocket(const ListenAddress& wanted, const char* who);
  ~ListeningSocket();
  ListeningSocket(ListeningSocket&& other) noexcept;
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  /// Address with the actual port.
  [[nodiscard]] const ListenAddress& address() const noexcept { return address_; }
  /// Returns the socket and passes its ownership to the caller.
  [[nodiscard]] int release() noexcept;

 private:
  ListenAddress address_;
  int socket_ = -1;
};

}  // namespace palpate
