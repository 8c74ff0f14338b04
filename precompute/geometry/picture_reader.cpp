#include "precompute/geometry/picture_reader.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <string_view>

#include "base/child_process.h"
#include "base/error.h"
#include "base/regular_file.h"
#include "precompute/machine/check_room.h"

namespace palpate {
namespace {

constexpr std::uint64_t max_pixels = 100'000'000;
constexpr double bytes_per_pixel = 16.0;  // of memory until the outlines are traced
constexpr unsigned char first_white = 128;
constexpr std::string_view png_signature = "\x89PNG\r\n\x1a\n";
const char* const save_again = "save the picture again as PNG, or as PBM (P1, P4)";

/// Throws Error for a picture that is empty or too large.
void check_pixels(std::uint64_t width, std::uint64_t height, const std::string& where) {
  if (width == 0 || height == 0) {
    throw Error(fmt::format("the picture has {} x {} pixels", width, height), where, save_again);
  }
  if (width > max_pixels || height > max_pixels / width) {
    throw Error(fmt::format("the picture of {} x {} pixels is larger than {} million pixels", width, height,
                            max_pixels / 1'000'000),
                where, "scale it down; the mesh does not follow single pixels anyway");
  }
  check_room(bytes_per_pixel * static_cast<double>(width * height),
             fmt::format("a picture of {} x {} pixels", width, height), where, "scale it down");
}

/// A body without pixels inside.
PixelBody blank(std::uint64_t width, std::uint64_t height) {
  PixelBody body{static_cast<Index>(width), static_cast<Index>(height), {}};
  body.inside.resize(width * height);
  return body;
}

/// libpng's picture, freed by the destructor.
struct PngImage {
  png_image image{};

  PngImage() { image.version = PNG_IMAGE_VERSION; }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
  ~PngImage() { png_image_free(&image); }
};

/// Reads a PNG; transparent pixels lie over background.
PixelBody read_png(const std::string& bytes, bool dark, const std::string& where) {
  PngImage png;
  const auto check = [&](int is_good) {
    if (is_good == 0) {
      throw Error(std::string("this PNG cannot be read: ") + static_cast<const char*>(png.image.message),
                  where, save_again);
    }
  };
  check(png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()));
  PixelBody body = blank(png.image.width, png.image.height);
  png.image.format = PNG_FORMAT_GRAY;
  const png_color black{0, 0, 0}, white{255, 255, 255};
  const auto upwards = -static_cast<png_int_32>(body.width);  // the first row in memory is the lowest
  check(png_image_finish_read(&png.image, dark ? &white : &black, body.inside.data(), upwards, nullptr));
  for (std::uint8_t& pixel : body.inside) pixel = (pixel >= first_white) != dark ? 1 : 0;
  if (std::ranges::find(body.inside, 1) == body.inside.end()) fail_on_no_body(where);
  return body;
}

/// Number in the four bytes of a PNG from `at` on.
std::uint32_t png_number(const std::string& bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (const char byte : bytes.substr(at, 4)) number = number << 8 | static_cast<unsigned char>(byte);
  return number;
}

/// Reads a PNG in a child, as libpng is third-party code. Its size is checked before, since the child cannot
/// see the available memory.
PixelBody read_png_in_child(const std::string& bytes, bool dark, const std::string& where) {
  constexpr std::size_t width_at = 16, height_at = 20, header_ends = 24;  // libpng refuses less
  if (bytes.size() >= header_ends)
    check_pixels(png_number(bytes, width_at), png_number(bytes, height_at), where);
  const ChildTask task = {.name = "libpng",
                          .where = where,
                          .limits = reading_limits(static_cast<std::int64_t>(bytes.size())),
                          .hint = save_again};
  const ChildResult result = run_in_child(task, [&] {
    const PixelBody body = read_png(bytes, dark, where);
    ChildResult answer;
    append_array(answer.bytes, std::span<const Index>(std::array{body.width, body.height}));
    append_array(answer.bytes, std::span(body.inside));
    return answer;
  });
  std::span<const std::byte> rest = result.bytes;
  const std::vector<Index> size = take_array<Index>(rest);
  if (size.size() != 2) {
    fail_on_answer();
  }
  PixelBody body{size[0], size[1], take_array<std::uint8_t>(rest)};
  if (body.inside.size() != static_cast<std::size_t>(body.width) * static_cast<std::size_t>(body.height)) {
    fail_on_answer();
  }
  return body;
}

/// Reader of a PBM file from its front.
class PbmReader {
 public:
  PbmReader(std::string_view text, const std::string& where) : text_(text), where_(where) {
    text_.remove_prefix(2);  // P1, P4
  }

