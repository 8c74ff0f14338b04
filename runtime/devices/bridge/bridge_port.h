// Device in another process of the same user, connected through a Unix socket.
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
  std::filesystem::path socket;                  ///< path, in a folder that no other user can write to
  double max_force = SafetyOptions{}.max_force;  ///< largest force displayed, local model included [N]
  StaleOptions stale{};                          ///< lifetime and damping of a command in the bridge
};

/// Listens on a socket that only this user can open (SOCK_SEQPACKET, mode 0600). A connected bridge is the
/// partner from its first accepted state until it disconnects or is silent for `max_silence`; others wait in
/// the meantime.
class BridgePort final : public DevicePort {
 public:
  static constexpr double max_silence = 1.0;  ///< [s]

  explicit BridgePort(BridgeOptions options);
  ~BridgePort() override { close(); }
  BridgePort(const BridgePort&) = delete;
  BridgePort& operator=(const BridgePort&) = delete;

  /// Creates the socket without waiting for a bridge. Throws Error if another program listens there,
  /// something else has the name, or the folder is not private.
  void open() override;

  /// Returns `lost` if the partner is gone, was silent for too long, or reports a fault of its device;
  /// `nothing`, not `lost`, before there is a partner.
  ReadResult read(DeviceState& state) noexcept override;

  /// True also while there is no partner; only read reports a loss.
  bool write(const DeviceCommand& command, const DeviceState& state) noexcept override;

  /// Sends the partner a command of zero force, disconnects and removes the socket.
  void close() noexcept override;

  /// Limits stated by the partner; infinite before its first state. May be called from any thread.
  [[nodiscard]] DeviceLimits limits() const noexcept override;

  [[nodiscard]] std::string refusals() const override;

  /// "bridge:" and the path of the socket.
  [[nodiscard]] std::string name() const override;

 private:
  static constexpr std::size_t reasons = static_cast<std::size_t>(Refusal::user) + 1;

  bool accept_bridge() noexcept;
  void count(Refusal refusal) noexcept;
  void set_limits(const DeviceLimits& limits) noexcept;

  BridgeOptions options_;
  FileDescriptor listener_;

  // Used by the reading thread alone.
  FileDescriptor bridge_;
  std::int64_t heard_ = 0;  // time of the connection or of the last accepted state [ns]

  // Used by both threads and by callers of limits() and refusals().
  std::atomic<int> partner_ = -1;  // descriptor of the bridge once a state has been accepted
  std::array<std::atomic<double>, 5> limits_;
  std::array<std::atomic<std::uint64_t>, reasons> refused_{};
};

}  // namespace palpate
