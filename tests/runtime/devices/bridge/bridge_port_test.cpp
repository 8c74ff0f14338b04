// The bridge's port: the handshake, whom it listens to, what it refuses and counts, and the example at its
// other end.
#include "runtime/devices/bridge/bridge_port.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "tests/support/devices/bytes.h"
#include "tests/support/folders.h"

namespace palpate::bridge_port_test {
namespace {

using Clock = std::chrono::steady_clock;
using ReadResult = DevicePort::ReadResult;
constexpr double infinity = std::numeric_limits<double>::infinity();

BridgeOptions any_port() {
  BridgeOptions options;
  options.listen.port = 0;
  return options;
}

/// Where this process and the example keep keys.
const std::filesystem::path keys = [] {
  const std::filesystem::path folder = testing::TempDir() + "/palpate_keys." + std::to_string(getpid());
  std::filesystem::create_directory(folder);
  setenv("XDG_RUNTIME_DIR", folder.c_str(), 1);
  return folder;
}();

class KeysAreRemoved : public testing::Environment {
  void TearDown() override { std::filesystem::remove_all(keys); }
};
const auto* const remover = testing::AddGlobalTestEnvironment(new KeysAreRemoved);

/// As a bridge reads it.
BridgeKey read_key(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::string text;
  EXPECT_TRUE(std::getline(stream, text)) << file;
  EXPECT_EQ(text.size(), 32U);
  BridgeKey key{};
  for (std::size_t k = 0; k < key.size(); ++k)
    key[k] = static_cast<std::uint8_t>(std::stoul(text.substr(2 * k, 2), nullptr, 16));
  return key;
}

/// A bridge that says what it is told to say.
class Partner {
 public:
  explicit Partner(const BridgePort& port) : Partner(port, read_key(port.key_file())) {}
  Partner(const BridgePort& of, const BridgeKey& key_given)
      : key(key_given), socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    const std::uint16_t port = of.port();
    sockaddr_in runtime{};
    runtime.sin_family = AF_INET;
    runtime.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    runtime.sin_port = htons(port);
    EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&runtime), sizeof runtime), 0);
  }
  ~Partner() { ::close(socket_); }
  Partner(const Partner&) = delete;
  Partner& operator=(const Partner&) = delete;

  /// With the next number. By its clock a second passes in between: whatever happens on this machine, nothing
  /// is too long on its way.
  void say(BridgeState state) {
    state.nonce = nonce;
    state.device.sequence = ++sequence;
    state.time = 1'000'000'000ULL * sequence;
    say_sealed(as_bytes(encode_bridge_state(state)));
  }
  void say_sealed(Bytes bytes) {
    if (bytes.size() > 8) seal(key, bytes);
    said.push_back(bytes);
    say_bytes(bytes);
  }
  void say_bytes(const Bytes& bytes) {
    EXPECT_EQ(send(socket_, bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
  }

  /// The next command; nothing when there is none.
  std::optional<BridgeCommand> told() {
    pollfd waiting{socket_, POLLIN, 0};
    poll(&waiting, 1, 50);
    std::array<std::uint8_t, 256> buffer{};
    const ssize_t size = recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
    BridgeCommand command;
    if (size < 0) return std::nullopt;
    EXPECT_TRUE(is_sealed(key, std::span(buffer).first(static_cast<std::size_t>(size))));
    EXPECT_EQ(decode_bridge_command(std::span(buffer).first(static_cast<std::size_t>(size)), command),
              Refusal::none);
    return command;
  }

  BridgeKey key;
  std::uint64_t nonce = 0;
  std::uint32_t sequence = 0;
  std::vector<Bytes> said;

 private:
  int socket_;
};

/// Reads until something comes of it, or not for `seconds`.
ReadResult hear(BridgePort& port, DeviceState& state, double seconds = 10.0) {
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  ReadResult heard = ReadResult::nothing;
  while (heard == ReadResult::nothing && Clock::now() < end) heard = port.read(state);
  return heard;
}

class BridgePortTest : public testing::Test {
 protected:
  void SetUp() override { port.open(); }

  /// Says hello, is told the nonce.
  void shake_hands(Partner& partner) {
    partner.say({});
    EXPECT_EQ(port.read(state), ReadResult::nothing);
    const auto answer = partner.told();
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->mode, BridgeMode::zero);
    EXPECT_NE(answer->nonce, 0U);
    partner.nonce = answer->nonce;
  }
  void join(Partner& partner) {
    shake_hands(partner);
    partner.say({});
    ASSERT_EQ(port.read(state), ReadResult::report);
  }
  /// What is said is refused, once and for that reason.
  void expect_refused(Refusal refusal) {
    const std::uint64_t before = port.counts()[refusal];
    const std::uint64_t taken = port.counts()[Refusal::none];
    EXPECT_EQ(port.read(state), ReadResult::nothing);
    EXPECT_EQ(port.counts()[refusal], before + 1);
    EXPECT_EQ(port.counts()[Refusal::none], taken);
  }

  BridgePort port{any_port()};
  DeviceState state;
};

