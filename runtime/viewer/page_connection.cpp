#include "runtime/viewer/page_connection.h"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <utility>

#include "runtime/viewer/page_word.h"
#include "runtime/viewer/wire.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto handshake_time = 10s;
constexpr auto idle_time = 30s;                          // a ping is sent after half of it
constexpr auto stall_time = 10s;                         // for the page to read a message
constexpr std::size_t most_unread = 32U << 20U;          // [bytes] queued texts
constexpr int send_buffer = 256 << 10;                   // small, so that a slow page sees recent pictures
constexpr std::int64_t nanoseconds_per_byte = 1000 / 6;  // pictures at 6 MB/s
constexpr std::size_t longest_reason = 120;              // bytes that fit into a closing frame

}  // namespace

PageConnection::PageConnection(tcp::socket socket, const Served& served)
    : Connection(std::move(socket)), served_(served), picture_timer_(stream_.get_executor()) {
  ErrorCode ignored;
  stream_.socket().set_option(tcp::no_delay(true), ignored);
  stream_.socket().set_option(asio::socket_base::send_buffer_size(send_buffer), ignored);
}

void PageConnection::answer_request() {
  const ServedAddress& address = served_.address;
  if (std::optional<Response> refused = refusal(request(), address)) return respond(std::move(*refused));
  if (wants_book(request())) return respond(book_answer(request(), address.book));
  if (!reception().has_room()) return respond(full_house());
  if (wants_proof(request())) return respond(proof_answer(request(), address));
  is_admitted_ = true;
  run_ = served_.runs[run_of(request(), address)].get();
  if (wants_socket(request(), address)) return open_socket();
  respond(answer(request(), address, run_->broadcast().picture()));
}

void PageConnection::leave() {
  if (run_ != nullptr) run_->leave(*this);
  Connection::leave();
}

void PageConnection::open_socket() {
  only_watches_ = palpate::only_watches(request());
  const bool offers = request().count(http::field::sec_websocket_protocol) > 0;
  stream_.expires_never();  // the WebSocket has timeouts of its own
  socket_.emplace(std::move(stream_));
  websocket::stream_base::timeout times{};
  times.handshake_timeout = handshake_time;
  times.idle_timeout = idle_time;
  times.keep_alive_pings = true;
  socket_->set_option(times);
  socket_->set_option(websocket::stream_base::decorator([offers](websocket::response_type& response) {
    if (offers) response.set(http::field::sec_websocket_protocol, subprotocol);
  }));
  socket_->read_message_max(longest_page_word);
  socket_->auto_fragment(false);
  buffer_.clear();
  socket_->async_accept(request(), [this, self = shared_from_this()](const ErrorCode& problem) {
    if (problem) return leave();
    is_open_ = true;
    ticks_ = run_->is_replay() ? 0 : run_->broadcast().ticks().end();
    run_->join(*this);
    read();
  });
}

void PageConnection::read() {
  socket_->async_read(buffer_, [this, self = shared_from_this()](const ErrorCode& problem, std::size_t) {
    receive(problem);
  });
}

void PageConnection::receive(const ErrorCode& problem) {
  if (problem) return leave();
  if (!is_open_) return;
  if (!socket_->got_text()) return close(websocket::close_code::unknown_data, "only text is read");
  const auto bytes = buffer_.data();
  std::string reason;
  const std::optional<PageWord> word =
      parse_page_word({static_cast<const char*>(bytes.data()), bytes.size()}, reason);
  if (!word) return close(websocket::close_code::bad_payload, reason);
  buffer_.consume(bytes.size());
  run_->obey(*this, *word);
  if (is_open_) read();
}

void PageConnection::close(websocket::close_code code, std::string reason) {
  if (!is_open_) return;
  is_open_ = false;
  leave();
  reason.resize(std::min(reason.size(), longest_reason));
  socket_->async_close(websocket::close_reason(code, reason),
                       [self = shared_from_this()](const ErrorCode&) {});
}

void PageConnection::cut() {
  is_open_ = false;
  if (socket_) {
    beast::get_lowest_layer(*socket_).close();
  } else {
    stream_.close();
  }
  if (run_ != nullptr) run_->leave(*this);
}

