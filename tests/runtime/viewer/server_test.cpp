// The viewer's server over real sockets.
#include <gtest/gtest.h>

#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <optional>
#include <random>
#include <thread>

#include "base/error.h"
#include "runtime/body/patch_maker.h"
#include "runtime/scene/node_order.h"
#include "runtime/serving/admission.h"
#include "runtime/viewer/viewer_server.h"
#include "runtime/web/page.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/files/meshes_files.h"
#include "tests/support/files/viewer_client.h"
#include "tests/support/files/viewer_decoder.h"

namespace palpate::server_test {
namespace {

using test::Asking;
using test::Client;
using test::Json;
namespace http = test::http;
namespace websocket = test::websocket;

/// Writes down what it is asked.
class Asked : public ViewedRun {
 public:
  void point(const PointerPose& wanted) override {
    note("point " + std::to_string(wanted.pose.position.x()) + (wanted.lifted ? " lifted" : ""));
  }
  void lose_pointer() override { note("lose_pointer"); }
  void pause(bool paused) override { note(paused ? "pause" : "go on"); }
  void step_once() override { note("step"); }
  void reset() override { note("reset"); }
  void acknowledge() override { note("acknowledge"); }
  void change(const SettingsChange& settings) override {
    if (settings.contains("friction")) throw Error("friction is -1", "--friction", "give a positive one");
    if (settings.contains("safety")) throw PageError(PageRefusal::hand, "a hand", "--safety", "no");
    note("change " + std::to_string(settings.size()));
  }
  void record(bool on) override { note(on ? "record" : "record no more"); }
  void seek(std::int64_t frame) override { note("seek " + std::to_string(frame)); }
  std::optional<RecordedFrame> recorded_frame(std::int64_t frame) override {
    RecordedFrame recorded{std::min<std::int64_t>(frame, 99), {}};
    recorded.picture.frame.tick = 1000 + recorded.frame;
    recorded.picture.frame.displacement.assign(displacements, static_cast<float>(recorded.frame));
    return recorded;
  }
  std::size_t displacements = 0;

  /// Waits for it, which may be among what was asked already.
  void wait_for(const std::string& word, std::ptrdiff_t times = 1) {
    std::unique_lock lock(mutex_);
    heard_.wait(lock, [&] { return std::count(words_.begin(), words_.end(), word) >= times; });
  }
  std::vector<std::string> words() {
    const std::lock_guard lock(mutex_);
    return words_;
  }

 private:
  void note(const std::string& word) {
    const std::lock_guard lock(mutex_);
    words_.push_back(word);
    heard_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable heard_;
  std::vector<std::string> words_;
};

constexpr const char* step = R"({"type":"step"})";
constexpr const char* take_control = R"({"type":"control","take":true})";
constexpr const char* give_control = R"({"type":"control","take":false})";

class Viewer : public testing::Test {
 protected:
  Asked run_;
  std::unique_ptr<ViewerServer> server_ = serve({.port = 0});
  Body body_{test::unit_model(ElementType::tet4, 3, Scope::full, Precision::double_precision), {}, 2};
  std::shared_ptr<const Scene> scene_ = std::make_shared<const Scene>(make_scene(body_, 1));

  [[nodiscard]] std::unique_ptr<ViewerServer> serve(const ViewerOptions& options, bool is_replay = false) {
    return std::make_unique<ViewerServer>(ViewerPort(options), std::vector<RunToShow>{{run_, is_replay}});
  }
  [[nodiscard]] test::Served served() const { return test::Served(server_->url()); }
  [[nodiscard]] std::uint16_t port() const { return served().port; }
  [[nodiscard]] Client client(const Asking& asking = {}) const { return Client(served(), asking); }

