// The secret between the runtime and its bridge: its file, and the seal that it makes.
#include "runtime/devices/bridge/bridge_key.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "runtime/devices/bridge/bridge_seal.h"

namespace palpate::bridge_key_test {
namespace {

std::string hex(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += digits[byte >> 4U];
    text += digits[byte & 15U];
  }
  return text;
}

std::vector<std::uint8_t> bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

std::string hash_of(const std::string& text) {
  std::array<std::uint8_t, BRIDGE_HASH_BYTES> hash{};
  const std::vector<std::uint8_t> bytes = bytes_of(text);
  bridge_hash(bytes.data(), bytes.size(), hash.data());
  return hex(hash);
}

TEST(BridgeSeal, HashIsThatOfTheStandard) {  // FIPS 180-4's examples
  EXPECT_EQ(hash_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hash_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(hash_of(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(BridgeSeal, IsTheStandardsCode) {  // RFC 4231, test case 2: a short key is one with zeros behind it
  const std::array<std::uint8_t, BRIDGE_KEY_BYTES> key = {'J', 'e', 'f', 'e'};
  const std::vector<std::uint8_t> text = bytes_of("what do ya want for nothing?");
  std::array<std::uint8_t, BRIDGE_SEAL_BYTES> made{};
  bridge_code(key.data(), text.data(), text.size(), made.data());
  EXPECT_EQ(hex(made), "5bdcc146bf60754e");
}

TEST(BridgeSeal, BreaksWithAnyBit) {
  BridgeKey key = {1, 2, 3};
  std::vector<std::uint8_t> datagram(160);
  for (std::size_t k = 0; k < datagram.size(); ++k) datagram[k] = static_cast<std::uint8_t>(7 * k);
  seal(key, datagram);
  EXPECT_TRUE(is_sealed(key, datagram));
  for (std::uint8_t& byte : datagram) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      byte ^= static_cast<std::uint8_t>(1U << bit);
      EXPECT_FALSE(is_sealed(key, datagram));
      byte ^= static_cast<std::uint8_t>(1U << bit);
    }
  }
  key[15] = 1;
  EXPECT_FALSE(is_sealed(key, datagram));
}

/// With folders of its own in place of this user's.
class BridgeKeyFile : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_);
    for (const char* name : {"XDG_RUNTIME_DIR", "XDG_STATE_HOME", "HOME"}) {
      const char* value = getenv(name);
      before_.emplace_back(name, value == nullptr ? std::nullopt : std::optional<std::string>(value));
      unsetenv(name);
    }
  }
  void TearDown() override {
    for (const auto& [name, value] : before_) {
      if (value) {
        setenv(name.c_str(), value->c_str(), 1);
      } else {
        unsetenv(name.c_str());
      }
    }
    std::filesystem::remove_all(folder_);
  }

  [[nodiscard]] static mode_t mode_of(const std::filesystem::path& path) {
    struct stat found {};
    EXPECT_EQ(lstat(path.c_str(), &found), 0) << path;
    return found.st_mode & 07777U;
  }

  const std::filesystem::path folder_ = testing::TempDir() + "/palpate_key." + std::to_string(getpid());
  std::vector<std::pair<std::string, std::optional<std::string>>> before_;
};

TEST_F(BridgeKeyFile, IsInTheFirstFolderThatThereIs) {
  EXPECT_THROW(static_cast<void>(bridge_key_file(4270)), Error);
  setenv("HOME", "/home/a", 1);
  EXPECT_EQ(bridge_key_file(4270), "/home/a/.local/state/palpate/bridge-4270.key");
  setenv("XDG_STATE_HOME", "/state", 1);
  EXPECT_EQ(bridge_key_file(4271), "/state/palpate/bridge-4271.key");
  setenv("XDG_RUNTIME_DIR", "/run/user/7", 1);
  EXPECT_EQ(bridge_key_file(4270), "/run/user/7/palpate/bridge-4270.key");
  setenv("XDG_RUNTIME_DIR", "relative", 1);
  EXPECT_EQ(bridge_key_file(4270), "/state/palpate/bridge-4270.key");
}

TEST_F(BridgeKeyFile, IsForThisUserAlone) {
  const std::filesystem::path file = folder_ / "deeper" / "palpate" / "bridge-1.key";
  const mode_t before = umask(0);
  write_bridge_key(file, {0x01, 0xab});
  umask(before);
  EXPECT_EQ(mode_of(file), 0600U);
  EXPECT_EQ(mode_of(file.parent_path()), 0700U);
  std::ifstream stream(file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(text, "01ab" + std::string(28, '0') + "\n");
  write_bridge_key(file, {0x02});
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(file.parent_path()), {}), 1);
}

TEST_F(BridgeKeyFile, IsNotWrittenWhereOthersMayWrite) {
  const std::filesystem::path open_to_all = folder_ / "palpate";
  std::filesystem::create_directory(open_to_all);
  std::filesystem::permissions(open_to_all, std::filesystem::perms::all);
  EXPECT_THROW(write_bridge_key(open_to_all / "bridge-1.key", {}), Error);
  std::filesystem::permissions(open_to_all, std::filesystem::perms::owner_all);
  std::filesystem::create_symlink(open_to_all, folder_ / "link");
  EXPECT_THROW(write_bridge_key(folder_ / "link" / "bridge-1.key", {}), Error);
  EXPECT_TRUE(std::filesystem::is_empty(open_to_all));
}

TEST_F(BridgeKeyFile, TakesThePlaceOfALinkAndLeavesWhatItLedTo) {
  const std::filesystem::path file = folder_ / "palpate" / "bridge-1.key";
  std::filesystem::create_directory(file.parent_path());
  std::filesystem::permissions(file.parent_path(), std::filesystem::perms::owner_all);
  std::ofstream(folder_ / "precious") << "precious";
  std::filesystem::create_symlink(folder_ / "precious", file);
  std::filesystem::create_symlink(folder_ / "precious", file.string() + ".partial");
  write_bridge_key(file, {});
  EXPECT_FALSE(std::filesystem::is_symlink(file));
  std::ifstream stream(folder_ / "precious");
  std::string text;
  stream >> text;
  EXPECT_EQ(text, "precious");
}

}  // namespace
}  // namespace palpate::bridge_key_test
