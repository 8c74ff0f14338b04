#include "formats/checksum.h"

#include <gtest/gtest.h>

#include <cstring>
#include <mutex>
#include <numeric>

#include "base/error.h"
#include "tests/support/files/formats_sample.h"

namespace palpate::test::checksum_test {
namespace {

std::vector<std::byte> pattern(std::size_t count) {
  std::vector<std::byte> bytes(count);
  std::uint32_t state = 1;
  for (std::byte& b : bytes) {
    state = state * 1664525U + 1013904223U;
    b = static_cast<std::byte>(state >> 24U);
  }
  return bytes;
}

std::vector<std::byte> bytes_of_digits(const std::string& digits) {
  std::vector<std::byte> bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2)
    bytes.push_back(static_cast<std::byte>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

// What `xxhsum -H2` (xxHash 0.8.1) prints.
TEST(Checksum, IsXxh3Of128Bits) {
  EXPECT_EQ(checksum(std::string_view("")), "99aa06d3014798d86001c324468d497f");
  EXPECT_EQ(checksum(std::string_view("palpate\n")), "c1c6640b671b31f4521cb0624c669433");
}

TEST(Checksum, OfAFileIsThatOfItsBytes) {
  const Folder folder;
  const auto bytes = pattern(3'000'001);
  std::string text(bytes.size(), '\0');
  std::memcpy(text.data(), bytes.data(), bytes.size());
  write_bytes(folder / "a", text);
  EXPECT_EQ(checksum_file(folder / "a"), checksum(bytes));
  EXPECT_THROW(checksum_file(folder / "none"), Error);
}

TEST(RunningChecksum, DoesNotDependOnThePieces) {
  const auto bytes = pattern(100'000);
  RunningChecksum running;
  for (std::size_t at = 0; at < bytes.size(); at += 777)
    running.update(std::span(bytes).subspan(at, std::min<std::size_t>(777, bytes.size() - at)));
  EXPECT_EQ(running.digits(), checksum(bytes));
}

TEST(ChunkedChecksum, OfOneChunkIsTheChecksum) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, ChunkedChecksum::chunk}) {
    const auto bytes = pattern(count);
    ChunkedChecksum running;
    running.append(bytes);
    EXPECT_EQ(running.digits(), checksum(bytes)) << count;
  }
}

TEST(ChunkedChecksum, OfMoreIsTheChecksumOfTheChunks) {
  constexpr std::size_t chunk = ChunkedChecksum::chunk;
  const auto bytes = pattern(2 * chunk + 12345);
  std::vector<std::byte> digests;
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    const auto part = std::span(bytes).subspan(at, std::min(chunk, bytes.size() - at));
    const auto digest = bytes_of_digits(checksum(part));
    digests.insert(digests.end(), digest.begin(), digest.end());
  }
  ChunkedChecksum at_once, in_two;
  at_once.append(bytes);
  in_two.append(std::span(bytes).first(chunk));
  in_two.append(std::span(bytes).subspan(chunk));
  EXPECT_EQ(at_once.digits(), checksum(digests));
  EXPECT_EQ(in_two.digits(), checksum(digests));
}

TEST(ChunkedChecksum, ShowsEveryByteOnce) {
  const auto bytes = pattern(ChunkedChecksum::chunk + 100'001);
  std::mutex mutex;
  std::vector<std::byte> seen(bytes.size());
  std::size_t shown = 0;
  ChunkedChecksum inspected, plain;
  inspected.append(bytes, [&](std::size_t first, std::span<const std::byte> block) {
    const std::scoped_lock lock(mutex);
    EXPECT_EQ(first % 65536, 0U);
    std::memcpy(&seen[first], block.data(), block.size());
    shown += block.size();
  });
  plain.append(bytes);
  EXPECT_EQ(shown, bytes.size());
  EXPECT_EQ(seen, bytes);
  EXPECT_EQ(inspected.digits(), plain.digits());
}

}  // namespace
}  // namespace palpate::test::checksum_test
