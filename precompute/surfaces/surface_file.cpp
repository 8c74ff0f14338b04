#include "precompute/surfaces/surface_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "meshes/readers/text_reader.h"

namespace palpate {
namespace {

using Polygon = PolygonSoup::Polygon;

constexpr double largest_coordinate = 1e30;
constexpr const char* export_again = "the file is damaged or cut short: export the surface again";

std::string in_small_letters(std::string_view word) {
  std::string text(word);
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

void add_point(PolygonSoup& soup, const Vec3& x) {
  soup.points.emplace_back(x[0], x[1], x[2]);
}

/// Checks that apply to any format.
void check_soup(const PolygonSoup& soup, const std::string& where) {
  for (const PolygonSoup::Point& p : soup.points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::abs(p[axis]) <= largest_coordinate)) {
        throw Error(
            fmt::format(
                "point {} of {} has a coordinate that is not a finite number or beyond all measure: {}",
                &p - soup.points.data() + 1, soup.points.size(), shown(p)),
            where, "export the surface again");
      }
    }
  }
  for (const Polygon& polygon : soup.polygons) {
    if (std::ranges::any_of(polygon, [&](std::size_t corner) { return corner >= soup.points.size(); })) {
      throw Error(fmt::format("polygon {} of {} has a corner that is none of the file's {} points",
                              &polygon - soup.polygons.data() + 1, soup.polygons.size(), soup.points.size()),
                  where, export_again);
    }
  }
  if (soup.polygons.empty())
    throw Error("cannot read a surface from this file: it has no polygons", where,
                "it must be a complete .off, .obj, .stl or .ply with triangles or polygons");
}

/// Reads OFF. A word before the first number has letters for the data that follow each point.
void read_off(TextReader& in, PolygonSoup& soup) {
  const std::string head(in.peek());
  if (const std::size_t off = in_small_letters(head).find("off"); off != std::string::npos) {
    if (head.find('4') < off || head.find("nOFF") < off)
      in.fail("'" + head + "' has points of other than three coordinates", "export the surface again");
    in.skip_letters(off + 3);
    if (in_small_letters(in.peek()) == "binary")
      in.fail("the file is a binary OFF; only text is read", "save it as text, or as STL or PLY");
  }
  const std::int64_t points = in.count("the number of points", 3), faces = in.count("the number of faces", 4);
  in.rest_of_line();  // the number of edges, which some files omit
  for (std::int64_t i = 0; i < points; ++i) {
    add_point(soup, in.point());
    in.rest_of_line();
  }
  for (std::int64_t i = 0; i < faces; ++i) {
    const std::int64_t corners = in.integer("the number of a face's corners", 0, points);
    Polygon& polygon = soup.polygons.emplace_back();
    for (std::int64_t k = 0; k < corners; ++k)
      polygon.push_back(static_cast<std::size_t>(in.integer("the number of a corner", 0, points - 1)));
    in.rest_of_line();
  }
  if (!in.at_end()) in.fail("the file goes on after the last of its faces", export_again);
}

/// A corner of an OBJ face: "7", "7/1", "7//2", counted from 1, or from the last point down from -1. Points
/// may follow: whether all corners are points is checked at the end.
std::size_t obj_corner(TextReader& in, std::size_t points) {
  const std::string_view word = in.word("the number of a corner");
  const std::string_view digits = word.substr(0, word.find('/'));
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error == std::errc::invalid_argument || end != digits.data() + digits.size())
    in.fail_on(word, "the number of a corner");
  const auto count = static_cast<std::int64_t>(points);
  if (error != std::errc() || number == 0 || number < -count || number > std::numeric_limits<Index>::max()) {
    in.fail(fmt::format("a face has the corner {}, which is none of the {} points before it",
                        digits.substr(0, 24), count),
            export_again);
  }
  return static_cast<std::size_t>(number > 0 ? number - 1 : count + number);
}

void read_obj(TextReader& in, PolygonSoup& soup) {
  std::map<std::string, std::set<std::string>, std::less<>> names = {{"g", {}}, {"o", {}}, {"usemtl", {}}};
  std::map<std::string, std::string> begun;  // since the last face
  while (!in.at_end()) {
    const std::string_view key = in.word("a keyword");
    if (key == "v") {
      add_point(soup, in.point());
    } else if (key == "f") {
      Polygon& polygon = soup.polygons.emplace_back();
      while (in.on_line()) polygon.push_back(obj_corner(in, soup.points.size()));
      for (const auto& [kind, name] : begun) names[kind].insert(name);
      begun.clear();
    } else if (names.contains(key)) {
      begun[std::string(key)] = in.on_line() ? in.word("a name") : "";
    }
    in.rest_of_line();
  }
  for (const auto& [kind, many] :
       {std::pair("o", "objects"), std::pair("g", "groups"), std::pair("usemtl", "materials")}) {
    if (names[kind].size() > 1)
      soup.remarks.push_back(fmt::format(
          "the file has {} {}, which are not told apart: all of it is one body", names[kind].size(), many));
  }
}

