#include "formats/superblock.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>

#include "base/error.h"

namespace palpate {
namespace {

std::uint64_t little_endian(std::span<const unsigned char> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = (value << 8U) | bytes[i];
  return value;
}

}  // namespace

void check_superblock(const FileDescriptor& file, const ExpectedFile& expected) {
  constexpr std::array<unsigned char, 12> start = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n', 3, 8, 8, 0};
  constexpr std::size_t signature_bytes = 8, end_at = 28, superblock_bytes = 48;
  const std::string where = file.path().string();
  const std::int64_t size = file_size(file);
  if (size == 0) throw Error("the file is empty", where, expected.again);

  std::array<unsigned char, superblock_bytes> superblock = {};
  const std::size_t got = read_some(file, std::as_writable_bytes(std::span(superblock)), 0);
  if (std::memcmp(superblock.data(), start.data(), std::min(got, signature_bytes)) != 0)
    throw Error("is not " + expected.what, where, expected.give);
  if (got < superblock_bytes)
    throw Error("the file is truncated: it ends after " + std::to_string(size) + " bytes", where,
                expected.again);
  if (std::memcmp(superblock.data(), start.data(), start.size()) != 0)
    throw Error("is an HDF5 file, but not " + expected.what, where, expected.give);
  const std::uint64_t end = little_endian(std::span(superblock).subspan(end_at, 8));
  if (end > static_cast<std::uint64_t>(size)) {
    throw Error(
        "the file is truncated: it has " + std::to_string(size) + " of " + std::to_string(end) + " bytes",
        where, expected.again);
  }
}

}  // namespace palpate
