#include "runtime/serving/viewer_port.h"

#include <fmt/format.h>

#include <cstdio>
#include <system_error>

#include "base/error.h"
#include "base/file_io.h"
#include "base/private_file.h"
#include "base/program.h"
#include "runtime/serving/admission.h"

namespace palpate {
namespace {

std::string seen_from_here(const std::string& address) {
  if (!is_any_address(address)) return url_host(address);
  return address == "::" ? "[::1]" : "127.0.0.1";
}

/// Returns the token of the last run at this port if it showed the same files to this user; otherwise a new
/// one, which is stored. Only the run that owns the port uses the file.
std::string token_of(const ViewerOptions& options) {
  if (options.shows.empty() || options.port == 0 || options.told >= 0 ||
      !is_this_machine(url_host(options.address)))
    return random_token();
  std::string shows;
  for (const std::filesystem::path& file : options.shows) {
    std::error_code nothing_there;  // reported later
    shows += std::filesystem::weakly_canonical(file, nothing_there).string() + "\n";
  }
  std::string token = random_token();
  try {
    const std::filesystem::path file = private_file(fmt::format("viewer-{}.token", options.port));
    const std::string kept = read_private_file(file);
    std::string before = kept.substr(0, token.size());
    if (is_token(before) && kept == before + "\n" + shows) return before;
    write_private_file(file, token + "\n" + shows);
  } catch (const Error&) {  // no folder for it: the next run gets a new token
  }
  return token;
}

}  // namespace

ViewerPort::ViewerPort(const ViewerOptions& options)
    : socket_({.address = options.address, .port = options.port}, "viewer"),
      served_{.address = options.address,
              .port = socket_.address().port,
              .token = token_of(options),
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
  static_cast<void>(write_all(served.told, line));  // a program that has gone needs no address
}

}  // namespace palpate
