// Files that may be gzipped, and how much of an image they may hold.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "base/file_io.h"

namespace palpate {

/// Voxels that an image may have; a whole-body CT has 1e9.
constexpr std::int64_t most_voxels = 1'000'000'000;

/// Throws Error where an image has more voxels than that, or than there is memory for: reading takes
/// `voxel_bytes` [byte] for each as the file has it, and what labels and their way from the child take.
/// `product` says where the number comes from.
void check_voxels(const std::string& product, double voxels, double voxel_bytes, const std::string& where);

using GzFile = std::unique_ptr<gzFile_s, int (*)(gzFile)>;

/// Reads from byte `from` on: plain files as they are, gzipped ones unpacked. Throws Error.
GzFile open_unpacked(const FileDescriptor& file, std::int64_t from = 0);

/// Fills `into` from a stream as far as it goes; returns how many bytes.
std::size_t read_unpacked(gzFile_s* stream, std::span<char> into);

/// What a stream holds.
struct Counted {
  std::int64_t bytes = 0;
  bool blank = true;  ///< all of them are 0
};

/// Goes through a stream from here to its end, or to `enough` bytes.
Counted count_bytes(gzFile_s* stream, std::int64_t enough);

/// Throws Error: of an image whose voxels are all 0 nothing can be made, however large it is.
[[noreturn]] void fail_on_blank(const std::string& where);

}  // namespace palpate
