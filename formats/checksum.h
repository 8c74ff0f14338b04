// XXH3-128 checksums: at memory speed, so that every load can afford the check. They find accidents, not attackers.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace palpate {

/// 32 hexadecimal digits.
std::string checksum(std::span<const std::byte> bytes);

/// Checksum of a file's bytes; throws Error when it cannot be read.
std::string checksum_file(const std::filesystem::path& file);

}  // namespace palpate
