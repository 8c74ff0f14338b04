// Files that may be gzipped, and limits on images in them.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "base/file_io.h"

namespace palpate {

/// Largest number of voxels of an image; a whole-body CT has 1e9.
constexpr std::int64_t most_voxels = 1'000'000'000;

/// Throws Error if an image has more voxels than that, or than the memory can hold: reading takes
/// `voxel_bytes` [byte] per voxel for the file's values, and more for labels and their transfer from the
/// child. There is no bound on how far a file may be packed: a segmentation of one organ in a whole-body CT
/// (512 x 512 x 700 voxels) has 838 bytes to each byte of its file, and deflate cannot do more than 1032.
/// `product`: origin of the number.
void check_voxels(const std::string& product, double voxels, double voxel_bytes, const std::string& where);

using GzFile = std::unique_ptr<gzFile_s, int (*)(gzFile)>;

/// Opens a file for reading from byte `from` on, plain or gzipped. Throws Error.
GzFile open_unpacked(const FileDescriptor& file, std::int64_t from = 0);

/// Fills `into` from a stream as far as possible; returns the number of bytes.
std::size_t read_unpacked(gzFile_s* stream, std::span<char> into);

/// Contents of a stream.
struct Counted {
  std::int64_t bytes = 0;
  bool blank = true;  ///< all bytes are 0
};

/// Reads a stream to its end, or up to `enough` bytes.
Counted count_bytes(gzFile_s* stream, std::int64_t enough);

/// Throws Error for an image whose voxels are all 0, from which nothing can be made.
[[noreturn]] void fail_on_blank(const std::string& where);

}  // namespace palpate
