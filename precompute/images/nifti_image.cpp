#include "precompute/images/nifti_image.h"

#include <fmt/format.h>
#include <nifti2_io.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "precompute/images/image_axes.h"
#include "precompute/images/unpacked_file.h"

namespace palpate {
namespace {

using Image = std::unique_ptr<nifti_image, void (*)(nifti_image*)>;

constexpr std::int32_t size_1 = 348, size_2 = 540;  // of headers [byte]

/// A number at an offset of a header of either byte order.
template <class T>
T number_at(std::span<const char> header, std::size_t offset, bool swapped) {
  std::array<char, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), header.data() + offset, sizeof(T));
  if (swapped) std::ranges::reverse(bytes);
  return std::bit_cast<T>(bytes);
}

/// Description of the voxels in a header.
struct Dimensions {
  std::array<std::int64_t, 8> dim{};  // their number, then each
  std::int64_t bits = 0;              // of a voxel
  double offset = 0.0;                // of the first voxel in the file [byte]
  double shift = 0.0;                 // from values to labels
  std::array<double, 3> sides{};      // of a voxel, if there is no matrix
  bool has_matrix = false, has_quaternion = false;
  std::array<double, 18> place{};  // quatern_b, c, d and qoffset, then the matrix by rows
};

Dimensions dimensions_1(std::span<const char> header, bool swapped) {
  Dimensions result;
  for (std::size_t i = 0; i < 8; ++i) result.dim.at(i) = number_at<std::int16_t>(header, 40 + 2 * i, swapped);
  result.bits = number_at<std::int16_t>(header, 72, swapped);
  result.offset = static_cast<double>(number_at<float>(header, 108, swapped));
  result.shift = static_cast<double>(number_at<float>(header, 116, swapped));
  for (std::size_t i = 0; i < 3; ++i)
    result.sides.at(i) = static_cast<double>(number_at<float>(header, 80 + 4 * i, swapped));
  result.has_quaternion = number_at<std::int16_t>(header, 252, swapped) > 0;
  result.has_matrix = number_at<std::int16_t>(header, 254, swapped) > 0;
  for (std::size_t i = 0; i < 18; ++i)
    result.place.at(i) = static_cast<double>(number_at<float>(header, 256 + 4 * i, swapped));
  return result;
}

Dimensions dimensions_2(std::span<const char> header, bool swapped) {
  Dimensions result;
  for (std::size_t i = 0; i < 8; ++i) result.dim.at(i) = number_at<std::int64_t>(header, 16 + 8 * i, swapped);
  result.bits = number_at<std::int16_t>(header, 14, swapped);
  result.offset = static_cast<double>(number_at<std::int64_t>(header, 168, swapped));
  result.shift = number_at<double>(header, 184, swapped);
  for (std::size_t i = 0; i < 3; ++i) result.sides.at(i) = number_at<double>(header, 112 + 8 * i, swapped);
  result.has_quaternion = number_at<std::int32_t>(header, 344, swapped) > 0;
  result.has_matrix = number_at<std::int32_t>(header, 348, swapped) > 0;
  for (std::size_t i = 0; i < 18; ++i) result.place.at(i) = number_at<double>(header, 352 + 8 * i, swapped);
  return result;
}

std::optional<Dimensions> read_dimensions(std::span<const char> header) {
  if (header.size() < size_1) return {};
  for (const bool swapped : {false, true}) {
    const auto size = number_at<std::int32_t>(header, 0, swapped);
    if (size == size_1 && std::string_view(header.data() + 344, 3) == "n+1")
      return dimensions_1(header, swapped);
    if (size == size_2 && header.size() >= size_2 && std::string_view(header.data() + 4, 3) == "n+2")
      return dimensions_2(header, swapped);
  }
  return {};
}

/// First bytes of a file, as many as the longer of both headers has.
std::string header_of(gzFile_s* stream) {
  std::string header(size_2, '\0');
  header.resize(read_unpacked(stream, header));
  return header;
}

