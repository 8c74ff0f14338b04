// Where a viewer is served.
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

/// The options of a viewer, as they were written.
struct ViewerArguments {
  std::optional<std::string> address;
  bool framed = false;
  std::optional<int> told;
};

/// Where a viewer is to be served.
struct ViewerOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8017;                 ///< 0: any that is free
  std::filesystem::path book = find_book();  ///< folder of the book's site; empty: none is served
  bool framed = false;  ///< pages of this machine's other servers, as notebooks, may have it in a frame
  int told = -1;        ///< descriptor of the program that is told the address; -1: a person is
  /// What is shown to a person. The next run that shows it at this port of this machine has the same token,
  /// so that pages find it; where nothing is named, none has.
  std::vector<std::filesystem::path> shows = {};
};

/// Where it is served, the secret that each request must show, and the book beside it.
struct ServedAddress {
  std::string address;
  std::uint16_t port = 0;
  std::string token;           ///< 128 random bits as hexadecimal digits
  std::filesystem::path book;  ///< empty: there is none
  std::size_t runs = 1;        ///< that are shown, one or two
  bool framed = false;         ///< as in ViewerOptions
  int told = -1;               ///< as in ViewerOptions
};

/// An address that is taken, so that what comes next cannot fail for it: who connects waits until a
/// ViewerServer serves the port, and is turned away when the port is destroyed instead.
class ViewerPort {
 public:
  /// Takes the address and draws the token, or has that of the run before. Throws Error (port in use, address
  /// unknown).
  explicit ViewerPort(const ViewerOptions& options);

  [[nodiscard]] const ServedAddress& served() const noexcept { return served_; }
  /// What to open in a browser of this machine: http://127.0.0.1:8017/PAGE?token=...
  [[nodiscard]] std::string url(const std::string& page = "") const;
  /// The listening socket, which is the caller's from now on.
  [[nodiscard]] int release() noexcept { return socket_.release(); }

 private:
  ListeningSocket socket_;
  ServedAddress served_;
};

/// Tells where the page is: a person in a line that ends with `more`, or the program that asked for it as one
/// line of JSON, {"url", "port", "token"}, on a descriptor that no file's text reaches.
void tell_address(const ServedAddress& served, const std::string& url, std::string_view more);

}  // namespace palpate
