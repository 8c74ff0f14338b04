// A run that is steered as a viewer's page does it.
#include "runtime/app/viewed_play.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/json_text.h"
#include "base/regular_file.h"
#include "formats/model_file.h"
#include "formats/recording.h"
#include "formats/writer/model_writer.h"
#include "runtime/app/fitting_tool.h"
#include "runtime/app/input_source.h"
#include "runtime/app/play_session.h"
#include "runtime/body/overlay_rings.h"
#include "runtime/body/patch_maker.h"
#include "runtime/loop/device_link.h"
#include "runtime/loop/loading.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/folders.h"

namespace palpate::viewed_play_test {
namespace {

const std::filesystem::path cube = palpate::test::source_file("tests/golden/cube2/cube2.palpate.hdf");

/// The options of `play FILE --view` with a ball.
PlayOptions options_of(const std::filesystem::path& file) {
  PlayOptions options;
  options.file = file;
  options.device.kind = DeviceChoice::Kind::mouse;
  options.device.text = "mouse";
  options.settings_text = {{"tool", "sphere:0.1"}};
  options.settings = read_settings(options.settings_text);
  options.view = ViewerOptions{.port = 0};
  options.report = "report.json";
  return options;
}

/// A run in a folder of its own, as that is where recordings go.
class ViewedPlayTest : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_);
    std::filesystem::current_path(folder_);
  }
  void TearDown() override {
    if (thread_.joinable()) finish();
    std::filesystem::current_path(before_);
    std::filesystem::remove_all(folder_);
  }

  void start(const PlayOptions& options) {
    play_ = std::make_unique<ViewedPlay>(options, input_,
                                         load_and_print(options.file, "", options.settings.body()),
                                         ViewerPort(*options.view));
    thread_ = std::thread([this] { report_ = play_->run(stop_); });
  }
  LoopReport finish() {
    stop_ = true;
    thread_.join();
    return report_;
  }

  /// Until pages are told so; false when that takes too long.
  bool wait_for(const std::function<bool(const RunState&)>& is_so) {
    for (int k = 0; k < 3000; ++k) {
      if (is_so(play_->state())) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  bool wait_for_ticks(std::int64_t more) {
    const std::int64_t before = play_->state().ticks;
    return wait_for([&](const RunState& state) { return state.ticks >= before + more; });
  }
  void point(double x, double z, bool lifted) {
    play_->point({.pose = {.position = {x, 0.5, z}}, .lifted = lifted});
  }

  const std::filesystem::path before_ = std::filesystem::current_path();
  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("palpate_viewed." + std::to_string(getpid()));
  std::atomic<bool> stop_ = false;
  InputSource input_;
  std::unique_ptr<ViewedPlay> play_;
  LoopReport report_;
  std::thread thread_;
};

std::string where_it_is_refused(const std::function<void()>& wish) {
  try {
    wish();
  } catch (const Error& error) {
    return error.where();
  }
  return "";
}

TEST_F(ViewedPlayTest, RecordsAnActThatIsReplayedToTheSameBits) {
  start(options_of(cube));
  ASSERT_TRUE(wait_for_ticks(50));
  play_->record(true);
  ASSERT_TRUE(
      wait_for([](const RunState& state) { return state.recording && state.locked && state.ticks > 0; }));
  EXPECT_EQ(where_it_is_refused([&] { play_->change({{"friction", "0.1"}}); }), "change");
  EXPECT_EQ(where_it_is_refused([&] { play_->reset(); }), "reset");
  const std::filesystem::path file = *play_->state().recording;
  EXPECT_TRUE(file.string().starts_with("cube2-20")) << file;
  for (const double x : {0.3, 0.7}) {
    point(x, 1.2, true);
    ASSERT_TRUE(wait_for_ticks(50));
    point(x, 1.05, false);
    ASSERT_TRUE(wait_for_ticks(150));
  }
  play_->pause(true);
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.paused; }));
  play_->pause(false);
  ASSERT_TRUE(wait_for_ticks(50));
  play_->record(false);
  ASSERT_TRUE(wait_for([](const RunState& state) { return !state.recording && !state.locked; }));
  EXPECT_TRUE(finish().interrupted);

  PlayOptions options;
  options.device.kind = DeviceChoice::Kind::replay;
  options.session = std::make_shared<const RecordingFile>(file);
  options.settings = read_settings(split_settings(options.session->info().options));
  options.fast = true;
  const Body body = load_body(cube, "", options.settings.body());
  const InputSource input = make_input_source(options, nullptr);
  const LoopReport replay = PlaySession(options, body, input).run(std::atomic<bool>(false));
  EXPECT_GT(replay.ticks, 450);
  EXPECT_GT(replay.ticks_in_contact, 200);
  EXPECT_GT(replay.largest_shown, 0.0);
  EXPECT_EQ(replay.replay.different, 0);
}

