// Triangles from black-and-white pictures.
#include "precompute/geometry/picture.h"

#include <gtest/gtest.h>
#include <png.h>

#include <functional>
#include <random>

#include "precompute/geometry/picture_reader.h"
#include "precompute/geometry/pixel_body.h"
#include "tests/support/bodies/geometry_plane.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::picture_test {
namespace {

using testing::area;
using testing::edge_lengths;
using testing::edges_of;
using testing::error_of;
using testing::expect_mentions;
using testing::expect_plane_mesh;
using testing::least;
using testing::mean;
using testing::PlaneEdge;
using testing::smallest_angles;
using testing::TempFolder;

using Bytes = std::string;

/// A PNG file of 8 bits a channel, the first row on top.
Bytes png(int width, int height, int format, const Bytes& channels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = static_cast<png_uint_32>(format);
  png_alloc_size_t size = 0;
  EXPECT_NE(png_image_write_to_memory(&image, nullptr, &size, 0, channels.data(), 0, nullptr), 0);
  Bytes file(size, '\0');
  EXPECT_NE(png_image_write_to_memory(&image, file.data(), &size, 0, channels.data(), 0, nullptr), 0);
  return file;
}

/// Grey PNG, white where `is_white(x, y)` for the middle of a pixel, y up.
Bytes drawing(int width, int height, const std::function<bool(double, double)>& is_white) {
  Bytes grey;
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      grey += is_white(column + 0.5, height - row - 0.5) ? '\xff' : '\0';
    }
  }
  return png(width, height, PNG_FORMAT_GRAY, grey);
}

/// Rows from the top, '#' where body.
PixelBody art(std::vector<std::string> rows) {
  PixelBody body{static_cast<Index>(rows[0].size()), static_cast<Index>(rows.size()), {}};
  std::reverse(rows.begin(), rows.end());
  for (const std::string& row : rows) {
    for (const char c : row) {
      body.inside.push_back(c == '#' ? 1 : 0);
    }
  }
  return body;
}

/// The white pixels: the number of them, which is the body's area.
std::ptrdiff_t pixels(const PixelBody& body) {
  return std::count(body.inside.begin(), body.inside.end(), 1);
}

std::vector<std::string> notes_of(PixelBody& body) {
  std::vector<std::string> notes;
  keep_one_body(body, "art", notes);
  return notes;
}

double signed_area(const std::vector<LatticePoint>& line) {
  std::vector<Vec3> points;
  points.reserve(line.size());
  for (const LatticePoint& p : line) {
    points.emplace_back(p[0], p[1], 0.0);
  }
  return testing::signed_area(points);
}

class Picture : public ::testing::Test {
 protected:
  Mesh mesh(const Bytes& file, double edge_length, double grading = 0.3) {
    MeshOptions options;
    options.edge_length = edge_length;
    options.grading = grading;
    return mesh_picture({folder_.write("body.png", file)}, options, notes_);
  }

  /// Number of white pixels of a picture file.
  double count(const Bytes& file) { return static_cast<double>(pixels(read(file))); }

  PixelBody read(const Bytes& file) { return read_picture({folder_.write("read", file)}); }

  TempFolder folder_;
  std::vector<std::string> notes_;
};

TEST_F(Picture, WhiteIsARectangle) {
  const Mesh white = mesh(drawing(90, 60, [](double, double) { return true; }), 10.0);
  expect_plane_mesh(white, 0);
  EXPECT_NEAR(area(white), 90.0 * 60.0, 1e-9);
  for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(90, 0, 0), Vec3(90, 60, 0), Vec3(0, 60, 0)}) {
    EXPECT_NE(std::find(white.nodes.begin(), white.nodes.end(), corner), white.nodes.end());
  }
  for (const double length : edge_lengths(white, true)) {
    EXPECT_NEAR(length, 10.0, 1e-9);
  }
  EXPECT_TRUE(notes_.empty());
}

TEST_F(Picture, DarkIsTheOtherSide) {
  const auto file = [](int format, const Bytes& on, const Bytes& off) {
    Bytes channels;
    for (int pixel = 0; pixel < 6; ++pixel) channels += pixel % 3 == 0 ? on : off;
    return png(3, 2, format, channels);
  };
  for (const Bytes& drawn : {file(PNG_FORMAT_GRAY, Bytes("\0", 1), "\xff"),              // black on white
                             file(PNG_FORMAT_GA, Bytes("\0\xff", 2), Bytes("\0\0", 2)),  // black on nothing
                             Bytes("P1 3 2 1 0 0 1 0 0")}) {
    const std::filesystem::path path = folder_.write("drawn", drawn);
    EXPECT_EQ(read_picture({path, true}).inside, (std::vector<std::uint8_t>{1, 0, 0, 1, 0, 0}));
  }
  const Bytes nothing = file(PNG_FORMAT_GA, Bytes("\0\xff", 2), Bytes("\0\0", 2));
  EXPECT_THROW((void)read_picture({folder_.write("nothing", nothing)}), Error);
}

