#include "precompute/images/labelled_image.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <span>

#include "base/child_process.h"
#include "base/error.h"
#include "base/regular_file.h"
#include "base/words.h"
#include "precompute/images/image_labels.h"
#include "precompute/images/inr_image.h"
#include "precompute/images/nifti_image.h"
#include "precompute/images/nrrd_image.h"
#include "precompute/images/unpacked_file.h"

namespace palpate {
namespace {

constexpr double largest_shear = 80.0;           // degrees; gantries tilt by 30
constexpr double largest_spacing_ratio = 100.0;  // slices of 5 mm with pixels of 0.1 mm have 50
constexpr double voxels_per_edge = 20.0;
constexpr double least_turn = 0.1;  // of the image's axes that is reported [degrees]
const char* const complete_file =
    "use a complete INR, NIfTI or NRRD file (.inr, .inr.gz, .nii, .nii.gz, .nrrd) with one label per voxel "
    "and positive VX, VY, VZ, pixdim or space directions";
constexpr std::size_t smallest_speck = 8;  // [voxels] less would be smoothed away
constexpr std::size_t most_labels = 100;   // of body by default: grey images have more

/// Functions for a kind of image file: recognition by name, check of the header, and reader.
struct ImageKind {
  bool (*is)(const std::filesystem::path& file);
  std::optional<std::int64_t> (*check)(const FileDescriptor& file);  ///< nullopt: not of this kind
  ChildResult (*read)(const FileDescriptor& file, const std::optional<ValueRange>& range);
};

const ImageKind& kind_of(const std::filesystem::path& file) {
  static constexpr std::array<ImageKind, 2> kinds = {
      {{is_nifti, check_nifti_header, read_nifti_labels}, {is_nrrd, check_nrrd_header, read_nrrd_labels}}};
  static constexpr ImageKind inr = {nullptr, check_inr_header, read_inr_labels};
  const auto* const found = std::ranges::find_if(kinds, [&](const ImageKind& kind) { return kind.is(file); });
  return found == kinds.end() ? inr : *found;
}

/// Throws Error for voxel sides, an origin and a shear that no image has.
void check_geometry(const VoxelGrid& grid, double sheared, const std::string& where) {
  const double smallest = grid.spacing.minCoeff(), largest = grid.spacing.maxCoeff();
  if (!((grid.spacing.array() > 1e-30).all() && largest < 1e30 &&
        largest <= largest_spacing_ratio * smallest)) {
    throw Error(fmt::format("the voxels' sides (VX, VY, VZ; pixdim; space directions) are {}, {}, {}",
                            shown(grid.spacing[0]), shown(grid.spacing[1]), shown(grid.spacing[2])),
                where,
                fmt::format("they must be positive, and none more than {} times another: correct the header",
                            largest_spacing_ratio));
  }
  if (!(grid.origin.cwiseAbs().maxCoeff() < 1e12 * largest)) {
    throw Error(fmt::format("the image's origin (TX, TY, TZ; sform, qform; space origin) is ({}, {}, {})",
                            shown(grid.origin[0]), shown(grid.origin[1]), shown(grid.origin[2])),
                where, "correct the header");
  }
  if (!(sheared <= largest_shear)) {
    throw Error(
        fmt::format("two axes of the image (sform, qform; space directions) are {} degrees from a "
                    "right angle",
                    shown(sheared)),
        where,
        fmt::format("correct the header: a tilted gantry shears by less than {} degrees", largest_shear));
  }
}

/// Throws Error for a grey image without a range, since its values do not determine the body. `kinds`: number
/// of labels.
void check_labels(const ImageHeader& header, std::size_t kinds, const std::string& occurring,
                  const ImageGeometry& image) {
  if (image.range) return;
  const bool chosen = !image.labels.empty(), is_negative = header.lowest<0.0, are_many = kinds> most_labels;
  if (header.whole && (chosen || (!is_negative && !are_many))) return;
  std::string what = fmt::format("the image is grey and no segmentation: its values go from {} to {}",
                                 shown(header.lowest), shown(header.highest));
  if (!header.whole)
    what += ", and not all are whole numbers";
  else if (are_many)
    what += fmt::format(", {} different ones", kinds);
  std::string hint =
      "say which values are the body by --range LOW:HIGH, in a description by range = [LOW, HIGH] under "
      "[geometry] (of a CT, 0:100 is about soft tissue); better, segment the image first, with 3D Slicer or "
      "TotalSegmentator for instance";
  if (header.whole && !are_many)
    hint += "; where these are labels (" + occurring + "), choose by labels = [...] under [geometry]";
  throw Error(what, image.file.string(), hint);
}

/// Labels in words: "1", "1 and 2", "1, 2 and 7".
std::string and_list(const std::vector<std::int32_t>& labels) {
  std::string text = fmt::format("{}", labels.front());
  for (std::size_t k = 1; k < labels.size(); ++k)
    text += fmt::format("{}{}", k + 1 == labels.size() ? " and " : ", ", labels[k]);
  return text;
}

/// Marks the voxels with one of the wanted labels (all but 0 if none are listed); labels that occur, and
/// whether they are wanted.
std::map<std::int32_t, std::uint8_t> mark(const std::vector<std::int32_t>& labels,
                                          const std::vector<int>& wanted, std::vector<std::uint8_t>& inside) {
  std::map<std::int32_t, std::uint8_t> selected;
  inside.reserve(labels.size());
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (v > 0 && labels[v] == labels[v - 1]) {  // most are
      inside.push_back(inside.back());
      continue;
    }
    const std::int32_t label = labels[v];
    const auto [entry, is_new] = selected.try_emplace(label, 0);
    if (is_new) {
      entry->second =
          wanted.empty() ? label != 0 : std::find(wanted.begin(), wanted.end(), label) != wanted.end();
    }
    inside.push_back(entry->second);
  }
  return selected;
}

/// Throws Error where labels do not make the body that is asked for; notes where they are merged.
void check_selected(const std::map<std::int32_t, std::uint8_t>& selected, const ImageHeader& header,
                    const ImageGeometry& image, std::vector<std::string>& notes) {
  const std::string where = image.file.string();
  const std::vector<int>& wanted = image.labels;
  std::string occurring;
  std::vector<std::int32_t> merged;
  for (const auto& [label, is_body] : selected) {
    occurring += (occurring.empty() ? "" : ", ") + std::to_string(label);
    if (is_body != 0) merged.push_back(label);
  }
  check_labels(header, selected.size(), occurring, image);
  for (const int label : wanted) {
    if (!selected.contains(label)) {
      throw Error("no voxel of the image has label " + std::to_string(label), where,
                  "its labels are " + occurring);
    }
  }
  if (merged.empty() && image.range) {
    throw Error(fmt::format("no voxel of the image has a value from {} to {}", shown(image.range->low),
                            shown(image.range->high)),
                where,
                fmt::format("its values go from {} to {}", shown(header.lowest), shown(header.highest)));
  }
  if (wanted.empty() && merged.empty()) fail_on_blank(where);
  if (wanted.empty() && !image.regions && merged.size() > 1) {
    notes.push_back(
        fmt::format("the labels {} are one tissue; for a tissue each write a [[material]] with "
                    "regions = [{}] and so on, to take some of them alone labels = [{}] under "
                    "[geometry]",
                    and_list(merged), merged.front(), merged.front()));
  }
}

/// The body of an answer: the voxels with one of the labels.
VoxelBody select(const Bytes& bytes, const ImageGeometry& image, std::vector<std::string>& notes) {
  const std::string where = image.file.string();
  std::span<const std::byte> rest = bytes;
  const std::vector<ImageHeader> headers = take_array<ImageHeader>(rest);
  std::vector<std::int32_t> labels = take_array<std::int32_t>(rest);
  if (headers.size() != 1) {
    fail_on_answer();
  }
  const ImageHeader& header = headers[0];
  VoxelBody body;
  body.size = header.size;
  body.spacing = Vec3(header.spacing[0], header.spacing[1], header.spacing[2]);
  body.origin = Vec3(header.origin[0], header.origin[1], header.origin[2]);
  if (labels.size() != body.voxels()) {
    fail_on_answer();
  }
  check_geometry(body, header.sheared, where);
  if (header.turned > least_turn)
    notes.push_back(fmt::format(
        "the image is turned by {:.1f} degrees in space; the body has the image's axes", header.turned));
  if (header.sheared > 0.0) {
    notes.push_back(
        fmt::format("the image is sheared by {:.1f} degrees, as with a tilted gantry, and so is the body",
                    header.sheared));
  }
  body.file_unit = header.unit;
  body.shear = Mat3::Map(header.shear.data());
  body.sheared_about = body.origin;

  const std::map<std::int32_t, std::uint8_t> selected = mark(labels, image.labels, body.inside);
  if (image.regions) {
    body.labels = std::move(labels);
    for (std::size_t v = 0; v < body.labels.size(); ++v) {
      body.labels[v] = body.inside[v] != 0 ? body.labels[v] : VoxelBody::no_label;
    }
  }
  check_selected(selected, header, image, notes);
  return body;
}

}  // namespace

