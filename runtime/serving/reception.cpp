#include "runtime/serving/reception.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace palpate {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::ptrdiff_t most_strangers = 32;  // connections without the token
constexpr std::ptrdiff_t most_admitted = 32;   // connections with it
constexpr auto retry_time = std::chrono::milliseconds(500);

tcp protocol_of(const std::string& address) {
  return asio::ip::make_address(address).is_v6() ? tcp::v6() : tcp::v4();
}

}  // namespace

Reception::Reception(asio::io_context& context, const std::string& address, int socket, Receive receive)
    : acceptor_(context, protocol_of(address), socket), retry_(context), receive_(std::move(receive)) {
  accept();
}

void Reception::accept() {
  acceptor_.async_accept([this](const error_code& problem, tcp::socket socket) {
    if (!acceptor_.is_open()) return;
    if (problem) {  // out of file descriptors: retry later
      retry_.expires_after(retry_time);
      retry_.async_wait([this](const error_code&) { accept(); });
      return;
    }
    make_room();
    connections_.push_back(receive_(std::move(socket)));
    connections_.back()->start();
    accept();
  });
}

/// Otherwise open connections without the token would keep all others out.
void Reception::make_room() {
  const auto is_stranger = [](const auto& one) { return !one->is_admitted(); };
  if (std::count_if(connections_.begin(), connections_.end(), is_stranger) < most_strangers) return;
  const std::shared_ptr<Received> oldest =
      *std::find_if(connections_.begin(), connections_.end(), is_stranger);
  cut(*oldest);
}

bool Reception::has_room() const {
  return std::count_if(connections_.begin(), connections_.end(),
                       [](const auto& one) { return one->is_admitted(); }) < most_admitted;
}

void Reception::leave(const Received& connection) {
  std::erase_if(connections_, [&](const auto& one) { return one.get() == &connection; });
}

void Reception::cut_stalled() {
  const auto connections = connections_;
  for (const auto& one : connections)
    if (one->is_stalled()) cut(*one);
}

void Reception::cut_all() {
  const auto connections = connections_;
  for (const auto& one : connections) cut(*one);
}

void Reception::cut(Received& connection) {
  connection.cut();
  leave(connection);
}

}  // namespace palpate