TEST_F(ViewedPlayTest, StandsStillAndTakesSingleTicks) {
  start(options_of(cube));
  ASSERT_TRUE(wait_for_ticks(50));
  play_->pause(true);
  std::int64_t ticks = -1;
  ASSERT_TRUE(
      wait_for([&](const RunState& state) { return std::exchange(ticks, state.ticks) == state.ticks; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  ticks = play_->state().ticks;
  for (int k = 1; k <= 3; ++k) {
    play_->step_once();
    ASSERT_TRUE(wait_for([&](const RunState& state) { return state.ticks == ticks + k; }));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(play_->state().ticks, ticks + 3);
  play_->reset();
  EXPECT_TRUE(wait_for([](const RunState& state) { return state.ticks == 1; }))
      << "a paused run shows the untouched body";
}

TEST_F(ViewedPlayTest, BeginsAnewWithOtherSettings) {
  start(options_of(cube));
  ASSERT_TRUE(wait_for_ticks(50));
  const std::uint32_t scene = play_->state().scene;
  play_->change({{"friction", "0.25"}, {"tool", "sphere:0.2"}});
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.settings.contains("friction"); }));
  EXPECT_EQ(play_->state().scene, scene) << "the same body";
  play_->change({{"friction", std::nullopt}, {"stiffness-scale", "2"}});
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.settings.contains("stiffness-scale"); }));
  EXPECT_EQ(play_->state().scene, scene + 1) << "another one";
  EXPECT_FALSE(play_->state().settings.contains("friction"));
  EXPECT_EQ(play_->state().settings.at("tool"), "sphere:0.2");
  ASSERT_TRUE(wait_for_ticks(50));
  EXPECT_TRUE(finish().interrupted);
}

/// What a report says of all its rows together.
template <class Number>
Number sum_of(const nlohmann::json& rows, const char* name) {
  Number sum = 0;
  for (const nlohmann::json& row : rows) sum += row.at(name).get<Number>();
  return sum;
}

nlohmann::json written_report() {
  return nlohmann::json::parse(read_all("report.json"));
}

