#include "runtime/devices/bridge/bridge_port.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <ctime>
#include <limits>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/random_bytes.h"
#include "runtime/safety/monotonic_clock.h"
#include "runtime/safety/plausible.h"

namespace palpate {
namespace {

constexpr int patience = 10;        // ms that a read waits
constexpr int most_at_once = 1024;  // datagrams that a read takes: it ends, whoever floods us
constexpr int farewells = 3;        // a datagram may be lost

/// Not 0, and no later one is.
std::uint64_t draw_nonce() {
  return (std::bit_cast<std::uint64_t>(random_bytes<sizeof(std::uint64_t)>()) >> 1U) + 1;
}

std::uint16_t milliseconds(double time) noexcept {
  return static_cast<std::uint16_t>(std::lround(std::clamp(1e3 * time, 0.0, 65535.0)));
}

BridgeMode mode_of(const DeviceCommand& command) noexcept {
  const bool has_model = command.local.radius > 0.0;
  const bool is_zero = command.wrench.force.isZero(0.0) && command.wrench.torque.isZero(0.0) &&
                       (!has_model || command.local.stiffness.isZero(0.0));
  if (is_zero || !is_plausible(command)) return BridgeMode::zero;
  return has_model ? BridgeMode::local_model : BridgeMode::force;
}

sockaddr_in as_socket_address(std::uint64_t peer) noexcept {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(static_cast<std::uint32_t>(peer >> 16U));
  address.sin_port = htons(static_cast<std::uint16_t>(peer));
  return address;
}

std::uint64_t as_peer(const sockaddr_in& address) noexcept {
  return static_cast<std::uint64_t>(ntohl(address.sin_addr.s_addr)) << 16U | ntohs(address.sin_port);
}

std::optional<in_addr> parse_ipv4(const std::string& text) noexcept {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1 ? std::optional(address) : std::nullopt;
}

std::string as_text(const BridgeAddress& listen) {
  return "bridge:" + listen.address + ":" + std::to_string(listen.port);
}

std::string way_out(int error) {
  switch (error) {
    case EADDRINUSE:
      return "end the other program that listens there, or take another port: bridge:PORT";
    case EADDRNOTAVAIL:
      return "take an address of this machine, such as 127.0.0.1";
    case EACCES:
      return "take a port from 1024 on";
    default:
      return "try another port: bridge:PORT";
  }
}

}  // namespace

BridgeAddress parse_bridge_address(std::string_view text) {
  constexpr std::string_view scheme = "bridge";
  const auto refuse = [&](const std::string& what) -> Error {
    return {what, "\"" + std::string(text) + "\"", "write bridge, bridge:PORT or bridge:ADDRESS:PORT"};
  };
  BridgeAddress result;
  if (text == scheme) return result;
  if (!text.starts_with("bridge:")) throw refuse("this is no bridge");
  std::string_view port = text.substr(scheme.size() + 1);
  if (const auto colon = port.rfind(':'); colon != std::string_view::npos) {
    result.address = port.substr(0, colon);
    port.remove_prefix(colon + 1);
    if (!parse_ipv4(result.address)) throw refuse("\"" + result.address + "\" is no IPv4 address");
  } else if (port.empty()) {
    return result;
  }
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), result.port);
  if (error != std::errc{} || end != port.data() + port.size() || result.port == 0) {
    throw refuse("the port must be a whole number from 1 to 65535");
  }
  return result;
}

BridgePort::BridgePort(BridgeOptions options)
    : options_(std::move(options)), key_(random_bytes<std::tuple_size_v<BridgeKey>>()), nonce_(draw_nonce()) {
  for (std::atomic<double>& limit : limits_) {
    limit = std::numeric_limits<double>::infinity();
  }
}

BridgePort::~BridgePort() {
  close();
  if (!key_file_.empty()) unlink(key_file_.c_str());
}

void BridgePort::open() {
  close();
  const BridgeAddress& listen = options_.listen;
  const auto address = parse_ipv4(listen.address);
  if (!address) {
    throw Error("\"" + listen.address + "\" is no IPv4 address", as_text(listen),
                "take an address of this machine, such as 127.0.0.1");
  }
  sockaddr_in here =
      as_socket_address(static_cast<std::uint64_t>(ntohl(address->s_addr)) << 16U | listen.port);
  socklen_t size = sizeof here;
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_ < 0 || bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0 ||
      getsockname(socket_, reinterpret_cast<sockaddr*>(&here), &size) != 0) {
    const int error = errno;
    close();
    throw Error(std::string("cannot listen for a bridge: ") + std::strerror(error), as_text(listen),
                way_out(error));
  }
  port_ = ntohs(here.sin_port);
  try {
    const std::filesystem::path file = bridge_key_file(port_);
    write_bridge_key(file, key_);
    if (file != key_file_) key_file_ = file;
  } catch (...) {
    close();
    throw;
  }
}