/// libnifti's image, without voxels, for a header that read_dimensions accepts; null if libnifti refuses it.
nifti_image* image_of(const std::string& header) {
  if (header.substr(4, 3) == "n+2") {
    nifti_2_header second{};
    std::memcpy(&second, header.data(), sizeof second);
    return nifti_convert_n2hdr2nim(second, nullptr);
  }
  nifti_1_header first{};
  std::memcpy(&first, header.data(), sizeof first);
  return nifti_convert_n1hdr2nim(first, nullptr);
}

/// Reads the voxels, which the image frees, into this machine's byte order.
bool read_voxels(gzFile_s* stream, nifti_image& image) {
  const auto bytes = static_cast<std::size_t>(image.nvox) * static_cast<std::size_t>(image.nbyper);
  image.data = std::calloc(std::max<std::size_t>(bytes, 1), 1);
  if (image.data == nullptr) throw std::bad_alloc();
  if (gzseek(stream, static_cast<z_off_t>(image.iname_offset), SEEK_SET) < 0) return false;
  if (read_unpacked(stream, {static_cast<char*>(image.data), bytes}) != bytes) return false;
  if (image.swapsize > 1 && image.byteorder != nifti_short_order())
    nifti_swap_Nbytes(image.nvox * image.nbyper / image.swapsize, image.swapsize, image.data);
  return true;
}

template <class T>
Labels rounded(const nifti_image& image, std::size_t voxels, const std::optional<ValueRange>& range) {
  const bool scaled =
      image.scl_slope != 0.0 && std::isfinite(image.scl_slope) && std::isfinite(image.scl_inter);
  const double slope = scaled ? image.scl_slope : 1.0, shift = scaled ? image.scl_inter : 0.0;
  const T* const values = static_cast<const T*>(image.data);
  return labels_from(voxels, range,
                     [&](std::size_t v) { return slope * static_cast<double>(values[v]) + shift; });
}

/// Voxels as labels; empty for colours and complex numbers.
Labels labels_of(const nifti_image& image, std::size_t voxels, const std::optional<ValueRange>& range) {
  switch (image.datatype) {
    case NIFTI_TYPE_UINT8:
      return rounded<std::uint8_t>(image, voxels, range);
    case NIFTI_TYPE_INT8:
      return rounded<std::int8_t>(image, voxels, range);
    case NIFTI_TYPE_UINT16:
      return rounded<std::uint16_t>(image, voxels, range);
    case NIFTI_TYPE_INT16:
      return rounded<std::int16_t>(image, voxels, range);
    case NIFTI_TYPE_UINT32:
      return rounded<std::uint32_t>(image, voxels, range);
    case NIFTI_TYPE_INT32:
      return rounded<std::int32_t>(image, voxels, range);
    case NIFTI_TYPE_UINT64:
      return rounded<std::uint64_t>(image, voxels, range);
    case NIFTI_TYPE_INT64:
      return rounded<std::int64_t>(image, voxels, range);
    case NIFTI_TYPE_FLOAT32:
      return rounded<float>(image, voxels, range);
    case NIFTI_TYPE_FLOAT64:
      return rounded<double>(image, voxels, range);
    default:
      return {};
  }
}

/// Length of a unit [mm]; 0 if the header has none.
double millimetres(int unit) {
  if (unit == NIFTI_UNITS_METER) return 1e3;
  if (unit == NIFTI_UNITS_MICRON) return 1e-3;
  return unit == NIFTI_UNITS_MM ? 1.0 : 0.0;
}

/// Throws Error for voxel sides that are not positive: libnifti would replace 0 by 1, and a negative one may
/// mean a mirror image or nothing.
void check_sides(const Dimensions& said, const std::string& where) {
  if (said.has_matrix) return;
  for (std::size_t i = 0; i < 3 && static_cast<std::int64_t>(i) < said.dim[0]; ++i) {
    if (said.sides.at(i) > 0.0) continue;
    throw Error(
        fmt::format("pixdim[{}] of the image's header is {}, and the side of a voxel must be positive", i + 1,
                    said.sides.at(i)),
        where,
        "correct the header; where a negative number meant that the image is mirrored, turn its voxels "
        "round too, or give it an sform");
  }
}

