#include "runtime/devices/bridge/bridge_port.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <limits>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/private_file.h"
#include "runtime/safety/monotonic_clock.h"
#include "runtime/safety/plausible.h"

namespace palpate {
namespace {

constexpr int max_wait = 10;       // ms; waiting time of a read
constexpr int max_at_once = 1024;  // messages per read, so that a flood of them cannot keep it busy
constexpr int max_waiting = 4;     // bridges that wait beside the connected one

constexpr std::array<const char*, 8> refusal_names = {"",
                                                      "messages by size",
                                                      "messages by version",
                                                      "messages by not_finite",
                                                      "messages by implausible",
                                                      "messages by orientation",
                                                      "messages by age",
                                                      "bridges by user"};

/// Socket and the address that it binds or connects to.
struct NamedSocket {
  FileDescriptor socket;
  sockaddr_un address{};

  explicit NamedSocket(const std::filesystem::path& name) : address{.sun_family = AF_UNIX, .sun_path = {}} {
    const std::string& text = name.native();
    if (text.size() >= sizeof address.sun_path) {
      throw Error(fmt::format("a socket's name has at most {} bytes, not {}", sizeof address.sun_path - 1,
                              text.size()),
                  text, "give a shorter one: --device bridge:SOCKET");
    }
    text.copy(address.sun_path, text.size());
    socket = FileDescriptor(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), name);
  }

  [[nodiscard]] const sockaddr* generic() const noexcept {
    return reinterpret_cast<const sockaddr*>(&address);
  }
};

/// Removes the socket file of a program that was killed: nothing listens on it.
void remove_dead_socket(const std::filesystem::path& name) {
  std::error_code nothing_there;
  if (!std::filesystem::is_socket(std::filesystem::symlink_status(name, nothing_there))) return;
  const NamedSocket probe(name);
  if (connect(probe.socket.get(), probe.generic(), sizeof probe.address) != 0 && errno == ECONNREFUSED)
    unlink(name.c_str());
}

bool is_of_this_user(const FileDescriptor& peer) noexcept {
  ucred who{};
  socklen_t size = sizeof who;
  return getsockopt(peer.get(), SOL_SOCKET, SO_PEERCRED, &who, &size) == 0 && who.uid == geteuid();
}

bool may_pass(int error) noexcept {
  return error == EAGAIN || error == EINTR || error == ENOBUFS;
}

}  // namespace

BridgePort::BridgePort(BridgeOptions options) : options_(std::move(options)) {
  options_.socket = std::filesystem::absolute(options_.socket);
  for (std::atomic<double>& limit : limits_) limit = std::numeric_limits<double>::infinity();
}

void BridgePort::open() {
  close();
  const std::filesystem::path& place = options_.socket;
  make_private_folder(place.parent_path());
  remove_dead_socket(place);
  NamedSocket made(place);
  const int listener = made.socket.get();
  if (bind(listener, made.generic(), sizeof made.address) != 0 ||
      chmod(place.c_str(), S_IRUSR | S_IWUSR) != 0 || listen(listener, max_waiting) != 0) {
    throw Error("cannot listen for a bridge: " + std::system_category().message(errno), name(),
                "end the other program that listens there, or take another name: --device bridge:SOCKET");
  }
  listener_ = std::move(made.socket);
}

DevicePort::ReadResult BridgePort::read(DeviceState& state) noexcept {
  if (listener_.get() < 0) return ReadResult::lost;
  const bool is_connected = bridge_.get() >= 0;
  pollfd waiting{is_connected ? bridge_.get() : listener_.get(), POLLIN, 0};
  poll(&waiting, 1, max_wait);
  if (!is_connected && !accept_bridge()) return ReadResult::nothing;
  BridgeState newest;
  bool is_heard = false, is_gone = false;
  for (int i = 0; i < max_at_once; ++i) {
    bridge_state said{};
    const ssize_t size = recv(bridge_.get(), &said, sizeof said, MSG_DONTWAIT | MSG_TRUNC);
    is_gone = size == 0 || (size < 0 && !may_pass(errno));
    if (size <= 0) break;
    const Refusal refusal = read_bridge_state(said, static_cast<std::size_t>(size), monotonic_now(), newest);
    count(refusal);
    is_heard = is_heard || refusal == Refusal::none;
  }
  if (is_heard) {
    heard_ = newest.device.arrived;
    partner_ = bridge_.get();
    set_limits(newest.limits);
  }
  if (is_gone || seconds_between(heard_, monotonic_now()) > max_silence) {
    if (partner_ >= 0) return ReadResult::lost;
    bridge_.close();  // it never became the partner
    return ReadResult::nothing;
  }
  if (!is_heard) return ReadResult::nothing;
  if (newest.fault) return ReadResult::lost;
  state = newest.device;
  return ReadResult::report;
}

bool BridgePort::accept_bridge() noexcept {
  FileDescriptor peer(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC), {});
  if (peer.get() < 0) return false;
  if (!is_of_this_user(peer)) {
    count(Refusal::user);
    return false;
  }
  bridge_ = std::move(peer);
  heard_ = monotonic_now();
  return true;
}

bool BridgePort::write(const DeviceCommand& command, const DeviceState& state) noexcept {
  if (listener_.get() < 0) return false;
  const int partner = partner_;
  if (partner < 0) return true;
  const bridge_command told =
      make_bridge_command(command, state.sequence, options_.stale, options_.max_force);
  // A full queue loses a command, not the device.
  return send(partner, &told, sizeof told, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0 || may_pass(errno);
}

void BridgePort::close() noexcept {
  if (listener_.get() < 0) return;
  write({}, {});
  unlink(options_.socket.c_str());  // still listening, so no other program has taken the name
  partner_ = -1;
  bridge_.close();
  listener_.close();
}

void BridgePort::count(Refusal refusal) noexcept {
  refused_[static_cast<std::size_t>(refusal)].fetch_add(1, std::memory_order_relaxed);
}

void BridgePort::set_limits(const DeviceLimits& limits) noexcept {
  limits_[0] = limits.max_force;
  limits_[1] = limits.max_torque;
  limits_[2] = limits.max_stiffness;
  limits_[3] = limits.max_damping;
  limits_[4] = limits.workspace_radius;
}

DeviceLimits BridgePort::limits() const noexcept {
  return {limits_[0], limits_[1], limits_[2], limits_[3], limits_[4]};
}

std::string BridgePort::refusals() const {
  std::string text;
  for (std::size_t k = 1; k < refused_.size(); ++k) {
    const std::uint64_t times = refused_[k].load(std::memory_order_relaxed);
    if (times > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", times, refusal_names[k]);
  }
  return text;
}

std::string BridgePort::name() const {
  return "bridge:" + options_.socket.string();
}

}  // namespace palpate