DevicePort::ReadResult BridgePort::read(DeviceState& state) noexcept {
  if (socket_ < 0) return ReadResult::lost;
  pollfd waiting{socket_, POLLIN, 0};
  poll(&waiting, 1, patience);
  BridgeState newest;
  bool heard = false;
  for (int i = 0; i < most_at_once; ++i) {
    std::array<std::uint8_t, 2 * bridge_state_bytes> buffer;
    sockaddr_in from{};
    socklen_t from_size = sizeof from;
    const ssize_t size = recvfrom(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT,
                                  reinterpret_cast<sockaddr*>(&from), &from_size);
    if (size < 0) break;
    const Refusal refusal =
        take(std::span(buffer).first(static_cast<std::size_t>(size)), as_peer(from), monotonic_now(), newest);
    datagrams_[static_cast<std::size_t>(refusal)].fetch_add(1, std::memory_order_relaxed);
    heard = heard || refusal == Refusal::none;
  }
  if (!heard) {
    if (partner_ == 0 || seconds_between(heard_, monotonic_now()) <= most_silence) return ReadResult::nothing;
    forget_partner();
    return ReadResult::lost;
  }
  skipped_.store(order_.skipped(), std::memory_order_relaxed);
  set_limits(newest.limits);
  if (newest.fault) return ReadResult::lost;
  state = newest.device;
  return ReadResult::report;
}

Refusal BridgePort::take(std::span<const std::uint8_t> datagram, Peer from, std::int64_t now,
                         BridgeState& state) noexcept {
  BridgeState said;
  if (const Refusal refusal = decode_bridge_state(datagram, said); refusal != Refusal::none) return refusal;
  const Peer partner = partner_;
  if (partner != 0 && from != partner) return Refusal::address;
  if (!is_sealed(key_, datagram)) return Refusal::seal;
  if (said.nonce != nonce_) {
    send(no_force(), from);
    return said.nonce == 0 ? Refusal::hello : Refusal::wrong_nonce;
  }
  if (const Refusal refusal = order_.see(said.device.sequence, said.time, now); refusal != Refusal::none) {
    return refusal;
  }
  partner_ = from;
  heard_ = now;
  state = said;
  state.device.arrived = now;
  return Refusal::none;
}

bool BridgePort::write(const DeviceCommand& command, const DeviceState& state) noexcept {
  if (socket_ < 0) return false;
  const Peer partner = partner_;
  if (partner == 0) return true;
  BridgeCommand told = no_force();
  told.answers = state.sequence;
  told.mode = mode_of(command);
  if (told.mode != BridgeMode::zero) told.command = command;
  return send(told, partner);
}

void BridgePort::close() noexcept {
  if (socket_ < 0) return;
  const Peer partner = partner_;
  for (int i = 0; i < farewells && partner != 0; ++i) {
    send(no_force(), partner);
  }
  ::close(socket_);
  socket_ = -1;
  forget_partner();
}

void BridgePort::forget_partner() noexcept {
  if (partner_ != 0) ++nonce_;
  partner_ = 0;
  order_.reset();
}

BridgeCommand BridgePort::no_force() const noexcept {
  BridgeCommand command;
  command.nonce = nonce_;
  command.damping = options_.stale.damping;
  command.time_to_live = milliseconds(options_.stale.time_to_live);
  command.fade = milliseconds(options_.stale.fade);
  command.max_force = options_.max_force;
  return command;
}

bool BridgePort::send(BridgeCommand command, Peer to) noexcept {
  command.sequence = ++sequence_;
  command.time = static_cast<std::uint64_t>(monotonic_now());
  auto datagram = encode_bridge_command(command);
  seal(key_, datagram);
  const sockaddr_in address = as_socket_address(to);
  const ssize_t sent = sendto(socket_, datagram.data(), datagram.size(), MSG_DONTWAIT,
                              reinterpret_cast<const sockaddr*>(&address), sizeof address);
  if (sent >= 0) commands_.fetch_add(1, std::memory_order_relaxed);
  // A full buffer loses a datagram, not the device.
  return sent >= 0 || errno == EAGAIN || errno == EINTR || errno == ENOBUFS;
}

void BridgePort::set_limits(const DeviceLimits& limits) noexcept {
  const std::array<double, 5> said = {limits.max_force, limits.max_torque, limits.max_stiffness,
                                      limits.max_damping, limits.workspace_radius};
  bool changed = false;
  for (std::size_t k = 0; k < said.size(); ++k) {
    changed = limits_[k].exchange(said[k]) != said[k] || changed;
  }
  if (changed) ++limit_changes_;  // after them: who has read some of the old ones will look again
}

DeviceLimits BridgePort::limits() const noexcept {
  return {limits_[0], limits_[1], limits_[2], limits_[3], limits_[4]};
}

std::uint32_t BridgePort::limit_changes() const noexcept {
  return limit_changes_;
}

std::string BridgePort::refusals() const {
  const BridgeCounts all = counts();
  std::string text;
  for (const auto& [refusal, name] : refusal_names) {
    // A bridge that has to be told the nonce is no trouble.
    if (refusal == Refusal::none || refusal == Refusal::hello || all[refusal] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::to_string(all[refusal]) + " datagrams by " + name;
    if (refusal == Refusal::seal) text += " (the key is in " + key_file_.string() + ")";
  }
  return text;
}

std::string BridgePort::name() const {
  BridgeAddress listen = options_.listen;
  if (port_ != 0) listen.port = port_;
  return as_text(listen);
}

BridgeCounts BridgePort::counts() const noexcept {
  BridgeCounts counts;
  for (std::size_t k = 0; k < datagrams_.size(); ++k) {
    counts.datagrams[k] = datagrams_[k].load(std::memory_order_relaxed);
  }
  counts.skipped = skipped_.load(std::memory_order_relaxed);
  counts.commands = commands_.load(std::memory_order_relaxed);
  return counts;
}

}  // namespace palpate
