#include "runtime/serving/listening_socket.h"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <charconv>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "runtime/serving/admission.h"

namespace palpate {

std::optional<ListenAddress> parse_listen_address(const std::string& text) {
  ListenAddress address;
  const std::size_t colon = text.rfind(':');
  if (colon != std::string::npos) address.address = text.substr(0, colon);
  const char* const end = text.data() + text.size();
  const auto [last, bad] =
      std::from_chars(text.data() + (colon == std::string::npos ? 0 : colon + 1), end, address.port);
  if (bad != std::errc() || last != end || address.address.empty()) return std::nullopt;
  return address;
}

ListeningSocket::ListeningSocket(const ListenAddress& wanted, const char* who) : address_(wanted) {
  namespace asio = boost::asio;
  using asio::ip::tcp;
  boost::system::error_code problem;
  const asio::ip::address address = asio::ip::make_address(wanted.address, problem);
  if (problem) {
    throw Error("'" + wanted.address + "' is not an IP address", who,
                "give one of this machine, such as 127.0.0.1, or 0.0.0.0 for all of them");
  }
  const tcp::endpoint place(address, wanted.port);
  asio::io_context context;
  tcp::acceptor acceptor(context);
  acceptor.open(place.protocol(), problem);
  if (!problem) acceptor.set_option(asio::socket_base::reuse_address(true), problem);
  if (!problem) acceptor.bind(place, problem);
  if (!problem) acceptor.listen(asio::socket_base::max_listen_connections, problem);
  if (problem) {
    throw Error(
        "cannot listen: " + problem.message(), fmt::format("{}:{}", url_host(wanted.address), wanted.port),
        problem == asio::error::address_in_use ? "choose another port, or end the program that has it"
                                               : "choose an address of this machine and another port");
  }
  address_.port = acceptor.local_endpoint().port();
  socket_ = acceptor.release();
}

ListeningSocket::~ListeningSocket() {
  if (socket_ >= 0) close(socket_);
}

ListeningSocket::ListeningSocket(ListeningSocket&& other) noexcept
    : address_(std::move(other.address_)), socket_(other.release()) {}

int ListeningSocket::release() noexcept {
  return std::exchange(socket_, -1);
}

}  // namespace palpate
