// Files that may be gzipped, and how much of an image they may hold.
#pragma once

#include <zlib.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace palpate {

/// Voxels that an image may have; a whole-body CT has 1e9.
constexpr std::int64_t most_voxels = 1'000'000'000;

/// Throws Error where there are more; `product` says where the number comes from.
void check_voxels(const std::string& product, double voxels, const std::string& where);

using GzFile = std::unique_ptr<gzFile_s, int (*)(gzFile)>;

/// Reads plain files as they are, gzipped ones unpacked. Throws Error.
GzFile open_unpacked(const std::filesystem::path& file);

/// Bytes from here to the end, or `enough` where there are more.
std::int64_t count_bytes(gzFile_s* stream, std::int64_t enough);

}  // namespace palpate