TEST_F(Picture, CornersStay) {
  const Mesh angle = mesh(drawing(50, 40, [](double x, double y) { return x < 20 || y < 15; }), 5.0);
  EXPECT_NEAR(area(angle), 50.0 * 15.0 + 20.0 * 25.0, 1e-9);
  EXPECT_NE(std::find(angle.nodes.begin(), angle.nodes.end(), Vec3(20, 15, 0)), angle.nodes.end());
}

TEST_F(Picture, UpIsUp) {
  const Mesh corner = mesh(drawing(40, 30, [](double x, double y) { return x < 10 && y > 22; }), 3.0);
  EXPECT_NEAR(area(corner), 80.0, 1e-9);
  for (const Vec3& x : corner.nodes) {
    EXPECT_LE(x[0], 10.0);
    EXPECT_GE(x[1], 22.0);
  }
}

TEST_F(Picture, DiscIsRound) {
  constexpr double radius = 60.0;
  const Vec3 center(70.2, 64.7, 0.0);
  const Bytes file =
      drawing(140, 130, [&](double x, double y) { return (Vec3(x, y, 0.0) - center).norm() < radius; });
  const Mesh disc = mesh(file, 8.0);
  expect_plane_mesh(disc, 0);
  EXPECT_NEAR(area(disc), count(file), 0.01 * count(file));
  EXPECT_GT(least(smallest_angles(disc)), 20.0);
  for (const PlaneEdge& edge : edges_of(disc)) {
    if (edge.is_boundary) {
      EXPECT_NEAR((edge.from - center).norm(), radius, 1.0);
      EXPECT_NEAR((edge.middle() - center).norm(), radius, 1.3);
    }
  }
  EXPECT_NEAR(mean(edge_lengths(disc, true)), 8.0, 2.0);  // its staircase has edges of 1
  EXPECT_TRUE(notes_.empty());
}

TEST_F(Picture, SlantedSidesAreStraight) {
  const Vec3 along(std::cos(0.3), std::sin(0.3), 0.0), across(-along[1], along[0], 0.0), center(150, 100, 0);
  const auto from_center = [&](double x, double y) -> Vec3 { return Vec3(x, y, 0.0) - center; };
  const Bytes file = drawing(300, 200, [&](double x, double y) {
    const Vec3 d = from_center(x, y);
    return std::abs(d.dot(along)) < 110.0 && std::abs(d.dot(across)) < 40.0;
  });
  const Mesh bar = mesh(file, 10.0);
  expect_plane_mesh(bar, 0);
  EXPECT_NEAR(area(bar), 220.0 * 80.0, 0.005 * 220.0 * 80.0);
  for (const PlaneEdge& edge : edges_of(bar)) {
    if (edge.is_boundary) {
      const Vec3 d = from_center(edge.from[0], edge.from[1]);
      EXPECT_NEAR(std::max(std::abs(d.dot(along)) - 110.0, std::abs(d.dot(across)) - 40.0), 0.0, 1.0);
    }
  }
}

TEST_F(Picture, HolesAreKept) {
  const Bytes file = drawing(200, 120, [](double x, double y) {
    return std::hypot(x - 50, y - 60) > 20 && std::hypot(x - 140.3, y - 50) > 3;
  });
  const Mesh plate = mesh(file, 10.0);
  expect_plane_mesh(plate, 2);
  EXPECT_NEAR(area(plate), count(file), 0.005 * count(file));
  EXPECT_TRUE(notes_.empty());
}

TEST_F(Picture, ThinBarKeepsItsArea) {
  const auto bar = [&](int thickness) {
    return area(mesh(drawing(60, 8, [&](double, double y) { return y > 2 && y < 2 + thickness; }), 4.0));
  };
  EXPECT_NEAR(bar(1), 60.0, 1e-9);
  EXPECT_NEAR(bar(2), 120.0, 1e-9);
}

