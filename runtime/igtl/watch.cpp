#include "runtime/igtl/watch.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "base/error.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

constexpr const char* subprotocol = "palpate.2";
constexpr std::size_t longest_message = std::size_t{1} << 30U;  // [bytes]

/// The address of a page as the socket's: its port stands behind the last colon that is not in brackets.
struct SocketAddress {
  explicit SocketAddress(const std::string& page) {
    constexpr std::string_view scheme = "http://";
    const std::size_t slash = page.find('/', scheme.size());
    const std::size_t question = page.find("?token=");
    if (!page.starts_with(scheme) || question == std::string::npos || slash > question)
      throw Error("is not the address of a page", page,
                  "give it whole, as palpate-runtime prints it: http://127.0.0.1:8017/?token=...");
    host = page.substr(scheme.size(), slash - scheme.size());
    const std::size_t colon = host.rfind(':');
    const bool has_port = colon != std::string::npos && !host.ends_with(']');
    name = has_port ? host.substr(0, colon) : host;
    if (name.starts_with('[') && name.ends_with(']')) name = name.substr(1, name.size() - 2);
    if (has_port) port = host.substr(colon + 1);
    const std::size_t end = page.rfind('/', question) + 1;
    target = page.substr(slash, end - slash) + "socket" + page.substr(question) + "&watch";
  }
  std::string host, name, port = "80", target;
};

class Watched : public std::enable_shared_from_this<Watched> {
 public:
  Watched(asio::io_context& context, SocketAddress address, std::function<void(const WatchedPicture&)> show,
          std::function<void()> over)
      : socket_(context), address_(std::move(address)), show_(std::move(show)), over_(std::move(over)) {}

  void connect() {
    error_code problem;
    tcp::resolver resolver(socket_.get_executor());
    const auto places = resolver.resolve(address_.name, address_.port, problem);
    if (!problem) asio::connect(socket_.next_layer(), places, problem);
    if (problem)
      throw Error("cannot connect: " + problem.message(), address_.host,
                  "start palpate-runtime play FILE --view first, and give the address that it prints");
    socket_.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
      request.set(beast::http::field::sec_websocket_protocol, subprotocol);
    }));
    socket_.read_message_max(longest_message);
    socket_.handshake(address_.host, address_.target, problem);
    if (problem)
      throw Error("does not let this program watch: " + problem.message(), address_.host,
                  "give the whole address that the run printed last; both programs must be of one version");
  }

  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](const error_code& problem, std::size_t) {
      if (problem) return self->over_();
      if (self->socket_.got_binary()) self->take();
      self->buffer_.clear();
      self->read();
    });
  }

 private:
  void take() {
    const auto bytes = buffer_.data();
    try {
      if (reader_.take({static_cast<const char*>(bytes.data()), bytes.size()})) show_(reader_.picture());
    } catch (const std::out_of_range&) {
      throw Error("sends a picture that cannot be read", address_.host,
                  "take palpate-openigtlink and palpate-runtime of one version");
    }
  }

  websocket::stream<tcp::socket> socket_;
  SocketAddress address_;
  beast::flat_buffer buffer_;
  PictureReader reader_;
  std::function<void(const WatchedPicture&)> show_;
  std::function<void()> over_;
};

}  // namespace

void watch(asio::io_context& context, const std::string& address,
           std::function<void(const WatchedPicture&)> show, std::function<void()> over) {
  const auto watched =
      std::make_shared<Watched>(context, SocketAddress(address), std::move(show), std::move(over));
  watched->connect();
  watched->read();
}

}  // namespace palpate