TEST_F(ViewedPlayTest, TheReportIsOfTheWholeRun) {
  start(options_of(cube));
  point(0.5, 1.2, true);
  ASSERT_TRUE(wait_for_ticks(50));
  point(0.5, 1.05, false);
  ASSERT_TRUE(wait_for_ticks(300));  // all that is felt
  point(0.5, 3.0, true);
  play_->reset();
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.ticks < 250; }));
  ASSERT_TRUE(wait_for_ticks(20));
  play_->change({{"friction", "0.25"}});
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.settings.contains("friction"); }));
  ASSERT_TRUE(wait_for_ticks(20));
  play_->change({{"stiffness-scale", "2"}});
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.settings.contains("stiffness-scale"); }));
  ASSERT_TRUE(wait_for_ticks(20));
  play_->record(true);
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.recording && state.ticks > 20; }));
  play_->record(false);
  ASSERT_TRUE(wait_for([](const RunState& state) { return !state.recording && state.ticks > 20; }));
  const LoopReport report = finish();
  EXPECT_GT(report.ticks, 430);
  EXPECT_GT(report.ticks_in_contact, 100);
  EXPECT_GT(report.largest_force, 0.004);
  EXPECT_GT(report.largest_shown, 0.004);
  EXPECT_LT(report.largest_force_time, 0.001 * static_cast<double>(report.ticks));
  EXPECT_EQ(report.compute.total(), report.ticks);
  EXPECT_EQ(report.lateness.total(), report.ticks);
  const nlohmann::json json = written_report(), rows = json.at("parts");
  std::vector<std::string> because;
  for (const nlohmann::json& row : rows) because.push_back(row.at("because"));
  EXPECT_EQ(because, (std::vector<std::string>{"start", "reset", "settings", "settings", "recording begun",
                                               "recording ended"}));
  for (const char* name : {"ticks", "ticks_in_contact", "deadline_misses"})
    EXPECT_EQ(sum_of<std::int64_t>(rows, name), json.at(name)) << name;
  EXPECT_EQ(json.at("ticks"), report.ticks);
  EXPECT_EQ(json.at("largest_force_N"), rows[0].at("largest_force_N"));
  EXPECT_EQ(rows[1].at("largest_force_N"), 0.0);
  EXPECT_FALSE(rows[1].at("settings").contains("friction"));
  EXPECT_EQ(rows[2].at("settings").at("friction"), "0.25");
  EXPECT_EQ(rows[3].at("settings").at("stiffness-scale"), "2");
  EXPECT_TRUE(rows[4].at("recording").get<std::string>().starts_with("cube2-20"));
  EXPECT_TRUE(rows[5].at("recording").is_null());
  EXPECT_DOUBLE_EQ(rows[1].at("begun_s"), 0.001 * rows[0].at("ticks").get<double>());
}

/// A device that a hand holds: where it is said to be, each millisecond.
class HeldPort : public DevicePort {
 public:
  explicit HeldPort(const std::atomic<double>& height) : height_(height) {}

  void open() override {}
  ReadResult read(DeviceState& state) noexcept override {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    state.pose.position = Vec3(0.0, 0.0, height_);
    state.arrived = std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
    ++sequence_;
    state.sequence = sequence_;
    return ReadResult::report;
  }
  bool write(const DeviceCommand&, const DeviceState&) noexcept override { return true; }
  void close() noexcept override {}
  [[nodiscard]] DeviceLimits limits() const override { return {}; }
  [[nodiscard]] std::string refusals() const override { return ""; }
  [[nodiscard]] std::string name() const override { return "held"; }

 private:
  const std::atomic<double>& height_;
  std::uint32_t sequence_ = 0;
};

