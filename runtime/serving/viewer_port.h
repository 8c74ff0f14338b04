// Port and address of a viewer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/serving/book_files.h"
#include "runtime/serving/listening_socket.h"

namespace palpate {

/// Options of a viewer as given on the command line.
struct ViewerArguments {
  std::optional<std::string> address;
  bool framed = false;
  std::optional<int> told;
};

/// Options of a viewer.
struct ViewerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8017;                 ///< 0: any free port
  std::filesystem::path book = find_book();  ///< folder of the book's site; empty: not served
  bool framed = false;  ///< pages of other servers of this machine, such as notebooks, may frame it
  int told = -1;        ///< descriptor to write the address to, for a program; -1: printed for a person
  /// Files that are shown. The next run that shows the same at this port of this machine gets the same token,
  /// so that open pages reconnect; empty: a new token.
  std::vector<std::filesystem::path> shows = {};
};

/// Served address, the token that each request must show, and the book.
struct ServedAddress {
  std::string address;
  std::uint16_t port = 0;
  std::string token;           ///< 128 random bits as hexadecimal digits
  std::filesystem::path book;  ///< empty if there is none
  std::size_t runs = 1;        ///< number of runs shown, 1 or 2
  bool framed = false;         ///< see ViewerOptions
  int told = -1;               ///< see ViewerOptions
};

/// Bound port of a viewer, so that later steps cannot fail because of it. A client that connects waits until
/// a ViewerServer serves the port, and is disconnected if the port is destroyed instead.
class ViewerPort {
 public:
  /// Binds the address and draws a token, or takes that of the run before. Throws Error (port in use, unknown
  /// address).
  explicit ViewerPort(const ViewerOptions& options);

  [[nodiscard]] const ServedAddress& served() const noexcept { return served_; }
  /// URL for a browser on this machine: http://127.0.0.1:8017/PAGE?token=...
  [[nodiscard]] std::string url(const std::string& page = "") const;
  /// Returns the listening socket and passes its ownership to the caller.
  [[nodiscard]] int release() noexcept { return socket_.release(); }

 private:
  ListeningSocket socket_;
  ServedAddress served_;
};

/// Reports the address of the page: to a person as a line that ends with `more`, or to the requesting program
/// as one line of JSON, {"url", "port", "token"}, on a descriptor of its own that carries no other text.
void tell_address(const ServedAddress& served, const std::string& url, std::string_view more);

}  // namespace palpate