  [[nodiscard]] SurfacePicture picture(std::int64_t tick) const {
    SurfacePicture picture;
    picture.frame.tick = tick;
    picture.frame.displacement.assign(3 * body_.surface_rest_positions().size(), 0.0F);
    return picture;
  }
  [[nodiscard]] double tick_of(const std::string& frame) const {
    return test::decode_frame(frame, scene_->nodes.size()).tick;
  }
  /// Reads frames until that of a tick.
  void hear_frame(Client& client, std::int64_t tick) const {
    while (tick_of(client.receive(3)) != static_cast<double>(tick)) {
    }
  }
};

bool is_controller(const Json& state) {
  return state.at("you") == "controller";
}

TEST_F(Viewer, ServesItsPageAndNothingElse) {
  EXPECT_EQ(server_->url(), "http://127.0.0.1:" + std::to_string(port()) + "/" + served().query);
  const test::Answer page = test::ask(served(), {.target = "/"});
  EXPECT_EQ(page.result_int(), 200U);
  EXPECT_EQ(page.body(), viewer_page());
  EXPECT_EQ(page[http::field::content_type], "text/html; charset=utf-8");
  EXPECT_EQ(page["X-Content-Type-Options"], "nosniff");
  EXPECT_EQ(page["Referrer-Policy"], "no-referrer");
  EXPECT_EQ(page["Cross-Origin-Resource-Policy"], "same-origin");
  EXPECT_EQ(page.count("Access-Control-Allow-Origin"), 0U);
  const std::string policy(page["Content-Security-Policy"]);
  EXPECT_TRUE(policy.starts_with("default-src 'none'; script-src ")) << policy;
  EXPECT_EQ(policy.find("unsafe"), std::string::npos) << policy;
  EXPECT_NE(policy.find("connect-src 'self' ws://127.0.0.1:" + std::to_string(port()) + ";"),
            std::string::npos)
      << policy;

  const test::Answer header = test::ask(served(), {.target = "/"}, http::verb::head);
  EXPECT_EQ(header.result_int(), 200U);
  EXPECT_TRUE(header.body().empty());
  EXPECT_EQ(header[http::field::content_length], std::to_string(viewer_page().size()));

  for (const char* target : {"/index.html", "/../etc/passwd", "/surface.stl", "/surface.vtu", "//"})
    EXPECT_EQ(test::ask(served(), {.target = target}).result_int(), 404U) << target;
  EXPECT_EQ(test::ask(served(), {.target = "/socket"}).result_int(), 404U);  // without an upgrade
  const test::Answer post = test::ask(served(), {.target = "/"}, http::verb::post);
  EXPECT_EQ(post.result_int(), 405U);
  EXPECT_EQ(post[http::field::allow], "GET, HEAD");
}

TEST_F(Viewer, RefusesForeignHostsAndPages) {
  const std::string own = "127.0.0.1:" + std::to_string(port());
  const std::string foreign = "evil.example:" + std::to_string(port());
  EXPECT_EQ(test::ask(served(), {.target = "/", .host = foreign}).result_int(), 403U);
  EXPECT_EQ(test::ask(served(), {.target = "/", .host = "192.168.1.5:9000"}).result_int(), 403U);
  EXPECT_TRUE(test::ask(served(), {.target = "/", .host = foreign}).body().find("lead here") !=
              std::string::npos);
  for (const char* tunnel : {"localhost:9000", "127.0.0.1", "[::1]:1"})
    EXPECT_EQ(Client(served(), {.host = tunnel, .origin = std::string("http://") + tunnel}).status, 101U)
        << tunnel;
  EXPECT_EQ(Client(served(), {.host = "localhost:9000", .origin = "http://localhost:9001"}).status, 403U);
  EXPECT_EQ(test::ask(served(), {.target = "/", .origin = "http://evil.example"}).result_int(), 403U);
  EXPECT_EQ(Client(served(), {.host = foreign, .origin = "http://" + foreign}).status, 403U);
  EXPECT_EQ(Client(served(), {.origin = "http://evil.example"}).status, 403U);
  EXPECT_EQ(Client(served(), {.origin = "null"}).status, 403U);
  EXPECT_EQ(Client(served(), {.origin = "http://" + own}).status, 101U);
  const std::string name = "localhost:" + std::to_string(port());
  EXPECT_EQ(Client(served(), {.host = name, .origin = "http://" + name}).status, 101U);
  EXPECT_EQ(Client(served(), {.target = "/other"}).status, 404U);
  EXPECT_EQ(Client(served(), {.subprotocol = "palpate.1"}).status, 400U);
  EXPECT_EQ(Client(served(), {.subprotocol = "palpate.3, palpate.2"}).subprotocol, "palpate.2");
  EXPECT_EQ(Client(served(), {.subprotocol = ""}).status, 101U);
}

TEST_F(Viewer, ServesTheBookToEveryPageOfThisAddress) {
  const test::ScratchFolder book;
  (void)book.write("index.html", "the book");
  (void)book.write("page.css", "");
  server_ = serve({.port = 0, .book = book.path()});
  const auto ask = [&](Asking asking, http::verb method = http::verb::get) {
    asking.query = "";
    return test::ask(served(), asking, method);
  };
  const test::Answer page = ask({.target = "/book/index.html"});
  EXPECT_EQ(page.result_int(), 200U);
  EXPECT_EQ(page.body(), "the book");
  EXPECT_EQ(page[http::field::content_type], "text/html; charset=utf-8");
  EXPECT_EQ(page["X-Content-Type-Options"], "nosniff");
  EXPECT_EQ(page["Cross-Origin-Resource-Policy"], "same-origin");
  EXPECT_TRUE(page["Content-Security-Policy"].starts_with(
      "default-src 'none'; script-src 'self'; style-src 'self';"));
  EXPECT_EQ(ask({.target = "/book/index.html?q=tool"}).body(), "the book");
  EXPECT_EQ(ask({.target = "/book/page.css"})[http::field::content_type], "text/css; charset=utf-8");
  EXPECT_EQ(ask({.target = "/book/index.html"}, http::verb::head)[http::field::content_length], "8");
  for (const char* target : {"/book/", "/book/../index.html", "/book//index.html", "/book/missing.html"})
    EXPECT_EQ(ask({.target = target}).result_int(), 404U) << target;
  for (const char* target : {"/book", "/books/index.html", "/x/../book/index.html"})
    EXPECT_EQ(ask({.target = target}).result_int(), 403U)
        << target << ": is not the book's, and has no token";
  const std::string foreign = "evil.example:" + std::to_string(port());
  EXPECT_EQ(ask({.target = "/book/index.html", .host = foreign}).result_int(), 403U);
  EXPECT_EQ(ask({.target = "/book/index.html", .origin = "http://evil.example"}).result_int(), 403U);
  EXPECT_EQ(ask({.target = "/book/index.html"}, http::verb::post).result_int(), 405U);
  EXPECT_EQ(client().receive("hello").at("book"), true);
}

TEST_F(Viewer, IsWithoutABookWhereThereIsNone) {
  server_ = serve({.port = 0, .book = {}});
  EXPECT_EQ(test::ask(served(), {.target = "/book/index.html"}).result_int(), 404U);
  EXPECT_EQ(client().receive("hello").at("book"), false);
}

TEST_F(Viewer, AsksForATokenWhereverItIs) {
  std::string before;
  for (const char* address : {"127.0.0.1", "0.0.0.0"}) {
    server_ = serve({.address = address, .port = 0});
    const std::string& url = server_->url();
    ASSERT_EQ(url.substr(0, 17), "http://127.0.0.1:");
    const std::string token = served().query;
    EXPECT_EQ(token.size(), 7U + 32U);
    EXPECT_NE(token, before) << "it is another one each time";
    before = token;
    server_->show_scene(scene_);
    server_->show_picture(picture(0));
    Client page = client();
    hear_frame(page, 0);
    const std::string wrong = "?token=" + std::string(32, '0');
    for (const char* path : {"/", "/surface.stl", "/surface.vtu", "/nothing", "/socket"}) {
      for (const std::string& query : {std::string(), wrong, token + "0", token.substr(0, token.size() - 1)})
        EXPECT_EQ(test::ask(served(), {.target = path, .query = query}).result_int(), 403U) << path << query;
    }
    for (const char* path : {"/", "/surface.stl", "/surface.vtu"})
      EXPECT_EQ(test::ask(served(), {.target = path}).result_int(), 200U) << path;
    for (const std::string& query : {std::string(), wrong}) EXPECT_EQ(client({.query = query}).status, 403U);
    EXPECT_EQ(client().status, 101U);
  }
}

TEST_F(Viewer, GivesWhoHasNoTokenThePageWhichSaysWhatToDo) {
  const test::Answer page = test::ask(served(), {.target = "/", .query = "?token=0"});
  EXPECT_EQ(page.result_int(), 403U);
  EXPECT_EQ(page.body(), viewer_page());
  EXPECT_TRUE(page["Content-Security-Policy"].starts_with("default-src 'none'; script-src "));
  EXPECT_LT(test::ask(served(), {.target = "/surface.stl", .query = ""}).body().size(), 200U);
}

TEST_F(Viewer, ProvesToWhoeverAsksFromHereThatItHasTheToken) {
  const std::string nonce(32, '1');
  EXPECT_EQ(proof_of(std::string(32, '0'), nonce),
            "b11c187293f67c5a4fca84d509b3354537528291ae4d1f9315b9868b02f4305a");
  const auto ask = [&](Asking asking) {
    asking.target = "/proof";
    return test::ask(served(), asking);
  };
  const std::string own = served().query.substr(std::string("?token=").size());
  EXPECT_EQ(ask({.query = "?nonce=" + nonce}).body(), proof_of(own, nonce) + "\n");
  for (const std::string& wrong : {std::string(), nonce + "1", std::string(32, 'x')})
    EXPECT_EQ(ask({.query = "?nonce=" + wrong}).result_int(), 400U) << wrong;
  EXPECT_EQ(ask({.query = "?nonce=" + nonce, .host = "evil.example"}).result_int(), 403U);
  EXPECT_EQ(ask({.query = "?nonce=" + nonce, .origin = "http://evil.example"}).result_int(), 403U);
}

TEST_F(Viewer, HasTheTokenOfTheRunBeforeThatShowedTheSame) {
  const test::ScratchFolder secrets;
  const std::filesystem::path kept =
      secrets.path() / "palpate" / ("viewer-" + std::to_string(port()) + ".token");
  const ViewerOptions one = {.port = port(), .shows = {"one.palpate.hdf"}};
  const auto token = [&](const ViewerOptions& options) {
    server_.reset();
    server_ = serve(options);
    return served().query;
  };
  setenv("XDG_RUNTIME_DIR", secrets.path().c_str(), 1);
  const std::string first = token(one);
  EXPECT_EQ(token(one), first);
  EXPECT_EQ(std::filesystem::status(kept).permissions(), std::filesystem::perms(0600));
  std::filesystem::permissions(kept, std::filesystem::perms(0640));
  const std::string second = token(one);
  EXPECT_NE(second, first) << "others could have read it";
  const ViewerOptions to_all = {.address = "0.0.0.0", .port = one.port, .shows = one.shows};
  const ViewerOptions to_a_program = {.port = one.port, .told = 1, .shows = one.shows};
  for (const ViewerOptions& other : {ViewerOptions{.port = one.port}, to_all, to_a_program})
    EXPECT_NE(token(other), second);
  EXPECT_EQ(token(one), second);
  EXPECT_NE(token({.port = one.port, .shows = {"one.palpate.hdf", "two.mcap"}}), second);
  EXPECT_NE(token(one), second) << "something else was shown since";
  std::filesystem::permissions(kept.parent_path(), std::filesystem::perms::all);
  std::filesystem::remove(kept);
  EXPECT_NE(token(one), token(one)) << "it is kept where others may write";
  unsetenv("XDG_RUNTIME_DIR");
}

TEST_F(Viewer, SaysHelloThenStateSceneAndPicture) {
  server_->show_state(R"({"ticks":5})");
  server_->show_scene(scene_);
  server_->show_picture(picture(42));
  hear_frame(*std::make_unique<Client>(served()), 42);  // all has arrived
  Client page = client();
  const Json hello = Json::parse(page.receive().bytes);
  EXPECT_EQ(hello.at("type"), "hello");
  EXPECT_EQ(hello.at("mode"), "live");
  const Json state = Json::parse(page.receive().bytes);
  EXPECT_EQ(state.at("type"), "state");
  EXPECT_EQ(state.at("ticks"), 5);
  EXPECT_EQ(state.at("scene"), 1);
  const Client::Said scene = page.receive();
  EXPECT_EQ(test::decode_scene(scene.bytes).position.size(), 3 * scene_->nodes.size());
  EXPECT_EQ(tick_of(page.receive().bytes), 42.0);
}

TEST_F(Viewer, RepeatsTheStateTwiceASecond) {
  server_->show_state(R"({"ticks":5})");
  Client page = client();
  for (int k = 0; k < 3; ++k) EXPECT_EQ(page.receive("state").at("ticks"), 5);
}

TEST_F(Viewer, SendsAPatchBeforeTheFirstFrameOnIt) {
  const Index centre = body_.nearest_surface_node(test::top_middle(3)).node;
  PatchMaker maker(body_, 1);
  const auto patch = maker.make({&centre, 1});
  server_->show_scene(scene_);
  Client page = client();
  page.receive(1);
  const auto shown = [&](std::int64_t tick, std::shared_ptr<const Patch> of) {
    SurfacePicture next = picture(tick);
    next.patch = std::move(of);
    server_->show_picture(std::move(next), &body_);
  };
  shown(1, patch);
  const test::DecodedPatch first = test::decode_patch(page.receive().bytes);
  EXPECT_EQ(first.patch, 1U);
  EXPECT_EQ(first.position.size(), 3 * patch->surface_nodes().size());
  EXPECT_EQ(test::decode_frame(page.receive().bytes, scene_->nodes.size()).patch, 1U);
  shown(2, patch);  // known
  EXPECT_EQ(test::decode_frame(page.receive().bytes, scene_->nodes.size()).patch, 1U);
  shown(3, nullptr);
  EXPECT_EQ(test::decode_frame(page.receive().bytes, scene_->nodes.size()).patch, 0U);
  shown(4, maker.make({&centre, 1}));
  EXPECT_EQ(test::decode_patch(page.receive().bytes).patch, 2U);
  EXPECT_EQ(test::decode_frame(page.receive().bytes, scene_->nodes.size()).patch, 2U);
  Client late = client();
  EXPECT_EQ(test::decode_patch(late.receive(2)).patch, 2U);
}

TEST_F(Viewer, ShowsNoPictureOfAnotherBody) {
  server_->show_scene(scene_);
  Client page = client();
  server_->show_picture(picture(1));
  hear_frame(page, 1);
  const Body other(test::unit_model(ElementType::tet4, 4, Scope::full, Precision::double_precision));
  server_->show_scene(std::make_shared<const Scene>(make_scene(other, 2)));
  SurfacePicture small;
  small.frame.tick = 2;
  small.frame.displacement.assign(3 * scene_->nodes.size(), 0.0F);
  server_->show_picture(std::move(small));  // of the body before
  EXPECT_EQ(test::decode_scene(page.receive(1)).scene, 2U);
  SurfacePicture fitting;
  fitting.frame.tick = 3;
  fitting.frame.displacement.assign(3 * other.surface_rest_positions().size(), 0.0F);
  server_->show_picture(std::move(fitting));
  const test::DecodedFrame frame = test::decode_frame(page.receive(3), other.surface_rest_positions().size());
  EXPECT_EQ(frame.tick, 3.0);
  EXPECT_EQ(frame.scene, 2U);
}

TEST_F(Viewer, OnlyTheControllerIsObeyed) {
  server_->show_state(R"({"pointer":true})");
  Client first = client();
  EXPECT_EQ(first.receive("state", is_controller).at("pointer"), true);
  Client second = client();
  const Json state = second.receive("state");
  EXPECT_EQ(state.at("you"), "watcher");
  EXPECT_EQ(state.at("controlled"), true);
  EXPECT_EQ(state.at("watchers"), 2);
  EXPECT_EQ(state.at("pointer"), false);

  second.say(step);
  const Json refused = second.receive("error");
  EXPECT_EQ(refused.at("about"), "step");
  EXPECT_EQ(refused.at("reason"), "control");
  second.say(take_control);
  EXPECT_EQ(second.receive("error").at("about"), "control");
  for (const char* word :
       {R"({"type":"point","position":[2,0,0],"orientation":[0,0,0,1],"grab":false,"lifted":true})",
        R"({"type":"pause","paused":true})", R"({"type":"pause","paused":false})", step,
        R"({"type":"reset"})", R"({"type":"acknowledge"})", R"({"type":"change","settings":{"tool":null}})",
        R"({"type":"record","on":true})", R"({"type":"record","on":false})", R"({"type":"seek","frame":9})"})
    first.say(word);
  run_.wait_for("seek 9");
  EXPECT_EQ(run_.words(),
            (std::vector<std::string>{"point 2.000000 lifted", "pause", "go on", "step", "reset",
                                      "acknowledge", "change 1", "record", "record no more", "seek 9"}));
}

TEST_F(Viewer, ControlIsHandedOver) {
  server_->show_state("{}");
  Client first = client();
  first.receive("state", is_controller);
  Client second = client();
  second.receive("state");
  first.say(give_control);
  run_.wait_for("lose_pointer");
  second.receive("state", [](const Json& state) { return state.at("controlled") == false; });
  second.say(take_control);
  second.receive("state", is_controller);
  first.receive("state",
                [](const Json& state) { return !is_controller(state) && state.at("controlled") == true; });
  second.say(step);
  run_.wait_for("step");
}

TEST_F(Viewer, PointerIsLostWithItsPage) {
  server_->show_state("{}");
  Client first = client();
  first.receive("state", is_controller);
  Client second = client();
  second.receive("state");
  first.cut();
  run_.wait_for("lose_pointer");
  second.receive("state", [](const Json& state) { return state.at("controlled") == false; });
  second.say(step);
  EXPECT_EQ(second.receive("error").at("about"), "step");
  second.say(take_control);
  second.receive("state", is_controller);
  second.cut();
  run_.wait_for("lose_pointer", 2);
  Client again = client();  // the only page: a reload
  again.receive("state", is_controller);
}

TEST_F(Viewer, AProgramThatWatchesLeavesControlToThePage) {
  server_->show_state("{}");
  Client program = client({.query = served().query + "&watch"});
  EXPECT_EQ(program.receive("state").at("you"), "watcher");
  Client page = client();
  page.receive("state", is_controller);
  page.cut();
  run_.wait_for("lose_pointer");
  Client again = client();
  again.receive("state", is_controller);
  Client other = client();
  EXPECT_EQ(other.receive("state").at("you"), "watcher");
}

TEST_F(Viewer, TellsThePageWhatCannotBe) {
  Client page = client();
  page.say(R"({"type":"change","settings":{"friction":"-1"}})");
  EXPECT_EQ(page.receive("error"), (Json{{"type", "error"},
                                         {"about", "change"},
                                         {"reason", "value"},
                                         {"what", "friction is -1"},
                                         {"where", "--friction"},
                                         {"hint", "give a positive one"}}));
  page.say(R"({"type":"change","settings":{"safety":"max_force=9"}})");
  EXPECT_EQ(page.receive("error").at("reason"), "hand");
  page.say(step);
  run_.wait_for("step");
}

TEST_F(Viewer, ClosesOnlyThePageThatTalksNonsense) {
  server_->show_scene(scene_);
  Client good = client();
  good.receive("hello");
  const auto closed = [&](auto&& talk) {
    Client bad = client();
    talk(bad);
    return bad.hear_end();
  };
  const websocket::close_reason text = closed([](Client& bad) { bad.say("{"); });
  EXPECT_EQ(text.code, websocket::close_code::bad_payload);
  EXPECT_EQ(text.reason, "the message is not JSON");
  const websocket::close_reason unknown = closed([](Client& bad) { bad.say(R"({"type":"stop"})"); });
  EXPECT_EQ(unknown.code, websocket::close_code::bad_payload);
  EXPECT_FALSE(unknown.reason.empty());
  EXPECT_EQ(closed([](Client& bad) { bad.say_binary(step); }).code, websocket::close_code::unknown_data);
  EXPECT_EQ(closed([](Client& bad) { bad.say(std::string(16385, ' ')); }).code,
            websocket::close_code::too_big);
  EXPECT_EQ(closed([](Client& bad) { bad.say("\"\xff\""); }).code, websocket::close_code::bad_payload);
  (void)closed([](Client& bad) {  // not a frame at all
    test::asio::write(bad.connection(), test::asio::buffer(std::string(100, '\xff')));
  });
  good.say(step);
  run_.wait_for("step");
  server_->show_picture(picture(1));
  hear_frame(good, 1);
  EXPECT_EQ(run_.words(), std::vector<std::string>{"step"});
}

TEST_F(Viewer, RefusesWhatIsNoRequest) {
  const std::string host = "Host: 127.0.0.1:" + std::to_string(port()) + "\r\n";
  for (const std::string& bytes :
       {std::string("GARBAGE\r\n\r\n"), std::string(100, '\0'),
        "GET / HTTP/1.1\r\n" + host + "X: " + std::string(20000, 'x') + "\r\n\r\n",
        std::string("GET / HTTP/1.1\r\n\r\n"), "GET / HTTP/1.1\r\n" + host + "Host: evil.example\r\n\r\n"}) {
    test::asio::io_context context;
    test::tcp::socket socket(context);
    socket.connect(test::local(port()));
    boost::system::error_code problem;
    test::asio::write(socket, test::asio::buffer(bytes), problem);
    std::string answer;
    test::asio::read(socket, test::asio::dynamic_buffer(answer), problem);
    EXPECT_TRUE(answer.empty() || answer.starts_with("HTTP/1.1 403")) << answer;
  }
  EXPECT_EQ(client().status, 101U);
}

/// A scene whose pictures fill a slow page's buffers soon.
class SlowPages : public Viewer {
 protected:
  static constexpr std::size_t nodes = 20'000;
  static constexpr std::int64_t ticks_a_picture = 64;

