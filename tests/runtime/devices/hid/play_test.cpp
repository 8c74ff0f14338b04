// palpate-runtime itself, in a process of its own, plays on emulated devices: the system's hidapi, a baked
// body, hands that press on it, and what the firmware was told. Run by umockdev-wrapper.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkdtemp
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>
#include <thread>

#include "formats/recording.h"
#include "runtime/devices/hid/hid_choice.h"
#include "runtime/devices/reports/woodenhaptics_report.h"
#include "runtime/safety/device.h"
#include "runtime/safety/fault.h"
#include "runtime/safety/safety.h"
#include "tests/support/devices/emulated_bus.h"
#include "tests/support/files/recorded_ticks.h"
#include "tests/support/folders.h"

namespace palpate::play_test {
namespace {

namespace fs = std::filesystem;

/// 10 cm, as stiff as a soft organ: at its top's middle some 80 N/m to a ball.
constexpr const char* small_cube = R"(name = "cube"
[geometry]
box = { origin = [0, 0, 0], size = [0.1, 0.1, 0.1], cells = [4, 4, 4] }
[material]
youngs_modulus = 3000
poissons_ratio = 0.3
density = 1000
[[fixed]]
half_space = { point = [0, 0, 0], normal = [0, 0, -1] }
[storage]
scope = "full"
precision = "double"
)";

/// This machine may be busy: late ticks and reports, and hands that seem to jump meanwhile, have their own
/// tests.
const std::string patient =
    "late=10,most_late=1e9,stale_life=10,silence=30,silence_fade=20,frozen=100,ramp=0.2,buzz_flips=1000,"
    "max_speed=1000";

/// Where the ball touches the cube with the handle at 0.
constexpr const char* at_touch = "0.05,0.05,0.11";

constexpr double max_force = 0.5;  // of the board: less than the cube would give [N]

const BoardFeature board_feature{.axes = 3,
                                 .watchdog = 1000,
                                 .force_unit = 250,
                                 .max_force = 500,
                                 .max_stiffness = 600,
                                 .max_damping = 3000,
                                 .workspace_radius = 80000};
constexpr double quantum = 250e-6;  // of the board's force [N]

double tremor(double t) {
  return 2e-5 * std::sin(60.0 * t);
}

/// From 10 mm above to 10 mm deep, lifted, and again: each 2 s.
Vec3 pressing(double t) {
  return {0.0, 0.0, 0.01 * std::cos(std::numbers::pi * t) + tremor(t)};
}

/// Waits 10 mm above until it is told to press: force begins out of contact only, so the loop must run first.
class WaitingHand {
 public:
  void press(const Firmware& firmware) { begin_ = firmware.time(); }

  /// In 1 s to 8 mm deep, and there for good.
  [[nodiscard]] double height(double t) const { return 0.01 - 0.018 * std::clamp(t - begin_, 0.0, 1.0); }
  [[nodiscard]] Hand hand() const {
    return [this](double t) { return Vec3(0.0, 0.0, height(t) + tremor(t)); };
  }

 private:
  std::atomic<double> begin_ = 1e9;  // [s]
};

Vec3 vector(const double (&numbers)[3]) {
  return {numbers[0], numbers[1], numbers[2]};
}

template <typename Constants>
Constants constants_of(const std::string& profile) {
  return std::get<Constants>(find_profile(profile).profile.kind);
}

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// Waits for what comes a moment later. Two minutes without it are a hang.
template <typename Condition>
bool comes_true(const Condition& condition) {
  for (int k = 0; k < 6000; ++k) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return condition();
}

std::string characters(std::span<const std::uint8_t> report) {
  return {report.begin(), report.end()};
}

double last_force(const Firmware& firmware) {
  const auto forces = firmware.forces();
  return forces.empty() ? 0.0 : forces.back().force.norm();
}

::testing::AssertionResult says(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "'" << part << "' is not in: " << text;
}

/// A program that runs; killed when this is left.
class Program {
 public:
  Program(const std::vector<std::string>& line, const fs::path& folder) : messages_(folder / "messages.txt") {
    std::vector<char*> arguments;
    arguments.reserve(line.size() + 1);
    for (const std::string& word : line) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    // Not by fork: umockdev's locks may be held by the threads of emulated devices. And without the far ends
    // of these: who has one keeps its device plugged in.
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, messages_.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     0644);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    EXPECT_EQ(posix_spawn(&child_, arguments[0], &actions, nullptr, arguments.data(), environ), 0);
    posix_spawn_file_actions_destroy(&actions);
  }
  ~Program() {
    if (child_ <= 0) return;
    kill(child_, SIGKILL);
    wait();
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void signal(int number) const { kill(child_, number); }
  /// Its exit status, or the signal that ended it less 1000.
  int wait() {
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status) - 1000;
  }
  [[nodiscard]] std::string messages() const { return text_of(messages_); }

