#include "precompute/images/inr_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <string_view>

#include "base/error.h"
#include "base/words.h"
#include "precompute/images/unpacked_file.h"

namespace palpate {
namespace {

constexpr std::string_view magic = "#INRIMAGE-4#{";
constexpr std::string_view header_end = "##}";
constexpr std::size_t largest_header = 65'536;
const char* const complete_file = "use a complete INR file (.inr, .inr.gz) with one label a voxel";

/// A field's value that is a whole number from 1; `fallback` where the header lacks the field.
std::int64_t field(std::string_view header, std::string_view name, std::int64_t fallback,
                   const std::string& where) {
  std::int64_t value = fallback;
  for (std::size_t at = header.find('\n'); at != std::string_view::npos; at = header.find('\n', at + 1)) {
    std::string_view line = header.substr(at + 1, header.find('\n', at + 1) - at - 1);
    if (!line.starts_with(name) || !line.substr(name.size()).starts_with("=")) {
      continue;
    }
    line.remove_prefix(name.size() + 1);
    const std::string_view given = line;
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    const auto [end, status] = std::from_chars(line.data(), line.data() + line.size(), value);
    if (status != std::errc() || value < 1) {
      throw Error(fmt::format("{} of the image's header is \"{}\", not a whole number from 1", name,
                              shortened(given)),
                  where, complete_file);
    }
  }
  return value;
}

}  // namespace

std::int64_t check_inr_header(const std::filesystem::path& file) {
  const std::string where = file.string();
  const auto file_bytes = static_cast<std::int64_t>(std::filesystem::file_size(file));
  const GzFile stream = open_unpacked(file);
  std::string text(largest_header, '\0');
  text.resize(static_cast<std::size_t>(
      std::max(0, gzread(stream.get(), text.data(), static_cast<unsigned>(text.size())))));
  const std::size_t end = text.find(header_end);
  if (!text.starts_with(magic) || end == std::string::npos) {
    return file_bytes;
  }
  const std::string_view header = std::string_view(text).substr(0, end);
  double voxels = 1.0;
  std::string product;
  for (const char* name : {"XDIM", "YDIM", "ZDIM", "VDIM"}) {
    const std::int64_t size = field(header, name, 1, where);
    voxels *= static_cast<double>(size);
    product += fmt::format("{}{} {}", product.empty() ? "" : " x ", name, size);
  }
  check_voxels(product, voxels, where);
  const std::int64_t bits = field(header, "PIXSIZE", 8, where);
  if (bits > 64) {
    throw Error(fmt::format("PIXSIZE of the image's header is {} bits", bits), where, complete_file);
  }
  const std::int64_t needed = static_cast<std::int64_t>(voxels) * bits / 8;
  const std::size_t data = std::min(text.find('\n', end), text.size() - 1) + 1;  // after the line "##}"
  const auto after_header = static_cast<std::int64_t>(text.size() - data);
  const std::int64_t present = after_header + count_bytes(stream.get(), needed - after_header);
  if (present < needed) {
    throw Error(fmt::format("the image's header asks for {} voxels of {} bits, {} bytes, but only {} bytes "
                            "follow it",
                            product, bits, needed, present),
                where, "get the whole file, or correct the header");
  }
  return std::max(file_bytes, needed);
}

}  // namespace palpate
