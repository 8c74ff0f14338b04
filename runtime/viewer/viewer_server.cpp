#include "runtime/viewer/viewer_server.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "meshes/error.h"
#include "runtime/viewer/admission.h"
#include "runtime/viewer/page.h"
#include "runtime/viewer/page_word.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/seen_surface.h"
#include "runtime/viewer/tick_history.h"
#include "runtime/viewer/wire.h"

namespace palpate {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

using Request = http::request<http::empty_body>;
using Response = http::response<http::string_body>;

constexpr std::size_t most_connections = 32;
constexpr std::uint32_t longest_request = 8192;  // header [bytes]
constexpr auto request_time = 10s;               // for a header to be said
constexpr auto response_time = 30s;              // for an answer to be taken
constexpr auto idle_time = 30s;                  // half of it: a ping
constexpr auto stall_time = 10s;                 // that a message may wait for its page to read
constexpr std::size_t most_unread = 32U << 20U;  // [bytes] of what a page must not miss
constexpr int send_buffer = 256 << 10;           // small, so that a slow page sees what is, not what was
constexpr auto state_period = 500ms;
constexpr double seconds_of_ticks = 2.0;    // that a slow page is sent
constexpr std::size_t most_waiting = 1024;  // calls of show_ticks that nobody has looked at
constexpr std::size_t most_recorded_ticks = 1U << 18U;
constexpr std::size_t longest_reason = 120;  // that a closing frame has room for
constexpr int niceness = 5;
constexpr const char* subprotocol = "palpate.1";

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

/// Encoded once, sent to many.
struct Message {
  std::shared_ptr<const std::string> bytes;
  bool is_text = false;

  explicit operator bool() const noexcept { return bytes != nullptr; }
};

Message text_message(std::string text) {
  return {std::make_shared<const std::string>(std::move(text)), true};
}

Message binary_message(std::string bytes) {
  return {std::make_shared<const std::string>(std::move(bytes)), false};
}

/// A picture and what it is drawn on.
struct ShownPicture {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const ScenePatch> patch;
  SurfacePicture picture;
};

/// What all pages are to see, encoded when the first of them wants it. Counts tell a page what it has been
/// sent.
class Show {
 public:
  void set_scene(std::shared_ptr<const Scene> scene) {
    scene_ = std::move(scene);
    scene_message_ = binary_message(encode_scene(*scene_));
    picture_.reset();
    frame_ = {};
    ticks_.clear();
    ++scenes_;
  }
  void set_picture(ShownPicture picture) {
    if (picture.scene != scene_) return;  // of the body before
    if (!picture_ || picture_->patch != picture.patch) patch_message_ = {};
    picture_ = std::move(picture);
    frame_ = {};
    ++pictures_;
  }
  void add_ticks(const std::vector<TickNote>& ticks, std::int64_t stride, bool replay) {
    const double rate = state_ ? state_->rate() : RunState("{}").rate();
    ticks_.append(ticks, stride,
                  replay ? most_recorded_ticks : static_cast<std::size_t>(seconds_of_ticks * rate));
  }
  void set_state(RunState state) {
    state_ = std::move(state);
    touch_state();
  }
  void set_times(nlohmann::json times) { times_ = std::move(times); }
  /// Pages are to be sent the state again.
  void touch_state() {
    ++states_;
    state_touched_ = Clock::now();
  }
  void repeat_state() {
    if (state_ && Clock::now() - state_touched_ >= state_period) touch_state();
  }

  [[nodiscard]] std::int64_t scenes() const noexcept { return scenes_; }
  [[nodiscard]] std::int64_t pictures() const noexcept { return pictures_; }
  [[nodiscard]] std::int64_t states() const noexcept { return state_ ? states_ : 0; }
  [[nodiscard]] const TickHistory& ticks() const noexcept { return ticks_; }
  [[nodiscard]] const std::optional<ShownPicture>& picture() const noexcept { return picture_; }

