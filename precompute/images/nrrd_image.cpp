#include "precompute/images/nrrd_image.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <teem/nrrd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/regular_file.h"
#include "base/words.h"
#include "precompute/images/image_axes.h"
#include "precompute/images/unpacked_file.h"

namespace palpate {
namespace {

constexpr std::size_t largest_nrrd_header = 1 << 20;  // Slicer's segments are described there
const char* const complete_nrrd = "use a complete NRRD file (.nrrd) with one label a voxel";

/// What a header says, by field.
struct Header {
  std::map<std::string, std::string> fields;
  std::size_t bytes = 0;  // up to the first voxel, where those follow

  [[nodiscard]] std::string field(const std::string& name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? "" : found->second;
  }
};

/// Nothing where it is none, or does not end.
std::optional<Header> parse(std::string_view text) {
  if (!text.starts_with("NRRD000")) return {};
  Header header;
  while (header.bytes < text.size()) {
    const std::size_t end = text.find('\n', header.bytes);
    if (end == std::string_view::npos) return {};
    std::string_view line = text.substr(header.bytes, end - header.bytes);
    header.bytes = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) return header;
    const std::size_t colon = line.find(": ");
    if (!line.starts_with('#') && colon != std::string_view::npos)
      header.fields.emplace(line.substr(0, colon), line.substr(colon + 2));
  }
  return {};
}

/// Bytes of a number of this type; 0 for one that is none.
std::int64_t bytes_of(const std::string& type) {
  const int known = airEnumVal(nrrdType, type.c_str());
  return known == nrrdTypeUnknown || known == nrrdTypeBlock ? 0
                                                            : static_cast<std::int64_t>(nrrdTypeSize[known]);
}

/// Bytes from the header's end on, unpacked where they are gzipped, or `enough` where there are more.
std::int64_t count_voxels(const std::filesystem::path& file, const Header& header, std::int64_t enough) {
  const int fd = open_regular_file(file, O_RDONLY);
  ::lseek(fd, static_cast<off_t>(header.bytes), SEEK_SET);
  const GzFile stream(gzdopen(fd, "rb"), gzclose);
  if (!stream) throw Error("there is no memory to read the file", file.string(), "close other programs");
  return count_bytes(stream.get(), enough);
}

/// As NIfTI has them: to the right, to the front, to the head.
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

double millimetres(const char* unit) {
  const std::string name = unit == nullptr ? "mm" : unit;
  if (name == "m") return 1e3;
  if (name == "cm") return 10.0;
  return name == "um" || name == "µm" || name == "microns" ? 1e-3 : 1.0;
}

/// The columns of space that are known; else the spacing along the file's own axes.
ImagePlace place_of(const Nrrd& image, const std::vector<unsigned>& axes) {
  ImagePlace place;
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
  place.unit = millimetres(image.spaceUnits[0]);
  return place;
}

std::vector<std::int32_t> labels_of(const Nrrd& image, std::size_t voxels) {
  constexpr double most = 2147483647.0;
  std::vector<std::int32_t> labels;
  labels.reserve(voxels);
  const auto value_at = nrrdDLookup[image.type];
  for (std::size_t v = 0; v < voxels; ++v) {
    const double value = value_at(image.data, v);
    labels.push_back(
        static_cast<std::int32_t>(std::lround(std::isnan(value) ? 0.0 : std::clamp(value, -most, most))));
  }
  return labels;
}

}  // namespace

bool is_nrrd(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.ends_with(".nrrd");
}

std::int64_t check_nrrd_header(const std::filesystem::path& file) {
  const std::string where = file.string();
  const auto file_bytes = static_cast<std::int64_t>(std::filesystem::file_size(file));
  std::string text(largest_nrrd_header, '\0');
  text.resize(static_cast<std::size_t>(
      std::max(0, gzread(open_unpacked(file).get(), text.data(), static_cast<unsigned>(text.size())))));
  const std::optional<Header> header = parse(text);
  if (!header) return file_bytes;
  if (!header->field("data file").empty() || !header->field("datafile").empty())
    throw Error("the image's voxels are in another file", where,
                "save header and voxels as one file (.nrrd)");
  double voxels = 1.0;
  std::string product;
  std::istringstream sizes(header->field("sizes"));
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
  check_voxels(product, voxels, where);
  const auto needed = static_cast<std::int64_t>(voxels) * bytes_of(header->field("type"));
  const std::string encoding = header->field("encoding");
  if (encoding == "raw" || encoding == "gzip" || encoding == "gz") {
    const std::int64_t present = count_voxels(file, *header, needed);
    if (present < needed) {
      throw Error(fmt::format("the image's header asks for {} voxels, {} bytes, but only {} bytes follow it",
                              product, needed, present),
                  where, "get the whole file, or correct the header");
    }
  }
  return std::max(file_bytes, needed);
}

ChildResult read_nrrd_labels(const std::string& file) {
  const std::unique_ptr<Nrrd, Nrrd* (*)(Nrrd*)> image(nrrdNew(), nrrdNuke);
  if (nrrdLoad(image.get(), file.c_str(), nullptr) != 0 || image->data == nullptr) return {not_an_image, {}};
  if (image->type <= nrrdTypeUnknown || image->type >= nrrdTypeBlock) return {not_scalar, {}};
  std::vector<unsigned> axes;  // that lie in space
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
  const std::vector<std::int32_t> labels = labels_of(*image, size[0] * size[1] * size[2]);
  return along_space(place_of(*image, axes), size, labels);
}

}  // namespace palpate
