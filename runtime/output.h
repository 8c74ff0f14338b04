// What the program prints and writes.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "meshes/mesh.h"

namespace palpate {

/// `text` as a JSON string, with its quotes.
std::string json_string(std::string_view text);

/// `v` as a JSON array; numbers read back to the same bits.
std::string json_vector(const Vec3& v);

/// Writes a text file under a temporary name and renames it. Throws Error when that fails, leaving what was
/// there.
void write_text_file(const std::filesystem::path& file, std::string_view text);

/// `warning: TEXT` on the error stream.
void print_warning(std::string_view text);

}  // namespace palpate