/// A run whose device has a hand in it. This machine may be busy: late ticks and reports are no faults here.
class HeldDevice : public ViewedPlayTest {
 protected:
  void start_held() {
    auto link = std::make_unique<DeviceLink>(std::make_unique<HeldPort>(height_), DeviceLinkOptions{});
    input_.link = link.get();
    input_.device = std::move(link);
    while (!input_.link->has_reported()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    PlayOptions options = options_of(cube);
    options.device.kind = DeviceChoice::Kind::bridge;
    options.device.text = "bridge";
    options.settings_text["safety"] = "late=10,most_late=1e9,stale_life=10,silence=5,silence_fade=4";
    options.settings = read_settings(options.settings_text);
    start(options);
    ASSERT_TRUE(wait_for_ticks(50));
  }
  void TearDown() override {
    ViewedPlayTest::TearDown();
    input_.device.reset();  // before the height
  }

  std::atomic<double> height_ = 0.1;  // [m]
};

TEST_F(HeldDevice, NoPageChangesWhatProtectsAHand) {
  start_held();
  EXPECT_TRUE(play_->state().hand);
  const auto refused = [](const std::function<void()>& wish) {
    try {
      wish();
    } catch (const PageError& error) {
      EXPECT_EQ(error.reason(), PageRefusal::hand);
      EXPECT_FALSE(error.hint().empty());
      return error.where();
    }
    return std::string();
  };
  for (const auto& [name, value] : {std::pair("safety", "max_force=1000"),
                                    {"coupling", "1e9"},
                                    {"coupling-torsion", "1e9"},
                                    {"max-force", "1000"},
                                    {"hand-over", "inf"}}) {
    EXPECT_EQ(refused([&, n = name, v = value] {
                play_->change({{n, v}, {"friction", "0.1"}});
              }),
              std::string("--") + name);
    EXPECT_EQ(refused([&, n = name] { play_->change({{n, std::nullopt}}); }), std::string("--") + name);
  }
  EXPECT_EQ(refused([&] { play_->acknowledge(); }), "acknowledge");
  ASSERT_TRUE(wait_for_ticks(50));
  EXPECT_EQ(play_->state().settings.count("friction"), 0U) << "all of a change, or none";
  play_->change({{"friction", "0.1"}, {"tool", "sphere:0.2"}, {"stiffness-scale", "2"}});
  EXPECT_TRUE(wait_for([](const RunState& state) { return state.settings.contains("friction"); }));
}

TEST_F(HeldDevice, AFaultOutlivesWhatAPageBegins) {
  start_held();
  height_ = 0.5;  // nobody moves so fast
  const auto is_latched = [](const RunState& state) {
    return state.fault == Fault::too_fast && state.ticks > 20;
  };
  ASSERT_TRUE(wait_for(is_latched));
  ASSERT_TRUE(wait_for_ticks(2000));  // so that it is seen that they begin anew
  const std::int64_t before = play_->state().ticks;
  play_->reset();
  ASSERT_TRUE(wait_for([&](const RunState& state) { return state.ticks < before; }));
  EXPECT_TRUE(wait_for(is_latched));
  play_->change({{"friction", "0.1"}});
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.settings.contains("friction"); }));
  EXPECT_TRUE(wait_for(is_latched));
  play_->pause(true);
  play_->pause(false);
  ASSERT_TRUE(wait_for_ticks(100));
  EXPECT_EQ(play_->state().fault, Fault::too_fast);
  EXPECT_EQ(play_->state().phase, SafetyPhase::faulted);
  play_->record(true);  // which would not be what a replay has
  EXPECT_TRUE(wait_for([](const RunState& state) {
    return state.refused && state.refused->hint() == "acknowledge the fault first";
  }));
  EXPECT_TRUE(wait_for(is_latched));
  EXPECT_FALSE(play_->state().recording);
}

TEST_F(HeldDevice, TheReportKeepsWhatTheHandWasShownAndItsFaults) {
  start_held();
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.phase == SafetyPhase::active; }));
  height_ = 0.5;
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.fault == Fault::too_fast; }));
  for (int k = 0; k < 3; ++k) {
    const std::string friction = std::to_string(0.1 * (k + 1));
    play_->change({{"friction", friction}});
    ASSERT_TRUE(wait_for([&](const RunState& state) {
      const auto set = state.settings.find("friction");
      return set != state.settings.end() && set->second == friction && state.ticks > 20;
    }));
  }
  const LoopReport report = finish();
  EXPECT_EQ(report.faults[static_cast<std::size_t>(Fault::too_fast)], 1) << "it came once, and stayed";
  const nlohmann::json json = written_report(), rows = json.at("parts");
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0].at("faults"), 1);
  for (std::size_t k = 1; k < rows.size(); ++k) EXPECT_EQ(rows[k].at("faults"), 0) << k;
  EXPECT_EQ(json.at("safety").at("faults").at("too_fast"), 1) << json.at("safety");
}