 private:
  fs::path messages_;
  pid_t child_ = -1;
};

class PlayedDevice : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::string name = (fs::temp_directory_path() / "palpate-play-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
    std::ofstream(folder / "cube.toml") << small_cube;
    Program bake(
        {palpate::test::built_file("precompute/palpate-precompute"), "cube.toml", "-o", "cube.palpate.hdf"},
        folder);
    ASSERT_EQ(bake.wait(), 0) << bake.messages();
  }
  static void TearDownTestSuite() { fs::remove_all(folder); }

  void SetUp() override {
    ASSERT_TRUE(EmulatedBus::is_there()) << "run this by umockdev-wrapper";
    fs::remove(session());
  }

  [[nodiscard]] static fs::path session() { return folder / "session.mcap"; }

  /// palpate-runtime with the only device.
  [[nodiscard]] static std::unique_ptr<Program> play(std::vector<std::string> arguments,
                                                     const std::string& safety = patient) {
    const std::string program = palpate::test::built_file("runtime/palpate-runtime");
    std::vector<std::string> line = {program,
                                     "play",
                                     "cube.palpate.hdf",
                                     "--device",
                                     "hid",
                                     "--tool",
                                     "sphere:0.01",
                                     "--overlay",
                                     "no",
                                     "--safety",
                                     safety,
                                     "--record",
                                     "session.mcap",
                                     "--record-frames",
                                     "0",
                                     "--report",
                                     "report.json"};
    if (std::ranges::find(arguments, "--origin") == arguments.end()) {
      arguments.emplace_back("--origin");
      arguments.emplace_back(at_touch);
    }
    line.insert(line.end(), arguments.begin(), arguments.end());
    line.emplace_back("--force");  // over the recording of the run before
    return std::make_unique<Program>(line, folder);
  }

  /// What was recorded up to now, which a checkpoint each half second makes more.
  [[nodiscard]] static std::vector<TickRecord> ticks_until_now() {
    return fs::exists(session()) ? palpate::test::ticks_of(session()) : std::vector<TickRecord>();
  }

  static void wait_for_the_loop(const Program& runtime) {
    EXPECT_TRUE(comes_true([] { return !ticks_until_now().empty(); })) << runtime.messages();
  }

  /// A number of the JSON report.
  [[nodiscard]] static std::int64_t reported(const std::string& name) {
    const std::string report = text_of(folder / "report.json");
    const std::size_t at = report.find("\"" + name + "\": ");
    EXPECT_NE(at, std::string::npos) << name << " is not in " << report;
    return at == std::string::npos ? -1 : std::stoll(report.substr(at + name.size() + 4));
  }

  /// Each output report follows from a tick of the session, but those that the writer made itself while the
  /// loop was held up, those after the loop, and those of ticks that the recording has not.
  static void expect_all_told(const std::vector<Bytes>& told, const std::set<std::string>& computed) {
    const auto others =
        std::ranges::count_if(told, [&](const Bytes& r) { return !computed.contains(characters(r)); });
    const std::int64_t after = static_cast<std::int64_t>(told.size()) - reported("writes") + 1;
    EXPECT_LE(others, reported("writes_without_loop") + reported("dropped_ticks") + after);
    EXPECT_GT(told.size(), 500U);
    EXPECT_GT(static_cast<std::int64_t>(told.size()) - others, 100)
        << "ticks are told, and not the writer's own alone";
  }

  static fs::path folder;
};

fs::path PlayedDevice::folder;