bool PageConnection::is_stalled() const {
  return writing_ && Clock::now() - writing_since_ > stall_time;
}

void PageConnection::say(std::string text) {
  said_bytes_ += text.size();
  said_.push_back(std::move(text));
  if (said_bytes_ > most_unread) return close(websocket::close_code::policy_error, "too much is unread");
  send_news();
}

void PageConnection::send_news() {
  if (!is_open_ || writing_) return;
  writing_ = next_message();
  if (!writing_) return;
  writing_since_ = Clock::now();
  socket_->text(writing_.is_text);
  socket_->async_write(asio::buffer(*writing_.bytes),
                       [this, self = shared_from_this()](const ErrorCode& problem, std::size_t) {
                         writing_ = {};
                         if (problem) return leave();
                         send_news();
                       });
}

Message PageConnection::next_message() {
  Broadcast& shown = run_->broadcast();
  if (!said_.empty()) {
    Message message = text_message(std::move(said_.front()));
    said_bytes_ -= message.bytes->size();
    said_.pop_front();
    return message;
  }
  if (states_ != shown.states() || !is_role_sent_) {
    const bool is_first = states_ == 0;
    states_ = shown.states();
    is_role_sent_ = true;
    return shown.state_message(run_->role(*this), is_first);
  }
  if (scenes_ != shown.scenes()) {
    scenes_ = shown.scenes();
    patch_ = 0;
    base_.reset();
    alone_.reset();
    return shown.scene_message();
  }
  const bool has_ticks = shown.ticks().has_from(ticks_);
  const bool is_new = alone_ ? !alone_->is_sent : shown.picture() && pictures_ != shown.pictures();
  if (is_new && !(has_ticks && ticks_first_)) {
    if (Clock::now() >= picture_due_) return next_picture();
    wait_for_picture();
  }
  if (!has_ticks) return {};
  ticks_first_ = false;
  return shown.ticks_message(ticks_);
}

void PageConnection::look_alone(DrawnPicture picture, std::int64_t frame) {
  alone_ = Alone{std::move(picture), frame};
  is_role_sent_ = false;
  send_news();
}

void PageConnection::follow() {
  if (!alone_) return;
  alone_.reset();
  pictures_ = 0;
  base_.reset();  // no base: it is not among the pictures sent to all
  is_role_sent_ = false;
  send_news();
}

std::optional<std::int64_t> PageConnection::own_frame() const noexcept {
  if (!alone_) return std::nullopt;
  return alone_->frame;
}

Message PageConnection::own_picture() {
  alone_->is_sent = true;
  ticks_first_ = true;
  const DrawnPicture& own = alone_->picture;
  const std::uint32_t number = base_ ? base_->number + 1 : 1;
  auto values = std::make_shared<const WireValues>(wire_values(own.picture, *own.scene, nullptr, number));
  Message message{std::make_shared<const std::string>(
                      encode_frame(own.picture, *own.scene, nullptr, *values, base_.get())),
                  false};
  base_ = std::move(values);
  note_picture(message);
  return message;
}

/// Sets the earliest time of the next picture by the length of this one.
void PageConnection::note_picture(const Message& message) {
  picture_due_ = Clock::now() + std::chrono::nanoseconds(static_cast<std::int64_t>(message.bytes->size()) *
                                                         nanoseconds_per_byte);
}

Message PageConnection::next_picture() {
  if (alone_) return own_picture();
  Broadcast& shown = run_->broadcast();
  const ScenePatch* patch = shown.picture()->patch.get();
  const std::uint32_t number = patch == nullptr ? 0 : patch->number;
  if (std::exchange(patch_, number) != number && number != 0) return shown.patch_message();
  pictures_ = shown.pictures();
  ticks_first_ = true;
  Message message = shown.frame_message(only_watches_ ? nullptr : base_.get());
  base_ = shown.values();
  note_picture(message);
  return message;
}

void PageConnection::wait_for_picture() {
  if (picture_timer_.expiry() == picture_due_) return;  // already waiting
  picture_timer_.expires_at(picture_due_);
  picture_timer_.async_wait([this, self = shared_from_this()](const ErrorCode& problem) {
    if (!problem) send_news();
  });
}

}  // namespace palpate