/// Passes over the name of a solid, and in files of one line over all up to the first facet.
void pass_name_of_solid(TextReader& in) {
  while (in.on_line())
    if (in_small_letters(in.word("a name")) == "facet" && in_small_letters(in.peek()) == "normal") return;
}

/// Reads ASCII STL; words outside facets are names and normals.
void read_ascii_stl(TextReader& in, PolygonSoup& soup) {
  Polygon corners;
  bool ended = false;
  while (!in.at_end()) {
    std::string key = in_small_letters(in.word("a keyword"));
    if (key == "end") key += in_small_letters(in.word("facet, loop or solid"));
    if (key == "solid" || key == "endsolid") {
      ended = key == "endsolid";
      pass_name_of_solid(in);
    } else if (key == "vertex") {
      corners.push_back(soup.points.size());
      add_point(soup, in.point());
    } else if (key == "endfacet" || key == "facet") {
      if (key == "facet" ? !corners.empty() : corners.size() != 3)
        in.fail(fmt::format("a facet has {} corners", corners.size()), export_again);
      if (!corners.empty()) soup.polygons.push_back(std::exchange(corners, {}));
      ended = false;
    }
  }
  if (!soup.polygons.empty() && !ended) in.fail("the file ends without endsolid", export_again);
}

template <class T>
double decoded(const char* bytes, bool swap) {
  std::array<char, sizeof(T)> raw;
  std::copy_n(bytes, sizeof(T), raw.begin());
  if (swap) std::ranges::reverse(raw);
  return static_cast<double>(std::bit_cast<T>(raw));
}

void read_binary_stl(const std::string& bytes, const std::string& where, PolygonSoup& soup) {
  constexpr std::size_t header = 80, facet = 50;
  const std::size_t start = header + sizeof(std::uint32_t);
  const auto count = static_cast<std::size_t>(decoded<std::uint32_t>(bytes.data() + header, false));
  const std::size_t room = (bytes.size() - start) / facet;
  if (room != count) {
    throw Error(
        fmt::format("the header of this binary STL tells of {} facets, and the file holds {}", count, room),
        where, export_again);
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const char* const at = bytes.data() + start + facet * i + 12 * (corner + 1);  // behind the normal
      add_point(soup,
                {decoded<float>(at, false), decoded<float>(at + 4, false), decoded<float>(at + 8, false)});
    }
    soup.polygons.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
}

/// A type of numbers in PLY.
struct PlyType {
  std::array<std::string_view, 2> names;
  std::size_t bytes;
  double (*decode)(const char*, bool);
};

constexpr std::array<PlyType, 10> ply_types = {{{{"char", "int8"}, 1, decoded<std::int8_t>},
                                                {{"uchar", "uint8"}, 1, decoded<std::uint8_t>},
                                                {{"short", "int16"}, 2, decoded<std::int16_t>},
                                                {{"ushort", "uint16"}, 2, decoded<std::uint16_t>},
                                                {{"int", "int32"}, 4, decoded<std::int32_t>},
                                                {{"uint", "uint32"}, 4, decoded<std::uint32_t>},
                                                {{"long", "int64"}, 8, decoded<std::int64_t>},
                                                {{"ulong", "uint64"}, 8, decoded<std::uint64_t>},
                                                {{"float", "float32"}, 4, decoded<float>},
                                                {{"double", "float64"}, 8, decoded<double>}}};

struct PlyProperty {
  std::string name;
  const PlyType* type = nullptr;
  const PlyType* count = nullptr;  // of a list
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

/// Reader of a PLY file: the header's elements in order, and then their values.
class PlyReader {
 public:
  PlyReader(const std::string& bytes, const std::filesystem::path& file)
      : bytes_(bytes), where_(file.string()), text_(file, bytes, '\0') {}

  void read(PolygonSoup& soup) {
    read_header();
    for (const PlyElement& element : elements_) {
      if (element.properties.empty()) continue;
      element_ = &element;
      for (number_ = 0; number_ < element.count; ++number_) {
        read_element(soup);
        if (is_ascii() && text_.on_line())
          text_.fail("more values stand on the line than the header tells of", export_again);
      }
    }
  }

 private:
  [[nodiscard]] bool is_ascii() const { return format_ == "ascii"; }

  const PlyType* type() {
    const std::string_view word = text_.word("a type");
    for (const PlyType& type : ply_types)
      if (word == type.names[0] || word == type.names[1]) return &type;
    text_.fail_on(word, "a type of PLY, such as float,");
  }

  void read_header() {
    text_.expect("ply");
    while (true) {
      const std::string_view key = text_.word("a line of the header");
      if (key == "format") {
        format_ = text_.word("ascii, binary_little_endian or binary_big_endian");
        if (format_ != "ascii" && format_ != "binary_little_endian" && format_ != "binary_big_endian")
          text_.fail_on(format_, "ascii, binary_little_endian or binary_big_endian");
      } else if (key == "element") {
        PlyElement& element = elements_.emplace_back();
        element.name = text_.word("a name");
        element.count = text_.integer("the number of elements", 0, std::ssize(bytes_));
      } else if (key == "property") {
        if (elements_.empty()) text_.fail("a property of no element", export_again);
        PlyProperty& property = elements_.back().properties.emplace_back();
        if (text_.peek() == "list") {
          text_.word("list");
          property.count = type();
        }
        property.type = type();
        property.name = text_.word("a name");
      } else if (key == "end_header") {
        break;
      } else if (key != "comment" && key != "obj_info") {
        text_.fail_on(key, "a line of a PLY header");
      }
      text_.rest_of_line();
    }
    if (format_.empty()) text_.fail("the header has no format", export_again);
    find_body();
  }

