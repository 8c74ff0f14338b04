#include "runtime/serving/viewer_port.h"

#include <fmt/format.h>

#include "runtime/serving/admission.h"

namespace palpate {
namespace {

std::string seen_from_here(const std::string& address) {
  if (!is_any_address(address)) return url_host(address);
  return address == "::" ? "[::1]" : "127.0.0.1";
}

}  // namespace

ViewerPort::ViewerPort(const ViewerOptions& options)
    : socket_({.address = options.address, .port = options.port}, "viewer"),
      served_{.address = options.address,
              .port = socket_.address().port,
              .token = random_token(),
              .book = options.book,
              .runs = 1,
              .framed = options.framed} {}

std::string ViewerPort::url(const std::string& page) const {
  return fmt::format("http://{}:{}/{}?token={}", seen_from_here(served_.address), served_.port, page,
                     served_.token);
}

}  // namespace palpate