TEST(BridgeAddress, OfItsText) {
  const auto expect = [](const char* text, const char* address, int number) {
    const BridgeAddress parsed = parse_bridge_address(text);
    EXPECT_EQ(parsed.address, address) << text;
    EXPECT_EQ(parsed.port, number) << text;
  };
  expect("bridge", "127.0.0.1", 4270);
  expect("bridge:", "127.0.0.1", 4270);
  expect("bridge:5000", "127.0.0.1", 5000);
  expect("bridge:65535", "127.0.0.1", 65535);
  expect("bridge:192.168.1.2:5000", "192.168.1.2", 5000);
  for (const char* text :
       {"", "bridg", "bridges", "script:4270", "bridge:0", "bridge:65536", "bridge:-1", "bridge:5000 ",
        "bridge:5000x", "bridge:x", "bridge::5000", "bridge:localhost:5000",
        "bridge:127.0.0.1:", "bridge:127.0.0.1", "bridge:::1:5000", "bridge:127.0.0.1:5000:6000"}) {
    EXPECT_THROW(static_cast<void>(parse_bridge_address(text)), Error) << text;
  }
}

TEST_F(BridgePortTest, AnAddressThatIsTakenOrNotOurs) {
  EXPECT_EQ(port.name(), "bridge:127.0.0.1:" + std::to_string(port.port()));
  BridgeOptions options;
  options.listen.port = port.port();
  BridgePort second(options);
  try {
    second.open();
    FAIL() << "two listen at one port";
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), port.name());
    EXPECT_NE(error.hint().find("another port"), std::string::npos);
  }
  port.close();
  second.open();
  options.listen.address = "192.0.2.1";  // of nobody: for documentation
  EXPECT_THROW(BridgePort(options).open(), Error);
  options.listen.address = "nowhere";
  EXPECT_THROW(BridgePort(options).open(), Error);
}

TEST_F(BridgePortTest, HandshakeThenReports) {
  Partner partner(port);
  shake_hands(partner);
  EXPECT_EQ(port.counts()[Refusal::hello], 1U);
  EXPECT_EQ(port.counts()[Refusal::none], 0U);

  BridgeState said;
  said.device.pose.position = Vec3(0.01, 0.02, -0.03);
  said.device.pose.orientation = Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5);
  said.device.velocity = Vec3(0.1, 0.2, 0.3);
  said.device.buttons = 0x8001;
  const auto before = Clock::now().time_since_epoch();
  partner.say(said);
  ASSERT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(state.pose.position, said.device.pose.position);
  EXPECT_EQ(state.pose.orientation.coeffs(), said.device.pose.orientation.coeffs());
  EXPECT_EQ(state.velocity, said.device.velocity);
  EXPECT_EQ(state.buttons, 0x8001U);
  EXPECT_TRUE(state.pose.grab);
  EXPECT_EQ(state.sequence, 2U);
  EXPECT_GE(state.arrived, std::chrono::nanoseconds(before).count());
  EXPECT_LE(state.arrived, std::chrono::nanoseconds(Clock::now().time_since_epoch()).count());
  EXPECT_EQ(port.read(state), ReadResult::nothing);
}

