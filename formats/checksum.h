// XXH3-128 checksums, fast enough to check every load. They detect accidents, not attackers.
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

class FileDescriptor;

/// Checksum of bytes, 32 hexadecimal digits.
std::string checksum(std::span<const std::byte> bytes);

/// Checksum of a text's bytes, 32 hexadecimal digits.
std::string checksum(std::string_view text);

/// Checksum of a file's bytes (as printed by `xxhsum -H2`); throws Error if it cannot be read.
std::string checksum_file(const std::filesystem::path& file);

/// Checksum of bytes that arrive in pieces.
class RunningChecksum {
 public:
  RunningChecksum();
  ~RunningChecksum();
  void update(std::span<const std::byte> bytes);
  [[nodiscard]] std::string digits() const;  ///< 32 hexadecimal digits of all bytes so far

 private:
  friend class ChunkedChecksum;
  struct State;
  std::unique_ptr<State> state_;
};

/// Checksum of a large array, computed on all processors. Up to `chunk` bytes it equals `checksum`; beyond
/// that it is the `checksum` of the chunks' 16-byte big-endian digests, one after the other.
class ChunkedChecksum {
 public:
  static constexpr std::size_t chunk = std::size_t{16} << 20;  ///< [byte]

  /// Reads a block while it is in the cache; called by several threads at once. Blocks start at multiples of
  /// 64 KiB if the size appended before is one.
  using Inspect = std::function<void(std::size_t first_byte, std::span<const std::byte> block)>;

  ChunkedChecksum();
  ~ChunkedChecksum();

  /// Appends a piece of any size. Whole chunks that begin at a multiple of `chunk` are distributed over the
  /// processors.
  void append(std::span<const std::byte> bytes, const Inspect& inspect = {});

  /// Reads `bytes` bytes of a file at `offset` and appends them; stores them at `into` unless it is null.
  /// Call it first, or after multiples of `chunk`. Throws Error if they cannot be read.
  void append_file(const FileDescriptor& file, std::int64_t offset, std::int64_t bytes, std::byte* into,
                   const Inspect& inspect = {});

  [[nodiscard]] std::string digits() const;  ///< 32 hexadecimal digits of all bytes so far

 private:
  struct Open;
  void close_chunk();
  std::vector<std::byte> digests_;  ///< 16 per whole chunk
  std::size_t bytes_ = 0;           ///< in whole chunks
  std::unique_ptr<Open> open_;      ///< the chunk that is not whole yet
};

}  // namespace palpate
