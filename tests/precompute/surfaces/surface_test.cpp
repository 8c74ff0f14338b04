// Surfaces in four formats, whole and broken.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <tuple>

#include "precompute/surfaces/shells.h"
#include "precompute/surfaces/surface_input.h"
#include "precompute/surfaces/surface_repair.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::surface_test {
namespace {

using testing::at;
using testing::ball;
using testing::cube;
using testing::error_of;
using testing::expect_mentions;
using testing::joined;
using testing::off;
using testing::TempFolder;
using testing::volume;

std::string numbers(const Vec3& x) {
  return std::to_string(x[0]) + " " + std::to_string(x[1]) + " " + std::to_string(x[2]);
}

std::string obj(const TriangleSurface& s) {
  std::string text;
  for (const Vec3& x : s.nodes) {
    text += "v " + numbers(x) + "\n";
  }
  for (const auto& [a, b, c] : s.triangles) {
    text += "f " + std::to_string(a + 1) + " " + std::to_string(b + 1) + " " + std::to_string(c + 1) + "\n";
  }
  return text;
}

std::string ply(const TriangleSurface& s) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(s.nodes.size()) +
                     "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                     std::to_string(s.triangles.size()) +
                     "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3& x : s.nodes) {
    text += numbers(x) + "\n";
  }
  for (const auto& [a, b, c] : s.triangles) {
    text += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  }
  return text;
}