VoxelBody read_labelled_image(const ImageGeometry& image, double edge_length,
                              std::vector<std::string>& notes) {
  const std::string where = image.file.string();
  constexpr const char* if_missing = "Check image = \"...\" in [geometry]";
  const FileDescriptor file(open_regular_file(image.file, O_RDONLY, if_missing), image.file);
  const ImageKind& kind = kind_of(image.file);
  const auto not_readable = [&] { return Error("this is not a readable image", where, complete_file); };
  const std::optional<std::int64_t> held = kind.check(file);
  if (!held) throw not_readable();
  const ChildTask task = {.name = "the image reader",
                          .where = where,
                          .limits = reading_limits(*held),
                          .hint = complete_file,
                          .files = {file.get()}};
  const ChildResult read = run_in_child(task, [&] { return kind.read(file, image.range); });
  if (read.status == not_scalar) throw Error("the image has several values per voxel", where, complete_file);
  if (read.status != read_ok) throw not_readable();
  const VoxelBody whole = select(read.bytes, image, notes);
  VoxelBody body = crop(whole, 2);
  if (edge_length * voxels_per_edge < body.spacing.minCoeff()) {
    throw Error(
        fmt::format("edge_length is {} of the image's units, its voxels are {} x {} x {}", shown(edge_length),
                    shown(body.spacing[0]), shown(body.spacing[1]), shown(body.spacing[2])),
        where,
        "an image says nothing about lengths below its voxels: use a larger edge_length in [mesh], or "
        "check scale in [geometry]");
  }
  keep_one_part(body, where, notes);
  if (const std::size_t filled = join_across_edges(body); filled != 0) {
    notes.push_back("filled " + std::to_string(filled) +
                    " voxel(s) of the image where voxels touched along an edge only");
  }
  if (image.regions) {
    const double element = std::pow(edge_length, 3) / (6.0 * std::sqrt(2.0));
    complete_labels(body, std::max(static_cast<std::size_t>(element / body.spacing.prod()), smallest_speck),
                    notes);
  }
  return body;
}

}  // namespace palpate
