#include "precompute/geometry/pixel_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.h"

namespace palpate {
namespace {

constexpr double small_part = 0.01;        // of the largest part
constexpr std::size_t largest_filled = 4;  // pixels; larger holes may be intended
constexpr std::size_t listed_bodies = 5;

using Pixel = std::array<Index, 2>;

/// A group of pixels connected through sides that are all body or all background.
struct Part {
  bool is_body = false;
  bool is_at_rim = false;
  std::size_t pixels = 0;
  Pixel first{};  ///< one of its pixels
};

/// Numbers the pixels connected with `first`.
Part fill_part(const PixelBody& body, const Pixel& first, Index number, std::vector<Index>& part_of) {
  Part part{body.is_body(first[0], first[1]), false, 0, first};
  part_of[body.at(first[0], first[1])] = number;
  std::vector<Pixel> front{first};
  while (!front.empty()) {
    const auto [x, y] = front.back();
    front.pop_back();
    ++part.pixels;
    for (const Pixel next : {Pixel{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}}) {
      if (next[0] < 0 || next[1] < 0 || next[0] >= body.width || next[1] >= body.height) {
        part.is_at_rim = true;
        continue;
      }
      Index& next_part = part_of[body.at(next[0], next[1])];
      if (next_part < 0 && body.is_body(next[0], next[1]) == part.is_body) {
        next_part = number;
        front.push_back(next);
      }
    }
  }
  return part;
}

/// Numbers the parts; `part_of` gets the part of each pixel.
std::vector<Part> find_parts(const PixelBody& body, std::vector<Index>& part_of) {
  std::vector<Part> parts;
  part_of.assign(body.inside.size(), -1);
  for (Index j = 0; j < body.height; ++j) {
    for (Index i = 0; i < body.width; ++i) {
      if (part_of[body.at(i, j)] < 0)
        parts.push_back(fill_part(body, {i, j}, static_cast<Index>(parts.size()), part_of));
    }
  }
  return parts;
}

/// Position of a pixel as picture viewers count.
std::string shown(const PixelBody& body, const Pixel& pixel) {
  return fmt::format("column {}, row {}", pixel[0], body.height - 1 - pixel[1]);
}

/// Switches the pixels of some parts between body and background; returns how many.
std::size_t turn(PixelBody& body, const std::vector<Index>& part_of, const std::vector<bool>& turned) {
  std::size_t count = 0;
  for (std::size_t p = 0; p < body.inside.size(); ++p) {
    if (turned[static_cast<std::size_t>(part_of[p])]) {
      body.inside[p] ^= 1;
      ++count;
    }
  }
  return count;
}

/// True if, of the four pixels from (i, j) on, exactly the two on a diagonal are body.
bool touches_at_corner(const PixelBody& body, Index i, Index j) {
  const bool here = body.is_body(i, j), right = body.is_body(i + 1, j);
  return here != right && here == body.is_body(i + 1, j + 1) && right == body.is_body(i, j + 1);
}

/// Calls `visit` for the lower left pixel of each square of four.
template <typename Visit>
void for_each_square(const PixelBody& body, const Visit& visit) {
  for (Index j = 0; j + 1 < body.height; ++j) {
    for (Index i = 0; i + 1 < body.width; ++i) {
      visit(i, j);
    }
  }
}

/// Throws Error for several bodies; touching ones are reported first.
[[noreturn]] void refuse_bodies(const PixelBody& body, const std::vector<Index>& part_of,
                                const std::vector<Part>& bodies, const std::string& where) {
  for_each_square(body, [&](Index i, Index j) {
    const Index across = body.is_body(i, j) ? 0 : 1;
    if (touches_at_corner(body, i, j) &&
        part_of[body.at(i + across, j)] != part_of[body.at(i + 1 - across, j + 1)]) {
      throw Error(
          "touching bodies: two bodies of the picture meet at a corner only, at " + shown(body, {i, j}),
          where, "join them there by painting one more pixel, or paint one of them black");
    }
  });
  std::string list;
  for (std::size_t b = 0; b < std::min(bodies.size(), listed_bodies); ++b) {
    list += fmt::format("{}one of {} pixels at {}", b == 0 ? "" : "; ", bodies[b].pixels,
                        shown(body, bodies[b].first));
  }
  throw Error(fmt::format("the picture has {} bodies: {}{}", bodies.size(), list,
                          bodies.size() > listed_bodies ? "; ..." : ""),
              where, "keep one and paint over the others (rows and columns count from the top left, from 0)");
}

void drop_small_parts(PixelBody& body, const std::string& where, std::vector<std::string>& notes) {
  std::vector<Index> part_of;
  const std::vector<Part> parts = find_parts(body, part_of);
  std::size_t largest = 0;
  for (const Part& part : parts) {
    largest = std::max(largest, part.is_body ? part.pixels : 0);
  }
  if (largest == 0) fail_on_no_body(where);
  std::vector<Part> bodies;
  std::vector<bool> is_small(parts.size());
  for (std::size_t p = 0; p < parts.size(); ++p) {
    is_small[p] =
        parts[p].is_body && static_cast<double>(parts[p].pixels) < small_part * static_cast<double>(largest);
    if (parts[p].is_body && !is_small[p]) {
      bodies.push_back(parts[p]);
    }
  }
  const auto dropped = std::count(is_small.begin(), is_small.end(), true);
  const std::size_t pixels = turn(body, part_of, is_small);
  if (bodies.size() > 1) {
    refuse_bodies(body, part_of, bodies, where);
  }
  if (dropped != 0) {
    notes.push_back(
        fmt::format("dropped {} stray part(s) of the picture, together {} pixel(s)", dropped, pixels));
  }
}

/// Fills one of the two empty pixels wherever the body touches itself at a corner only.
void join_across_corners(PixelBody& body, std::vector<std::string>& notes) {
  std::size_t filled = 0;
  for (std::size_t before = 1; before != filled;) {  // a filled pixel may touch another one
    before = filled;
    for_each_square(body, [&](Index i, Index j) {
      if (touches_at_corner(body, i, j)) {
        body.inside[body.is_body(i, j) ? body.at(i + 1, j) : body.at(i, j)] = 1;
        ++filled;
      }
    });
  }
  if (filled != 0) {
    notes.push_back(
        fmt::format("filled {} pixel(s) of the picture where the body touched itself at a corner", filled));
  }
}

void fill_small_holes(PixelBody& body, std::vector<std::string>& notes) {
  std::vector<Index> part_of;
  const std::vector<Part> parts = find_parts(body, part_of);
  std::vector<bool> is_small(parts.size());
  std::transform(parts.begin(), parts.end(), is_small.begin(), [](const Part& part) {
    return !part.is_body && !part.is_at_rim && part.pixels <= largest_filled;
  });
  const auto holes = std::count(is_small.begin(), is_small.end(), true);
  if (const std::size_t pixels = turn(body, part_of, is_small); pixels != 0) {
    notes.push_back(
        fmt::format("filled {} hole(s) of the picture's body, together {} pixel(s)", holes, pixels));
  }
}

constexpr std::uint8_t no_step = 4;

std::size_t corner_at(const PixelBody& body, const LatticePoint& p) {
  return static_cast<std::size_t>(p[0]) +
         static_cast<std::size_t>(body.width + 1) * static_cast<std::size_t>(p[1]);
}

/// Direction (0 to 3: right, up, left, down) of the outline that leaves each corner of pixels with the body
/// on its left: at most one, as no corner touches another.
std::vector<std::uint8_t> steps_along_outlines(const PixelBody& body) {
  std::vector<std::uint8_t> onward(corner_at(body, {0, body.height + 1}), no_step);
  for (Index j = 0; j < body.height; ++j) {
    for (Index i = 0; i < body.width; ++i) {
      if (!body.is_body(i, j)) {
        continue;
      }
      if (!body.is_body(i, j - 1)) onward[corner_at(body, {i, j})] = 0;
      if (!body.is_body(i + 1, j)) onward[corner_at(body, {i + 1, j})] = 1;
      if (!body.is_body(i, j + 1)) onward[corner_at(body, {i + 1, j + 1})] = 2;
      if (!body.is_body(i - 1, j)) onward[corner_at(body, {i, j + 1})] = 3;
    }
  }
  return onward;
}

}  // namespace

void fail_on_no_body(const std::string& where) {
  throw Error("the picture has no body: all its pixels are black, or white where dark is true", where,
              "paint the body white on black, or black on white; a pixel is black when its grey value is "
              "below 128");
}

void keep_one_body(PixelBody& body, const std::string& where, std::vector<std::string>& notes) {
  drop_small_parts(body, where, notes);
  join_across_corners(body, notes);
  fill_small_holes(body, notes);
}

std::vector<std::vector<LatticePoint>> trace_outlines(const PixelBody& body) {
  constexpr std::array<LatticePoint, 4> step = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
  std::vector<std::uint8_t> onward = steps_along_outlines(body);
  const auto next = [&](const LatticePoint& p) -> std::uint8_t& { return onward[corner_at(body, p)]; };
  std::vector<std::vector<LatticePoint>> lines;  // the outer one has the lowest point, so it comes first
  for (Index y = 0; y <= body.height; ++y) {
    for (Index x = 0; x <= body.width; ++x) {
      if (next({x, y}) == no_step) {
        continue;
      }
      lines.emplace_back();
      for (LatticePoint p = {x, y}; next(p) != no_step;) {
        lines.back().push_back(p);
        const LatticePoint& d = step[std::exchange(next(p), no_step)];
        p = {p[0] + d[0], p[1] + d[1]};
      }
    }
  }
  return lines;
}

}  // namespace palpate