TEST(LoopReport, AddsWhatCameLater) {
  LoopReport first, later;
  first.ticks = 2000;
  first.largest_force = 1.0;
  first.largest_force_time = 0.5;
  first.largest_shown = 1.12;
  first.faults[2] = 1;
  first.status_ticks[1] = 4;
  first.most_contacts = 7;
  first.deadline_misses = 3;
  first.compute.add(100);
  first.lateness.add(2'000'000'000);
  first.best_effort.add(StepStatus::not_converged, 1.0, 0.1, 0, 0.25);
  first.replay.first_tick = -1;
  later.ticks = 1000;
  later.largest_force = 2.0;
  later.largest_force_time = 0.25;
  later.largest_jump = 0.5;
  later.largest_jump_time = 0.125;
  later.largest_shown = 0.3;
  later.faults[2] = 1;
  later.status_ticks[1] = 2;
  later.most_contacts = 5;
  later.deadline_misses = 1;
  later.compute.add(5'000'000);
  later.best_effort.add(StepStatus::not_converged, 1.0, 0.4, 2, 0.5);
  later.replay.first_tick = 10;
  later.replay.first_field = "force";
  later.interrupted = true;
  first.add(later);
  EXPECT_EQ(first.ticks, 3000);
  EXPECT_EQ(first.largest_force, 2.0);
  EXPECT_EQ(first.largest_force_time, 2.25) << "of the run";
  EXPECT_EQ(first.largest_jump_time, 2.125);
  EXPECT_EQ(first.largest_shown, 1.12);
  EXPECT_EQ(first.faults[2], 2);
  EXPECT_EQ(first.status_ticks[1], 6);
  EXPECT_EQ(first.most_contacts, 7);
  EXPECT_EQ(first.deadline_misses, 4);
  EXPECT_EQ(first.compute.total(), 2);
  EXPECT_EQ(first.compute.worst(), 5'000'000);
  EXPECT_EQ(first.compute.total_between(0, 200), 1);
  EXPECT_EQ(first.lateness.worst(), 2'000'000'000);
  EXPECT_EQ(first.best_effort.ticks, 2);
  EXPECT_EQ(first.best_effort.most_left_out, 2);
  EXPECT_EQ(first.best_effort.largest_error_time, 2.5);
  EXPECT_NEAR(first.best_effort.median_error(), 0.1, 0.01);
  EXPECT_EQ(first.replay.first_tick, 2010);
  EXPECT_STREQ(first.replay.first_field, "force");
  EXPECT_TRUE(first.interrupted);
}

TEST_F(ViewedPlayTest, NobodyIsInAPointer) {
  start(options_of(cube));
  ASSERT_TRUE(wait_for_ticks(50));
  EXPECT_FALSE(play_->state().hand);
  play_->acknowledge();
  play_->change({{"safety", "max_force=1"}, {"coupling", "100"}});
  EXPECT_TRUE(wait_for([](const RunState& state) { return state.settings.contains("safety"); }));
}

TEST_F(ViewedPlayTest, ABallSuitsTheBodyWhereNoToolIsGiven) {
  PlayOptions options = options_of(cube);
  options.settings_text.clear();
  options.settings = read_settings({});
  start(options);
  ASSERT_TRUE(wait_for_ticks(50));
  EXPECT_EQ(play_->state().settings.at("tool"), "sphere:0.17") << "a tenth of the diagonal, sqrt(3) m";
  EXPECT_EQ(play_->state().defaults.at("radius"), 0.17);
  EXPECT_EQ(play_->state().defaults.at("depth"), 0.05 * std::sqrt(3.0));
  play_->change({{"tool", "point"}});
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.settings.at("tool") == "point"; }));
  play_->change({{"tool", std::nullopt}});
  EXPECT_TRUE(wait_for([](const RunState& state) { return state.settings.at("tool") == "sphere:0.17"; }));
}

TEST_F(ViewedPlayTest, RefusesAToolThatIsLargerThanTheBody) {
  start(options_of(cube));
  const auto refused = [&](const char* tool) {
    return where_it_is_refused([&] { play_->change({{"tool", tool}}); });
  };
  EXPECT_EQ(refused("sphere:0.87"), "--tool");
  EXPECT_EQ(refused("capsule:0.1,1.54"), "--tool");
  EXPECT_EQ(refused("sphere:0.86"), "");
  EXPECT_EQ(refused("capsule:0.1,1.53"), "");
  EXPECT_EQ(refused("disc:0.87"), "--tool");
  EXPECT_EQ(refused("disc:0.86"), "");
}

TEST(FittingTool, IsAsLargeAsTheSurfacesEdgesWithinBounds) {
  const auto radius = [](int cells) {
    return fitting_radius(
        Body(test::unit_model(ElementType::hex8, cells, Scope::surface, Precision::double_precision)));
  };
  EXPECT_EQ(radius(2), 0.17) << "no more than a tenth of the diagonal";
  // Edges of 1/8, and the diagonals of its squares, of which there are half as many.
  EXPECT_NEAR(radius(8), (2.0 + std::sqrt(2.0)) / 3.0 / 8.0, 0.005);
}