  PixelBody plain() {
    PixelBody body = header();
    for_each_row(body, [&](Index j) {
      for (Index i = 0; i < body.width; ++i) {
        skip_blanks();
        if (text_.empty()) {
          ends_early(body, i, j);
        }
        if (text_[0] != '0' && text_[0] != '1') {
          throw Error(fmt::format("this PBM has neither 0 nor 1 for the pixel of column {}, row {}", i,
                                  body.height - 1 - j),
                      where_, save_again);
        }
        body.inside[body.at(i, j)] = text_[0] == '0' ? 1 : 0;
        text_.remove_prefix(1);
      }
    });
    return body;
  }

  PixelBody raw() {
    PixelBody body = header();
    text_.remove_prefix(std::min<std::size_t>(text_.size(), 1));  // the one blank after the header
    const auto row_bytes = static_cast<std::size_t>(body.width + 7) / 8;
    for_each_row(body, [&](Index j) {
      if (text_.size() < row_bytes) {
        ends_early(body, 0, j);
      }
      for (Index i = 0; i < body.width; ++i) {
        const auto byte = static_cast<unsigned char>(text_[static_cast<std::size_t>(i) / 8]);
        body.inside[body.at(i, j)] = (byte >> (7 - i % 8) & 1) == 0 ? 1 : 0;
      }
      text_.remove_prefix(row_bytes);
    });
    return body;
  }

 private:
  /// Skips blanks, and comments from # to the end of their line.
  void skip_blanks() {
    while (!text_.empty() && (std::string_view(" \t\r\n\v\f#").find(text_[0]) != std::string_view::npos)) {
      const std::size_t end = text_[0] == '#' ? std::min(text_.find('\n'), text_.size() - 1) : 0;
      text_.remove_prefix(end + 1);
    }
  }

  std::uint64_t number() {
    skip_blanks();
    std::uint64_t value = 0;
    const auto [end, status] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (status != std::errc()) {
      throw Error("this PBM does not begin with its width and height", where_, save_again);
    }
    text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
    return value;
  }

  PixelBody header() {
    const std::uint64_t width = number();
    const std::uint64_t height = number();
    check_pixels(width, height, where_);
    return blank(width, height);
  }

  template <typename ReadRow>
  static void for_each_row(const PixelBody& body, const ReadRow& read_row) {
    for (Index j = body.height; j-- > 0;) {
      read_row(j);
    }
  }

  [[noreturn]] void ends_early(const PixelBody& body, Index i, Index j) const {
    throw Error(fmt::format("this PBM of {} x {} pixels ends before column {}, row {}", body.width,
                            body.height, i, body.height - 1 - j),
                where_, "get the whole file, or " + std::string(save_again));
  }

  std::string_view text_;
  const std::string& where_;
};

/// The body of a PBM: the paper or, if `dark`, the ink.
PixelBody with_ground(PixelBody body, bool dark) {
  if (dark)
    for (std::uint8_t& pixel : body.inside) pixel = pixel == 0 ? 1 : 0;
  return body;
}

}  // namespace

PixelBody read_picture(const PictureGeometry& picture) {
  const std::string where = picture.file.string();
  const std::string bytes = read_all(picture.file, "Check the path, or picture = \"...\" in [geometry]");
  if (bytes.starts_with(png_signature)) {
    return read_png_in_child(bytes, picture.dark, where);
  }
  if (bytes.starts_with("P1")) {
    return with_ground(PbmReader(bytes, where).plain(), picture.dark);
  }
  if (bytes.starts_with("P4")) {
    return with_ground(PbmReader(bytes, where).raw(), picture.dark);
  }
  throw Error("this is neither a PNG nor a PBM picture", where, save_again);
}

}  // namespace palpate
