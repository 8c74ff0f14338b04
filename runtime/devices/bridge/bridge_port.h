// Another process of the same user as a device, by a Unix socket.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <string>

#include "base/file_io.h"
#include "runtime/devices/bridge/bridge_message.h"
#include "runtime/safety/device_port.h"
#include "runtime/safety/safety_options.h"

namespace palpate {

struct BridgeOptions {
  std::filesystem::path socket;                  ///< its name, in a folder where nobody else may write
  double max_force = SafetyOptions{}.max_force;  ///< that a bridge may show, local model included [N]
  StaleOptions stale{};                          ///< how long a bridge shows a command, and with what damping
};

/// Listens at a socket that only this user can open (SOCK_SEQPACKET, mode 0600). The bridge that connects is
/// the partner from its first state that is taken, until it disconnects or is silent for `max_silence`;
/// others wait meanwhile.
class BridgePort final : public DevicePort {
 public:
  static constexpr double max_silence = 1.0;  ///< [s]

  explicit BridgePort(BridgeOptions options);
  ~BridgePort() override { close(); }
  BridgePort(const BridgePort&) = delete;
  BridgePort& operator=(const BridgePort&) = delete;

  /// Makes the socket; waits for nobody. Throws Error where another program listens there, where something
  /// else has the name, or the folder is not private.
  void open() override;

  /// Lost: the partner is gone or was silent for too long, or it says that its device has a fault. Nothing,
  /// and not lost, while there was no partner yet.
  ReadResult read(DeviceState& state) noexcept override;

  /// True while there is nobody to tell: it is read that says lost.
  bool write(const DeviceCommand& command, const DeviceState& state) noexcept override;

  /// Tells the partner to show no force, disconnects and removes the socket.
  void close() noexcept override;

  /// Infinite before the partner has said any. From any thread.
  [[nodiscard]] DeviceLimits limits() const noexcept override;

  [[nodiscard]] std::string refusals() const override;

  /// "bridge:" and the socket.
  [[nodiscard]] std::string name() const override;

 private:
  static constexpr std::size_t reasons = static_cast<std::size_t>(Refusal::user) + 1;

  bool accept_bridge() noexcept;
  void count(Refusal refusal) noexcept;
  void set_limits(const DeviceLimits& limits) noexcept;

  BridgeOptions options_;
  FileDescriptor listener_;

  // Of the thread that reads.
  FileDescriptor bridge_;
  std::int64_t heard_ = 0;  // when it connected, or something was taken [ns]

  // Of both threads and of who asks.
  std::atomic<int> partner_ = -1;  // the bridge's descriptor once something was taken
  std::array<std::atomic<double>, 5> limits_;
  std::array<std::atomic<std::uint64_t>, reasons> refused_{};
};

}  // namespace palpate
