#include "precompute/images/inr_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/words.h"
#include "precompute/images/unpacked_file.h"

namespace palpate {
namespace {

constexpr std::string_view magic = "#INRIMAGE-4#{\n";
constexpr std::string_view header_end = "##}";
constexpr std::size_t largest_header = 65'536;
const char* const complete_inr = "use a complete INR file (.inr, .inr.gz) with one label per voxel";

/// Text after "NAME=" in the last line that begins so.
std::optional<std::string_view> field(std::string_view header, std::string_view name) {
  std::optional<std::string_view> value;
  for (std::size_t at = header.find('\n'); at != std::string_view::npos; at = header.find('\n', at + 1)) {
    std::string_view line = header.substr(at + 1, header.find('\n', at + 1) - at - 1);
    if (!line.starts_with(name) || !line.substr(name.size()).starts_with("=")) continue;
    line.remove_prefix(name.size() + 1);
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    value = line;
  }
  return value;
}

/// A whole number from 1; `fallback` if the header lacks the field.
std::int64_t whole(std::string_view header, std::string_view name, std::int64_t fallback,
                   const std::string& where) {
  const std::optional<std::string_view> given = field(header, name);
  if (!given) return fallback;
  std::int64_t value = 0;
  const auto [end, status] = std::from_chars(given->data(), given->data() + given->size(), value);
  if (status != std::errc() || value < 1) {
    throw Error(
        fmt::format("{} of the image's header is \"{}\", not a whole number from 1", name, shortened(*given)),
        where, complete_inr);
  }
  return value;
}

/// A number; NaN if the text is none.
double real(std::string_view header, std::string_view name, double fallback) {
  const std::optional<std::string_view> given = field(header, name);
  double value = fallback;
  if (given && std::from_chars(given->data(), given->data() + given->size(), value).ec != std::errc())
    value = std::numeric_limits<double>::quiet_NaN();
  return value;
}

struct InrHeader {
  std::array<std::int64_t, 4> size{};  // along x, y, z, and values per voxel
  std::array<double, 3> spacing{}, origin{};
  std::int64_t bits = 0;  // of a value
  bool is_float = false, is_signed = false, is_big_endian = false;
  std::size_t bytes = 0;  // up to the first voxel

  [[nodiscard]] std::int64_t values() const { return size[0] * size[1] * size[2] * size[3]; }
  [[nodiscard]] std::string product() const {
    return fmt::format("XDIM {} x YDIM {} x ZDIM {} x VDIM {}", size[0], size[1], size[2], size[3]);
  }
};

/// Reads the kind of number and the byte order; false if they are missing or unknown.
bool read_kind(std::string_view text, InrHeader& header) {
  const std::string_view type = field(text, "TYPE").value_or(""), order = field(text, "CPU").value_or("");
  const auto is = [](std::string_view value, auto... names) { return (value.starts_with(names) || ...); };
  header.is_float = is(type, "float");
  header.is_signed = is(type, "signed fixed");
  header.is_big_endian = is(order, "sun", "sgi");
  const bool known = header.is_float
                         ? header.bits == 32 || header.bits == 64
                         : header.bits == 8 || header.bits == 16 || header.bits == 32 || header.bits == 64;
  return known && (header.is_float || header.is_signed || is(type, "unsigned fixed")) &&
         (header.is_big_endian || is(order, "decm", "alpha", "pc"));
}

/// Reads the header; nullopt if the file has no INR header, or one of an unknown kind.
std::optional<InrHeader> read_header(gzFile_s* stream, const std::string& where) {
  std::string text(largest_header, '\0');
  text.resize(read_unpacked(stream, text));
  const std::size_t end = text.find(header_end);
  if (!text.starts_with(magic) || end == std::string::npos) return {};
  const std::string_view lines = std::string_view(text).substr(0, end);
  InrHeader header;
  constexpr std::array<const char*, 4> sizes = {"XDIM", "YDIM", "ZDIM", "VDIM"};
  constexpr std::array<const char*, 3> sides = {"VX", "VY", "VZ"}, places = {"TX", "TY", "TZ"};
  double values = 1.0;
  for (std::size_t axis = 0; axis < sizes.size(); ++axis) {
    header.size.at(axis) = whole(lines, sizes.at(axis), 1, where);
    values *= static_cast<double>(header.size.at(axis));
  }
  header.bits = whole(lines, "PIXSIZE", 8, where);
  if (header.bits > 64) {
    throw Error(fmt::format("PIXSIZE of the image's header is {} bits", header.bits), where, complete_inr);
  }
  check_voxels(header.product(), values, static_cast<double>(header.bits) / 8.0, where);
  if (!read_kind(lines, header)) return {};
  for (std::size_t axis = 0; axis < sides.size(); ++axis) {
    header.spacing.at(axis) = real(lines, sides.at(axis), 1.0);
    header.origin.at(axis) = real(lines, places.at(axis), 0.0);
    if (!(header.spacing.at(axis) > 0.0)) return {};
  }
  header.bytes = std::min(text.find('\n', end), text.size() - 1) + 1;  // after the line "##}"
  return header;
}

template <class T>
Labels labels_as(std::vector<char>& bytes, bool swapped, const std::optional<ValueRange>& range) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (swapped) {
    for (std::size_t at = 0; at < bytes.size(); at += sizeof(T))
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                   bytes.begin() + static_cast<std::ptrdiff_t>(at + sizeof(T)));
  }
  std::memcpy(values.data(), bytes.data(), bytes.size());
  bytes = {};
  return labels_from(values.size(), range, [&](std::size_t v) { return static_cast<double>(values[v]); });
}

