#include "formats/checksum.h"

#define XXH_INLINE_ALL  // compiled for our vector unit: the shared library knows only SSE2
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <exception>
#include <mutex>
#include <thread>

#include "base/file_io.h"

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

/// Provides bytes [first, first + size) of an array, in place or read from a file into `buffer`.
using Take = std::function<std::span<const std::byte>(std::size_t first, std::size_t size,
                                                      std::span<std::byte> buffer)>;

/// Hash of bytes [first, first + size); `inspect` gets them block by block.
XXH128_hash_t hash_of_chunk(std::size_t first, std::size_t size, const Take& take,
                            const ChunkedChecksum::Inspect& inspect) {
  alignas(64) XXH3_state_t state;
  XXH3_128bits_reset(&state);
  std::vector<std::byte> buffer(block_bytes);
  for (std::size_t at = first; at < first + size; at += block_bytes) {
    const auto block = take(at, std::min(block_bytes, first + size - at), buffer);
    XXH3_128bits_update(&state, block.data(), block.size());
    if (inspect) inspect(at, block);
  }
  return XXH3_128bits_digest(&state);
}

/// Digests of the chunks of bytes [first, first + size), computed on all processors.
std::vector<std::byte> digests_of(std::size_t first, std::size_t size, const Take& take,
                                  const ChunkedChecksum::Inspect& inspect) {
  constexpr std::size_t chunk = ChunkedChecksum::chunk;
  const std::size_t chunks = (size + chunk - 1) / chunk;
  std::vector<std::byte> digests(chunks * digest_bytes);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < chunks; i = next++) {
        const std::size_t at = i * chunk;
        const auto digest = canonical(hash_of_chunk(first + at, std::min(chunk, size - at), take, inspect));
        std::memcpy(&digests[i * digest_bytes], digest.digest, digest_bytes);
      }
    } catch (...) {
      next = chunks;
      const std::scoped_lock lock(mutex);
      failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (std::size_t i = 1; i < std::min<std::size_t>(chunks, std::thread::hardware_concurrency()); ++i)
      helpers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return digests;
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

struct ChunkedChecksum::Open {
  RunningChecksum::State state;
  std::size_t bytes = 0;
};

ChunkedChecksum::ChunkedChecksum() : open_(std::make_unique<Open>()) {
  XXH3_128bits_reset(&open_->state.hash);
}

ChunkedChecksum::~ChunkedChecksum() = default;

void ChunkedChecksum::append(std::span<const std::byte> bytes, const Inspect& inspect) {
  if (open_->bytes == 0 && bytes.size() >= chunk) {
    const std::span<const std::byte> whole = bytes.first(bytes.size() / chunk * chunk);
    const Take take = [&](std::size_t first, std::size_t size, std::span<std::byte>) {
      return whole.subspan(first - bytes_, size);
    };
    const std::vector<std::byte> digests = digests_of(bytes_, whole.size(), take, inspect);
    digests_.insert(digests_.end(), digests.begin(), digests.end());
    bytes_ += whole.size();
    bytes = bytes.subspan(whole.size());
  }
  while (!bytes.empty()) {
    const auto part = bytes.first(std::min({bytes.size(), chunk - open_->bytes, block_bytes}));
    XXH3_128bits_update(&open_->state.hash, part.data(), part.size());
    if (inspect) inspect(bytes_ + open_->bytes, part);
    open_->bytes += part.size();
    bytes = bytes.subspan(part.size());
    if (open_->bytes == chunk) close_chunk();
  }
}

void ChunkedChecksum::close_chunk() {
  const auto digest = canonical(XXH3_128bits_digest(&open_->state.hash));
  const auto bytes = std::as_bytes(std::span(digest.digest));
  digests_.insert(digests_.end(), bytes.begin(), bytes.end());
  bytes_ += open_->bytes;
  open_->bytes = 0;
  XXH3_128bits_reset(&open_->state.hash);
}

void ChunkedChecksum::append_file(const FileDescriptor& file, std::int64_t offset, std::int64_t bytes,
                                  std::byte* into, const Inspect& inspect) {
  const std::size_t before = bytes_;
  const auto size = static_cast<std::size_t>(bytes);
  const std::size_t whole = size / chunk * chunk;
  const Take take = [&](std::size_t first, std::size_t count, std::span<std::byte> buffer) {
    const std::size_t at = first - before;
    const std::span<std::byte> block = into != nullptr ? std::span(into + at, count) : buffer.first(count);
    read_exactly(file, block, offset + static_cast<std::int64_t>(at));
    return std::span<const std::byte>(block);
  };
  const std::vector<std::byte> digests = digests_of(before, whole, take, inspect);
  digests_.insert(digests_.end(), digests.begin(), digests.end());
  bytes_ += whole;
  std::vector<std::byte> buffer(block_bytes);
  for (std::size_t at = whole; at < size; at += block_bytes)
    append(take(before + at, std::min(block_bytes, size - at), buffer), inspect);
}

std::string ChunkedChecksum::digits() const {
  const auto digest = canonical(XXH3_128bits_digest(&open_->state.hash));
  const auto rest = std::as_bytes(std::span(digest.digest));
  if (digests_.empty()) return hexadecimal(digest);
  std::vector<std::byte> all = digests_;
  if (open_->bytes > 0) all.insert(all.end(), rest.begin(), rest.end());
  if (all.size() != digest_bytes) return checksum(all);
  XXH128_canonical_t only;
  std::memcpy(only.digest, all.data(), digest_bytes);
  return hexadecimal(only);
}

}  // namespace palpate