TEST_F(BridgePortTest, EachPortHasItsOwnSession) {
  Partner partner(port);
  join(partner);
  BridgePort other(any_port());
  other.open();
  Partner stale(other);
  stale.nonce = partner.nonce;
  stale.say({});
  EXPECT_EQ(other.read(state), ReadResult::nothing);
  EXPECT_EQ(other.counts()[Refusal::wrong_nonce], 1U);
  const auto answer = stale.told();
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->mode, BridgeMode::zero);
  EXPECT_NE(answer->nonce, partner.nonce);
  stale.nonce = answer->nonce;
  stale.say({});
  EXPECT_EQ(other.read(state), ReadResult::report);
}

TEST_F(BridgePortTest, TakesTheNewestOfWhatWaits) {
  Partner partner(port);
  join(partner);
  for (int k = 1; k <= 20; ++k) {
    BridgeState said;
    said.device.pose.position.x() = 0.001 * k;
    partner.say(said);
  }
  partner.say_bytes({1, 2, 3});
  ASSERT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(state.pose.position.x(), 0.001 * 20);
  EXPECT_EQ(port.counts()[Refusal::none], 21U);
  EXPECT_EQ(port.counts()[Refusal::size], 1U);
}

TEST_F(BridgePortTest, RefusesByReason) {
  Partner partner(port);
  join(partner);
  const DeviceState before = state;
  BridgeState said;
  said.nonce = partner.nonce;
  said.time = 10'000'000'000;
  said.device.sequence = 10;
  const Bytes good = as_bytes(encode_bridge_state(said));
  const auto changed = [&](std::size_t at, const Bytes& to) {
    Bytes bad = good;
    std::copy(to.begin(), to.end(), bad.begin() + static_cast<std::ptrdiff_t>(at));
    partner.say_sealed(bad);
  };
  partner.say_bytes(Bytes(good.begin(), good.end() - 1));
  expect_refused(Refusal::size);
  partner.say_bytes(Bytes(2000, good[0]));
  expect_refused(Refusal::magic);
  partner.say_bytes({});
  expect_refused(Refusal::size);
  changed(0, {'X'});
  expect_refused(Refusal::magic);
  changed(4, {1});
  expect_refused(Refusal::version);
  changed(32 + 6, {0xF8, 0x7F});  // NaN
  expect_refused(Refusal::not_finite);
  changed(56 + 6, {0xF0, 0x7F});  // infinite
  expect_refused(Refusal::not_finite);
  changed(32 + 6, {0x28, 0x40});  // 12 m
  expect_refused(Refusal::implausible);
  changed(80, {0, 0, 0, 0});  // a quaternion of length 0
  expect_refused(Refusal::orientation);
  changed(16, {2});  // the number of the last one
  expect_refused(Refusal::order);
  changed(24, Bytes(8, 0));
  expect_refused(Refusal::time);
  changed(8, Bytes(8, 0));
  expect_refused(Refusal::hello);
  changed(8, Bytes(8, 1));
  expect_refused(Refusal::wrong_nonce);
  partner.say_bytes(good);
  expect_refused(Refusal::seal);
  Bytes resealed = good;
  seal(partner.key, resealed);
  resealed[40] ^= 1U;
  partner.say_bytes(resealed);
  expect_refused(Refusal::seal);
  Partner other(port);
  other.say_sealed(good);
  expect_refused(Refusal::address);
  EXPECT_EQ(state.sequence, before.sequence);
  EXPECT_EQ(state.arrived, before.arrived);

  partner.say_sealed(good);
  EXPECT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(state.sequence, 10U);
  EXPECT_EQ(port.counts().skipped, 7U);  // 3 to 9
}