  [[nodiscard]] const Message& scene_message() const noexcept { return scene_message_; }
  [[nodiscard]] const Message& patch_message() {
    if (!patch_message_) patch_message_ = binary_message(encode_patch(scene_->number, *picture_->patch));
    return patch_message_;
  }
  [[nodiscard]] const Message& frame_message() {
    if (!frame_) frame_ = binary_message(encode_frame(picture_->picture, *scene_, picture_->patch.get()));
    return frame_;
  }
  /// Of the ticks from a place on, which it moves on.
  [[nodiscard]] Message ticks_message(std::int64_t& place) {
    if (!run_message_ || run_begin_ != place || run_last_ != ticks_.end()) {
      const TickHistory::Run run = ticks_.run_from(place);
      run_begin_ = place;
      run_last_ = ticks_.end();
      run_end_ = run.end;
      run_message_ = binary_message(encode_ticks(scene_ ? scene_->number : 0, run.ticks, run.stride));
    }
    place = run_end_;
    return run_message_;
  }
  [[nodiscard]] Message state_message(const PageRole& role, bool is_first) const {
    return text_message(
        state_->for_page(scene_ ? scene_->number : 0, role, is_first ? times_ : nlohmann::json()));
  }

 private:
  std::shared_ptr<const Scene> scene_;
  std::optional<ShownPicture> picture_;
  TickHistory ticks_;
  std::optional<RunState> state_;
  nlohmann::json times_;
  std::int64_t scenes_ = 0;
  std::int64_t pictures_ = 0;
  std::int64_t states_ = 0;
  Clock::time_point state_touched_;
  Message scene_message_;
  Message patch_message_;
  Message frame_;
  Message run_message_;  // of the ticks that a page was sent last
  std::int64_t run_begin_ = 0;
  std::int64_t run_end_ = 0;
  std::int64_t run_last_ = 0;  // end of all ticks then
};

/// What has been shown since the server's thread last looked.
struct Mailbox {
  struct Ticks {
    std::vector<TickNote> notes;
    std::int64_t stride = 1;
  };

  std::shared_ptr<const Scene> scene;
  std::optional<ShownPicture> picture;
  std::deque<Ticks> ticks;
  std::optional<RunState> state;
  nlohmann::json times;  // of the last state that had them
};

class Server;

/// A connection: one request, and where that asks for it a socket from then on. For the server's thread.
class Page : public std::enable_shared_from_this<Page> {
 public:
  Page(tcp::socket socket, Server& server) : stream_(std::move(socket)), server_(server) {}

  void start();
  /// Without a word.
  void cut() noexcept;
  /// Sends what there is that the page has not been sent, one message after the other.
  void show();
  void say(std::string text);
  [[nodiscard]] bool is_stalled() const { return writing_ && Clock::now() - writing_since_ > stall_time; }

 private:
  void answer(const Request& request);
  void respond(Response response, bool header_only);
  void open_socket();
  void read();
  void hear(const error_code& problem);
  void close(websocket::close_code code, std::string reason);
  Message next_message();

  beast::tcp_stream stream_;
  std::optional<websocket::stream<beast::tcp_stream>> socket_;
  Server& server_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<Response> response_;
  std::optional<http::response<http::empty_body>> header_;

  bool is_open_ = false;
  std::deque<std::string> said_;
  std::size_t said_bytes_ = 0;
  Message writing_;
  Clock::time_point writing_since_;
  // What it has been sent.
  std::int64_t scenes_ = 0;
  std::int64_t pictures_ = 0;
  std::int64_t states_ = 0;
  std::int64_t ticks_ = 0;
  std::uint32_t patch_ = 0;
  bool ticks_first_ = true;  // else pictures
};

/// Listens, and knows all pages.
class Server {
 public:
  Server(const ViewerOptions& options, ViewedRun& run)
      : run_(run), options_(options), acceptor_(context_), timer_(context_), retry_(context_) {
    listen();
    accept();
    tick();
    thread_ = std::thread([this] { work(); });
  }
  ~Server() {
    asio::post(context_, [this] { stop(); });
    thread_.join();
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] const std::string& url() const noexcept { return url_; }

  /// Puts something into the mailbox, by any thread.
  template <class Put>
  void post(Put&& put) {
    const std::lock_guard lock(mutex_);
    put(mailbox_);
    if (posted_) return;
    posted_ = true;
    asio::post(context_, [this] { take(); });
  }

  // By pages.
  [[nodiscard]] Show& show() noexcept { return show_; }
  [[nodiscard]] bool replay() const noexcept { return options_.replay; }
  [[nodiscard]] Response answer(const Request& request) const;
  [[nodiscard]] bool wants_socket(const Request& request) const {
    return split_target(view(request.target())).path == "/socket" && websocket::is_upgrade(request);
  }
  [[nodiscard]] std::optional<Response> refusal(const Request& request) const;
  [[nodiscard]] PageRole role(const Page& page) const {
    return {controller_ == &page, controller_ != nullptr, open_.size()};
  }
  void join(Page& page);
  void leave(Page& page);
  void obey(Page& page, const PageWord& word);