TEST_F(Picture, ThinStrokesKeepTheirAreaWhateverTheEdges) {
  const Bytes file = drawing(400, 300, [](double x, double y) {
    const auto stroke = [&](double from, double to, double slope) {
      return x > from && x < to && std::abs(y - 150 - slope * (x - 200)) < 4 * std::hypot(1.0, slope);
    };
    return stroke(20, 380, 0.0) || stroke(200, 330, 0.9) || stroke(80, 200, 1.1);
  });
  const Mesh strokes = mesh(file, 100.0);
  expect_plane_mesh(strokes, 0);
  EXPECT_NEAR(area(strokes), count(file), 0.025 * count(file));
}

TEST_F(Picture, NotFinerThanNeeded) {
  const Bytes star = drawing(300, 200, [](double x, double y) {
    const double angle = std::atan2(y - 100, x - 150);
    return std::hypot(x - 150, y - 100) < 60 + 20 * std::cos(5 * angle);
  });
  const Mesh fine = mesh(star, 4.0), coarse = mesh(star, 20.0);
  EXPECT_NEAR(area(fine), count(star), 0.01 * count(star));
  EXPECT_NEAR(area(coarse), count(star), 0.05 * count(star));
  EXPECT_LT(6 * edge_lengths(coarse, true).size(), 2 * edge_lengths(fine, true).size());
}

TEST_F(Picture, SameInputSameMesh) {
  const Bytes file = drawing(60, 60, [](double x, double y) { return std::hypot(x - 30, y - 30) < 25; });
  const Mesh a = mesh(file, 5.0), b = mesh(file, 5.0);
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.connectivity, b.connectivity);
}

TEST_F(Picture, EveryKindIsReadAlike) {
  // 11 columns, as rows of raw PBM end at bytes
  const PixelBody wanted = art({".#.........", "###.......#", "####....###"});
  const std::vector<std::string> top_down = {".#.........", "###.......#", "####....###"};
  Bytes grey, grey_alpha, rgb, rgba, plain = "P1\n# by hand\n11 3\n", raw = "P4 11 # wide\n3\n";
  for (const std::string& row : top_down) {
    for (const char c : row) {
      const bool body = c == '#';
      grey += body ? '\x80' : '\x7f';  // 128, 127
      grey_alpha += body ? "\xff\xff" : std::string("\xff\0", 2);
      rgb += body ? std::string("\0\xff\0", 3) : std::string("\xff\0\0", 3);  // green is bright, red is not
      rgba += body ? "\xff\xff\xff\xff" : std::string("\0\0\0\xff", 4);
      plain += body ? "0" : "1";
    }
    plain += row == top_down[0] ? " # a comment\n" : "\n";
  }
  raw += std::string("\xbf\xe0\x1f\xc0\x0f\x00", 6);  // 1 is black
  EXPECT_EQ(read(png(11, 3, PNG_FORMAT_GRAY, grey)).inside, wanted.inside);
  EXPECT_EQ(read(png(11, 3, PNG_FORMAT_GA, grey_alpha)).inside, wanted.inside);
  EXPECT_EQ(read(png(11, 3, PNG_FORMAT_RGB, rgb)).inside, wanted.inside);
  EXPECT_EQ(read(png(11, 3, PNG_FORMAT_RGBA, rgba)).inside, wanted.inside);
  EXPECT_EQ(read(plain).inside, wanted.inside);
  EXPECT_EQ(read(raw).inside, wanted.inside);
  EXPECT_EQ(read(raw).width, 11);
  EXPECT_EQ(read(raw).height, 3);
}

TEST_F(Picture, BadBodies) {
  const auto error = [&](const PixelBody& body) {
    return error_of([&] {
      mesh(drawing(body.width, body.height,
                   [&](double x, double y) {
                     return body.is_body(static_cast<Index>(x), static_cast<Index>(y));
                   }),
           2.0);
    });
  };
  expect_mentions(error(art({"...", "..."})), {"body.png", "no body", "all its pixels are black", "128"});
  expect_mentions(error(art({"##....", "##..##", "......", "#....."})),
                  {"body.png", "3 bodies", "1 pixels at column 0, row 3", "2 pixels at column 4, row 1",
                   "4 pixels at column 0, row 1"});
  expect_mentions(error(art({"##..", "##..", "..##"})), {"touching bodies", "column 1, row 2"});
  expect_mentions(error(art({"..##", "..##", "##.."})), {"touching bodies", "column 1, row 2"});
}

