#include "runtime/devices/bridge/bridge_key.h"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <system_error>

#include "base/error.h"
#include "base/write_file.h"
#include "runtime/devices/bridge/bridge_seal.h"

namespace palpate {
namespace {

constexpr mode_t of_others = S_IWGRP | S_IWOTH;

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& why) {
  throw Error("the bridge's key cannot be kept there: " + why, file.string(),
              "set XDG_RUNTIME_DIR to a folder that is yours alone (mode 0700)");
}

[[noreturn]] void fail(const std::filesystem::path& file, int error) {
  fail(file, std::system_category().message(error));
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder.parent_path(), problem);
  if (mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST) fail(folder, errno);
  struct stat found {};
  if (lstat(folder.c_str(), &found) != 0) fail(folder, errno);
  if (!S_ISDIR(found.st_mode) || found.st_uid != geteuid() || (found.st_mode & of_others) != 0)
    fail(folder, "somebody else may write there");
}

}  // namespace

std::filesystem::path bridge_key_file(std::uint16_t port) {
  struct Place {
    const char* variable;
    const char* below;
  };
  constexpr std::array<Place, 3> places = {
      {{"XDG_RUNTIME_DIR", ""}, {"XDG_STATE_HOME", ""}, {"HOME", ".local/state"}}};
  const std::string name = "bridge-" + std::to_string(port) + ".key";
  for (const Place& place : places) {
    const char* folder = std::getenv(place.variable);
    if (folder != nullptr && *folder == '/')
      return std::filesystem::path(folder) / place.below / "palpate" / name;
  }
  throw Error("there is no folder of yours for the bridge's key", name,
              "set XDG_RUNTIME_DIR to a folder that is yours alone (mode 0700)");
}

void write_bridge_key(const std::filesystem::path& file, const BridgeKey& key) {
  make_folder(file.parent_path());
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : key) {
    text += digits[byte >> 4U];
    text += digits[byte & 15U];
  }
  text += '\n';
  replace_file(file, text, S_IRUSR | S_IWUSR);
}

void seal(const BridgeKey& key, std::span<std::uint8_t> datagram) noexcept {
  bridge_seal(key.data(), datagram.data(), datagram.size());
}

bool is_sealed(const BridgeKey& key, std::span<const std::uint8_t> datagram) noexcept {
  return bridge_is_sealed(key.data(), datagram.data(), datagram.size()) != 0;
}

}  // namespace palpate