 private:
  void listen();
  void accept();
  void tick();
  void work();
  void stop();
  void take();
  void show_all();
  void release();
  [[nodiscard]] Response download(const Target& target) const;

  ViewedRun& run_;
  ViewerOptions options_;
  std::string token_;  // empty: none is asked for
  std::string url_;
  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  asio::steady_timer timer_;
  asio::steady_timer retry_;
  Show show_;
  std::set<std::shared_ptr<Page>> pages_;  // all connections
  std::set<Page*> open_;                   // those that are sockets
  Page* controller_ = nullptr;
  std::uint64_t joined_ = 0;
  std::mutex mutex_;
  Mailbox mailbox_;
  bool posted_ = false;  // the thread will look into it
  std::thread thread_;
};

// ---- Page

void Page::start() {
  error_code ignored;
  stream_.socket().set_option(tcp::no_delay(true), ignored);
  stream_.socket().set_option(asio::socket_base::send_buffer_size(send_buffer), ignored);
  parser_.emplace();
  parser_->header_limit(longest_request);
  stream_.expires_after(request_time);
  http::async_read_header(stream_, buffer_, *parser_,
                          [self = shared_from_this()](const error_code& problem, std::size_t) {
                            if (problem) return self->server_.leave(*self);
                            self->answer(self->parser_->get());
                          });
}

void Page::answer(const Request& request) {
  const bool header_only = request.method() == http::verb::head;
  if (std::optional<Response> refusal = server_.refusal(request))
    return respond(std::move(*refusal), header_only);
  if (server_.wants_socket(request)) return open_socket();
  respond(server_.answer(request), header_only);
}

void Page::respond(Response response, bool header_only) {
  stream_.expires_after(response_time);
  const auto done = [self = shared_from_this()](const error_code&, std::size_t) {
    error_code ignored;
    self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    self->server_.leave(*self);
  };
  if (header_only) {
    header_.emplace(std::move(response.base()));
    header_->content_length(response.body().size());
    http::async_write(stream_, *header_, done);
  } else {
    response_.emplace(std::move(response));
    response_->prepare_payload();
    http::async_write(stream_, *response_, done);
  }
}

void Page::open_socket() {
  const Request& request = parser_->get();
  const bool offers = request.count(http::field::sec_websocket_protocol) > 0;
  stream_.expires_never();  // the socket has its own times
  socket_.emplace(std::move(stream_));
  websocket::stream_base::timeout times{};
  times.handshake_timeout = request_time;
  times.idle_timeout = idle_time;
  times.keep_alive_pings = true;
  socket_->set_option(times);
  socket_->set_option(websocket::stream_base::decorator([offers](websocket::response_type& response) {
    if (offers) response.set(http::field::sec_websocket_protocol, subprotocol);
  }));
  socket_->read_message_max(longest_page_word);
  socket_->auto_fragment(false);
  buffer_.clear();
  socket_->async_accept(request, [self = shared_from_this()](const error_code& problem) {
    if (problem) return self->server_.leave(*self);
    self->is_open_ = true;
    self->ticks_ = self->server_.replay() ? 0 : self->server_.show().ticks().end();
    self->server_.join(*self);
    self->read();
  });
}

void Page::read() {
  socket_->async_read(
      buffer_, [self = shared_from_this()](const error_code& problem, std::size_t) { self->hear(problem); });
}

void Page::hear(const error_code& problem) {
  if (problem) return server_.leave(*this);
  if (!is_open_) return;
  if (!socket_->got_text()) return close(websocket::close_code::unknown_data, "only text is read");
  const auto bytes = buffer_.data();
  std::string reason;
  const std::optional<PageWord> word =
      parse_page_word({static_cast<const char*>(bytes.data()), bytes.size()}, reason);
  if (!word) return close(websocket::close_code::bad_payload, reason);
  buffer_.consume(bytes.size());
  server_.obey(*this, *word);
  if (is_open_) read();
}

void Page::close(websocket::close_code code, std::string reason) {
  if (!is_open_) return;
  is_open_ = false;
  server_.leave(*this);
  reason.resize(std::min(reason.size(), longest_reason));
  socket_->async_close(websocket::close_reason(code, reason),
                       [self = shared_from_this()](const error_code&) {});
}

void Page::cut() noexcept {
  is_open_ = false;
  if (socket_) {
    beast::get_lowest_layer(*socket_).close();
  } else {
    stream_.close();
  }
}

void Page::say(std::string text) {
  said_bytes_ += text.size();
  said_.push_back(std::move(text));
  if (said_bytes_ > most_unread) return close(websocket::close_code::policy_error, "too much is unread");
  show();
}

void Page::show() {
  if (!is_open_ || writing_) return;
  writing_ = next_message();
  if (!writing_) return;
  writing_since_ = Clock::now();
  socket_->text(writing_.is_text);
  socket_->async_write(asio::buffer(*writing_.bytes),
                       [self = shared_from_this()](const error_code& problem, std::size_t) {
                         self->writing_ = {};
                         if (problem) return self->server_.leave(*self);
                         self->show();
                       });
}

Message Page::next_message() {
  Show& shown = server_.show();
  if (!said_.empty()) {
    Message message = text_message(std::move(said_.front()));
    said_bytes_ -= message.bytes->size();
    said_.pop_front();
    return message;
  }
  if (states_ != shown.states()) {
    const bool is_first = states_ == 0;
    states_ = shown.states();
    return shown.state_message(server_.role(*this), is_first);
  }
  if (scenes_ != shown.scenes()) {
    scenes_ = shown.scenes();
    patch_ = 0;
    return shown.scene_message();
  }
  const bool has_ticks = ticks_ < shown.ticks().end();
  if (shown.picture() && pictures_ != shown.pictures() && !(has_ticks && ticks_first_)) {
    const ScenePatch* patch = shown.picture()->patch.get();
    const std::uint32_t number = patch == nullptr ? 0 : patch->number;
    if (std::exchange(patch_, number) != number && number != 0) return shown.patch_message();
    pictures_ = shown.pictures();
    ticks_first_ = true;
    return shown.frame_message();
  }
  if (!has_ticks) return {};
  ticks_first_ = false;
  return shown.ticks_message(ticks_);
}

// ---- Server

void Server::listen() {
  error_code problem;
  const asio::ip::address address = asio::ip::make_address(options_.address, problem);
  if (problem) {
    throw Error("'" + options_.address + "' is not an IP address", "viewer",
                "give one of this machine, such as 127.0.0.1, or 0.0.0.0 for all of them");
  }
  const tcp::endpoint wanted(address, options_.port);
  acceptor_.open(wanted.protocol(), problem);
  if (!problem) acceptor_.set_option(asio::socket_base::reuse_address(true), problem);
  if (!problem) acceptor_.bind(wanted, problem);
  if (!problem) acceptor_.listen(asio::socket_base::max_listen_connections, problem);
  const std::string host = url_host(options_.address);
  if (problem) {
    throw Error("cannot listen: " + problem.message(), fmt::format("{}:{}", host, options_.port),
                problem == asio::error::address_in_use
                    ? "choose another port, or end the program that has it"
                    : "choose an address of this machine and another port");
  }
  options_.port = acceptor_.local_endpoint().port();
  if (!is_loopback(options_.address)) token_ = random_token();
  const std::string seen_from_here = options_.address == "0.0.0.0" ? "127.0.0.1"
                                     : options_.address == "::"    ? "[::1]"
                                                                   : host;
  url_ = fmt::format("http://{}:{}/{}{}", seen_from_here, options_.port,
                     token_.empty() ? "" : "?token=", token_);
}

void Server::accept() {
  acceptor_.async_accept([this](const error_code& problem, tcp::socket socket) {
    if (!acceptor_.is_open()) return;
    if (problem) {  // no file is left for a connection: later there may be
      retry_.expires_after(state_period);
      retry_.async_wait([this](const error_code&) { accept(); });
      return;
    }
    if (pages_.size() < most_connections) {
      const auto page = std::make_shared<Page>(std::move(socket), *this);
      pages_.insert(page);
      page->start();
    }
    accept();
  });
}

void Server::tick() {
  timer_.expires_after(state_period);
  timer_.async_wait([this](const error_code& problem) {
    if (problem) return;
    const std::set<std::shared_ptr<Page>> pages = pages_;
    for (const auto& page : pages) {
      if (!page->is_stalled()) continue;
      page->cut();
      leave(*page);
    }
    show_.repeat_state();
    show_all();
    tick();
  });
}

void Server::work() {
  // Its starter may be the loop's thread.
  const sched_param ordinary{};
  pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), niceness);
  context_.run();
}

