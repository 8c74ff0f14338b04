// What pages and the runtime say in JSON, who may ask, and which ticks a slow page gets.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "runtime/serving/admission.h"
#include "runtime/viewer/page_word.h"
#include "runtime/viewer/run_words.h"
#include "runtime/viewer/tick_history.h"

namespace palpate::words_test {
namespace {

using Json = nlohmann::json;

PageWord parsed(const std::string& text) {
  std::string problem;
  const std::optional<PageWord> word = parse_page_word(text, problem);
  EXPECT_TRUE(word) << problem;
  return word.value_or(PageWord{});
}

/// Notes what it was asked last.
struct NotingRun : ViewedRun {
  std::string asked;
  PointerPose wanted;
  SettingsChange settings;

  void point(const PointerPose& pose) override {
    asked = "point";
    wanted = pose;
  }
  void pause(bool paused) override { asked = paused ? "pause" : "go on"; }
  void step_once() override { asked = "step"; }
  void reset() override { asked = "reset"; }
  void acknowledge() override { asked = "acknowledge"; }
  void change(const SettingsChange& changed) override {
    asked = "change";
    settings = changed;
  }
  void record(bool on) override { asked = on ? "record" : "end"; }
  void seek(std::int64_t frame) override { asked = "seek " + std::to_string(frame); }
};

NotingRun asked(const std::string& text) {
  NotingRun run;
  const PageWord word = parsed(text);
  if (word.ask) word.ask(run);
  return run;
}

TEST(PageWord, ThoseOfTheProtocolAreUnderstood) {
  const NotingRun point = asked(
      R"({"type":"point","position":[1,-2.5,3e-3],"orientation":[0.6,0,0,0.8],"grab":true,"lifted":false})");
  EXPECT_EQ(point.asked, "point");
  EXPECT_EQ(point.wanted.pose.position, Vec3(1, -2.5, 0.003));
  EXPECT_NEAR(point.wanted.pose.orientation.x(), 0.6, 1e-15);
  EXPECT_NEAR(point.wanted.pose.orientation.w(), 0.8, 1e-15);
  EXPECT_TRUE(point.wanted.pose.grab);
  EXPECT_FALSE(point.wanted.lifted);
  EXPECT_EQ(asked(R"({"type":"pause","paused":true})").asked, "pause");
  EXPECT_EQ(asked(R"({"type":"pause","paused":false})").asked, "go on");
  EXPECT_EQ(asked(R"({"type":"step"})").asked, "step");
  EXPECT_EQ(asked(R"({"type":"reset"})").asked, "reset");
  EXPECT_EQ(asked(R"({"type":"acknowledge"})").asked, "acknowledge");
  const NotingRun change = asked(R"({"type":"change","settings":{"tool":"sphere:0.005","overlay":null}})");
  EXPECT_EQ(change.asked, "change");
  EXPECT_EQ(change.settings, (SettingsChange{{"tool", "sphere:0.005"}, {"overlay", std::nullopt}}));
  EXPECT_EQ(asked(R"({"type":"record","on":false})").asked, "end");
  EXPECT_EQ(asked(R"({"type":"record","on":true})").asked, "record");
  EXPECT_EQ(asked(R"({"type":"seek","frame":123})").asked, "seek 123");
  EXPECT_EQ(parsed(R"({"type":"seek","frame":123})").frame, 123);
  EXPECT_EQ(parsed(R"({"type":"seek","frame":0})").type, "seek");
  for (const char* const take : {"true", "false"}) {
    const PageWord control = parsed(std::string(R"({"type":"control","take":)") + take + "}");
    EXPECT_EQ(control.type, "control");
    EXPECT_EQ(control.take, take == std::string("true"));
    EXPECT_FALSE(control.ask) << "it is between pages";
  }
  EXPECT_EQ(parsed(R"({"type":"follow"})").type, "follow");
  EXPECT_FALSE(parsed(R"({"type":"follow"})").ask);
}

TEST(PageWord, OrientationIsMadeAUnitQuaternion) {
  const NotingRun point =
      asked(R"({"type":"point","position":[0,0,0],"orientation":[0,0,0,1.005],"grab":false,"lifted":true})");
  EXPECT_EQ(point.wanted.pose.orientation.w(), 1.0);
  EXPECT_TRUE(point.wanted.lifted);
}

TEST(PageWord, NothingElseIs) {
  const std::string pose = R"("orientation":[0,0,0,1],"grab":false,"lifted":false})";
  for (const std::string& text : std::vector<std::string>{
           "",
           "null",
           "7",
           "[]",
           "{}",
           "{",
           R"({"type":"step"} x)",
           R"({'type':'step'})",
           R"({"type":7})",
           R"({"type":"stop"})",
           R"({"type":"Step"})",
           R"({"type":"step","more":1})",
           R"({"type":"pause"})",
           R"({"type":"pause","paused":1})",
           R"({"type":"pause","paused":"true"})",
           R"({"type":"record","on":null})",
           R"({"type":"control","take":[true]})",
           R"({"type":"seek","frame":1.5})",
           R"({"type":"seek","frame":-1})",
           R"({"type":"seek","frame":9007199254740993})",
           R"({"type":"seek","frame":99999999999999999999999999})",
           R"({"type":"change","settings":null})",
           R"({"type":"change","settings":["tool"]})",
           R"({"type":"change","settings":{"tool":5}})",
           R"({"type":"change","settings":{"tool":{"radius":5}}})",
           R"({"type":"point","position":[0,0],)" + pose,
           R"({"type":"point","position":[0,0,0,0],)" + pose,
           R"({"type":"point","position":[0,0,"0"],)" + pose,
           R"({"type":"point","position":[0,0,null],)" + pose,
           R"({"type":"point","position":[0,0,1000001],)" + pose,
           R"({"type":"point","position":[0,0,-1e300],)" + pose,
           R"({"type":"point","position":[0,0,1e999],)" + pose,
           R"({"type":"point","position":[0,0,NaN],)" + pose,
           R"({"type":"point",)" + pose,
           R"({"type":"point","position":[0,0,0],"orientation":[0,0,0,0],"grab":false,"lifted":false})",
           R"({"type":"point","position":[0,0,0],"orientation":[0,0,0,2],"grab":false,"lifted":false})",
           R"({"type":"point","position":[0,0,0],"orientation":[0,0,0,1.02],"grab":false,"lifted":false})",
           R"({"type":"point","position":[0,0,0],"orientation":[0,0.98,0,0],"grab":false,"lifted":false})",
           R"({"type":"point","position":[0,0,0],"orientation":[0,0,1],"grab":false,"lifted":false})",
           R"({"type":"point","position":[0,0,0],"orientation":[0,0,0,1],"grab":0,"lifted":false})",
           "{\"type\":\"st\xff\xfe\"}",
           std::string("{\"type\":\"step\"}\0", 16),
           std::string(8000, '[') + std::string(8000, ']'),
           R"({"type":"change","settings":{"a":)" + std::string(5000, '[') + std::string(5000, ']') + "}}",
           R"({"type":"change","settings":{"a":")" + std::string(longest_page_word, 'x') + "\"}}",
       }) {
    std::string problem;
    EXPECT_FALSE(parse_page_word(text, problem)) << text.substr(0, 100);
    EXPECT_FALSE(problem.empty());
    EXPECT_TRUE(std::all_of(problem.begin(), problem.end(), [](char c) { return c >= ' ' && c <= '~'; }));
  }
}

RC_GTEST_PROP(PageWord, BrokenWordsNeitherCrashNorAreObeyed, ()) {
  std::string text =
      R"({"type":"point","position":[1,-2.5,3e-3],"orientation":[0,0,0,1],"grab":true,"lifted":false})";
  const auto cut = *rc::gen::inRange<std::size_t>(0, text.size());
  std::string problem;
  RC_ASSERT(!parse_page_word(text.substr(0, cut), problem));
  text[cut] = *rc::gen::arbitrary<char>();
  const std::optional<PageWord> word = parse_page_word(text, problem);  // may still be one
  if (word) {
    NotingRun run;
    word->ask(run);
    const PointerPose& wanted = run.wanted;
    RC_ASSERT(wanted.pose.position.allFinite() && wanted.pose.position.cwiseAbs().maxCoeff() <= 1e6);
    RC_ASSERT(std::abs(wanted.pose.orientation.norm() - 1.0) < 1e-12);
  }
}

TEST(RunWords, HelloAndErrors) {
  const Json hello = Json::parse(hello_word("live", 7));
  EXPECT_EQ(hello, (Json{{"type", "hello"},
                         {"protocol", 2},
                         {"version", PALPATE_VERSION},
                         {"mode", "live"},
                         {"id", 7},
                         {"book", false}}));
  EXPECT_EQ(Json::parse(hello_word("replay", 1)).at("mode"), "replay");
  EXPECT_EQ(Json::parse(hello_word("replay", 1, true)).at("book"), true);
  EXPECT_EQ(Json::parse(error_word("change", Error("what", "where", "hint"))), (Json{{"type", "error"},
                                                                                     {"about", "change"},
                                                                                     {"reason", "value"},
                                                                                     {"what", "what"},
                                                                                     {"where", "where"},
                                                                                     {"hint", "hint"}}));
  EXPECT_EQ(
      Json::parse(error_word("change", PageError(PageRefusal::hand, "what", "where", "hint"))).at("reason"),
      "hand");
  EXPECT_EQ(Json::parse(error_word("change", Error("a file \xff", "", ""))).at("what"),
            "a file \xef\xbf\xbd");
}

TEST(RunWords, StateIsTheRunsAndThePages) {
  const StateWord state(R"({"rate":4000,"pointer":true,"times":[0,1],"you":"nobody"})");
  EXPECT_EQ(state.rate(), 4000.0);
  EXPECT_EQ(state.times(), Json({0, 1}));
  const Json controller = Json::parse(state.for_page(3, {true, true, 2}, state.times()));
  EXPECT_EQ(controller, (Json{{"type", "state"},
                              {"scene", 3},
                              {"you", "controller"},
                              {"controlled", true},
                              {"watchers", 2},
                              {"alone", false},
                              {"pointer", true},
                              {"rate", 4000},
                              {"times", {0, 1}}}));
  const Json watcher = Json::parse(state.for_page(3, {false, true, 2}, {}));
  EXPECT_EQ(watcher.at("you"), "watcher");
  EXPECT_EQ(watcher.at("pointer"), false);
  const Json alone = Json::parse(state.for_page(3, {false, true, 2, 7}, {}));
  EXPECT_EQ(alone.at("alone"), true);
  EXPECT_EQ(alone.at("frame"), 7);
  EXPECT_FALSE(watcher.contains("times"));
  EXPECT_EQ(StateWord("{}").rate(), 1000.0);
  EXPECT_THROW(StateWord("[]"), Error);
  EXPECT_THROW(StateWord("{"), Error);
}

TEST(Admission, HostIsTheAddressServed) {
  for (const char* host : {"127.0.0.1:8017", "localhost:8017", "LocalHost:8017", "[::1]:8017",
                           "localhost:9000", "127.0.0.1:8018", "127.0.0.1:1", "127.255.3.4:65535",
                           "[::1]:9000", "localhost", "127.0.0.1"})  // a tunnel's port is any
    EXPECT_TRUE(is_served(host, "127.0.0.1", 8017)) << host;
  for (const char* host : {"",
                           "127.0.0.1:80170",
                           "127.0.0.1:8017:8017",
                           "127.0.0.1:0",
                           "127.0.0.1:-1",
                           "127.0.0.1:",
                           "localhost:80x",
                           "localhost: 80",
                           "localhost.:8017",
                           "a.localhost:8017",
                           "127.0.0.1.evil.example:8017",
                           "127.1:8017",
                           "127.0.0.256:8017",
                           "127.0.0.01:8017",
                           "128.0.0.1:8017",
                           "0x7f.0.0.1:8017",
                           "2130706433:8017",
                           "[::1%lo]:8017",
                           "[::2]:8017",
                           "[::ffff:127.0.0.1]:8017",
                           "localhost@evil.example:8017",
                           "evil.example@localhost:8017",
                           "evil.example",
                           "evil.example:9000",
                           "192.168.1.5",
                           "evil.example:8017",
                           "localhost.evil.example:8017",
                           "192.168.1.5:8017",
                           "[::1:8017",
                           "::1:8017",
                           ":8017",
                           "[]:8017",
                           "[fe80::1]:8017"})
    EXPECT_FALSE(is_served(host, "127.0.0.1", 8017)) << host;
  EXPECT_TRUE(is_served("192.168.1.5:8017", "192.168.1.5", 8017));
  EXPECT_FALSE(is_served("192.168.1.6:8017", "192.168.1.5", 8017));
  EXPECT_FALSE(is_served("192.168.1.5:9000", "192.168.1.5", 8017));
  EXPECT_FALSE(is_served("192.168.1.5:9000", "0.0.0.0", 8017));
  EXPECT_TRUE(is_served("192.168.1.6:8017", "0.0.0.0", 8017));
  EXPECT_TRUE(is_served("[fe80::1]:8017", "::", 8017));
  EXPECT_TRUE(is_served("localhost", "127.0.0.1", 80));
  for (const char* host : {"evil.example:8017", "1.2.3:8017", "fe80::1:8017", "[1.2.3.4]:8017", "[x]:8017"})
    EXPECT_FALSE(is_served(host, "0.0.0.0", 8017)) << host;
}

TEST(Admission, OriginIsThePageServed) {
  EXPECT_TRUE(is_own_page("http://127.0.0.1:8017", "127.0.0.1:8017"));
  EXPECT_TRUE(is_own_page("http://localhost:9000", "localhost:9000"));
  EXPECT_FALSE(is_own_page("http://localhost:9000", "localhost:8017")) << "another program of this machine";
  for (const char* origin : {"https://127.0.0.1:8017", "http://127.0.0.1:8018", "http://evil.example", "null",
                             "http://127.0.0.1:8017/", "http://localhost:8017", ""})
    EXPECT_FALSE(is_own_page(origin, "127.0.0.1:8017")) << origin;
}

TEST(Admission, TokensAndAddresses) {
  const std::string token = random_token();
  EXPECT_EQ(token.size(), 32U);
  EXPECT_NE(token, random_token());
  EXPECT_TRUE(is_same_token(token, token));
  EXPECT_FALSE(is_same_token(token.substr(1), token));
  EXPECT_FALSE(is_same_token("", token));
  EXPECT_EQ(split_target("/socket?a=b&token=xy&c").path, "/socket");
  EXPECT_EQ(split_target("/socket?a=b&token=xy&c").token, "xy");
  EXPECT_EQ(split_target("/?atoken=xy").token, "");
  EXPECT_TRUE(split_target("/socket?token=xy&watch").watch);
  EXPECT_FALSE(split_target("/watch?token=watch").watch);
  EXPECT_EQ(split_target("/").path, "/");
}

std::vector<TickNote> ticks_from(std::int64_t first, std::int64_t count, std::int64_t stride = 1) {
  std::vector<TickNote> ticks(static_cast<std::size_t>(count));
  for (std::int64_t k = 0; k < count; ++k) ticks[static_cast<std::size_t>(k)].number = first + stride * k;
  return ticks;
}

TEST(TickHistory, GivesWhatFollowsWithoutAGap) {
  TickHistory history;
  history.append(ticks_from(10, 5), 1, 100);
  history.append(ticks_from(15, 5), 1, 100);
  history.append(ticks_from(30, 2), 1, 100);     // ticks were lost
  history.append(ticks_from(32, 3, 4), 4, 100);  // another stride
  EXPECT_EQ(history.end(), 15);
  TickHistory::Run run = history.run_from(3);
  EXPECT_EQ(run.ticks.size(), 7U);
  EXPECT_EQ(run.ticks.front().number, 13);
  EXPECT_EQ(run.end, 10);
  run = history.run_from(run.end);
  EXPECT_EQ(run.ticks.front().number, 30);
  EXPECT_EQ(run.ticks.size(), 2U);
  run = history.run_from(run.end);
  EXPECT_EQ(run.ticks.size(), 3U);
  EXPECT_EQ(run.stride, 4);
  EXPECT_EQ(run.end, history.end());
  EXPECT_TRUE(history.run_from(run.end).ticks.empty());
}

TEST(TickHistory, ForgetsTheOldest) {
  TickHistory history;
  history.append(ticks_from(0, 10), 1, 4);
  EXPECT_EQ(history.end(), 10);
  EXPECT_EQ(history.run_from(0).ticks.front().number, 6);
  history.clear();
  EXPECT_EQ(history.end(), 10);
  EXPECT_TRUE(history.run_from(0).ticks.empty());
  EXPECT_FALSE(history.has_from(0)) << "none is kept";
  history.append(ticks_from(0, 1), 1, 4);
  EXPECT_TRUE(history.has_from(0));
  EXPECT_TRUE(history.has_from(10));
  EXPECT_FALSE(history.has_from(11));
  EXPECT_EQ(history.run_from(5).ticks.front().number, 0);
}

}  // namespace
}  // namespace palpate::words_test