  /// Finds the values, which begin after the first line that is end_header. If lines end with \r alone, a
  /// body may begin with \n.
  void find_body() {
    constexpr std::string_view mark = "end_header";
    const auto is_end = [](char c) { return c == '\n' || c == '\r'; };
    do position_ = bytes_.find(mark, position_ + 1);
    while (position_ != std::string::npos && !is_end(bytes_[position_ - 1]));
    position_ = bytes_.find_first_of("\r\n", position_);
    if (position_ == std::string::npos) return;  // then there are no values
    position_ += bytes_.compare(bytes_.find_first_of("\r\n"), 2, "\r\n") == 0 ? 2 : 1;
  }

  const char* take(const PlyType& type) {
    if (type.bytes > bytes_.size() - std::min(position_, bytes_.size()))
      throw Error(fmt::format("the file ends in {} {} of {}", element_->name, number_ + 1, element_->count),
                  where_, export_again);
    const char* const at = bytes_.data() + position_;
    position_ += type.bytes;
    return at;
  }

  double value(const PlyType& type) {
    return is_ascii() ? text_.number("a number") : type.decode(take(type), format_ == "binary_big_endian");
  }

  void skip(const PlyType& type) {
    if (is_ascii())
      text_.word("a number");
    else
      take(type);
  }

  /// Reads a value that must be a whole number.
  std::int64_t integer(const PlyType& type) {
    constexpr double largest = 9e15;  // below 2^53: exact
    const double number = value(type);
    if (std::abs(number) <= largest && number == std::floor(number)) return static_cast<std::int64_t>(number);
    throw Error(fmt::format("{} {} of {} has {} where a whole number should be", element_->name, number_ + 1,
                            element_->count, number),
                where_, export_again);
  }

  void read_element(PolygonSoup& soup) {
    const bool is_vertex = element_->name == "vertex";
    Vec3 x = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
    for (const PlyProperty& property : element_->properties) {
      if (property.count != nullptr) {
        read_list(property, soup);
      } else {
        if (is_vertex && (property.name == "x" || property.name == "y" || property.name == "z"))
          x[property.name[0] - 'x'] = value(*property.type);
        else
          skip(*property.type);
      }
    }
    if (is_vertex) add_point(soup, x);
  }

  void read_list(const PlyProperty& property, PolygonSoup& soup) {
    const bool corners = property.name == "vertex_indices" || property.name == "vertex_index";
    const std::int64_t size = integer(*property.count);
    std::vector<std::size_t> list;
    for (std::int64_t i = 0; i < size; ++i) {
      if (corners)
        list.push_back(static_cast<std::size_t>(integer(*property.type)));
      else
        skip(*property.type);
    }
    if (!corners) return;
    if (element_->name == "tristrips") {
      add_strips(list, soup);
    } else if (element_->name == "face") {
      soup.polygons.push_back(std::move(list));
    }
  }

  /// Adds strips of triangles, every other one of which is reversed; -1 ends a strip.
  static void add_strips(const std::vector<std::size_t>& list, PolygonSoup& soup) {
    constexpr auto end = static_cast<std::size_t>(-1);
    std::size_t begin = 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i] == end) begin = i + 1;
      if (i < begin + 2) continue;
      const bool is_odd = (i - begin) % 2 != 0;
      soup.polygons.push_back({list[is_odd ? i - 1 : i - 2], list[is_odd ? i - 2 : i - 1], list[i]});
    }
  }

  const std::string& bytes_;
  std::string where_;
  TextReader text_;
  std::size_t position_ = 0;
  std::string format_;
  std::vector<PlyElement> elements_;
  const PlyElement* element_ = nullptr;  // being read
  std::int64_t number_ = 0;              // of it
};

void read_by_name(const std::string& bytes, const std::filesystem::path& file, PolygonSoup& soup) {
  const std::string extension = in_small_letters(file.extension().string());
  // The facet count of a binary STL has a zero byte, which text has not.
  if (extension == ".stl" && bytes.size() >= 84 && bytes.find('\0', 80) < 84)
    return read_binary_stl(bytes, file.string(), soup);
  if (extension == ".ply") return PlyReader(bytes, file).read(soup);
  if (extension != ".off" && extension != ".obj" && extension != ".stl") return;
  TextReader in(file, bytes, extension == ".stl" ? '\0' : '#');
  (extension == ".off" ? read_off : extension == ".obj" ? read_obj : read_ascii_stl)(in, soup);
}

}  // namespace

PolygonSoup read_polygon_soup(const std::string& bytes, const std::filesystem::path& file) {
  PolygonSoup soup;
  read_by_name(bytes, file, soup);
  check_soup(soup, file.string());
  return soup;
}

}  // namespace palpate
