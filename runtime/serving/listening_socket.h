// An address that is taken before a run begins, so that what comes next cannot fail for it.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

struct ListenAddress {
  std::string address = "127.0.0.1";  ///< IPv4 or IPv6
  std::uint16_t port = 0;             ///< 0: any that is free
};

/// Who connects waits until a server has the socket, and is turned away when it is destroyed instead.
class ListeningSocket {
 public:
  /// Throws Error (port in use, address unknown), where `who` says what was to listen.
  ListeningSocket(const ListenAddress& wanted, const char* who);
  ~ListeningSocket();
  ListeningSocket(ListeningSocket&& other) noexcept;
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  /// With the port that it got.
  [[nodiscard]] const ListenAddress& address() const noexcept { return address_; }
  /// The socket itself, which is the caller's from now on.
  [[nodiscard]] int release() noexcept;

 private:
  ListenAddress address_;
  int socket_ = -1;
};

}  // namespace palpate