TEST_F(BridgePortTest, TooLongOnItsWay) {
  Partner partner(port);
  join(partner);
  BridgeState said;
  said.nonce = partner.nonce;
  said.device.sequence = 3;
  said.time = 3'000'000'000;
  partner.say_sealed(as_bytes(encode_bridge_state(said)));
  ASSERT_EQ(port.read(state), ReadResult::report);
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
  said.device.sequence = 4;
  said.time += 1'000'000;  // by its clock it was said 1 ms later
  partner.say_sealed(as_bytes(encode_bridge_state(said)));
  expect_refused(Refusal::age);
}

TEST_F(BridgePortTest, RandomDatagramsDoNotGetThrough) {
  Partner partner(port);
  join(partner);
  std::mt19937 random(11);
  for (int i = 0; i < 100'000; ++i) {
    Bytes any = random_bytes(random, random() % 200);
    if (i % 2 == 0) {  // or all but the nonce as it should be
      BridgeState said;
      said.device.sequence = static_cast<std::uint32_t>(random());
      any = as_bytes(encode_bridge_state(said));
      for (std::size_t k = 8; k < 16; ++k) any[k] = static_cast<std::uint8_t>(random());
      if (i % 4 == 0) seal(partner.key, any);
    }
    partner.say_bytes(any);
    if (i % 50 == 0) {
      EXPECT_NE(port.read(state), ReadResult::report);  // after a second the partner is lost
    }
  }
  EXPECT_NE(port.read(state), ReadResult::report);
  EXPECT_EQ(port.counts()[Refusal::none], 1U);
  EXPECT_GT(port.counts()[Refusal::wrong_nonce], 5'000U);
  EXPECT_GT(port.counts()[Refusal::seal], 5'000U);
}

TEST_F(BridgePortTest, NobodyIsNotLost) {
  EXPECT_EQ(hear(port, state, 1.2), ReadResult::nothing);
  EXPECT_TRUE(port.write({}, state));
  EXPECT_EQ(port.counts().commands, 0U);
}

TEST_F(BridgePortTest, TheNextOneTakesOverAfterSilence) {
  Partner first(port);
  join(first);
  Partner second(port);
  const auto silent_since = Clock::now();
  ReadResult heard = ReadResult::nothing;
  while (heard == ReadResult::nothing && Clock::now() - silent_since < std::chrono::seconds(20)) {
    second.say({});  // hello
    heard = port.read(state);
  }
  EXPECT_EQ(heard, ReadResult::lost);
  EXPECT_GE(Clock::now() - silent_since, std::chrono::milliseconds(900));
  EXPECT_LE(Clock::now() - silent_since, std::chrono::seconds(6));
  EXPECT_GE(port.counts()[Refusal::address], 1U);
  EXPECT_FALSE(second.told()) << "it was answered while the first one was there";
  join(second);
  first.say({});
  expect_refused(Refusal::address);
}

TEST_F(BridgePortTest, LostAndOpenedAgainItWaits) {
  Partner partner(port);
  join(partner);
  EXPECT_EQ(hear(port, state), ReadResult::lost);
  port.close();
  EXPECT_EQ(port.read(state), ReadResult::lost);
  EXPECT_FALSE(port.write({}, state));
  port.open();
  EXPECT_EQ(port.read(state), ReadResult::nothing);
  Partner again(port);
  EXPECT_EQ(again.key, partner.key) << "it is the port's";
  again.nonce = partner.nonce;
  again.say({});
  EXPECT_EQ(port.read(state), ReadResult::nothing) << "what was said before does not count any more";
  const auto answer = again.told();
  ASSERT_TRUE(answer);
  again.nonce = answer->nonce;
  again.say({});
  EXPECT_EQ(port.read(state), ReadResult::report);
}

/// Until the port has given its partner up; `meanwhile` is called all the time.
void lose(BridgePort& port, const std::function<void()>& meanwhile) {
  DeviceState state;
  const auto end = Clock::now() + std::chrono::seconds(20);
  ReadResult heard = ReadResult::nothing;
  while (heard == ReadResult::nothing && Clock::now() < end) {
    meanwhile();
    heard = port.read(state);
  }
  EXPECT_EQ(heard, ReadResult::lost);
}

TEST_F(BridgePortTest, AStrangerNeverBecomesThePartner) {
  BridgeKey guess{};
  guess.back() = 1;
  Partner stranger(port, guess);
  const auto expect_ignored = [&] {
    const std::uint64_t before = port.counts()[Refusal::seal];
    stranger.say({});
    stranger.say_bytes(as_bytes(encode_bridge_state({})));  // not even sealed
    EXPECT_EQ(port.read(state), ReadResult::nothing);
    EXPECT_EQ(port.counts()[Refusal::seal], before + 2);
    EXPECT_FALSE(stranger.told()) << "it was answered";
  };
  expect_ignored();
  Partner honest(port);
  join(honest);
  stranger.nonce = honest.nonce;  // even if it knew
  lose(port, [&] { stranger.say({}); });
  stranger.nonce = 0;
  expect_ignored();
  stranger.nonce = honest.nonce;
  expect_ignored();
  honest.nonce = 0;
  join(honest);  // it is taken again
  EXPECT_EQ(port.counts()[Refusal::none], 2U);
}

TEST_F(BridgePortTest, WhatWasSaidOnceDoesNotCountAgain) {
  Partner honest(port);
  join(honest);
  for (int k = 0; k < 3; ++k) {
    honest.say({});
    EXPECT_EQ(port.read(state), ReadResult::report);
  }
  Partner thief(port);  // it has heard all, and has no key
  const auto replay = [&] {
    for (const Bytes& bytes : honest.said) {
      thief.say_bytes(bytes);
      EXPECT_NE(port.read(state), ReadResult::report);
    }
  };
  replay();
  lose(port, [] {});
  replay();
  port.close();
  port.open();
  const std::uint64_t taken = port.counts()[Refusal::none];
  Partner later(port);
  for (const Bytes& bytes : honest.said) {
    later.say_bytes(bytes);
    EXPECT_EQ(port.read(state), ReadResult::nothing);
  }
  EXPECT_EQ(port.counts()[Refusal::none], taken);
  Partner back(port);
  join(back);
}

TEST_F(BridgePortTest, FaultOfTheDeviceIsLost) {
  Partner partner(port);
  join(partner);
  const DeviceState before = state;
  BridgeState said;
  said.fault = true;
  said.device.pose.position.x() = 0.5;
  partner.say(said);
  EXPECT_EQ(port.read(state), ReadResult::lost);
  EXPECT_EQ(state.pose.position, before.pose.position);
}

TEST_F(BridgePortTest, LimitsAreWhatWasSaidLast) {
  EXPECT_EQ(port.limits().max_force, infinity);
  EXPECT_EQ(port.limit_changes(), 0U);
  Partner partner(port);
  join(partner);
  EXPECT_EQ(port.limit_changes(), 0U);  // it said none
  BridgeState said;
  said.limits = {8.0, infinity, 2000.0, 20.0, 0.125};
  for (int k = 0; k < 3; ++k) {
    partner.say(said);
    ASSERT_EQ(port.read(state), ReadResult::report);
    EXPECT_EQ(port.limit_changes(), 1U);
  }
  const DeviceLimits limits = port.limits();
  EXPECT_EQ(limits.max_force, 8.0);
  EXPECT_EQ(limits.max_torque, infinity);
  EXPECT_EQ(limits.max_stiffness, 2000.0);
  EXPECT_EQ(limits.max_damping, 20.0);
  EXPECT_EQ(limits.workspace_radius, 0.125);
  said.limits.max_force = 3.0;
  partner.say(said);
  ASSERT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(port.limit_changes(), 2U);
  EXPECT_EQ(port.limits().max_force, 3.0);
}

TEST_F(BridgePortTest, CommandsByMode) {
  Partner partner(port);
  join(partner);
  DeviceCommand command;
  const auto mode = [&] {
    EXPECT_TRUE(port.write(command, state));
    const auto told = partner.told();
    EXPECT_TRUE(told);
    return told.value_or(BridgeCommand{}).mode;
  };
  EXPECT_EQ(mode(), BridgeMode::zero);
  command.local.radius = 0.001;
  command.local.point = Vec3(1, 2, 3);
  EXPECT_EQ(mode(), BridgeMode::zero);
  command.local.stiffness(1, 1) = 100.0;
  EXPECT_EQ(mode(), BridgeMode::local_model);
  command.local.radius = 0.0;
  EXPECT_EQ(mode(), BridgeMode::zero);
  command.wrench.torque.y() = 0.01;
  EXPECT_EQ(mode(), BridgeMode::force);
  command.wrench = {Vec3(0, 0, -1), Vec3::Zero()};
  EXPECT_EQ(mode(), BridgeMode::force);
  command.local.radius = 0.001;
  EXPECT_EQ(mode(), BridgeMode::local_model);
  command.wrench.force.x() = std::nan("");
  EXPECT_EQ(mode(), BridgeMode::zero);
}

TEST_F(BridgePortTest, CommandSaysAllThatABridgeNeeds) {
  Partner partner(port);
  join(partner);
  DeviceCommand command;
  command.wrench = {Vec3(0, 0.5, 2), Vec3(0.125, 0, 0)};
  command.local = {command.wrench.force, 500.0 * Mat3::Identity(), Vec3(0.01, 0.02, 0.03), 0.25};
  state.sequence = 77;
  ASSERT_TRUE(port.write(command, state));
  const auto told = partner.told();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->nonce, partner.nonce);
  EXPECT_EQ(told->answers, 77U);
  EXPECT_EQ(told->command.wrench.force, command.wrench.force);
  EXPECT_EQ(told->command.wrench.torque, command.wrench.torque);
  EXPECT_EQ(told->command.local.stiffness, command.local.stiffness);
  EXPECT_EQ(told->command.local.point, command.local.point);
  EXPECT_EQ(told->command.local.radius, 0.25);
  EXPECT_EQ(told->damping, 0.5);
  EXPECT_EQ(told->time_to_live, 10);
  EXPECT_EQ(told->fade, 20);
  EXPECT_EQ(told->max_force, 3.0);
  ASSERT_TRUE(port.write(command, state));
  const auto next = partner.told();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->sequence, told->sequence + 1);
  EXPECT_GE(next->time, told->time);
}