TEST(FittingTool, TellsOfOneThatIsSmallForTheMesh) {
  const Body body(test::unit_model(ElementType::hex8, 8, Scope::surface, Precision::double_precision));
  const auto told = [&](const Tool& tool) { return too_small(tool, body); };
  EXPECT_NE(told({}).find("no radius"), std::string::npos);
  // h = 0.142, C = 0.78: a = R where it is pressed in by R, and 0.32 R by a tenth of it.
  const char* const factors = "by 0.01 m the body is about 3.6 times too stiff, by 0.1 m 1.5 times";
  EXPECT_NE(told({.radius = 0.1}).find(factors), std::string::npos) << told({.radius = 0.1});
  EXPECT_EQ(told({.radius = 0.2}), "");
  EXPECT_NE(told({.disc_radius = 0.1}), "");
}

/// A block of some layers, all nodes stored but those deeper than `layers` cells below its surface.
class OverlayRings : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Layers, OverlayRings, testing::Values(0, 1, 2));

TEST_P(OverlayRings, AreAsManyAsTheFileKeepsLayersFor) {
  Model model = test::unit_model(2, 8, Scope::full, Precision::double_precision);
  std::vector<Index> stored;
  for (const Index node : model.stored_nodes) {
    const Vec3& x = model.mesh.nodes[static_cast<std::size_t>(node)];
    const double below = 8.0 * std::min({x.x(), 1.0 - x.x(), 1.0 - x.y()});
    if (below <= GetParam() + 1e-9) stored.push_back(node);
  }
  model.stored_nodes = stored;  // which is all that counts here
  model.greens = test::pack(test::random_definite(2 * std::ssize(stored), 3), Precision::double_precision);
  const Body body(std::move(model));
  const int rings = overlay_rings(body);
  EXPECT_EQ(rings, GetParam());
  if (rings > 0) {
    EXPECT_GT(patch_room(body, rings, 1), 0);
  }
  EXPECT_THROW(static_cast<void>(patch_room(body, rings + 1, 1)), Error);
}

TEST_F(ViewedPlayTest, RefusesAtOnceWhatCannotBe) {
  start(options_of(cube));
  ASSERT_TRUE(wait_for_ticks(50));
  const auto refused = [&](const char* name, const char* value) {
    return where_it_is_refused([&] { play_->change({{name, value}, {"tool", "sphere:0.2"}}); });
  };
  EXPECT_EQ(refused("friction", "-1"), "--friction");
  EXPECT_EQ(refused("contact", "dynamic"), "--contact") << "the file has no dynamics";
  EXPECT_EQ(refused("rate", "2000"), "--rate");
  EXPECT_EQ(refused("no-such", "1"), "--no-such");
  EXPECT_EQ(where_it_is_refused([&] { play_->seek(3); }), "seek");
  ASSERT_TRUE(wait_for_ticks(50));
  EXPECT_EQ(play_->state().settings.at("tool"), "sphere:0.1") << "all of a change, or none";
}

/// The cube under a force, with a node that is held where it was taken to.
void write_mixed_cube(const std::filesystem::path& file) {
  Model model = load_model(cube);
  const auto held = static_cast<std::size_t>(
      std::find_if(model.fixed.begin(), model.fixed.end(), [](std::uint8_t axes) { return axes != 0; }) -
      model.fixed.begin());
  model.rest_displacement[held] = Vec3(0.0, 0.0, 0.01);
  model.rest_force[static_cast<std::size_t>(model.stored_nodes[0])] = Vec3(0.0, 0.0, 0.01);
  ModelWriter writer(file, model, Precision::double_precision);
  const auto packed = model.greens.as<double>();
  writer.write_columns(0, model.stored_dofs(), {packed.data(), packed.size()});
  writer.finish(model.probes);
}