std::string ascii_stl(const TriangleSurface& s) {
  std::string text = "solid s\n";
  for (const Triangle& t : s.triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const Index node : t) {
      text += "vertex " + numbers(s.nodes[at(node)]) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid s\n";
}

std::string binary_stl(const TriangleSurface& s) {
  std::string text(80, ' ');
  const auto append = [&](const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  append(static_cast<std::uint32_t>(s.triangles.size()));
  for (const Triangle& t : s.triangles) {
    for (int i = 0; i < 3; ++i) {
      append(0.0F);
    }
    for (const Index node : t) {
      for (const double x : s.nodes[at(node)]) {
        append(static_cast<float>(x));
      }
    }
    append(std::uint16_t{0});
  }
  return text;
}

class SurfaceInput : public ::testing::Test {
 protected:
  TriangleSurface read(const std::string& name, const std::string& text) {
    return read_surface(folder_.write(name, text), notes_);
  }

  /// What a person is told about a bad surface.
  std::string error(const TriangleSurface& surface) {
    return error_of([&] { read("bad.off", off(surface)); });
  }

  TempFolder folder_;
  std::vector<std::string> notes_;
};

TEST_F(SurfaceInput, ReadsAllFormatsAlike) {
  const std::vector<std::pair<std::string, std::string (*)(const TriangleSurface&)>> formats = {
      {"a.off", off}, {"a.obj", obj}, {"a.ply", ply}, {"a.stl", ascii_stl}, {"b.stl", binary_stl}};
  for (const auto& [name, write] : formats) {
    for (const TriangleSurface& surface : {cube(), testing::tetrahedron(), ball(2)}) {
      const TriangleSurface result = read(name, write(surface));
      EXPECT_EQ(result.nodes.size(), surface.nodes.size()) << name;
      EXPECT_EQ(result.triangles.size(), surface.triangles.size()) << name;
      EXPECT_NEAR(volume(result), volume(surface), 1e-5) << name;
      EXPECT_NEAR(mean_edge_length(result), mean_edge_length(surface), 1e-5) << name;
    }
  }
  EXPECT_TRUE(notes_.empty());
}

TEST_F(SurfaceInput, SplitsPolygons) {
  const TriangleSurface result = read("quads.off",
                                      "OFF\n8 6 0\n0 0 0\n2 0 0\n2 2 0\n0 2 0\n0 0 2\n2 0 2\n2 2 2\n0 2 2\n"
                                      "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  EXPECT_EQ(result.triangles.size(), 12U);
  EXPECT_NEAR(volume(result), 8.0, 1e-12);
}

TEST_F(SurfaceInput, TurnsAnInsideOutSurface) {
  TriangleSurface surface = ball(1);
  for (Triangle& t : surface.triangles) {
    std::swap(t[0], t[1]);
  }
  ASSERT_LT(volume(surface), 0.0);
  EXPECT_NEAR(volume(read("in.off", off(surface))), -volume(surface), 1e-5);
  ASSERT_EQ(notes_.size(), 1U);
  expect_mentions(notes_[0], {"inwards"});
}

TEST_F(SurfaceInput, TurnsSingleTriangles) {
  TriangleSurface surface = cube();
  std::swap(surface.triangles[3][0], surface.triangles[3][1]);
  EXPECT_NEAR(volume(read("mixed.off", off(surface))), 1.0, 1e-12);
  ASSERT_FALSE(notes_.empty());
  expect_mentions(notes_[0], {"of 12 polygons", "turned"});
}

TEST_F(SurfaceInput, OpenSurface) {
  TriangleSurface surface = cube();
  surface.triangles.pop_back();                            // a corner at (1, 1, 1)
  surface.triangles.erase(surface.triangles.begin() + 8);  // a corner at the origin
  expect_mentions(error(surface), {"bad.off", "open", "2 hole(s)", "6 open edges", "(0, 0, 0)"});
}

TEST_F(SurfaceInput, NonManifoldEdge) {
  TriangleSurface surface = cube();
  surface.nodes.emplace_back(0.5, -1, -1);
  surface.triangles.push_back({0, 1, 8});
  expect_mentions(error(surface), {"not manifold", "3 triangles", "from (0, 0, 0) to (1, 0, 0)"});
}

TEST_F(SurfaceInput, NonManifoldPoint) {
  expect_mentions(error(joined(cube(), cube(), {1, 1, 1})), {"not manifold", "touch in the point (1, 1, 1)"});
}

TEST_F(SurfaceInput, SeveralParts) {
  expect_mentions(error(joined(cube(), cube(), {3, 0, 0})), {"2 disconnected parts"});
}

TEST_F(SurfaceInput, FlatTriangle) {
  TriangleSurface surface = cube();
  surface.nodes.emplace_back(0.5, 0, 0);  // on the edge 0-1, with a flat triangle between
  surface.triangles[0] = {0, 2, 8};
  surface.triangles.insert(surface.triangles.end(), {{8, 2, 1}, {8, 1, 0}});
  expect_mentions(error(surface), {"no area", "0, 0)"});
}

TEST_F(SurfaceInput, SelfIntersection) {
  TriangleSurface surface = testing::fine_cube(1);
  for (Vec3& x : surface.nodes) {
    if (x == Vec3(0.5, 0.5, 1.0)) {
      x[2] = -1.0;  // the middle of the lid goes through the floor
    }
  }
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  std::ofstream("bad.bad-faces.off") << "mine\n";
  EXPECT_EQ(error(surface).find("bad-faces"), std::string::npos) << "it is another's file";
  std::string mine;
  std::ifstream("bad.bad-faces.off") >> mine;
  EXPECT_EQ(mine, "mine");
  std::filesystem::remove("bad.bad-faces.off");
  expect_mentions(error(surface), {"bad.bad-faces.off"});
  std::ofstream("bad.bad-faces.off", std::ios::app) << "\n";
  const auto kept = std::filesystem::file_size("bad.bad-faces.off");
  error_of([&] { read_surface("bad.off", notes_, true); });
  EXPECT_EQ(std::filesystem::file_size("bad.bad-faces.off"), kept);
  const std::string text = error(surface);  // over its own
  EXPECT_LT(std::filesystem::file_size("bad.bad-faces.off"), kept);
  std::filesystem::current_path(before);
  expect_mentions(text, {"intersects itself", "pair(s) of triangles", "near (", "bad.bad-faces.off"});

  std::ifstream bad_faces(folder_.path() / "bad.bad-faces.off");
  std::string head;
  std::size_t points = 0, faces = 0;
  bad_faces >> head >> points >> faces;
  EXPECT_EQ(head, "OFF");
  EXPECT_GE(faces, 2U);
  EXPECT_LT(faces, surface.triangles.size());
  EXPECT_EQ(points, 3 * faces);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "bad.bad-faces.off.partial"));
}

TEST_F(SurfaceInput, UnreadableFiles) {
  expect_mentions(error_of([&] { read_surface(folder_.path() / "none.off", notes_); }),
                  {"none.off", "No such file", "surface ="});
  for (const std::string name : {"a.off", "a.obj", "a.stl", "a.ply", "a.xyz"}) {
    expect_mentions(error_of([&] { read(name, "this is no surface\n"); }), {name});
    expect_mentions(error_of([&] { read(name, ""); }), {name});
  }
  expect_mentions(error_of([&] { read("a.xyz", "1 2 3\n"); }), {"cannot read a surface", "no polygons"});
  expect_mentions(error_of([&] { read("cut.off", off(cube()).substr(0, 150)); }), {"cut.off:"});
}

/// A text with each `from` in it replaced.
std::string with(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

std::string in_capitals(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

/// All are the same cube, as some program writes it.
TEST_F(SurfaceInput, ReadsWhatProgramsWrite) {
  const std::string o = off(cube()), w = obj(cube()), s = ascii_stl(cube()), p = ply(cube()),
                    bom = "\xef\xbb\xbf";
  const std::string counts = "8 12 0\n", first = "v 0.000000 0.000000 0.000000\n", face = "f 1 3 2\n";
  const std::pair<std::string, std::string> files[] = {
      {"small.off", with(o, "OFF", "off")},
      {"bom.off", bom + o},
      {"cr.off", with(o, "\n", "\r")},
      {"crlf.off", with(o, "\n", "\r\n")},
      {"glued.off", with(o, "OFF\n", "OFF")},
      {"counts.off", with(o, counts, "8 12\n")},
      {"comment.off", with(o, counts, "# OFF 4\n\n" + counts)},
      {"texture.off", with(with(o, "OFF", "STCOFF"), "1.000000\n", "1.000000 255 0 0 255 0.5 0.5\n")},
      {"tabs.obj", with(w, " ", "\t")},
      {"cr.obj", with(w, "\n", "\r")},
      {"continued.obj", with(w, face, "f 1 \\\r\n3\\\n 2\n")},
      {"path.obj", with(w, first, "# C:\\\n" + first)},
      {"skipped.obj", with(w, face, "mg 1\nl 1 2\ncurv 0 1\n" + face)},
      {"slashes.obj", with(with(w, first, "v 0 0 0 1 0.5 0  # red\n"), face, "f -8/1 3//2 2/1/1\n")},
      {"points_last.obj", w.substr(w.find(face)) + w.substr(0, w.find(face))},
      {"tab.stl", with(s, "solid s", "solid\ts")},
      {"name.stl", with(s, "solid s", "solid solid facet vertex")},
      {"line.stl", with(s, "\n", " ")},
      {"several.stl", with(s, "facet normal", "endsolid\nsolid b\nfacet normal")},
      {"capitals.stl", in_capitals(s)},
      {"bom.stl", bom + s},
      {"solid.stl", "solid facet" + binary_stl(cube()).substr(11) + "more"},
      {"early.ply", with(p, "ply\n", "ply\ncomment end_header\nobj_info x\n")},
      {"int.ply", with(with(p, "double", "int"), ".000000", "")},
      {"wide.ply", with(p, "list uchar int", "list double uint64")}};
  for (const auto& [name, text] : files) {
    SCOPED_TRACE(name);
    const TriangleSurface result = read(name, text);
    EXPECT_EQ(result.nodes.size(), 8U);
    EXPECT_EQ(result.triangles.size(), 12U);
    EXPECT_NEAR(volume(result), 1.0, 1e-12);
  }
  EXPECT_TRUE(notes_.empty());
}

TEST_F(SurfaceInput, SaysLineAndReason) {
  const std::string o = off(cube()), w = obj(cube()), s = ascii_stl(cube()), p = ply(cube()),
                    b = binary_stl(cube());
  const std::string first = "0.000000 0.000000 0.000000";
  const std::tuple<std::string, std::string, std::vector<std::string>> files[] = {
      {"comma.off", with(o, first, "0,0 0,0 0,0"), {"comma.off:3", "'0,0'", "a coordinate", "with a point"}},
      {"more.off", with(o, "8 12 0", "8 11 0"), {"more.off:21", "after the last"}},
      {"corner.off", with(o, "3 0 2 1", "3 0 2 8"), {"corner.off:11", "0 to 7"}},
      {"four.off", "4" + o, {"four.off:1", "4OFF"}},
      {"wide.off", "\xff\xfeO", {"wide.off:1", "UTF-16"}},
      {"zero.obj", with(w, "f 1 3 2", "f 1 3 0"), {"zero.obj:9", "corner 0", "8 points"}},
      {"nine.obj", with(w, "f 1 3 2", "f 1 3 9"), {"polygon 1 of 12", "8 points"}},
      {"word.obj", with(w, "f 1 3 2", "f 1 x 2"), {"word.obj:9", "'x'"}},
      {"end.stl", with(s, "endsolid s", ""), {"end.stl:", "without endsolid"}},
      {"two.stl", with(s, "outer loop\nvertex " + first, "outer loop"), {"two.stl:7", "2 corners"}},
      {"cut.stl", b.substr(0, b.size() - 10), {"12 facets", "holds 11"}},
      {"type.ply", with(p, "double x", "dubble x"), {"type.ply:4", "'dubble'"}},
      {"values.ply", with(p, first, first + " 1"), {"values.ply:10", "more values"}},
      {"z.ply", with(p, "double z", "double w"), {"point 1 of 8", "nan"}}};
  for (const auto& [name, text, said] : files) {
    SCOPED_TRACE(name);
    expect_mentions(error_of([&, &name = name, &text = text] { read(name, text); }), said);
  }
}

TEST_F(SurfaceInput, StripsOfTriangles) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty int x\nproperty int y\nproperty int z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  const TriangleSurface result = read("strip.ply", head + "12 0 2 1 3 -1 0 3 2 -1 0 1 3\n");  // a tetrahedron
  EXPECT_TRUE(notes_.empty());
  EXPECT_EQ(result.triangles.size(), 4U);
  EXPECT_NEAR(volume(result), 1.0 / 6.0, 1e-12);
}

TEST_F(SurfaceInput, GroupsOfObjAreToldAndNoRepair) {
  const std::string text =
      with(with(obj(cube()), "f 1 3 2", "g a\nusemtl m\nf 1 3 2"), "f 5 6 7", "g b\nusemtl m\nf 5 6 7");
  const RepairedSurface found = repair_surface(folder_.write("groups.obj", text), SurfaceParts::most, 500);
  EXPECT_TRUE(found.repairs.empty());
  ASSERT_EQ(found.remarks.size(), 1U);
  expect_mentions(found.remarks[0], {"2 groups", "one body"});
}

TEST_F(SurfaceInput, CavitiesAreTurnedInwards) {
  const TriangleSurface inner = ball(1);  // of radius 1 in a cube of 4
  const TriangleSurface result = read("hollow.off", off(joined(cube(4.0), inner, {2, 2, 2})));
  EXPECT_NEAR(volume(result), 64.0 - volume(inner), 1e-4);
  const std::vector<TriangleSurface> cavities = cavities_of(result);
  ASSERT_EQ(cavities.size(), 1U);
  EXPECT_LT((point_inside(cavities[0]) - Vec3(2, 2, 2)).norm(), 0.8);
  // A ball in the cavity is no part of the body, nor is one beside it.
  const TriangleSurface both = joined(cube(4.0), inner, {2, 2, 2});
  expect_mentions(error_of([&] {
                    read("deep.off", off(joined(both, cube(0.2), {1.9, 1.9, 1.9})));
                  }),
                  {"2 disconnected parts"});
  expect_mentions(error_of([&] {
                    read("beside.off", off(joined(both, cube(0.2), {9, 9, 9})));
                  }),
                  {"2 disconnected parts"});
}

TEST_F(SurfaceInput, RemeshesAndKeepsSharpEdges) {
  const TriangleSurface given = read("cube.off", off(cube()));
  const Remeshing remeshing = remesh_surface(folder_.path() / "cube.off", given, 0.2);
  ASSERT_EQ(remeshing.problem, "");
  const TriangleSurface& result = remeshing.surface;
  EXPECT_NEAR(mean_edge_length(result), 0.2, 0.04);
  EXPECT_NEAR(volume(result), 1.0, 1e-9);  // no edge was rounded
}

TEST_F(SurfaceInput, MeasuresDistance) {
  const auto distance = distance_to(cube());
  EXPECT_NEAR(distance({0.5, 0.5, 0.4}), 0.4, 1e-12);
  EXPECT_NEAR(distance({2.0, 2.0, 0.5}), std::sqrt(2.0), 1e-12);
}

}  // namespace
}  // namespace palpate::surface_test
