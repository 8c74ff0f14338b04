// The bridge's port: whom it listens to, what it refuses, and the example at its other end.
#include "runtime/devices/bridge/bridge_port.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "runtime/safety/monotonic_clock.h"
#include "tests/support/devices/bytes.h"
#include "tests/support/folders.h"

namespace palpate::bridge_port_test {
namespace {

using Clock = std::chrono::steady_clock;
using ReadResult = DevicePort::ReadResult;
constexpr double infinity = std::numeric_limits<double>::infinity();

/// A bridge that says what it is told to say.
class Partner {
 public:
  explicit Partner(const std::filesystem::path& name) : socket_(socket(AF_UNIX, SOCK_SEQPACKET, 0)) {
    sockaddr_un runtime{};
    runtime.sun_family = AF_UNIX;
    name.native().copy(runtime.sun_path, sizeof runtime.sun_path - 1);
    EXPECT_EQ(connect(socket_, reinterpret_cast<const sockaddr*>(&runtime), sizeof runtime), 0) << name;
  }
  ~Partner() { leave(); }
  Partner(const Partner&) = delete;
  Partner& operator=(const Partner&) = delete;

  void leave() {
    if (socket_ >= 0) ::close(std::exchange(socket_, -1));
  }

  /// A state at rest, with the next number. Its time is half a second from now: whatever happens on this
  /// machine, it is not too old.
  bridge_state next() {
    bridge_state state{};
    std::memcpy(state.magic, "PLPS", sizeof state.magic);
    state.version = BRIDGE_VERSION;
    state.sequence = ++sequence;
    state.time = static_cast<std::uint64_t>(monotonic_now()) + 500'000'000;
    state.orientation[0] = 1.0F;
    return state;
  }
  void say() { say(next()); }
  void say(const bridge_state& state) {
    Bytes message(sizeof state);
    std::memcpy(message.data(), &state, sizeof state);
    say_bytes(message);
  }
  void say_bytes(const Bytes& bytes) {
    EXPECT_EQ(send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }

  /// The next command; nothing when there is none.
  std::optional<bridge_command> told() {
    pollfd waiting{socket_, POLLIN, 0};
    poll(&waiting, 1, 50);
    bridge_command command{};
    const ssize_t size = recv(socket_, &command, sizeof command, MSG_DONTWAIT | MSG_TRUNC);
    if (size <= 0) return std::nullopt;
    EXPECT_EQ(size, static_cast<ssize_t>(sizeof command));
    EXPECT_EQ(std::string(command.magic, 4), "PLPC");
    EXPECT_EQ(command.version, std::uint32_t{BRIDGE_VERSION});
    return command;
  }

  /// Whether the runtime has hung up.
  [[nodiscard]] bool is_left() const {
    char byte = 0;
    const ssize_t size = recv(socket_, &byte, sizeof byte, MSG_DONTWAIT);
    return size == 0 || (size < 0 && errno != EAGAIN);
  }

  std::uint32_t sequence = 0;

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

/// A port at a socket of its own.
class BridgePortTest : public testing::Test {
 protected:
  void SetUp() override { port.open(); }
  void TearDown() override {
    port.close();
    std::filesystem::remove_all(folder);
  }

  void join(Partner& partner) {
    partner.say();
    ASSERT_EQ(hear(port, state), ReadResult::report);
  }

  const std::filesystem::path folder = testing::TempDir() + "/palpate_bridge." + std::to_string(getpid());
  const std::filesystem::path name = folder / "bridge.socket";
  BridgePort port{{.socket = name}};
  DeviceState state;
};

TEST_F(BridgePortTest, ItsSocketIsThisUsersAlone) {
  EXPECT_EQ(port.name(), "bridge:" + name.string());
  struct stat found {};
  ASSERT_EQ(lstat(name.c_str(), &found), 0);
  EXPECT_TRUE(S_ISSOCK(found.st_mode));
  EXPECT_EQ(found.st_mode & 07777U, 0600U);
  ASSERT_EQ(lstat(folder.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 07777U, 0700U);
  port.close();
  EXPECT_FALSE(std::filesystem::exists(name));
}

TEST_F(BridgePortTest, ANameThatIsTaken) {
  BridgePort second({.socket = name});
  try {
    second.open();
    FAIL() << "two listen at one socket";
  } catch (const Error& error) {
    EXPECT_EQ(error.where(), port.name());
    EXPECT_NE(error.hint().find("another name"), std::string::npos);
  }
  Partner partner(name);
  join(partner);  // the first one goes on
  port.close();
  second.open();
  second.close();
  std::ofstream(name) << "precious";
  EXPECT_THROW(second.open(), Error);
  std::filesystem::remove(name);
  std::filesystem::create_symlink("precious", name);
  EXPECT_THROW(second.open(), Error);
  EXPECT_TRUE(std::filesystem::is_symlink(name));
}

TEST_F(BridgePortTest, NamesThatCannotBe) {
  const std::filesystem::path longest = folder / std::string(107 - folder.native().size() - 1, 'x');
  BridgePort at_most({.socket = longest});
  at_most.open();
  Partner partner(longest);
  EXPECT_THROW(BridgePort({.socket = longest.string() + "x"}).open(), Error);
  EXPECT_FALSE(std::filesystem::exists(longest.string() + "x"));
  std::filesystem::permissions(folder, std::filesystem::perms::all);
  EXPECT_THROW(BridgePort({.socket = folder / "other"}).open(), Error) << "others may write there";
}

TEST_F(BridgePortTest, TakesTheNameOfOneThatWasKilled) {
  port.close();
  const pid_t killed = fork();
  if (killed == 0) {
    port.open();
    _exit(0);  // closes nothing
  }
  waitpid(killed, nullptr, 0);
  port.open();
  Partner partner(name);
  join(partner);
}

TEST_F(BridgePortTest, ReportsWhatIsSaid) {
  Partner partner(name);
  bridge_state said = partner.next();
  const std::array<double, 3> position = {0.01, 0.02, -0.03}, velocity = {0.1, 0.2, 0.3};
  std::copy(position.begin(), position.end(), said.position);
  std::copy(velocity.begin(), velocity.end(), said.velocity);
  const std::array<float, 4> orientation = {0.5F, 0.5F, -0.5F, 0.5F};
  std::copy(orientation.begin(), orientation.end(), said.orientation);
  said.flags = 0x8001;
  const std::int64_t before = monotonic_now();
  partner.say(said);
  ASSERT_EQ(hear(port, state), ReadResult::report);
  EXPECT_EQ(state.pose.position, Vec3(0.01, 0.02, -0.03));
  EXPECT_EQ(state.pose.orientation.coeffs(), Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5).coeffs());
  EXPECT_EQ(state.velocity, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(state.buttons, 0x8001U);
  EXPECT_TRUE(state.pose.grab);
  EXPECT_EQ(state.sequence, 1U);
  EXPECT_GE(state.arrived, before);
  EXPECT_LE(state.arrived, monotonic_now());
  EXPECT_EQ(port.read(state), ReadResult::nothing);
  EXPECT_EQ(port.refusals(), "");
}

TEST_F(BridgePortTest, TakesTheNewestOfWhatWaits) {
  Partner partner(name);
  join(partner);
  for (int k = 1; k <= 8; ++k) {
    bridge_state said = partner.next();
    said.position[0] = 0.001 * k;
    partner.say(said);
  }
  partner.say_bytes({1, 2, 3});
  ASSERT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(state.pose.position.x(), 0.001 * 8);
  EXPECT_EQ(port.read(state), ReadResult::nothing);
  EXPECT_EQ(port.refusals(), "1 messages by size");
}

TEST_F(BridgePortTest, RefusesByReason) {
  Partner partner(name);
  join(partner);
  const DeviceState before = state;
  const auto refuse = [&](const bridge_state& said) {
    partner.say(said);
    EXPECT_EQ(port.read(state), ReadResult::nothing);
  };
  partner.say_bytes(Bytes(2000, 'P'));
  EXPECT_EQ(port.read(state), ReadResult::nothing);
  bridge_state said = partner.next();
  said.version = 2;
  refuse(said);
  said = partner.next();
  said.position[1] = infinity;
  refuse(said);
  said.position[1] = 12.0;
  refuse(said);
  said.position[1] = 0.0;
  said.orientation[0] = 0.0F;
  refuse(said);
  said.orientation[0] = 1.0F;
  said.time -= 1'000'000'000;
  refuse(said);
  EXPECT_EQ(port.refusals(),
            "2 messages by version, 1 messages by not_finite, 1 messages by implausible, 1 messages by "
            "orientation, 1 messages by age");
  EXPECT_EQ(state.sequence, before.sequence);
  EXPECT_EQ(state.arrived, before.arrived);
  join(partner);
}

TEST_F(BridgePortTest, WhatWaitedTooLongIsNotTaken) {
  Partner partner(name);
  join(partner);
  bridge_state said = partner.next();
  said.time = static_cast<std::uint64_t>(monotonic_now());
  partner.say(said);
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
  EXPECT_EQ(port.read(state), ReadResult::nothing);
  EXPECT_EQ(port.refusals(), "1 messages by age");
}

TEST_F(BridgePortTest, RandomMessagesDoNotGetThrough) {
  Partner partner(name);
  std::mt19937 random(11);
  for (int i = 0; i < 20'000; ++i) {
    if (i % 100 == 0) join(partner);  // so that it is not given up
    partner.say_bytes(random_bytes(random, 1 + random() % 200));
    EXPECT_EQ(port.read(state), ReadResult::nothing);
  }
}

TEST_F(BridgePortTest, AnotherUsersBridgeIsRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be another user";
  std::filesystem::permissions(folder, std::filesystem::perms(0755));
  std::filesystem::permissions(name, std::filesystem::perms(0666));
  const pid_t stranger = fork();
  if (stranger == 0) {
    if (setuid(65534) != 0) _exit(1);
    Partner partner(name);
    while (!partner.is_left()) usleep(1000);
    _exit(0);
  }
  const auto end = Clock::now() + std::chrono::seconds(20);
  while (port.refusals().empty() && Clock::now() < end) EXPECT_EQ(port.read(state), ReadResult::nothing);
  EXPECT_EQ(port.refusals(), "1 bridges by user");
  waitpid(stranger, nullptr, 0);
  Partner partner(name);
  join(partner);
}

TEST_F(BridgePortTest, NobodyIsNotLost) {
  EXPECT_EQ(hear(port, state, 0.1), ReadResult::nothing);
  EXPECT_TRUE(port.write({}, state));
  Partner silent(name);  // connects, and says nothing that counts
  silent.say_bytes({1, 2, 3});
  EXPECT_EQ(hear(port, state, 0.1), ReadResult::nothing);
  EXPECT_TRUE(port.write({}, state));
  EXPECT_FALSE(silent.told());
  const auto end = Clock::now() + std::chrono::seconds(20);
  while (!silent.is_left() && Clock::now() < end) EXPECT_EQ(port.read(state), ReadResult::nothing);
  EXPECT_TRUE(silent.is_left()) << "it gives way to the next one";
  Partner gone(name);
  gone.leave();
  EXPECT_EQ(hear(port, state, 0.1), ReadResult::nothing);
  Partner next(name);
  join(next);
}

TEST_F(BridgePortTest, WhoGoesIsLostAtOnce) {
  Partner partner(name);
  join(partner);
  partner.leave();
  EXPECT_EQ(port.read(state), ReadResult::lost);
}

TEST_F(BridgePortTest, WhoIsSilentIsLostAndTheNextOneTakesOver) {
  Partner first(name);
  const auto before = Clock::now();
  join(first);
  Partner second(name);
  second.say();
  EXPECT_EQ(hear(port, state, 20.0), ReadResult::lost);
  EXPECT_GE(Clock::now() - before, std::chrono::seconds(1));
  EXPECT_FALSE(second.told()) << "it was answered while the first one was there";
  port.close();
  EXPECT_TRUE(second.is_left()) << "it has to come again";
  EXPECT_EQ(port.read(state), ReadResult::lost);
  EXPECT_FALSE(port.write({}, state));
  port.open();
  EXPECT_EQ(port.read(state), ReadResult::nothing);
  Partner again(name);
  join(again);
  EXPECT_EQ(state.sequence, 1U) << "nothing counts that was said before";
}

TEST_F(BridgePortTest, TheNextOneWaitsForItsTurn) {
  Partner first(name);
  join(first);
  Partner second(name);
  second.say();
  for (int k = 0; k < 10; ++k) {
    first.say();
    ASSERT_EQ(port.read(state), ReadResult::report);
    EXPECT_EQ(state.sequence, first.sequence);
  }
  EXPECT_FALSE(second.told());
}

TEST_F(BridgePortTest, FaultOfTheDeviceIsLost) {
  Partner partner(name);
  join(partner);
  const DeviceState before = state;
  bridge_state said = partner.next();
  said.flags = BRIDGE_DEVICE_FAULT;
  said.position[0] = 0.5;
  partner.say(said);
  EXPECT_EQ(port.read(state), ReadResult::lost);
  EXPECT_EQ(state.pose.position, before.pose.position);
}

TEST_F(BridgePortTest, LimitsAreWhatWasSaidLast) {
  EXPECT_EQ(port.limits().max_force, infinity);
  Partner partner(name);
  join(partner);
  EXPECT_EQ(port.limits().max_force, infinity) << "it said none";
  bridge_state said = partner.next();
  const std::array<float, 5> limits = {8.0F, 0.0F, 2000.0F, 20.0F, 0.125F};
  std::copy(limits.begin(), limits.end(), said.limits);
  partner.say(said);
  ASSERT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(port.limits().max_force, 8.0);
  EXPECT_EQ(port.limits().max_torque, infinity);
  EXPECT_EQ(port.limits().max_stiffness, 2000.0);
  EXPECT_EQ(port.limits().max_damping, 20.0);
  EXPECT_EQ(port.limits().workspace_radius, 0.125);
  said = partner.next();
  said.limits[0] = 3.0F;
  partner.say(said);
  ASSERT_EQ(port.read(state), ReadResult::report);
  EXPECT_EQ(port.limits().max_force, 3.0);
}

TEST_F(BridgePortTest, CommandSaysAllThatABridgeNeeds) {
  Partner partner(name);
  join(partner);
  DeviceCommand command;
  command.wrench = {Vec3(0, 0.5, 2), Vec3(0.125, 0, 0)};
  command.local = {command.wrench.force, 500.0 * Mat3::Identity(), Vec3(0.01, 0.02, 0.03), 0.25};
  state.sequence = 77;
  ASSERT_TRUE(port.write(command, state));
  const auto told = partner.told();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->answers, 77U);
  EXPECT_EQ(told->mode, std::uint32_t{BRIDGE_LOCAL_MODEL});
  EXPECT_EQ(Eigen::Map<const Vec3>(told->force), command.wrench.force);
  EXPECT_EQ(Eigen::Map<const Vec3>(told->point), command.local.point);
  EXPECT_EQ(told->torque[0], 0.125F);
  EXPECT_EQ(told->stiffness[2], 500.0F);
  EXPECT_EQ(told->radius, 0.25F);
  EXPECT_EQ(told->damping, 0.5F);
  EXPECT_EQ(told->time_to_live, 10);
  EXPECT_EQ(told->fade, 20);
  EXPECT_EQ(told->max_force, 3.0F);
  ASSERT_TRUE(port.write(command, state));
  const auto next = partner.told();
  ASSERT_TRUE(next);
  EXPECT_GE(next->time, told->time);
}

TEST_F(BridgePortTest, ABridgeThatDoesNotListenIsNotLost) {
  Partner partner(name);
  join(partner);
  for (int k = 0; k < 2000; ++k) EXPECT_TRUE(port.write({}, state));  // more than its queue has room for
  partner.leave();
  EXPECT_FALSE(port.write({}, state));
}

TEST_F(BridgePortTest, CloseSaysNoForce) {
  Partner partner(name);
  join(partner);
  DeviceCommand command;
  command.wrench.force.z() = 1.0;
  ASSERT_TRUE(port.write(command, state));
  port.close();
  EXPECT_EQ(partner.told().value_or(bridge_command{}).mode, std::uint32_t{BRIDGE_FORCE});
  const auto told = partner.told();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->mode, std::uint32_t{BRIDGE_ZERO});
  EXPECT_TRUE(partner.is_left());
  port.close();
}

TEST_F(BridgePortTest, OneThreadReadsAnotherWrites) {
  Partner partner(name);
  join(partner);
  std::atomic<bool> done = false;
  std::atomic<int> written = 0;
  std::thread writer([&] {
    DeviceCommand command;
    command.wrench.force.z() = 1.0;
    while (!done) {
      EXPECT_TRUE(port.write(command, {}));
      ++written;
    }
  });
  for (int k = 1; k <= 2000; ++k) {
    bridge_state said = partner.next();
    said.limits[0] = static_cast<float>(k);
    partner.say(said);
    EXPECT_EQ(port.read(state), ReadResult::report);
    EXPECT_EQ(port.limits().max_force, k);
  }
  while (written < 10) std::this_thread::yield();  // until the writer had its turn
  done = true;
  writer.join();
  int told = 0;
  while (partner.told()) ++told;
  EXPECT_GT(told, 0);
  EXPECT_LE(told, written);
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

class BridgeExample : public BridgePortTest {};

TEST_F(BridgeExample, TheHandIsPushedToWhereForcesBalance) {
  // The hand's spring of 300 N/m and the command's local model:
  // 300 (start - x) + F - K (x - x0) = 0.
  port.close();
  BridgeOptions options{.socket = name};
  options.stale.time_to_live = 1.0;  // this machine may be busy
  BridgePort first(options);
  first.open();
  const Example example({"--socket", name.string(), "--rate", "2000", "--seconds", "60", "--from",
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

  const auto end = Clock::now() + std::chrono::seconds(40);
  ASSERT_EQ(hear(first, state, 20.0), ReadResult::report);
  EXPECT_LT((state.pose.position - start).norm(), 1e-9);  // it was not pushed yet
  double distance = 1.0;
  while (distance > 1e-6 && Clock::now() < end) {
    if (first.read(state) == ReadResult::report) {
      distance = (state.pose.position - expected).norm() + 0.01 * state.velocity.norm();
    }
    ASSERT_TRUE(first.write(command, state));
  }
  EXPECT_LT(distance, 1e-6);
  EXPECT_EQ(first.limits().max_force, 8.0);
  EXPECT_EQ(first.limits().max_stiffness, 2000.0);
  EXPECT_EQ(first.limits().max_torque, infinity);

  // Let go, it goes back: its own clock ends the force.
  while ((state.pose.position - start).norm() > 1e-6 && Clock::now() < end) {
    first.read(state);
  }
  EXPECT_LT((state.pose.position - start).norm(), 1e-6);

  // A runtime that begins anew: the bridge joins it by itself.
  first.close();
  BridgePort second(options);
  second.open();
  EXPECT_EQ(hear(second, state, 20.0), ReadResult::report);
}

}  // namespace
}  // namespace palpate::bridge_port_test