TEST_F(BridgePortTest, CloseSaysNoForceThreeTimes) {
  Partner partner(port);
  join(partner);
  DeviceCommand command;
  command.wrench.force.z() = 1.0;
  ASSERT_TRUE(port.write(command, state));
  port.close();
  ASSERT_EQ(partner.told().value_or(BridgeCommand{}).mode, BridgeMode::force);
  for (int k = 0; k < 3; ++k) {
    const auto told = partner.told();
    ASSERT_TRUE(told) << k;
    EXPECT_EQ(told->mode, BridgeMode::zero);
    EXPECT_EQ(told->nonce, partner.nonce);
  }
  port.close();
}

TEST_F(BridgePortTest, OneThreadReadsAnotherWrites) {
  Partner partner(port);
  join(partner);
  std::atomic<bool> done = false;
  std::thread writer([&] {
    DeviceCommand command;
    command.wrench.force.z() = 1.0;
    while (!done) EXPECT_TRUE(port.write(command, {}));
  });
  BridgeState said;
  for (int k = 1; k <= 2000; ++k) {
    said.limits.max_force = k;
    partner.say(said);
    port.read(state);
    EXPECT_LE(port.limits().max_force, k);
  }
  while (port.counts().commands < 10) std::this_thread::yield();  // until the writer had its turn
  done = true;
  writer.join();
  EXPECT_EQ(port.counts()[Refusal::none], 2001U);
  EXPECT_EQ(port.limits().max_force, 2000.0);
  std::uint64_t told = 0;
  while (partner.told()) ++told;
  EXPECT_GT(told, 0U);
  EXPECT_LE(told, port.counts().commands);
}

