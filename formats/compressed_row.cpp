#include "formats/compressed_row.h"

#include <zlib.h>

#include <new>

namespace palpate {
namespace {

constexpr int fastest = 1;
constexpr int window_bits = 15, memory_level = 8;  // zlib's own, which HDF5 uses, too

const Bytef* bytes_of(std::span<const std::byte> bytes) {
  return reinterpret_cast<const Bytef*>(bytes.data());
}

}  // namespace

std::vector<std::byte> compress_row(std::span<const std::byte> row, std::size_t width) {
  const std::size_t numbers = row.size() / width;
  std::vector<std::byte> shuffled(row.size());
  for (std::size_t b = 0; b < width; ++b)
    for (std::size_t i = 0; i < numbers; ++i) shuffled[b * numbers + i] = row[i * width + b];

  z_stream stream = {};
  // Mantissas hold no repeated text: to look for runs alone is twice as fast and makes no more bytes.
  if (deflateInit2(&stream, fastest, Z_DEFLATED, window_bits, memory_level, Z_RLE) != Z_OK)
    throw std::bad_alloc();
  std::vector<std::byte> compressed(deflateBound(&stream, static_cast<uLong>(shuffled.size())));
  stream.next_in = const_cast<Bytef*>(bytes_of(shuffled));
  stream.avail_in = static_cast<uInt>(shuffled.size());
  stream.next_out = reinterpret_cast<Bytef*>(compressed.data());
  stream.avail_out = static_cast<uInt>(compressed.size());
  deflate(&stream, Z_FINISH);  // into enough room
  compressed.resize(stream.total_out);
  deflateEnd(&stream);
  return compressed;
}

bool expand_row(std::span<const std::byte> compressed, std::size_t width, std::span<std::byte> row) {
  std::vector<std::byte> shuffled(row.size());
  auto bytes = static_cast<uLongf>(shuffled.size());
  auto used = static_cast<uLong>(compressed.size());
  if (uncompress2(reinterpret_cast<Bytef*>(shuffled.data()), &bytes, bytes_of(compressed), &used) != Z_OK ||
      bytes != shuffled.size() || used != compressed.size())
    return false;
  const std::size_t numbers = row.size() / width;
  for (std::size_t b = 0; b < width; ++b)
    for (std::size_t i = 0; i < numbers; ++i) row[i * width + b] = shuffled[b * numbers + i];
  return true;
}

}  // namespace palpate