void Server::stop() {
  const std::set<std::shared_ptr<Page>> pages = pages_;
  for (const auto& page : pages) {
    page->cut();
    leave(*page);
  }
  context_.stop();
}

void Server::take() {
  Mailbox mail;
  {
    const std::lock_guard lock(mutex_);
    std::swap(mail, mailbox_);
    posted_ = false;
  }
  if (mail.scene) {
    show_.set_scene(std::move(mail.scene));
    show_.touch_state();
  }
  if (!mail.times.is_null()) show_.set_times(std::move(mail.times));
  if (mail.state) show_.set_state(std::move(*mail.state));
  if (mail.picture) show_.set_picture(std::move(*mail.picture));
  for (const Mailbox::Ticks& ticks : mail.ticks) show_.add_ticks(ticks.notes, ticks.stride, options_.replay);
  show_all();
}

void Server::show_all() {
  const std::set<Page*> pages = open_;
  for (Page* page : pages) page->show();
}

void Server::join(Page& page) {
  open_.insert(&page);
  if (open_.size() == 1) controller_ = &page;
  show_.touch_state();
  page.say(hello_word(options_.replay ? "replay" : "live", ++joined_));
  show_all();
}

void Server::leave(Page& page) {
  if (open_.erase(&page) > 0) {
    if (controller_ == &page) {
      release();
    } else {
      show_.touch_state();
      show_all();
    }
  }
  pages_.erase(page.shared_from_this());
}