  SlowPages() {
    Scene large;
    large.number = 1;
    large.nodes.assign(nodes, Vec3::Zero());
    large.held.assign(nodes, 0);
    large.order = order_along_curve(large.nodes);
    scene_ = std::make_shared<const Scene>(large);
    server_->show_scene(scene_);
  }
  /// Of a page, from one picture to the next.
  struct Follower {
    Client& page;
    std::optional<test::DecodedFrame> frame{};
    std::size_t bytes = 0;

    void take(const std::string& message) {
      frame = test::decode_frame(message, nodes, frame ? &*frame : nullptr);
      bytes += message.size();
    }
    void follow_to(std::int64_t tick) {
      do take(page.receive(3));
      while (frame->tick != static_cast<double>(tick));
    }
  };
  void expect_last_picture(const test::DecodedFrame& frame) const {
    ASSERT_EQ(frame.u.size(), last_.size());
    for (std::size_t k = 0; k < nodes; k += 37) {
      const auto node = static_cast<std::size_t>(scene_->order[k]);
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(frame.u[3 * k + axis], last_[3 * node + axis], 0.5 * frame.unit_u);
    }
  }

  void show(std::int64_t tick) {
    SurfacePicture next;
    next.frame.tick = tick;
    next.frame.displacement.resize(3 * nodes);
    for (float& u : next.frame.displacement) u = static_cast<float>(random_() % 1000);  // all of them move
    last_ = next.frame.displacement;
    server_->show_picture(std::move(next));
    std::vector<TickNote> notes(ticks_a_picture);
    for (std::size_t k = 0; k < notes.size(); ++k)
      notes[k].number = ticks_a_picture * tick + static_cast<std::int64_t>(k);
    server_->show_ticks(notes);
  }

