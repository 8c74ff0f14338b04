#include "runtime/devices/bridge/bridge_key.h"

#include <fmt/ranges.h>

#include <string>

#include "runtime/devices/bridge/bridge_seal.h"
#include "runtime/devices/bridge/secret_file.h"

namespace palpate {

std::filesystem::path bridge_key_file(std::uint16_t port) {
  return secret_file("bridge-" + std::to_string(port) + ".key");
}

void write_bridge_key(const std::filesystem::path& file, const BridgeKey& key) {
  write_secret(file, fmt::format("{:02x}\n", fmt::join(key, "")));
}

void seal(const BridgeKey& key, std::span<std::uint8_t> datagram) noexcept {
  bridge_seal(key.data(), datagram.data(), datagram.size());
}

bool is_sealed(const BridgeKey& key, std::span<const std::uint8_t> datagram) noexcept {
  return bridge_is_sealed(key.data(), datagram.data(), datagram.size()) != 0;
}

}  // namespace palpate