void Server::release() {
  controller_ = nullptr;
  run_.lose_pointer();
  show_.touch_state();
  show_all();
}

void Server::obey(Page& page, const PageWord& word) {
  const char* name = name_of(word);
  if (const auto* control = std::get_if<ControlWord>(&word)) {
    if (!control->take) {
      if (controller_ == &page) release();
    } else if (controller_ == nullptr) {
      controller_ = &page;
      show_.touch_state();
      show_all();
    } else if (controller_ != &page) {
      page.say(error_word(name, "another page has control", "ask for it when that page has given it up"));
    }
    return;
  }
  if (controller_ != &page) {
    page.say(error_word(name, "this page only watches",
                        controller_ == nullptr ? "take control first" : "another page has control"));
    return;
  }
  struct Obey {
    ViewedRun& run;
    void operator()(const PointWord& w) const { run.point(w.wanted); }
    void operator()(const PauseWord& w) const { run.pause(w.paused); }
    void operator()(const StepWord&) const { run.step_once(); }
    void operator()(const ResetWord&) const { run.reset(); }
    void operator()(const AcknowledgeWord&) const { run.acknowledge(); }
    void operator()(const ChangeWord& w) const { run.change(w.settings); }
    void operator()(const RecordWord& w) const { run.record(w.on); }
    void operator()(const ControlWord&) const {}
    void operator()(const SeekWord& w) const { run.seek(w.frame); }
  };
  try {
    std::visit(Obey{run_}, word);
  } catch (const Error& error) {
    page.say(error_word(name, error));
  } catch (const std::exception& error) {  // no memory, say: the run goes on
    page.say(error_word(name, error.what(), ""));
  }
}

Response plain(http::status status, const std::string& text) {
  Response response(status, 11);
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.body() = text + "\n";
  return response;
}

/// What every answer has: nothing of it is for other pages, and the token in the address stays here.
Response guarded(Response response) {
  response.keep_alive(false);
  response.set(http::field::cache_control, "no-store");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  return response;
}

std::optional<Response> Server::refusal(const Request& request) const {
  const std::string_view host = view(request[http::field::host]);
  if (request.count(http::field::host) != 1 || !is_served(host, options_.address, options_.port))
    return guarded(
        plain(http::status::forbidden, "Open the viewer at the address that the runtime printed."));
  if (request.count(http::field::origin) > 0 && !is_own_page(view(request[http::field::origin]), host))
    return guarded(plain(http::status::forbidden, "Pages of other addresses may not ask."));
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    Response response = guarded(plain(http::status::method_not_allowed, "Only GET and HEAD are answered."));
    response.set(http::field::allow, "GET, HEAD");
    return response;
  }
  if (!token_.empty() && !is_same_token(split_target(view(request.target())).token, token_))
    return guarded(
        plain(http::status::forbidden, "Open the whole address that the runtime printed, with its token."));
  if (wants_socket(request)) {
    const auto offered = request.find(http::field::sec_websocket_protocol);
    if (offered != request.end() && !http::token_list(offered->value()).exists(subprotocol))
      return guarded(plain(http::status::bad_request, "The socket speaks palpate.1 only."));
  }
  return std::nullopt;
}