TEST_F(Picture, UnreadableFiles) {
  const Bytes good = drawing(40, 30, [](double x, double y) { return x + y < 35; });
  const auto error = [&](const Bytes& file) { return error_of([&] { read(file); }); };
  expect_mentions(error_of([&] { read_picture({folder_.path() / "none.png"}); }),
                  {"none.png", "No such file", "picture ="});
  expect_mentions(error_of([&] { read_picture({folder_.path()}); }), {"is a folder"});
  for (const Bytes& file : {Bytes(), Bytes("hello"), Bytes("P5 1 1 255\n\xff"), Bytes("\xff\xd8\xff\xe0")}) {
    expect_mentions(error(file), {"read", "neither a PNG nor a PBM"});
  }
  for (const std::size_t cut : {std::size_t{8}, std::size_t{20}, std::size_t{40}, good.size() - 20}) {
    expect_mentions(error(good.substr(0, cut)), {"read", "PNG cannot be read"});
  }
  Bytes damaged = good;
  damaged[good.size() / 2] = static_cast<char>(~damaged[good.size() / 2]);
  expect_mentions(error(damaged), {"PNG cannot be read"});
  expect_mentions(error("P1 0 5\n"), {"0 x 5 pixels"});
  expect_mentions(error("P1 2000000 2000000\n"), {"2000000 x 2000000", "100 million"});
  expect_mentions(error("P4 99999999999999999999 1\n"), {"width and height"});
  expect_mentions(error("P4 -3 1\n"), {"width and height"});
  expect_mentions(error("P1 3"), {"width and height"});
  expect_mentions(error("P1 3 2\n010 1"), {"3 x 2", "ends before column 1, row 1"});
  expect_mentions(error("P1 3 2\n010 1x"), {"neither 0 nor 1", "column 1, row 1"});
  expect_mentions(error("P4 9 2\nabc"), {"9 x 2", "ends before column 0, row 1"});
  expect_mentions(error("P1 3 2\n0#"), {"ends before column 1, row 0"});
}

TEST(PixelBody, SpecksAreDropped) {
  PixelBody body{30, 20, std::vector<std::uint8_t>(600, 0)};
  for (Index j = 0; j < 20; ++j) {
    for (Index i = 0; i < 15; ++i) {
      body.inside[body.at(i, j)] = 1;
    }
  }
  body.inside[body.at(20, 3)] = body.inside[body.at(21, 3)] = 1;
  body.inside[body.at(25, 19)] = 1;
  PixelBody larger = body;
  const std::vector<std::string> notes = notes_of(body);
  ASSERT_EQ(notes.size(), 1U);
  expect_mentions(notes[0], {"dropped 2 stray part(s)", "3 pixel(s)"});
  EXPECT_EQ(pixels(body), 300);
  larger.inside[larger.at(22, 3)] = 1;  // 1 % of the body
  expect_mentions(error_of([&] { notes_of(larger); }), {"2 bodies"});
}

TEST(PixelBody, OnlyHolesOfAFewPixelsAreFilled) {
  PixelBody body = art({"#########", "#..######", "#..##...#", "#######.#", "#.#####.#", "########."});
  const std::vector<std::string> notes = notes_of(body);
  ASSERT_EQ(notes.size(), 2U);
  expect_mentions(notes[0], {"filled 1 pixel(s)", "touched itself at a corner"});
  expect_mentions(notes[1], {"filled 2 hole(s)", "5 pixel(s)"});
}

TEST(PixelBody, BodyThatTouchesItselfIsJoined) {
  PixelBody body = art({"#####", "#...#", "#..#.", "#####"});  // open but for the corner on the right
  const std::vector<std::string> notes = notes_of(body);
  expect_mentions(notes.at(0), {"filled 1 pixel(s)", "at a corner"});
  EXPECT_EQ(pixels(body), 15);
}

TEST(PixelBody, OutlinesEncloseThePixels) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 20; ++trial) {
    PixelBody body{23, 17, {}};
    for (int p = 0; p < 23 * 17; ++p) {
      body.inside.push_back(random() % 100 < 85 ? 1 : 0);
    }
    for (Index i = 0; i < 23; ++i) {
      body.inside[body.at(i, 8)] = 1;  // one large part
    }
    try {
      notes_of(body);
    } catch (const Error&) {
      continue;
    }
    const auto lines = trace_outlines(body);
    double sum = 0.0;
    for (std::size_t l = 0; l < lines.size(); ++l) {
      EXPECT_EQ(signed_area(lines[l]) > 0.0, l == 0);
      sum += signed_area(lines[l]);
    }
    EXPECT_EQ(sum, static_cast<double>(pixels(body)));
  }
}

}  // namespace
}  // namespace palpate::picture_test
