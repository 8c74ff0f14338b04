#include "precompute/surfaces/polygon_soup.h"

#include <CGAL/IO/OBJ.h>
#include <CGAL/IO/OFF.h>
#include <CGAL/IO/PLY.h>
#include <CGAL/IO/STL.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>

#include "base/error.h"

namespace palpate {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Point = PolygonSoup::Point;
using Polygon = PolygonSoup::Polygon;

constexpr double largest_coordinate = 1e30;

/// What CGAL's readers leave to others.
void check_soup(const PolygonSoup& soup, const std::string& where) {
  for (const Point& p : soup.points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(p[axis]) <= largest_coordinate)) {
        throw Error("a coordinate is not a finite number or beyond all measure: " + shown(p), where,
                    "export the surface again");
      }
    }
  }
  for (std::size_t i = 0; i < soup.polygons.size(); ++i) {
    for (const std::size_t corner : soup.polygons[i]) {
      if (corner >= soup.points.size()) {
        throw Error("polygon " + std::to_string(i + 1) + " of " + std::to_string(soup.polygons.size()) +
                        " has a corner that is none of the file's " + std::to_string(soup.points.size()) +
                        " points",
                    where, "the file is damaged: export the surface again");
      }
    }
  }
}

/// CGAL's reader of OBJ stops at a number that it cannot hold, and takes the corners before it for all.
void check_obj_numbers(std::string_view text, const std::string& where) {
  constexpr std::string_view blanks = " \t\r\v\f";
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
    if (!line.starts_with('f') || line.find_first_of(blanks) != 1) continue;
    while (!line.empty()) {
      line.remove_prefix(std::min(line.find_first_of(blanks), line.size()));
      line.remove_prefix(std::min(line.find_first_not_of(blanks), line.size()));
      int corner = 0;
      if (std::from_chars(line.data(), line.data() + line.size(), corner).ec ==
          std::errc::result_out_of_range)
        throw Error("line " + std::to_string(line_number) + ": a face has the corner " +
                        std::string(line.substr(0, std::min<std::size_t>(line.find_first_of(blanks), 24))) +
                        ", which is none of the file's points",
                    where, "the file is damaged: export the surface again");
    }
  }
}

/// As the file's name ends, in small letters.
std::string extension_of(const std::filesystem::path& file) {
  std::string text = file.extension().string();
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// False where CGAL's reader says so.
bool read_by_cgal(const std::string& bytes, const std::string& extension, PolygonSoup& soup) {
  namespace io = CGAL::IO;
  const auto quietly = CGAL::parameters::verbose(false);
  const auto attempt = [&](io::Mode mode) {
    soup = {};
    std::istringstream in(bytes);
    io::set_mode(in, mode);
    if (extension == ".obj") return io::read_OBJ(in, soup.points, soup.polygons, quietly);
    if (extension == ".off") return io::read_OFF(in, soup.points, soup.polygons, quietly);
    if (extension == ".ply") return io::read_PLY(in, soup.points, soup.polygons, quietly);
    return extension == ".stl" && io::read_STL(in, soup.points, soup.polygons, quietly);
  };
  const bool may_be_binary = extension == ".ply" || extension == ".stl";
  return attempt(may_be_binary ? io::BINARY : io::ASCII) || (extension == ".stl" && attempt(io::ASCII));
}

}  // namespace

std::string shown(const Point& p) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << "(" << p.x() << ", " << p.y() << ", " << p.z() << ")";
  return text.str();
}

PolygonSoup read_polygon_soup(const std::string& bytes, const std::filesystem::path& file) {
  const std::string where = file.string(), extension = extension_of(file);
  if (extension == ".obj") check_obj_numbers(bytes, where);
  PolygonSoup soup;
  bool read = false;
  try {
    read = read_by_cgal(bytes, extension, soup);
  } catch (const std::exception&) {
    read = false;
  }
  if (!read || soup.polygons.empty()) {
    throw Error("cannot read a surface from this file", where,
                "it must be a complete .off, .obj, .stl or .ply with triangles or polygons");
  }
  check_soup(soup, where);
  return soup;
}

std::size_t weld(PolygonSoup& soup) {
  PMP::merge_duplicate_points_in_polygon_soup(soup.points, soup.polygons);
  for (Polygon& polygon : soup.polygons) {
    polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
    while (polygon.size() > 1 && polygon.front() == polygon.back()) {
      polygon.pop_back();
    }
  }
  const std::size_t dropped =
      std::erase_if(soup.polygons, [](const Polygon& polygon) { return polygon.size() < 3; });
  PMP::remove_isolated_points_in_polygon_soup(soup.points, soup.polygons);
  return dropped;
}

}  // namespace palpate
