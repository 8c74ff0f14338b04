#include "precompute/images/nrrd_image.h"

#include <fmt/format.h>
#include <teem/nrrd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/words.h"
#include "precompute/images/image_axes.h"
#include "precompute/images/unpacked_file.h"

namespace palpate {
namespace {

constexpr std::size_t largest_nrrd_header = 1 << 20;  // Slicer's segments are described there
const char* const complete_nrrd = "use a complete NRRD file (.nrrd) with one label per voxel";

/// Fields of a header by teem's numbers (nrrdField), since some have several names.
struct Header {
  std::map<int, std::string> fields;
  std::size_t bytes = 0;  // up to the first voxel, if voxels follow

  [[nodiscard]] std::string field(int number) const {
    const auto found = fields.find(number);
    return found == fields.end() ? "" : found->second;
  }
};

/// Parses the header; nullopt if there is none, or it does not end.
std::optional<Header> parse(std::string_view text) {
  if (!text.starts_with("NRRD000")) return {};
  Header header;
  while (header.bytes < text.size()) {
    const std::size_t end = text.find('\n', header.bytes);
    if (end == std::string_view::npos) return {};
    std::string_view line = text.substr(header.bytes, end - header.bytes);
    header.bytes = end + 1;
    while (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) return header;
    const std::size_t colon = line.find(':');
    if (line.starts_with('#') || colon == std::string_view::npos || line.substr(colon).starts_with(":="))
      continue;
    std::string name(line.substr(0, colon));
    line.remove_prefix(std::min(line.find_first_not_of(" \t", colon + 1), line.size()));
    const int number = airEnumVal(nrrdField, name.c_str());
    std::erase_if(name, [](unsigned char c) { return std::isalpha(c) == 0; });
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    // not only in teem's spellings: this key always means another file
    header.fields.emplace(name == "datafile" ? nrrdField_data_file : number, line);
  }
  return {};
}

/// Size of a number of this type [byte]; 0 for an unknown one.
std::int64_t bytes_of(const std::string& type) {
  const int known = airEnumVal(nrrdType, type.c_str());
  return known == nrrdTypeUnknown || known == nrrdTypeBlock ? 0
                                                            : static_cast<std::int64_t>(nrrdTypeSize[known]);
}

/// Signs of the axes relative to NIfTI's: to the right, to the front, to the head.
std::array<double, 3> signs_of(int space) {
  switch (space) {
    case nrrdSpaceLeftPosteriorSuperior:
    case nrrdSpaceScannerXYZ:
      return {-1.0, -1.0, 1.0};
    case nrrdSpaceLeftAnteriorSuperior:
      return {-1.0, 1.0, 1.0};
    default:
      return {1.0, 1.0, 1.0};
  }
}

/// True if lengths are millimetres by default, as in 3D Slicer and ITK.
bool is_of_a_patient(int space) {
  switch (space) {
    case nrrdSpaceRightAnteriorSuperior:
    case nrrdSpaceLeftAnteriorSuperior:
    case nrrdSpaceLeftPosteriorSuperior:
    case nrrdSpaceScannerXYZ:
      return true;
    default:
      return false;
  }
}

/// Unit in `space units`, or in `units` without a space [mm]; 0 if there is none. Throws Error for an unknown
/// one, and for several different ones.
double unit_of(const Nrrd& image, const std::vector<unsigned>& axes, const std::string& where) {
  static const std::map<std::string, double> units = {
      {"m", 1e3},   {"meter", 1e3},      {"cm", 10.0},         {"centimeter", 10.0},
      {"mm", 1.0},  {"millimeter", 1.0}, {"um", 1e-3},         {"µm", 1e-3},
      {"μm", 1e-3}, {"micron", 1e-3},    {"micrometer", 1e-3}, {"nm", 1e-6},
      {"in", 25.4}, {"inch", 25.4},      {"inche", 25.4},      {"nanometer", 1e-6}};
  double unit = 0.0;
  std::string first;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const char* const said = image.spaceDim == 3 ? image.spaceUnits[k] : image.axis[axes.at(k)].units;
    std::string name = said == nullptr ? "" : said;
    if (name.empty()) continue;
    const std::string written = shortened(name);
    if (name.size() > 2) {  // "Millimetres" is "millimeter"
      std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
      if (name.ends_with('s')) name.pop_back();
      if (name.ends_with("metre")) name.replace(name.size() - 2, 2, "er");
    }
    const auto known = units.find(name);
    if (known == units.end())
      throw Error(fmt::format("the image counts in \"{}\", a unit that is not known", written), where,
                  "say mm, cm, m, um, nm or in under space units of the header");
    if (unit != 0.0 && unit != known->second) {
      throw Error(fmt::format("the image counts in \"{}\" along one axis and in \"{}\" along another", first,
                              written),
                  where, "write space directions and space origin of the header in one unit");
    }
    unit = known->second;
    first = written;
  }
  if (unit == 0.0 && image.spaceDim == 3 && is_of_a_patient(image.space)) return 1.0;
  return unit;
}

/// Position from the known columns of space; else from the spacing along the file's own axes.
ImagePlace place_of(const Nrrd& image, const std::vector<unsigned>& axes, const std::string& where) {
  ImagePlace place;
  place.unit = unit_of(image, axes, where);
  const bool in_space = image.spaceDim == 3;
  const std::array<double, 3> signs = signs_of(in_space ? image.space : nrrdSpaceUnknown);
  for (int column = 0; column < 3; ++column) {
    if (static_cast<std::size_t>(column) >= axes.size()) continue;
    const NrrdAxisInfo& axis = image.axis[axes.at(static_cast<std::size_t>(column))];
    for (int row = 0; row < 3; ++row) {
      const double along = in_space ? signs.at(static_cast<std::size_t>(row)) * axis.spaceDirection[row]
                                    : (row == column && std::isfinite(axis.spacing) ? axis.spacing
                                       : row == column                              ? 1.0
                                                                                    : 0.0);
      place.to_space(row, column) = along;
    }
  }
  if (!in_space) return place;
  for (int row = 0; row < 3; ++row) {
    const double origin = image.spaceOrigin[row];
    place.to_space(row, 3) = std::isfinite(origin) ? signs.at(static_cast<std::size_t>(row)) * origin : 0.0;
  }
  return place;
}

}  // namespace