TEST_F(PlayedDevice, ABoardIsFeltAsTheSessionSays) {
  EmulatedBus bus;
  auto board = std::make_shared<BoardFirmware>(board_feature, pressing);
  const std::string path = bus.plug_in(board);
  const auto runtime = play({});
  bus.talk(path);
  // Two reports 8 s apart: when they arrived tells the rate, as exactly as their answers came at once.
  std::uint32_t begin = 0, end = 0;
  double late = 0.0;  // both answers together [s]
  const auto is_answered = [&](std::uint32_t least, std::uint32_t& number) {
    const auto answered = board->answered();
    if (answered.empty() || answered.back() < least) return false;
    number = answered.back() + 1;
    late += board->time() - 1e-3 * number;
    return true;
  };
  EXPECT_TRUE(comes_true([&] { return is_answered(0, begin); })) << runtime->messages();
  EXPECT_TRUE(comes_true([&] { return board->answered().size() > 4000; })) << runtime->messages();
  EXPECT_TRUE(comes_true([&] { return last_force(*board) > 0.9 * max_force; })) << runtime->messages();
  EXPECT_TRUE(comes_true([&] { return is_answered(begin + 8000, end); })) << runtime->messages();
  runtime->signal(SIGINT);
  ASSERT_EQ(runtime->wait(), 130) << runtime->messages();
  EXPECT_TRUE(says(runtime->messages(), "Home-made board, CAFE:4001 Board (/dev/hidraw0)"));
  EXPECT_TRUE(says(runtime->messages(), "at most 0.5 N and, by the coupling, 600 N/m"));

  const std::string options = RecordingFile(session()).info().options;
  EXPECT_TRUE(says(options, "\ncoupling=600\n"));
  EXPECT_TRUE(says(options, "max_force=0.5,"));
  const auto ticks = palpate::test::ticks_of(session());
  ASSERT_GT(ticks.size(), 2500U);
  std::set<std::string> computed;
  std::set<std::uint32_t> heard;
  double largest = 0.0;
  for (const TickRecord& tick : ticks) {
    heard.insert(tick.sequence);
    // Each is the place that belongs to its number: none is torn, none was miscounted.
    ASSERT_LT((vector(tick.handle_position) - pressing(1e-3 * (tick.sequence - 1))).norm(), 1e-6);
    const auto counts = board_counts(board_feature, vector(tick.shown_force));
    const auto report = encode_board_force({tick.sequence - 1, counts});
    computed.insert(characters(report));
    largest = std::max(largest, vector(tick.shown_force).norm());
    EXPECT_EQ(tick.fault, 0);
  }
  EXPECT_TRUE(std::ranges::is_sorted(ticks, {}, &TickRecord::sequence));
  EXPECT_GT(heard.size(), 20U) << "they go on coming; on a busy machine many ticks have the same one";
  const auto tick_of = [&](std::uint32_t number) {
    return *std::ranges::lower_bound(ticks, number, {}, &TickRecord::sequence);
  };
  const TickRecord first = tick_of(begin), last = tick_of(end);
  const double due = 1e-3 * (last.sequence - first.sequence);
  EXPECT_NEAR(1e-9 * static_cast<double>(last.arrived_ns - first.arrived_ns), due, 0.05 * due + late);
  EXPECT_NEAR(largest, max_force, 1e-9) << "the board's own limit";
  EXPECT_GT(reported("ticks_in_contact"), 1000);

  expect_all_told(board->outputs(), computed);
  for (const ShownForce& shown : board->forces()) {
    EXPECT_LE(shown.force.norm(), max_force + quantum);
  }
  EXPECT_EQ(last_force(*board), 0.0);
  RecordProperty("reports", std::to_string(reported("reports")));
}

TEST_F(PlayedDevice, WoodenHapticsIsFeltAsTheSessionSays) {
  EmulatedBus bus;
  const auto arm = constants_of<ArmConstants>("woodenhaptics");
  auto firmware = std::make_shared<WoodenHapticsFirmware>(arm, pressing);
  firmware->watchdog = 60.0;
  bus.talk(bus.plug_in(firmware));
  const auto runtime = play({"--profile", "woodenhaptics"});
  EXPECT_TRUE(comes_true([&] { return firmware->output_count() > 4000; })) << runtime->messages();
  EXPECT_TRUE(comes_true([&] { return last_force(*firmware) > 0.4; })) << runtime->messages();
  runtime->signal(SIGINT);
  ASSERT_EQ(runtime->wait(), 130) << runtime->messages();
  const auto ticks = palpate::test::ticks_of(session());
  std::set<std::string> computed;
  std::set<std::uint32_t> heard;
  double largest = 0.0;
  for (const TickRecord& tick : ticks) {
    heard.insert(tick.sequence);
    const Vec3 place = vector(tick.handle_position);
    const Vec3 force = vector(tick.shown_force);
    const auto report = encode_currents(motor_currents(arm, inverse_arm(arm, place).value(), force));
    computed.insert(characters(report));
    largest = std::max(largest, force.norm());
    ASSERT_LT(place.head<2>().norm(), 3e-4);
    EXPECT_EQ(tick.fault, 0);
  }
  EXPECT_GT(largest, 0.4) << "contact was felt";
  EXPECT_GT(heard.size(), 20U) << "they go on coming; on a busy machine many ticks have the same one";
  expect_all_told(firmware->outputs(), computed);
  double felt = 0.0;
  for (const ShownForce& shown : firmware->forces()) felt = std::max(felt, shown.force.norm());
  EXPECT_NEAR(felt, largest, 0.05);  // by whole milliamperes and counts of the encoders
  EXPECT_EQ(last_force(*firmware), 0.0);
}

