// The secret that the runtime shares with the bridges of its user.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

namespace palpate {

/// 128 random bits, drawn anew for each run.
using BridgeKey = std::array<std::uint8_t, 16>;

/// Where a bridge finds the key of a port: the secret bridge-PORT.key.
[[nodiscard]] std::filesystem::path bridge_key_file(std::uint16_t port);

/// Writes the key as 32 hexadecimal digits and a line's end, as a secret of this user.
void write_bridge_key(const std::filesystem::path& file, const BridgeKey& key);

/// Makes the last 8 bytes of a datagram the seal of those before.
void seal(const BridgeKey& key, std::span<std::uint8_t> datagram) noexcept;
/// Whether they are that.
[[nodiscard]] bool is_sealed(const BridgeKey& key, std::span<const std::uint8_t> datagram) noexcept;

}  // namespace palpate
