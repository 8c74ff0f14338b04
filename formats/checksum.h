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

class FileDescriptor;

/// 32 hexadecimal digits.
std::string checksum(std::span<const std::byte> bytes);

/// XXH3-128 of a text's bytes, 32 hexadecimal digits.
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
  friend class ChunkedChecksum;
  struct State;
  std::unique_ptr<State> state_;
};

/// Checksum of a large array, computed by all processors. Up to `chunk` bytes it is `checksum`; beyond that
/// the `checksum` of the 16-byte big-endian digests of the chunks, one after the other.
class ChunkedChecksum {
 public:
  static constexpr std::size_t chunk = std::size_t{16} << 20;  ///< [byte]

  /// Looks at a block while it is in the cache; called by several threads at once. Where what was appended
  /// before is a multiple of 64 KiB, so are the places where blocks start.
  using Inspect = std::function<void(std::size_t first_byte, std::span<const std::byte> block)>;

  ChunkedChecksum();
  ~ChunkedChecksum();

  /// Pieces of any size; what is a multiple of `chunk` at a multiple of `chunk` is shared among processors.
  void append(std::span<const std::byte> bytes, const Inspect& inspect = {});

  /// Reads `bytes` bytes of a file at `offset` and appends them. They are left at `into`, which may be null.
  /// Comes first, or after multiples of `chunk`. Throws Error when they cannot be read.
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