/// palpate-bridge-example, until destroyed.
class Example {
 public:
  explicit Example(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), palpate::test::built_file("runtime/palpate-bridge-example"));
    std::vector<char*> pointers;
    pointers.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    EXPECT_EQ(posix_spawn(&process_, pointers[0], nullptr, nullptr, pointers.data(), environ), 0);
  }
  ~Example() {
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  Example(const Example&) = delete;
  Example& operator=(const Example&) = delete;

 private:
  pid_t process_ = 0;
};

TEST(BridgeExample, TheHandIsPushedToWhereForcesBalance) {
  // The hand's spring of 300 N/m and the command's local model:
  // 300 (start - x) + F - K (x - x0) = 0.
  BridgeOptions options = any_port();
  options.stale.time_to_live = 1.0;  // this machine may be busy
  BridgePort port(options);
  port.open();
  const Example example({"--port", std::to_string(port.port()), "--rate", "2000", "--seconds", "60", "--from",
                         "0.01,0,-0.02", "--to", "0.01,0,-0.02"});
  const Vec3 start(0.01, 0, -0.02);
  DeviceCommand command;
  command.wrench.force = Vec3(0.3, -0.6, 0.9);
  command.local.stiffness << 300, 20, 0, 20, 200, 0, 0, 0, 100;
  command.local.point = Vec3(0.011, 0.001, -0.019);
  command.local.radius = 0.1;
  const Mat3 sum = 300.0 * Mat3::Identity() + command.local.stiffness;
  const Vec3 expected =
      sum.inverse() * (300.0 * start + command.wrench.force + command.local.stiffness * command.local.point);

  DeviceState state;
  const auto end = Clock::now() + std::chrono::seconds(40);
  ASSERT_EQ(hear(port, state, 20.0), ReadResult::report);
  EXPECT_LT((state.pose.position - start).norm(), 1e-9);  // it was not pushed yet
  double distance = 1.0;
  while (distance > 1e-6 && Clock::now() < end) {
    if (port.read(state) == ReadResult::report) {
      distance = (state.pose.position - expected).norm() + 0.01 * state.velocity.norm();
    }
    ASSERT_TRUE(port.write(command, state));
  }
  EXPECT_LT(distance, 1e-6);
  EXPECT_EQ(port.limits().max_force, 8.0);
  EXPECT_EQ(port.limits().max_stiffness, 2000.0);
  EXPECT_EQ(port.limits().max_torque, infinity);

  // Let go, it goes back: its own clock ends the force.
  while ((state.pose.position - start).norm() > 1e-6 && Clock::now() < end) {
    port.read(state);
  }
  EXPECT_LT((state.pose.position - start).norm(), 1e-6);

  // A runtime that begins anew has another nonce: the bridge joins it by itself.
  options.listen.port = port.port();
  port.close();
  BridgePort second(options);
  second.open();
  EXPECT_EQ(hear(second, state, 20.0), ReadResult::report);
  EXPECT_GE(second.counts()[Refusal::seal], 1U) << "it had the first one's key";
  EXPECT_GE(second.counts()[Refusal::wrong_nonce], 1U);
}

}  // namespace
}  // namespace palpate::bridge_port_test