bool is_nrrd(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.ends_with(".nrrd");
}

std::optional<std::int64_t> check_nrrd_header(const FileDescriptor& file) {
  const std::string where = file.path().string();
  std::string text(largest_nrrd_header, '\0');
  text.resize(read_unpacked(open_unpacked(file).get(), text));
  const std::optional<Header> header = parse(text);
  if (!header) return {};
  if (header->fields.contains(nrrdField_data_file))
    throw Error("the image's voxels are in another file", where,
                "save header and voxels as one file (.nrrd)");
  double voxels = 1.0;
  std::string product;
  std::istringstream sizes(header->field(nrrdField_sizes));
  for (std::string word; sizes >> word;) {
    std::int64_t size = 0;
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), size);
    if (status != std::errc() || end != word.data() + word.size() || size < 1) {
      throw Error(
          fmt::format("sizes of the image's header has \"{}\", not a whole number from 1", shortened(word)),
          where, complete_nrrd);
    }
    voxels *= static_cast<double>(size);
    product += fmt::format("{}{}", product.empty() ? "" : " x ", size);
  }
  const std::int64_t voxel_bytes = bytes_of(header->field(nrrdField_type));
  check_voxels(product, voxels, static_cast<double>(voxel_bytes), where);
  const auto count = static_cast<std::int64_t>(voxels), needed = count * voxel_bytes;
  const int encoding = airEnumVal(nrrdEncodingType, header->field(nrrdField_encoding).c_str());
  std::int64_t least = needed;  // bytes behind the header, unpacked
  if (encoding == nrrdEncodingTypeHex) least = 2 * needed;
  if (encoding == nrrdEncodingTypeAscii) least = 2 * count - 1;  // a digit each, and a blank between
  if (encoding == nrrdEncodingTypeBzip2) least = 1;
  const auto from = static_cast<std::int64_t>(header->bytes);
  const Counted present = count_bytes(open_unpacked(file, from).get(), least);
  if (present.bytes < least) {
    throw Error(fmt::format("the image's header asks for {} voxels, {} bytes, but only {} bytes follow it",
                            product, least, present.bytes),
                where, "get the whole file, or correct the header");
  }
  if (present.blank) fail_on_blank(where);
  return std::max(file_size(file), needed);
}

ChildResult read_nrrd_labels(const FileDescriptor& file, const std::optional<ValueRange>& range) {
  const std::unique_ptr<Nrrd, Nrrd* (*)(Nrrd*)> image(nrrdNew(), nrrdNuke);
  ::lseek(file.get(), 0, SEEK_SET);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(::fdopen(::dup(file.get()), "rb"),
                                                               std::fclose);
  if (!stream || nrrdRead(image.get(), stream.get(), nullptr) != 0 || image->data == nullptr)
    return {not_an_image, {}};
  if (image->type <= nrrdTypeUnknown || image->type >= nrrdTypeBlock) return {not_scalar, {}};
  std::vector<unsigned> axes;  // axes in space
  for (unsigned k = 0; k < image->dim; ++k) {
    const bool is_along = image->spaceDim != 3 || std::isfinite(image->axis[k].spaceDirection[0]);
    if (is_along && axes.size() < 3) {
      axes.push_back(k);
    } else if (image->axis[k].size != 1) {
      return {not_scalar, {}};
    }
  }
  std::array<std::size_t, 3> size = {1, 1, 1};
  for (std::size_t k = 0; k < axes.size(); ++k) size.at(k) = image->axis[axes.at(k)].size;
  const auto value_at = nrrdDLookup[image->type];
  const std::string where = file.path().string();
  return along_space(place_of(*image, axes, where), size,
                     labels_from(size[0] * size[1] * size[2], range,
                                 [&](std::size_t v) { return value_at(image->data, v); }));
}

}  // namespace palpate
