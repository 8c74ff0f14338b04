// Another process of the same user as a device, by datagrams over loopback.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "runtime/devices/bridge/bridge_datagram.h"
#include "runtime/devices/bridge/bridge_key.h"
#include "runtime/devices/bridge/bridge_order.h"
#include "runtime/safety/device_port.h"
#include "runtime/safety/safety_options.h"

namespace palpate {

/// Where the runtime listens for a bridge.
struct BridgeAddress {
  std::string address = "127.0.0.1";  ///< IPv4, of this machine
  std::uint16_t port = 4270;          ///< 0: any that is free
};

/// The address in "bridge", "bridge:PORT" or "bridge:ADDRESS:PORT". Throws Error for anything else.
[[nodiscard]] BridgeAddress parse_bridge_address(std::string_view text);

struct BridgeOptions {
  BridgeAddress listen{};
  double max_force = SafetyOptions{}.max_force;  ///< that a bridge may show, local model included [N]
  StaleOptions stale{};                          ///< how long a bridge shows a command, and with what damping
};

/// What came and went since the port was made.
struct BridgeCounts {
  std::array<std::uint64_t, refusal_names.size()> datagrams{};  ///< by Refusal; none: taken
  std::uint64_t skipped = 0;   ///< numbers between those that were taken: lost, refused or overtaken
  std::uint64_t commands = 0;  ///< sent

  [[nodiscard]] std::uint64_t operator[](Refusal refusal) const noexcept {
    return datagrams[static_cast<std::size_t>(refusal)];
  }
};

/// All datagrams are sealed with a key that the port draws and keeps in a file of this user's; what is not is
/// neither answered nor taken. A session is a nonce that the port draws. A bridge that does not say it is
/// told it by a command without force. Who says it first is the partner, and all others are refused until the
/// partner was silent for `most_silence`; then it is lost, the nonce is another one, so that nothing said
/// before counts, and the next bridge may come, or the same one again.
class BridgePort final : public DevicePort {
 public:
  static constexpr double most_silence = 1.0;  ///< [s]

  explicit BridgePort(BridgeOptions options = {});
  ~BridgePort() override;
  BridgePort(const BridgePort&) = delete;
  BridgePort& operator=(const BridgePort&) = delete;

  /// Takes the address and writes the key; waits for nobody. Throws Error where the address is not this
  /// machine's or is taken, or there is no place for the key.
  void open() override;

  /// Lost: the partner was silent for too long, or it says that its device has a fault. Nothing, and not
  /// lost, while there was no partner yet.
  ReadResult read(DeviceState& state) noexcept override;

  /// Numbers that are not finite are sent as no force. True while there is nobody to tell: it is read that
  /// says lost.
  bool write(const DeviceCommand& command, const DeviceState& state) noexcept override;

  /// Tells the partner three times to show no force.
  void close() noexcept override;

  /// What the partner said last: infinite before there was one. From any thread; see limit_changes.
  [[nodiscard]] DeviceLimits limits() const noexcept override;

  /// How often the limits changed. Look at it, then at the limits: when it has not changed since, they have
  /// neither. From any thread.
  [[nodiscard]] std::uint32_t limit_changes() const noexcept;

  [[nodiscard]] std::string refusals() const override;

  /// "bridge:127.0.0.1:4270"; with the port that was taken.
  [[nodiscard]] std::string name() const override;

  /// From any thread.
  [[nodiscard]] BridgeCounts counts() const noexcept;

  /// While it is open.
  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  /// Where its key stands, which is gone with the port. Once it was open.
  [[nodiscard]] const std::filesystem::path& key_file() const noexcept { return key_file_; }

 private:
  using Peer = std::uint64_t;  // address and port in one word, that both threads see it whole; 0: none

  /// One datagram: why it is not taken, or none, with `state` filled. Answers those that do not know the
  /// nonce.
  Refusal take(std::span<const std::uint8_t> datagram, Peer from, std::int64_t now,
               BridgeState& state) noexcept;
  void set_limits(const DeviceLimits& limits) noexcept;
  void forget_partner() noexcept;
  [[nodiscard]] BridgeCommand no_force() const noexcept;
  bool send(BridgeCommand command, Peer to) noexcept;  // numbers it and sets its time

  BridgeOptions options_;
  BridgeKey key_;
  int socket_ = -1;
  std::uint16_t port_ = 0;
  std::filesystem::path key_file_;

  // Of the thread that reads.
  BridgeOrder order_;
  std::int64_t heard_ = 0;  // when something was taken [ns]

  // Of both threads and of who asks.
  std::atomic<std::uint64_t> nonce_;
  std::atomic<Peer> partner_ = 0;
  std::atomic<std::uint32_t> sequence_ = 0;  // of commands
  std::array<std::atomic<double>, 5> limits_;
  std::atomic<std::uint32_t> limit_changes_ = 0;
  std::array<std::atomic<std::uint64_t>, refusal_names.size()> datagrams_{};
  std::atomic<std::uint64_t> skipped_ = 0;
  std::atomic<std::uint64_t> commands_ = 0;
};

}  // namespace palpate