TEST_F(PlayedDevice, UnpluggedInContactAndPluggedInAgain) {
  constexpr double rate = 20.0;  // N/s
  constexpr double lifts = 2.0;  // the second hand, from its beginning [s]
  WaitingHand hand;
  EmulatedBus bus;
  auto board = std::make_shared<BoardFirmware>(board_feature, hand.hand());
  const std::string path = bus.plug_in(board, "B1");
  const auto runtime = play({}, patient + ",max_force_rate=20");
  bus.talk(path);
  ASSERT_TRUE(comes_true([&] { return !board->outputs().empty(); })) << runtime->messages();
  hand.press(*board);
  ASSERT_TRUE(comes_true([&] { return last_force(*board) > 0.9 * max_force; })) << runtime->messages();
  bus.unplug(path);
  ASSERT_TRUE(comes_true([&] { return says(runtime->messages(), "device_lost"); })) << runtime->messages();
  auto again = std::make_shared<BoardFirmware>(board_feature, [](double t) {
    const double lifted = std::max(0.0, t - lifts);  // and again each 6.3 s
    return Vec3(0.0, 0.0, -0.008 + 0.009 * (1.0 - std::cos(lifted)) + tremor(t));
  });
  const std::string new_path = bus.plug_in(again, "B1");
  bus.talk(new_path);
  const bool felt = comes_true([&] { return last_force(*again) > 0.9 * max_force; });
  runtime->signal(SIGINT);
  ASSERT_EQ(runtime->wait(), 130) << runtime->messages();
  ASSERT_TRUE(felt) << runtime->messages();
  EXPECT_TRUE(says(runtime->messages(), "device_lost"));
  EXPECT_TRUE(says(runtime->messages(), "the device is back"));
  EXPECT_EQ(reported("opened_again"), 1);

  for (const ShownForce& shown : again->forces()) {
    // Its path is above touch only from here on.
    if (shown.time < lifts + 0.5) {
      ASSERT_EQ(shown.force, Vec3::Zero()) << shown.time;
    }
    EXPECT_LE(shown.force.norm(), max_force + quantum);
  }
  const auto ticks = palpate::test::ticks_of(session());
  bool was_lost = false;
  bool may_feel = true;
  Vec3 last = Vec3::Zero();
  std::int64_t begun = ticks.front().begun_ns;
  std::size_t bounded = 0;
  for (const TickRecord& tick : ticks) {
    const Vec3 shown = vector(tick.shown_force);
    const auto events = static_cast<DeviceEvent>(tick.event);
    was_lost = was_lost || has(events, DeviceEvent::lost);
    if (has(events, DeviceEvent::lost)) may_feel = false;  // until the tool is clear of the body
    if (tick.fault == 0 && vector(tick.force).norm() < SafetyOptions{}.small_force) may_feel = true;
    if (!may_feel) {
      ASSERT_EQ(shown, Vec3::Zero()) << tick.time;
    }
    EXPECT_LE(shown.norm(), max_force + 1e-12);
    // After a gap between ticks the device has let the force fade: see Safety.
    const double gap = 1e-9 * static_cast<double>(tick.begun_ns - begun);
    if (tick.fault == 0 && gap < SafetyOptions{}.stale.time_to_live) {
      EXPECT_LE((shown - last).norm(), rate * 1e-3 * (1 + 1e-9)) << tick.time << " after " << gap;
      ++bounded;
    }
    begun = tick.begun_ns;
    last = shown;
  }
  EXPECT_TRUE(was_lost);
  EXPECT_GT(bounded, ticks.size() / 4);
  const auto faulted =
      std::ranges::find(ticks, static_cast<std::uint8_t>(Fault::device_lost), &TickRecord::fault);
  EXPECT_NE(faulted, ticks.end());
}

TEST_F(PlayedDevice, KilledInContactItLeavesNoForce) {
  WaitingHand hand;
  EmulatedBus bus;
  auto board = std::make_shared<BoardFirmware>(board_feature, hand.hand());
  const std::string path = bus.plug_in(board);
  const auto runtime = play({});
  bus.talk(path);
  ASSERT_TRUE(comes_true([&] { return !board->outputs().empty(); })) << runtime->messages();
  hand.press(*board);
  ASSERT_TRUE(comes_true([&] { return last_force(*board) > 0.9 * max_force; })) << runtime->messages();
  runtime->signal(SIGKILL);
  EXPECT_EQ(runtime->wait(), SIGKILL - 1000);
  EXPECT_TRUE(comes_true([&] { return last_force(*board) == 0.0; })) << "the guardian's";
}

