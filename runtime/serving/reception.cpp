#include "runtime/serving/reception.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace palpate {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::system::error_code;
using namespace std::chrono_literals;

constexpr std::uint32_t longest_header = 8192;  // [bytes]
constexpr auto request_time = 10s;              // to receive a header
constexpr auto response_time = 30s;             // for the client to read an answer

constexpr std::ptrdiff_t most_strangers = 32;  // connections without the token
constexpr std::ptrdiff_t most_admitted = 32;   // connections with it
constexpr auto retry_time = 500ms;

tcp protocol_of(const std::string& address) {
  return asio::ip::make_address(address).is_v6() ? tcp::v6() : tcp::v4();
}

}  // namespace

void Connection::start(Reception& reception) {
  reception_ = &reception;
  parser_->header_limit(longest_header);
  stream_.expires_after(request_time);
  http::async_read_header(stream_, buffer_, *parser_,
                          [this, self = shared_from_this()](const ErrorCode& problem, std::size_t) {
                            if (problem) return fail(problem);
                            is_head_ = request().method() == http::verb::head;
                            answer_request();
                          });
}

void Connection::leave() {
  reception_->leave(*this);
}

void Connection::respond(Response response) {
  stream_.expires_after(response_time);
  response_.emplace(std::move(response));
  response_->prepare_payload();
  if (is_head_) response_->body().clear();  // whose length the header tells
  http::async_write(stream_, *response_, [this, self = shared_from_this()](const ErrorCode&, std::size_t) {
    ErrorCode ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    leave();
  });
}

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
    connections_.back()->start(*this);
    accept();
  });
}

/// Otherwise open connections without the token would keep all others out.
void Reception::make_room() {
  const auto is_stranger = [](const auto& one) { return !one->is_admitted(); };
  if (std::count_if(connections_.begin(), connections_.end(), is_stranger) < most_strangers) return;
  const std::shared_ptr<Connection> oldest =
      *std::find_if(connections_.begin(), connections_.end(), is_stranger);
  cut(*oldest);
}

bool Reception::has_room() const {
  return std::count_if(connections_.begin(), connections_.end(),
                       [](const auto& one) { return one->is_admitted(); }) < most_admitted;
}

void Reception::leave(const Connection& connection) {
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

void Reception::cut(Connection& connection) {
  connection.cut();
  leave(connection);
}

}  // namespace palpate
