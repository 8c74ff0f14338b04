#include "runtime/serving/viewer_port.h"

#include <fmt/format.h>

#include <cstdio>

#include "base/file_io.h"
#include "base/program.h"
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
              .framed = options.framed,
              .told = options.told} {}

std::string ViewerPort::url(const std::string& page) const {
  return fmt::format("http://{}:{}/{}?token={}", seen_from_here(served_.address), served_.port, page,
                     served_.token);
}

void tell_address(const ServedAddress& served, const std::string& url, std::string_view more) {
  if (served.told < 0) {
    say(stderr, "open {} in a browser{}\n", url, more);
    return;
  }
  const std::string line =
      fmt::format("{{\"url\": \"{}\", \"port\": {}, \"token\": \"{}\"}}\n", url, served.port, served.token);
  static_cast<void>(write_all(served.told, line));  // a program that is gone needs no address
}

}  // namespace palpate