TEST_F(PlayedDevice, ASpaceMouseMovesTheToolAndShowsNothing) {
  EmulatedBus bus;
  std::atomic<bool> down = false;
  auto firmware = std::make_shared<SpaceMouseFirmware>([&](double) {
    return std::array<std::int16_t, 6>{0, 0, static_cast<std::int16_t>(down ? 350 : 0), 0, 0, 0};
  });
  bus.talk(bus.plug_in(firmware));
  // Frozen numbers are a fault after 0.25 s, but not without a force.
  const std::string safety =
      "late=10,most_late=1e9,stale_life=10,silence=5,silence_fade=4,ramp=0.2,buzz_flips=1000";
  const auto runtime = play({"--origin", "0.05,0.05,0.13"}, safety);
  wait_for_the_loop(*runtime);
  // Some millimetres each time, and a look, until it has come down on the cube.
  const auto presses = [] {
    const auto ticks = ticks_until_now();
    return ticks.back().contacts > 0 && ticks.back().force[2] < -0.2;
  };
  EXPECT_TRUE(comes_true([&] {
    const std::size_t before = ticks_until_now().size();
    down = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    down = false;
    return comes_true([&] { return ticks_until_now().size() > before; }) && presses();
  }));
  const std::size_t there = ticks_until_now().size();  // and for twice as long as numbers may stand still
  EXPECT_TRUE(comes_true([&] { return ticks_until_now().size() > there + 1000; })) << runtime->messages();
  runtime->signal(SIGINT);
  ASSERT_EQ(runtime->wait(), 130) << runtime->messages();
  EXPECT_TRUE(says(runtime->messages(), "at most 0 N"));
  const auto ticks = palpate::test::ticks_of(session());
  for (const TickRecord& tick : ticks) {
    EXPECT_EQ(tick.fault, 0) << tick.time;
    EXPECT_EQ(vector(tick.shown_force), Vec3::Zero());
  }
  const TickRecord& end = ticks.back();
  EXPECT_NEAR(ticks.front().device_position[2], 0.13, 1e-12);
  EXPECT_LT(end.device_position[2], 0.11);
  EXPECT_GT(end.contacts, 0);
  EXPECT_LT(end.force[2], -0.1) << "the tool rests in contact";
  EXPECT_TRUE(firmware->outputs().empty());
}

TEST_F(PlayedDevice, AJoystickIsFeltAlsoWhileItRests) {
  WaitingHand hand;  // along y, and it rests there without a tremor
  EmulatedBus bus;
  auto firmware = std::make_shared<JoystickFirmware>(
      constants_of<PidConstants>("pid_joystick"), [&](double t) { return Vec3(0.0, hand.height(t), 0.0); });
  firmware->on_change = true;
  const std::string path = bus.plug_in(firmware);
  const auto runtime = play(
      {"--axes", "x,z,-y"},
      "late=10,most_late=1e9,stale_life=10,silence=1.5,silence_fade=1,frozen=100,ramp=0.2,buzz_flips=1000,"
      "max_speed=1000");
  ASSERT_TRUE(comes_true([&] { return firmware->playing() == 2; })) << runtime->messages();
  bus.talk(path);
  wait_for_the_loop(*runtime);
  hand.press(*firmware);
  const auto felt_for = [] {  // ticks
    const auto ticks = ticks_until_now();
    return ticks.end() -
           std::ranges::find_if(ticks, [](const TickRecord& tick) { return tick.shown_force[1] > 0.3; });
  };
  EXPECT_TRUE(comes_true([&] { return felt_for() > 4000; }))
      << "three seconds of them at rest: twice what is silence";
  const Vec3 felt = firmware->forces().back().force;
  runtime->signal(SIGINT);
  ASSERT_EQ(runtime->wait(), 130) << runtime->messages();
  const auto ticks = palpate::test::ticks_of(session());
  EXPECT_EQ(ticks.back().fault, 0);
  const Vec3 shown = vector(ticks.back().shown_force);
  EXPECT_GT(shown.y(), 0.3);
  EXPECT_NEAR(felt.y(), shown.y(), 0.05);  // a count is 10 N / 255
  EXPECT_NEAR(felt.x(), shown.x(), 0.05);
  EXPECT_EQ(firmware->playing(), 0U);
  EXPECT_EQ(last_force(*firmware), 0.0);
}

}  // namespace
}  // namespace palpate::play_test
