#include "runtime/serving/viewer_port.h"

#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <utility>

#include "base/error.h"
#include "runtime/serving/admission.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

std::string seen_from_here(const std::string& address) {
  if (!is_any_address(address)) return url_host(address);
  return address == "::" ? "[::1]" : "127.0.0.1";
}

}  // namespace

ViewerPort::ViewerPort(const ViewerOptions& options) {
  boost::system::error_code problem;
  const asio::ip::address address = asio::ip::make_address(options.address, problem);
  if (problem) {
    throw Error("'" + options.address + "' is not an IP address", "viewer",
                "give one of this machine, such as 127.0.0.1, or 0.0.0.0 for all of them");
  }
  served_ = {.address = options.address,
             .port = 0,
             .token = random_token(),
             .book = options.book,
             .runs = 1,
             .framed = options.framed};
  const tcp::endpoint wanted(address, options.port);
  asio::io_context context;
  tcp::acceptor acceptor(context);
  acceptor.open(wanted.protocol(), problem);
  if (!problem) acceptor.set_option(asio::socket_base::reuse_address(true), problem);
  if (!problem) acceptor.bind(wanted, problem);
  if (!problem) acceptor.listen(asio::socket_base::max_listen_connections, problem);
  if (problem) {
    throw Error(
        "cannot listen: " + problem.message(), fmt::format("{}:{}", url_host(options.address), options.port),
        problem == asio::error::address_in_use ? "choose another port, or end the program that has it"
                                               : "choose an address of this machine and another port");
  }
  served_.port = acceptor.local_endpoint().port();
  socket_ = acceptor.release();
}

ViewerPort::~ViewerPort() {
  if (socket_ >= 0) close(socket_);
}

ViewerPort::ViewerPort(ViewerPort&& other) noexcept
    : served_(std::move(other.served_)), socket_(other.release()) {}

std::string ViewerPort::url(const std::string& page) const {
  return fmt::format("http://{}:{}/{}?token={}", seen_from_here(served_.address), served_.port, page,
                     served_.token);
}

int ViewerPort::release() noexcept {
  return std::exchange(socket_, -1);
}

}  // namespace palpate