TEST_F(ViewedPlayTest, GoesOnAsBeforeWhereLoadingShowsThatItCannotBe) {
  write_mixed_cube(folder_ / "mixed.palpate.hdf");
  start(options_of(folder_ / "mixed.palpate.hdf"));
  ASSERT_TRUE(wait_for_ticks(50));
  play_->change({{"stiffness-scale", "2"}, {"tool", "sphere:0.2"}});
  ASSERT_TRUE(wait_for([](const RunState& state) {
    return state.refused &&
           std::string(state.refused->what()).find("prescribed displacements") != std::string::npos;
  }));
  ASSERT_TRUE(wait_for_ticks(50));
  EXPECT_EQ(play_->state().settings, (SettingsText{{"tool", "sphere:0.1"}}));
  play_->change({{"stiffness-scale", "2"}, {"load-scale", "0"}});
  ASSERT_TRUE(wait_for(
      [](const RunState& state) { return state.settings.contains("load-scale") && !state.refused; }));
  EXPECT_TRUE(wait_for_ticks(50));
}

TEST_F(ViewedPlayTest, GoesOnWithTheLoadedBodyWhereItsFileIsGone) {
  std::filesystem::copy_file(cube, folder_ / "gone.palpate.hdf");
  start(options_of(folder_ / "gone.palpate.hdf"));
  ASSERT_TRUE(wait_for_ticks(50));
  std::filesystem::remove(folder_ / "gone.palpate.hdf");
  play_->change({{"stiffness-scale", "2"}});
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.refused.has_value(); }));
  const Error refused = *play_->state().refused;
  EXPECT_NE(refused.where().find("gone.palpate.hdf"), std::string::npos);
  EXPECT_NE(std::string(refused.what()).find("cannot open the file"), std::string::npos);
  EXPECT_EQ(to_json(play_->state()).at("refused").at("what"), refused.what());
  ASSERT_TRUE(wait_for_ticks(50));
  play_->reset();
  ASSERT_TRUE(wait_for([](const RunState& state) { return !state.refused; }));
  EXPECT_TRUE(wait_for_ticks(50));
}

TEST_F(ViewedPlayTest, GoesOnWhereARecordingCannotBeMade) {
  start(options_of(cube));
  ASSERT_TRUE(wait_for_ticks(50));
  std::filesystem::remove_all(folder_);  // the working directory is gone
  play_->record(true);
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.refused.has_value(); }));
  EXPECT_TRUE(wait_for_ticks(50));
  EXPECT_FALSE(play_->state().recording);
  EXPECT_EQ(where_it_is_refused([&] { play_->change({{"friction", "0.1"}}); }), "") << "it is not locked";
  std::filesystem::create_directory(folder_);  // for the report
  std::filesystem::current_path(folder_);
}

TEST_F(ViewedPlayTest, TellsAtOnceOfARecordingThatFailsAndGoesOn) {
  start(options_of(cube));
  ASSERT_TRUE(wait_for_ticks(50));
  play_->record(true);
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.recording && state.ticks > 0; }));
  const std::filesystem::path file = *play_->state().recording;
  EXPECT_FALSE(play_->state().recording_failed);
  rlimit before = {};  // on the size of files: stands for a full disk
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit full = {std::filesystem::file_size(file) + 1000, before.rlim_max};
  auto* const action = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &full);
  const bool failed_then = wait_for([](const RunState& state) { return state.recording_failed.has_value(); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, action);
  ASSERT_TRUE(failed_then);
  EXPECT_EQ(play_->state().recording, file) << "the page says of which";
  const nlohmann::json failed = to_json(play_->state()).at("recording_failed");
  EXPECT_NE(failed.at("what").get<std::string>().find("File too large"), std::string::npos) << failed;
  EXPECT_TRUE(wait_for_ticks(50)) << "the loop goes on";
  play_->record(false);
  ASSERT_TRUE(wait_for([](const RunState& state) { return !state.recording && state.ticks > 0; }));
  EXPECT_FALSE(play_->state().recording_failed);
  EXPECT_TRUE(play_->state().refused);
  play_->record(true);  // another one can be made
  ASSERT_TRUE(wait_for([](const RunState& state) { return state.recording && state.ticks > 0; }));
  finish();
  EXPECT_TRUE(play_->recording_failed()) << "the exit status tells it";
}