/// Throws Error for a matrix or quaternion that is not finite: libnifti would take 0 for such numbers.
void check_place(const Dimensions& said, const std::string& where) {
  const std::span<const double> all(said.place);
  const auto used = said.has_matrix ? all.subspan(6) : all.first(said.has_quaternion ? 6 : 0);
  const auto wrong = std::ranges::find_if(used, [](double number) { return !std::isfinite(number); });
  if (wrong != used.end()) {
    throw Error(fmt::format("the image's {} has a number that is {}",
                            said.has_matrix ? "sform (srow_x, srow_y, srow_z)" : "qform", *wrong),
                where, "correct the header");
  }
}

}  // namespace

bool is_nifti(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name.ends_with(".nii") || name.ends_with(".nii.gz");
}

std::optional<std::int64_t> check_nifti_header(const FileDescriptor& file) {
  const std::string where = file.path().string();
  const GzFile stream = open_unpacked(file);
  const std::string header = header_of(stream.get());
  const std::optional<Dimensions> said = read_dimensions(header);
  if (!said) return {};
  const std::array<std::int64_t, 8>& dim = said->dim;
  const std::int64_t bits = said->bits;
  const double offset = said->offset;
  double voxels = 1.0;
  std::string product;
  for (std::size_t i = 1; i <= static_cast<std::size_t>(std::clamp<std::int64_t>(dim[0], 0, 7)); ++i) {
    if (dim.at(i) < 1)
      throw Error(fmt::format("dim[{}] of the image's header is {}, not a whole number from 1", i, dim.at(i)),
                  where, "correct the header");
    voxels *= static_cast<double>(dim.at(i));
    product += fmt::format("{}{}", product.empty() ? "" : " x ", dim.at(i));
  }
  check_sides(*said, where);
  check_place(*said, where);
  if (!(bits >= 0 && bits <= 256 && offset >= 0.0 && offset < 1e9))
    throw Error(fmt::format("bitpix and vox_offset of the image's header are {} and {}", bits, offset), where,
                "correct the header");
  check_voxels(product, voxels, static_cast<double>(bits) / 8.0, where);
  const auto bytes = static_cast<std::int64_t>(std::ceil(offset + voxels * static_cast<double>(bits) / 8.0));
  // voxels follow the header and its extensions
  const auto first = static_cast<std::int64_t>(std::max(offset, static_cast<double>(header.size())));
  gzseek(stream.get(), static_cast<z_off_t>(first), SEEK_SET);
  const Counted behind = count_bytes(stream.get(), bytes - first);
  const std::int64_t present = first + behind.bytes;
  if (present < bytes) {
    throw Error(
        fmt::format("the image's header asks for {} voxels of {} bits, {} bytes, but the file has only {} "
                    "bytes",
                    product, bits, bytes, present),
        where, "get the whole file, or correct the header");
  }
  if (behind.blank && said->shift == 0.0) fail_on_blank(where);
  return std::max(file_size(file), bytes);
}

ChildResult read_nifti_labels(const FileDescriptor& file, const std::optional<ValueRange>& range) {
  nifti_set_debug_level(0);
  const GzFile stream = open_unpacked(file);
  const std::string header = header_of(stream.get());
  const Image image(image_of(header), nifti_image_free);
  if (!image || !read_voxels(stream.get(), *image)) return {not_an_image, {}};
  std::array<std::size_t, 3> size{};
  std::size_t voxels = 1;
  for (int i = 0; i < 3; ++i) {
    size.at(static_cast<std::size_t>(i)) = i < image->ndim ? static_cast<std::size_t>(image->dim[i + 1]) : 1;
    voxels *= size.at(static_cast<std::size_t>(i));
  }
  if (voxels != static_cast<std::size_t>(image->nvox)) return {not_scalar, {}};
  Labels labels = labels_of(*image, voxels, range);
  if (labels.of_voxels.empty()) return {not_scalar, {}};
  const nifti_dmat44& to_space = image->sform_code > 0 ? image->sto_xyz : image->qto_xyz;
  ImagePlace place;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) place.to_space(row, column) = to_space.m[row][column];
  place.unit = millimetres(image->xyz_units);
  return along_space(place, size, std::move(labels));
}

}  // namespace palpate