  std::vector<float> last_;  // displacements of the last picture

 private:
  std::mt19937 random_{5};
};

TEST_F(SlowPages, MissPicturesAndHoldUpNobody) {
  constexpr std::int64_t pictures = 50;  // of 0.12 MB
  Client slow = client();
  slow.connection().set_option(test::asio::socket_base::receive_buffer_size(1 << 16));
  Client quick = client();
  slow.receive(1);
  quick.receive(1);
  Follower of_quick{quick};
  Follower of_slow{slow};
  std::int64_t frames = 0;
  std::int64_t most_ticks = 0;
  std::int64_t last_tick = -1;
  double last = -1.0;
  const auto read_slowly = [&] {
    const Client::Said said = slow.receive();
    if (said.kind() == 3) {
      of_slow.take(said.bytes);
      const double tick = of_slow.frame->tick;
      EXPECT_GT(tick, last);
      last = tick;
      ++frames;
    } else if (said.kind() == 4) {
      const test::DecodedTicks ticks = test::decode_ticks(said.bytes);
      EXPECT_GT(static_cast<std::int64_t>(ticks.first), last_tick);
      most_ticks = std::max(most_ticks, std::ssize(ticks.shown));
      last_tick = static_cast<std::int64_t>(ticks.first) + std::ssize(ticks.shown) - 1;
    }
  };
  for (std::int64_t tick = 0; tick < pictures; ++tick) {
    show(tick);
    of_quick.follow_to(tick);           // each of them
    if (tick % 10 == 9) read_slowly();  // a page that reads nothing for ten seconds is cut
  }
  expect_last_picture(*of_quick.frame);
  while (last != pictures - 1 || last_tick != ticks_a_picture * pictures - 1) read_slowly();
  EXPECT_LT(frames, pictures / 2);
  expect_last_picture(*of_slow.frame);
  EXPECT_EQ(most_ticks, 2000);  // two seconds in one message
}

TEST_F(SlowPages, AreSentSixMegabytesASecondAtMost) {
  Client page = client();
  page.receive(1);
  Follower follower{page};
  show(0);
  follower.follow_to(0);
  const auto begun = std::chrono::steady_clock::now();
  const std::size_t first = follower.bytes;
  std::size_t before_last = 0;  // its own time comes after it
  for (std::int64_t tick = 1; tick <= 20; ++tick) {
    before_last = follower.bytes;
    show(tick);
    follower.follow_to(tick);
  }
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begun;
  EXPECT_GT(before_last - first, 1'000'000U);
  EXPECT_LT(static_cast<double>(before_last - first), 6.1e6 * passed.count());
}

TEST_F(SlowPages, MissTheTicksOfTheBodyBefore) {
  Client slow = client();
  slow.connection().set_option(test::asio::socket_base::receive_buffer_size(1 << 16));
  slow.receive(1);
  Client quick = client();
  quick.receive(1);
  for (std::int64_t tick = 0; tick < 30; ++tick) {  // until ticks wait
    show(tick);
    hear_frame(quick, tick);
  }
  Scene other = *scene_;
  other.number = 2;
  server_->show_scene(std::make_shared<const Scene>(other));
  EXPECT_EQ(test::decode_scene(quick.receive(1)).scene, 2U);
  while (test::decode_scene(slow.receive(1)).scene != 2) {
  }
  show(30);
  hear_frame(slow, 30);
}

TEST_F(SlowPages, AreClosedWhenTheyDoNotReadForTenSeconds) {
  server_->show_state("{}");
  Client slow = client();
  slow.connection().set_option(test::asio::socket_base::receive_buffer_size(1 << 16));
  slow.receive("state", is_controller);
  test::asio::io_context context;
  test::tcp::socket half_a_request(context);
  half_a_request.connect(test::local(port()));
  test::asio::write(half_a_request, test::asio::buffer(std::string("GET / HT")));
  std::atomic<bool> done = false;
  std::thread shows([&] {
    for (std::int64_t tick = 0; !done; ++tick) {
      show(tick);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  const auto begun = std::chrono::steady_clock::now();
  run_.wait_for("lose_pointer");
  // Else it is the pings that end it, after half a minute.
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(25));
  done = true;
  shows.join();
  std::string answer;
  boost::system::error_code end;
  test::asio::read(half_a_request, test::asio::dynamic_buffer(answer), end);
  EXPECT_TRUE(answer.empty());
  EXPECT_TRUE(end);
}

TEST_F(Viewer, ReplayKeepsTicksAndTimesForLaterPages) {
  server_ = serve({.port = 0}, true);
  std::vector<TickNote> notes(5000);
  for (std::size_t k = 0; k < notes.size(); ++k) notes[k].number = 4 * static_cast<std::int64_t>(k);
  server_->show_state(R"({"frames":2,"times":[0,0.5]})");
  server_->show_scene(scene_);
  server_->show_ticks(notes, 4);
  server_->show_state(R"({"frames":2})");
  for (int k = 0; k < 2; ++k) {
    Client page = client();
    EXPECT_EQ(page.receive("hello").at("mode"), "replay");
    const Json state = page.receive("state", [](const Json& s) { return s.contains("frames"); });
    EXPECT_EQ(state.at("times"), Json({0, 0.5}));
    const test::DecodedTicks ticks = test::decode_ticks(page.receive(4));
    EXPECT_EQ(ticks.shown.size(), 5000U);
    EXPECT_EQ(ticks.stride, 4U);
    EXPECT_FALSE(page.receive("state").contains("times"));
  }
}

TEST_F(Viewer, WatchersOfAReplayLeafForThemselves) {
  server_ = serve({.port = 0}, true);
  run_.displacements = 3 * body_.surface_rest_positions().size();
  server_->show_state(R"({"frames":100,"frame":0})");
  server_->show_scene(scene_);
  server_->show_picture(picture(1));
  Client steers = client();
  steers.receive("state", is_controller);
  hear_frame(steers, 1);
  Client watches = client();
  hear_frame(watches, 1);
  const auto is_alone = [](const Json& state) { return state.at("alone") == true; };
  for (const int frame : {7, 40, 5000}) {
    watches.say(R"({"type":"seek","frame":)" + std::to_string(frame) + "}");
    const int shown = std::min(frame, 99);
    const Json state =
        watches.receive("state", [&](const Json& s) { return is_alone(s) && s.at("frame") == shown; });
    EXPECT_EQ(state.at("you"), "watcher");
    hear_frame(watches, 1000 + shown);
  }
  // What all see goes on without the one that looks alone, until it follows.
  server_->show_picture(picture(2));
  hear_frame(steers, 2);
  server_->show_picture(picture(3));
  hear_frame(steers, 3);
  watches.say(R"({"type":"seek","frame":8})");
  EXPECT_EQ(tick_of(watches.receive(3)), 1008.0);
  watches.say(R"({"type":"follow"})");
  EXPECT_EQ(watches.receive("state", [&](const Json& s) { return !is_alone(s); }).at("frame"), 0);
  EXPECT_EQ(tick_of(watches.receive(3)), 3.0);
  // Who steers moves all.
  steers.say(R"({"type":"seek","frame":9})");
  run_.wait_for("seek 9");
  EXPECT_EQ(run_.words(), std::vector<std::string>{"seek 9"});
}

TEST_F(Viewer, ItIsInFramesOfOthersOnlyWhereThatIsAskedFor) {
  const auto policy = [&] {
    return std::string(test::ask(served(), {.target = "/"})["Content-Security-Policy"]);
  };
  EXPECT_TRUE(policy().ends_with("frame-ancestors 'none'")) << policy();
  server_ = serve({.port = 0, .framed = true});
  EXPECT_TRUE(policy().ends_with("frame-ancestors 'self' http://localhost:* http://127.0.0.1:*")) << policy();
}

TEST_F(Viewer, TwoRunsHavePagesOfTheirOwn) {
  for (const char* target : {"/2/", "/beside"})
    EXPECT_EQ(test::ask(served(), {.target = target}).result_int(), 404U) << target << ": there is one run";
  Asked second;
  server_ = std::make_unique<ViewerServer>(ViewerPort({.port = 0}),
                                           std::vector<RunToShow>{{run_, false}, {second, true}});
  EXPECT_TRUE(server_->url().ends_with("/beside" + served().query));
  const auto policy = [&](const char* target) {
    const test::Answer page = test::ask(served(), {.target = target});
    EXPECT_EQ(page.result_int(), 200U) << target;
    return std::string(page["Content-Security-Policy"]);
  };
  for (const char* target : {"/", "/2/"})
    EXPECT_TRUE(policy(target).ends_with("frame-src 'none'; frame-ancestors 'self'")) << target;
  EXPECT_TRUE(policy("/beside").ends_with("frame-src 'self'; frame-ancestors 'none'"));
  for (const char* target : {"/2", "/2/beside", "/2/2/", "/3/"})
    EXPECT_EQ(test::ask(served(), {.target = target}).result_int(), 404U) << target;
  EXPECT_EQ(test::ask(served(), {.target = "/2/", .query = ""}).result_int(), 403U);

  for (const std::size_t run : {0U, 1U}) {
    server_->show_state("{}", run);
    server_->show_scene(scene_, run);
    server_->show_picture(picture(run == 0 ? 11 : 22), nullptr, run);
  }
  Client one = client();
  Client other = client({.target = "/2/socket"});
  EXPECT_EQ(one.receive("hello").at("mode"), "live");
  EXPECT_EQ(other.receive("hello").at("mode"), "replay");
  EXPECT_EQ(one.receive("state", is_controller).at("watchers"), 1);
  EXPECT_EQ(other.receive("state", is_controller).at("watchers"), 1) << "each run has a controller";
  hear_frame(one, 11);
  hear_frame(other, 22);
  const std::string saved =
      std::string(test::ask(served(), {.target = "/2/surface.stl"})[http::field::content_disposition]);
  EXPECT_EQ(saved, "attachment; filename=\"surface-tick-22.stl\"");
  other.say(R"({"type":"seek","frame":9})");
  second.wait_for("seek 9");
  one.say(step);
  run_.wait_for("step");
  EXPECT_EQ(run_.words(), std::vector<std::string>{"step"});
  EXPECT_EQ(second.words(), std::vector<std::string>{"seek 9"});
  server_.reset();  // before the second run
}

TEST_F(Viewer, WatchersOfARunDoNotLeaf) {
  server_->show_state("{}");
  server_->show_scene(scene_);
  server_->show_picture(picture(1));
  Client steers = client();
  steers.receive("state", is_controller);
  Client watches = client();
  watches.say(R"({"type":"seek","frame":8})");
  EXPECT_EQ(watches.receive("error").at("reason"), "control");
}

/// Connections that say nothing, or nothing that is enough.
class Held {
 public:
  Held(std::uint16_t port, int count, const std::string& said) {
    for (int k = 0; k < count; ++k) {
      sockets_.emplace_back(context_);
      sockets_.back().connect(test::local(port));
      test::asio::write(sockets_.back(), test::asio::buffer(said));
    }
  }

 private:
  test::asio::io_context context_;
  std::vector<test::tcp::socket> sockets_;
};

TEST_F(Viewer, HeldConnectionsGiveWay) {
  server_->show_state("{}");
  Client before = client();
  before.receive("state", is_controller);
  const std::string request = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port()) + "\r\n";
  for (const std::string& said : {std::string(), std::string("GET / HT"), request, request + "\r\n"}) {
    const Held held(port(), 40, said);
    EXPECT_EQ(test::ask(served(), {.target = "/"}).result_int(), 200U) << said;
    Client page = client();
    EXPECT_EQ(page.status, 101U) << said;
    page.receive("state");
  }
  before.say(step);  // who is in stays in
  run_.wait_for("step");
}

TEST_F(Viewer, PagesThatAreOpenAreNotCutForFurtherOnes) {
  server_->show_state("{}");
  std::vector<std::unique_ptr<Client>> pages;
  for (int k = 0; k < 32; ++k) {
    pages.push_back(std::make_unique<Client>(served()));
    ASSERT_EQ(pages.back()->status, 101U) << k;
  }
  EXPECT_EQ(client().status, 503U);
  EXPECT_EQ(test::ask(served(), {.target = "/"}).result_int(), 503U);
  EXPECT_EQ(test::ask(served(), {.target = "/", .query = ""}).result_int(), 403U);
  for (const auto& page : pages) EXPECT_EQ(page->receive("state").at("type"), "state");
  pages.pop_back();
  while (client().status != 101U)  // until it has noticed
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

TEST_F(Viewer, SurfaceCanBeSaved) {
  server_->show_scene(scene_);
  SurfacePicture seen = picture(8);
  for (std::size_t k = 0; k < body_.surface_rest_positions().size(); ++k)  // twice as high
    seen.frame.displacement[3 * k + 2] = static_cast<float>(body_.surface_in_mesh()[k].z());
  server_->show_picture(std::move(seen));
  Client page = client();
  hear_frame(page, 8);
  const test::Answer stl = test::ask(served(), {.target = "/surface.stl"});
  EXPECT_EQ(stl.result_int(), 200U);
  EXPECT_EQ(stl[http::field::content_disposition], "attachment; filename=\"surface-tick-8.stl\"");
  test::Bytes bytes(stl.body().substr(80));
  double volume = 0.0;
  for (std::uint32_t left = bytes.u32(); left > 0; --left) {
    Mat3 corners;
    for (int k = 0; k < 3; ++k) (void)bytes.take<float>();
    for (Eigen::Index k = 0; k < 9; ++k) corners(k % 3, k / 3) = bytes.take<float>();
    (void)bytes.take<std::uint16_t>();
    volume += corners.determinant() / 6.0;
  }
  EXPECT_NEAR(volume, 2.0, 1e-6);
  const test::Answer vtu = test::ask(served(), {.target = "/surface.vtu"});
  EXPECT_EQ(vtu.result_int(), 200U);
  EXPECT_TRUE(vtu.body().starts_with("<?xml"));
}

TEST_F(Viewer, PagesComeBackAfterARestartOnThePort) {
  server_->show_state("{}");
  Client page = client();
  page.receive("hello");
  const std::uint16_t taken = port();
  server_.reset();
  run_.wait_for("lose_pointer");
  (void)page.hear_end();
  server_ = serve({.port = taken});
  EXPECT_EQ(port(), taken);
  Client again = client();
  EXPECT_EQ(again.receive("hello").at("id"), 1);
}

TEST_F(Viewer, SaysWhyItCannotListen) {
  try {
    const ViewerPort second({.port = port()});
    FAIL() << "two have one port";
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), "127.0.0.1:" + std::to_string(port()));
    EXPECT_FALSE(error.hint().empty());
  }
  EXPECT_THROW(ViewerPort({.address = "elsewhere", .port = 0}), Error);
  EXPECT_THROW(ViewerPort({.address = "192.0.2.1", .port = 0}), Error);
}

TEST_F(Viewer, RefusesAStateThatIsNone) {
  EXPECT_THROW(server_->show_state("[1]"), Error);
}

}  // namespace
}  // namespace palpate::server_test