Response Server::answer(const Request& request) const {
  const Target target = split_target(view(request.target()));
  if (target.path != "/") return guarded(download(target));
  Response response(http::status::ok, 11);
  response.set(http::field::content_type, "text/html; charset=utf-8");
  const std::string_view host = view(request[http::field::host]);
  response.set("Content-Security-Policy",
               fmt::format("default-src 'none'; script-src 'unsafe-inline' blob:; worker-src blob:; "
                           "style-src 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; "
                           "connect-src 'self' ws://{} blob: data:; base-uri 'none'; form-action 'none'; "
                           "frame-ancestors 'none'",
                           host));
  response.body() = viewer_page();
  return guarded(std::move(response));
}

Response Server::download(const Target& target) const {
  const bool is_stl = target.path == "/surface.stl";
  if (!is_stl && target.path != "/surface.vtu")
    return plain(http::status::not_found, "There is no such page.");
  const std::optional<ShownPicture>& shown = show_.picture();
  if (!shown) return plain(http::status::not_found, "There is nothing to see yet.");
  try {
    Response response(http::status::ok, 11);
    response.set(http::field::content_type, is_stl ? "model/stl" : "application/octet-stream");
    response.set(http::field::content_disposition,
                 fmt::format("attachment; filename=\"surface-tick-{}.{}\"", shown->picture.frame.tick,
                             is_stl ? "stl" : "vtu"));
    const auto file = is_stl ? surface_stl : surface_vtu;
    response.body() = file(shown->picture, *shown->scene, shown->patch.get());
    return response;
  } catch (const Error& error) {
    return plain(http::status::not_found, to_text(error));
  }
}

}  // namespace

// ---- What the run has of it

struct ViewerServer::Impl {
  Impl(const ViewerOptions& options, ViewedRun& run) : server(options, run) {}

  // Of show_scene and show_picture.
  std::mutex drawn_mutex;
  std::shared_ptr<const Scene> scene;
  // Of show_picture. The patch is kept so that no other one can have its address.
  std::shared_ptr<const Scene> patch_scene;
  std::shared_ptr<const Patch> patch;
  std::shared_ptr<const ScenePatch> drawn_patch;
  std::uint32_t patches = 0;

  Server server;
};

ViewerServer::ViewerServer(const ViewerOptions& options, ViewedRun& run)
    : impl_(std::make_unique<Impl>(options, run)) {}

ViewerServer::~ViewerServer() = default;

const std::string& ViewerServer::url() const noexcept {
  return impl_->server.url();
}

void ViewerServer::show_scene(std::shared_ptr<const Scene> scene) {
  {
    const std::lock_guard lock(impl_->drawn_mutex);
    impl_->scene = scene;
  }
  impl_->server.post([&](Mailbox& mailbox) {
    mailbox.scene = std::move(scene);
    mailbox.picture.reset();
    mailbox.ticks.clear();
  });
}

void ViewerServer::show_picture(SurfacePicture picture, const Body* body) {
  ShownPicture shown;
  {
    const std::lock_guard lock(impl_->drawn_mutex);
    shown.scene = impl_->scene;
  }
  if (shown.scene == nullptr) return;
  if (picture.patch != impl_->patch || shown.scene != impl_->patch_scene) {
    impl_->patch = picture.patch;
    impl_->patch_scene = shown.scene;
    impl_->drawn_patch.reset();
    if (picture.patch != nullptr && body != nullptr) {
      auto drawn = std::make_shared<ScenePatch>(make_scene_patch(*body, *shown.scene, *picture.patch));
      drawn->number = ++impl_->patches;
      impl_->drawn_patch = std::move(drawn);
    }
  }
  shown.patch = impl_->drawn_patch;
  picture.patch.reset();
  if (!fits(picture, *shown.scene, shown.patch.get())) return;
  shown.picture = std::move(picture);
  impl_->server.post([&](Mailbox& mailbox) { mailbox.picture = std::move(shown); });
}

void ViewerServer::show_ticks(std::span<const TickNote> ticks, std::int64_t stride) {
  if (ticks.empty()) return;
  Mailbox::Ticks copy{{ticks.begin(), ticks.end()}, stride};
  impl_->server.post([&](Mailbox& mailbox) {
    mailbox.ticks.push_back(std::move(copy));
    if (mailbox.ticks.size() > most_waiting) mailbox.ticks.pop_front();
  });
}

void ViewerServer::show_state(const std::string& json) {
  RunState state(json);
  impl_->server.post([&](Mailbox& mailbox) {
    if (!state.times().is_null()) mailbox.times = state.times();
    mailbox.state = std::move(state);
  });
}

}  // namespace palpate