Labels labels_of(const InrHeader& header, std::vector<char>& bytes, const std::optional<ValueRange>& range) {
  const bool swapped = header.is_big_endian;
  if (header.is_float && header.bits == 32) return labels_as<float>(bytes, swapped, range);
  if (header.is_float) return labels_as<double>(bytes, swapped, range);
  const auto whole_numbers = [&]<class Signed, class Unsigned>(Signed, Unsigned) {
    return header.is_signed ? labels_as<Signed>(bytes, swapped, range)
                            : labels_as<Unsigned>(bytes, swapped, range);
  };
  if (header.bits == 8) return whole_numbers(std::int8_t{}, std::uint8_t{});
  if (header.bits == 16) return whole_numbers(std::int16_t{}, std::uint16_t{});
  if (header.bits == 32) return whole_numbers(std::int32_t{}, std::uint32_t{});
  return whole_numbers(std::int64_t{}, std::uint64_t{});
}

}  // namespace

std::optional<std::int64_t> check_inr_header(const FileDescriptor& file) {
  const std::string where = file.path().string();
  const std::optional<InrHeader> header = read_header(open_unpacked(file).get(), where);
  if (!header) return {};
  const std::int64_t needed = header->values() * header->bits / 8;
  const GzFile stream = open_unpacked(file);
  gzseek(stream.get(), static_cast<z_off_t>(header->bytes), SEEK_SET);
  const auto [present, blank] = count_bytes(stream.get(), needed);
  if (present < needed) {
    throw Error(fmt::format("the image's header asks for {} voxels of {} bits, {} bytes, but only {} bytes "
                            "follow it",
                            header->product(), header->bits, needed, present),
                where, "get the whole file, or correct the header");
  }
  if (blank) fail_on_blank(where);
  return std::max(file_size(file), needed);
}

ChildResult read_inr_labels(const FileDescriptor& file, const std::optional<ValueRange>& range) {
  const std::optional<InrHeader> header = read_header(open_unpacked(file).get(), file.path().string());
  if (!header) return {not_an_image, {}};
  if (header->size[3] != 1) return {not_scalar, {}};
  const GzFile stream = open_unpacked(file);
  gzseek(stream.get(), static_cast<z_off_t>(header->bytes), SEEK_SET);
  std::vector<char> bytes(static_cast<std::size_t>(header->values() * header->bits / 8));
  if (read_unpacked(stream.get(), bytes) != bytes.size()) return {not_an_image, {}};
  ImageHeader said;
  said.spacing = header->spacing;
  said.origin = header->origin;
  for (std::size_t axis = 0; axis < 3; ++axis) said.size.at(axis) = static_cast<Index>(header->size.at(axis));
  return image_labels(said, labels_of(*header, bytes, range));
}

}  // namespace palpate