TEST(RunState, IsJsonWhateverAFileIsCalled) {
  RunState state;
  state.device = "a \"hand\"\n";
  state.recording = "caf\xe9.mcap";  // of a file system that knows no UTF-8
  const nlohmann::json json = nlohmann::json::parse(json_text(to_json(state)));
  EXPECT_EQ(json.at("device"), state.device);
  EXPECT_EQ(json.at("recording"), "caf\xef\xbf\xbd.mcap");
  EXPECT_TRUE(json.at("settings").is_object());
  EXPECT_TRUE(json.at("fault").is_null());
  state.fault = Fault::too_fast;
  EXPECT_EQ(nlohmann::json::parse(json_text(to_json(state))).at("fault").at("remedy"),
            fault_remedy(Fault::too_fast));
}

class SettledSession : public testing::TestWithParam<double> {};

/// As soft as jelly, and steel.
INSTANTIATE_TEST_SUITE_P(Bodies, SettledSession, testing::Values(1.0, 2e11));

Body body_of(double youngs_modulus) {
  Model model = test::unit_model(3, 4, Scope::surface, Precision::double_precision);
  model.greens = model.greens.scaled(1.0 / youngs_modulus);
  return Body(std::move(model));
}

TEST_P(SettledSession, AMouseHangsOnAStiffCoupling) {
  const Body body = body_of(GetParam());
  InputSource input;
  add_mouse(input, options_of(cube), body);
  std::vector<double> stiffness;
  for (const Index node : body.free_surface_nodes())
    stiffness.push_back(3.0 / body.greens().block(node, node).trace());
  std::sort(stiffness.begin(), stiffness.end());
  const double k = apply_defaults({}, input, body).tool.coupling_stiffness;
  EXPECT_GE(k, 50.0 * stiffness[stiffness.size() / 2 - 1] * (1.0 - 1e-12));
  EXPECT_LE(k, 50.0 * stiffness[stiffness.size() / 2 + 1] * (1.0 + 1e-12));
  Settings asked;
  asked.tool.coupling_stiffness = 7.0;
  EXPECT_EQ(apply_defaults(asked, input, body).tool.coupling_stiffness, 7.0);
}

/// A pointer that presses, rests there, and hears its clock stand still for a while.
class Pressing : public Device {
 public:
  Pressing() : mouse_({.pose = {.position = {0.5, 0.5, 1.2}}}, 1000) {}
  DeviceNews poll(const TickTime& tick) noexcept override {
    if (tick.number == 20) mouse_.point({.pose = {.position = {0.5, 0.5, 1.05}}});
    DeviceNews news = mouse_.poll(tick);
    const std::int64_t stop = tick.number < 400 ? 0 : 300'000'000;  // ns
    news.begun = tick.begun + stop;
    news.state.arrived = *news.begun;
    return news;
  }
  void display(const DeviceCommand&, const DeviceState&, std::int64_t) noexcept override {}

 private:
  MouseDevice mouse_;
};

TEST_P(SettledSession, AMouseIsShownAllForceAndNoFault) {
  const Body body = body_of(GetParam());
  InputSource input;
  add_mouse(input, options_of(cube), body);
  Settings settings;
  settings.tool = {.radius = 0.1};
  settings = apply_defaults(settings, input, body);
  State state(body, {.tools = {settings.tool}});
  Safety safety(*settings.safety);
  Pressing device;
  const LoopReport report = run_loop({.body = body, .state = state, .device = device, .safety = &safety},
                                     {.ticks = 800, .fast = true}, std::atomic<bool>(false));
  EXPECT_GT(report.largest_force, 0.001 * GetParam());
  EXPECT_DOUBLE_EQ(report.largest_shown, report.largest_force);
  EXPECT_EQ(safety.fault(), Fault::none);
  EXPECT_EQ(safety.share(), 1.0);
  // What is left to its default is told, and read back.
  const Settings again = read_settings(split_settings(to_text(settings)));
  EXPECT_EQ(to_text(again), to_text(settings));
}

}  // namespace
}  // namespace palpate::viewed_play_test
