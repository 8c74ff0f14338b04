// Rows of numbers as HDF5's filters "shuffle" and "deflate" store them.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// Compresses a row of numbers of `width` bytes each: their first bytes come first, then their second ones,
/// and so on (shuffle), and of all that zlib makes a stream (deflate). Equal rows make equal bytes. Throws
/// std::bad_alloc.
std::vector<std::byte> compress_row(std::span<const std::byte> row, std::size_t width);

/// Undoes `compress_row`: fills `row`. False, and what is in `row` is of no use, unless the bytes are one
/// whole row of this size. Bytes from anywhere do no harm.
[[nodiscard]] bool expand_row(std::span<const std::byte> compressed, std::size_t width,
                              std::span<std::byte> row);

}  // namespace palpate
