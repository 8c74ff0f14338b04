// A page's side of the viewer's HTTP and WebSocket, one call after the other.
#pragma once

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace palpate::test {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Json = nlohmann::json;

inline tcp::endpoint local(std::uint16_t port) {
  return {asio::ip::make_address("127.0.0.1"), port};
}

/// Where a viewer is, as its URL says.
struct Served {
  explicit Served(const std::string& url) {
    const std::size_t colon = url.rfind(':');
    port = static_cast<std::uint16_t>(std::stoi(url.substr(colon + 1)));
    const std::size_t question = url.find('?');
    if (question != std::string::npos) query = url.substr(question);
  }
  std::uint16_t port = 0;
  std::string query;  ///< with the token
};

/// What makes a request one of a page that is served, or not.
struct Asking {
  std::string target = "/socket";
  std::optional<std::string> query{};  ///< else that of the address
  std::string host{};                  ///< else 127.0.0.1 with the port
  std::string origin{};                ///< else none is sent
  std::string subprotocol = "palpate.2";
};

inline std::string target_of(const Served& served, const Asking& asking) {
  return asking.target + asking.query.value_or(served.query);
}

inline std::string host_of(const Asking& asking, std::uint16_t port) {
  return asking.host.empty() ? "127.0.0.1:" + std::to_string(port) : asking.host;
}

using Answer = http::response<http::string_body>;

inline Answer ask(const Served& served, const Asking& asking, http::verb method = http::verb::get,
                  bool for_socket = false) {
  asio::io_context context;
  tcp::socket socket(context);
  socket.connect(local(served.port));
  http::request<http::empty_body> request(method, target_of(served, asking), 11);
  request.set(http::field::host, host_of(asking, served.port));
  if (!asking.origin.empty()) request.set(http::field::origin, asking.origin);
  if (for_socket) {
    request.set(http::field::connection, "upgrade");
    request.set(http::field::upgrade, "websocket");
    request.set(http::field::sec_websocket_version, "13");
    request.set(http::field::sec_websocket_key, "dGhlIHNhbXBsZSBub25jZQ==");
    request.set(http::field::sec_websocket_protocol, asking.subprotocol);
  }
  http::write(socket, request);
  beast::flat_buffer buffer;
  http::response_parser<http::string_body> parser;
  parser.body_limit(64U << 20U);
  parser.skip(method == http::verb::head);
  http::read(socket, buffer, parser);
  return parser.release();
}

/// A socket that is open, or was refused with `status`.
class Client {
 public:
  struct Said {
    bool is_text = false;
    std::string bytes;
    [[nodiscard]] std::uint32_t kind() const {  // of a binary message
      std::uint32_t kind = 0;
      if (!is_text) std::memcpy(&kind, bytes.data(), sizeof kind);
      return kind;
    }
    [[nodiscard]] std::string type() const {  // of a text
      return is_text ? Json::parse(bytes).at("type").get<std::string>() : "";
    }
  };

  explicit Client(const Served& served, const Asking& asking = {}) {
    beast::get_lowest_layer(socket_).connect(local(served.port));
    socket_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
      if (!asking.origin.empty()) request.set(http::field::origin, asking.origin);
      if (!asking.subprotocol.empty()) request.set(http::field::sec_websocket_protocol, asking.subprotocol);
    }));
    socket_.read_message_max(64U << 20U);
    websocket::response_type response;
    beast::error_code refused;
    socket_.handshake(response, host_of(asking, served.port), target_of(served, asking), refused);
    // Beast does not tell what a refusal said.
    status = refused ? ask(served, asking, http::verb::get, true).result_int() : response.result_int();
    const auto spoken = response[http::field::sec_websocket_protocol];
    subprotocol = {spoken.data(), spoken.size()};
  }

  unsigned status = 0;  ///< 101: open
  std::string subprotocol;

  void say(const std::string& text) {
    socket_.text(true);
    socket_.write(asio::buffer(text));
  }
  void say_binary(const std::string& bytes) {
    socket_.binary(true);
    socket_.write(asio::buffer(bytes));
  }

  /// The next message; throws boost::system::system_error when the connection is closed.
  Said receive() {
    beast::flat_buffer buffer;
    socket_.read(buffer);
    return {socket_.got_text(), beast::buffers_to_string(buffer.data())};
  }
  /// The next one of a binary kind, others are let pass.
  std::string receive(std::uint32_t kind) {
    for (;;) {
      Said said = receive();
      if (said.kind() == kind) return std::move(said.bytes);
    }
  }
  /// The next text of a type that is as it should be.
  Json receive(const std::string& type, const std::function<bool(const Json&)>& wanted = {}) {
    for (;;) {
      const Said said = receive();
      if (said.type() != type) continue;
      Json word = Json::parse(said.bytes);
      if (!wanted || wanted(word)) return word;
    }
  }
  /// Reads until the server closes; how it did.
  websocket::close_reason hear_end() {
    try {
      for (;;) (void)receive();
    } catch (const boost::system::system_error&) {
      return socket_.reason();
    }
  }

  /// Goes away without a word.
  void cut() { beast::get_lowest_layer(socket_).close(); }
  tcp::socket& connection() { return beast::get_lowest_layer(socket_); }

 private:
  asio::io_context context_;
  websocket::stream<tcp::socket> socket_{context_};
};

}  // namespace palpate::test
