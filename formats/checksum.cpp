#include "formats/checksum.h"

#define XXH_INLINE_ALL  // compiled for our vector unit: the shared library knows only SSE2
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <thread>

#include "formats/file_io.h"

namespace palpate {
namespace {

constexpr std::size_t digest_bytes = sizeof(XXH128_canonical_t);
constexpr std::size_t block_bytes = 65536;  // stays in the second-level cache between two looks

std::string hexadecimal(const XXH128_canonical_t& digest) {
  constexpr std::string_view digit = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : digest.digest) {
    text += digit[byte >> 4U];
    text += digit[byte & 15U];
  }
  return text;
}

XXH128_canonical_t canonical(XXH128_hash_t hash) {
  XXH128_canonical_t digest;
  XXH128_canonicalFromHash(&digest, hash);
  return digest;
}

XXH128_hash_t hash_of_chunk(std::size_t first_byte, std::span<const std::byte> bytes,
                            const ChunkedChecksum::Inspect& inspect) {
  if (!inspect) return XXH3_128bits(bytes.data(), bytes.size());
  alignas(64) XXH3_state_t state;
  XXH3_128bits_reset(&state);
  for (std::size_t at = 0; at < bytes.size(); at += block_bytes) {
    const auto block = bytes.subspan(at, std::min(block_bytes, bytes.size() - at));
    XXH3_128bits_update(&state, block.data(), block.size());
    inspect(first_byte + at, block);
  }
  return XXH3_128bits_digest(&state);
}

}  // namespace

std::string checksum(std::span<const std::byte> bytes) {
  return hexadecimal(canonical(XXH3_128bits(bytes.data(), bytes.size())));
}

std::string checksum(std::string_view text) {
  return checksum(std::as_bytes(std::span(text)));
}

std::string checksum_file(const std::filesystem::path& file) {
  const FileDescriptor descriptor = open_file(file, OpenMode::read);
  std::vector<std::byte> buffer(std::size_t{1} << 20);
  RunningChecksum running;
  for (std::int64_t at = 0;;) {
    const std::size_t got = read_some(descriptor, buffer, at);
    if (got == 0) return running.digits();
    running.update(std::span(buffer).first(got));
    at += static_cast<std::int64_t>(got);
  }
}

struct RunningChecksum::State {
  alignas(64) XXH3_state_t hash;
};

RunningChecksum::RunningChecksum() : state_(std::make_unique<State>()) {
  XXH3_128bits_reset(&state_->hash);
}

RunningChecksum::~RunningChecksum() = default;

void RunningChecksum::update(std::span<const std::byte> bytes) {
  XXH3_128bits_update(&state_->hash, bytes.data(), bytes.size());
}

std::string RunningChecksum::digits() const {
  return hexadecimal(canonical(XXH3_128bits_digest(&state_->hash)));
}

void ChunkedChecksum::append(std::span<const std::byte> bytes, const Inspect& inspect) {
  const std::size_t chunks = (bytes.size() + chunk - 1) / chunk;
  const std::size_t first_digest = digests_.size();
  digests_.resize(first_digest + chunks * digest_bytes);

  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < chunks; i = next++) {
      const auto part = bytes.subspan(i * chunk, std::min(chunk, bytes.size() - i * chunk));
      const auto digest = canonical(hash_of_chunk(bytes_ + i * chunk, part, inspect));
      std::memcpy(&digests_[first_digest + i * digest_bytes], digest.digest, digest_bytes);
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (std::size_t i = 1; i < std::min<std::size_t>(chunks, std::thread::hardware_concurrency()); ++i)
      helpers.emplace_back(work);
    work();
  }
  bytes_ += bytes.size();
}

std::string ChunkedChecksum::digits() const {
  if (digests_.size() != digest_bytes) return checksum(digests_);
  XXH128_canonical_t digest;
  std::memcpy(digest.digest, digests_.data(), digest_bytes);
  return hexadecimal(digest);
}

}  // namespace palpate
