// XXH3-128 checksums: at memory speed, so that every load can afford the check. They find accidents, not
// attackers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// 32 hexadecimal digits.
std::string checksum(std::span<const std::byte> bytes);

/// The same of a text's bytes.
std::string checksum(std::string_view text);

/// Checksum of a file's bytes (what `xxhsum -H2` prints); throws Error when it cannot be read.
std::string checksum_file(const std::filesystem::path& file);

/// Checksum of bytes that arrive in pieces.
class RunningChecksum {
 public:
  RunningChecksum();
  ~RunningChecksum();
  void update(std::span<const std::byte> bytes);
  [[nodiscard]] std::string digits() const;  ///< 32 hexadecimal digits of all bytes so far

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Checksum of a large array, computed by all processors. Up to `chunk` bytes it is `checksum`; beyond that
/// the `checksum` of the 16-byte big-endian digests of the chunks, one after the other.
class ChunkedChecksum {
 public:
  static constexpr std::size_t chunk = std::size_t{16} << 20;  ///< [byte]

  /// Looks at a block while it is in the cache; called by several threads at once. Blocks start at multiples
  /// of 64 KiB.
  using Inspect = std::function<void(std::size_t first_byte, std::span<const std::byte> block)>;

  /// Every call but the last brings a multiple of `chunk` bytes.
  void append(std::span<const std::byte> bytes, const Inspect& inspect = {});
  [[nodiscard]] std::string digits() const;  ///< 32 hexadecimal digits

 private:
  std::vector<std::byte> digests_;  ///< 16 a chunk
  std::size_t bytes_ = 0;
};

}  // namespace palpate
