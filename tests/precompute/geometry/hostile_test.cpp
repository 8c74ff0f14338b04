// Damaged and malicious surfaces and images: an Error with file and hint, never a crash, never for ever.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <zlib.h>

#include "precompute/geometry/image_mesh.h"
#include "precompute/geometry/mesh_bytes.h"
#include "precompute/geometry/mesh_size.h"
#include "precompute/geometry/picture_reader.h"
#include "precompute/images/inr_image.h"
#include "precompute/machine/allotment.h"
#include "precompute/surfaces/surface_repair.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::hostile_test {
namespace {

using testing::cube;
using testing::error_of;
using testing::expect_mentions;
using testing::off;
using testing::TempFolder;

TEST(MeshBytes, CutShortAreAnError) {
  Bytes bytes = pack(Mesh{});
  bytes.resize(bytes.size() - 1);
  expect_mentions(error_of([&] { unpack_mesh(bytes); }), {"damaged"});
}

TEST(MeshBytes, GiveTheMeshBack) {
  const Mesh mesh{ElementType::tet4, {{1, 2, 3}, {4, 5, 6}},      {0, 1, 0, 1, 1, 0, 1, 0},
                  {7, -2},           {0, 1, 1, 1, 0, 0, 0, 0, 1}, {3, 4, 5}};
  const Mesh back = unpack_mesh(pack(mesh));
  EXPECT_EQ(back.element, mesh.element);
  EXPECT_EQ(back.nodes, mesh.nodes);
  EXPECT_EQ(back.connectivity, mesh.connectivity);
  EXPECT_EQ(back.regions, mesh.regions);
  EXPECT_EQ(back.tagged_facets, mesh.tagged_facets);
  EXPECT_EQ(back.facet_tags, mesh.facet_tags);
}

class HostileInput : public ::testing::Test {
 protected:
  std::string surface_error(const std::string& name, const std::string& text) {
    return error_of([&] { read_surface(folder_.write(name, text), notes_); });
  }
  std::string image_error(const std::string& name, const std::string& text, double edge_length = 2.0) {
    MeshOptions options;
    options.mesher = Mesher::cgal;
    options.edge_length = edge_length;
    return error_of([&] { mesh_image({folder_.write(name, text), {}, false}, options, notes_); });
  }

  TempFolder folder_;
  std::vector<std::string> notes_;
};

const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

std::string ply(const std::string& body, const std::string& format = "ascii",
                const std::string& index = "int") {
  return "ply\nformat " + format +
         " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
         "property list uchar " +
         index + " vertex_indices\nend_header\n" + body;
}

TEST_F(HostileInput, CornersThatAreNoPoints) {
  for (const std::string corner : {"0", "5", "99999", "-5", "-99999", "4294967297", "9223372036854775807"}) {
    const std::string text =
        surface_error("a.obj", points + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 " + corner + "\n");
    expect_mentions(text, {"a.obj"});
  }
  for (const std::string corner : {"-1", "4", "100000", "2147483647", "-2147483648", "4294967295"}) {
    expect_mentions(
        surface_error("a.ply",
                      ply("0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 " + corner + "\n")),
        {"a.ply"});
    expect_mentions(surface_error("a.off",
                                  "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n"
                                  "3 0 3 " +
                                      corner + "\n"),
                    {"a.off"});
  }
  expect_mentions(surface_error("b.obj", points + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 0\n"),
                  {"b.obj:8", "corner 0", "none of the 4 points", "damaged"});
}

TEST_F(HostileInput, BinaryPlyWithCornersThatAreNoPoints) {
  for (const std::int32_t corner : {-1, 4, 100'000, std::numeric_limits<std::int32_t>::min()}) {
    std::string body;
    const auto append = [&](const auto& value) {
      body.append(reinterpret_cast<const char*>(&value), sizeof(value));
    };
    for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F}) append(x);
    for (const auto& [a, b, c] :
         std::vector<std::array<std::int32_t, 3>>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, corner}}) {
      append(std::uint8_t{3});
      append(a);
      append(b);
      append(c);
    }
    expect_mentions(surface_error("a.ply", ply(body, "binary_little_endian")), {"a.ply"});
  }
}

TEST_F(HostileInput, HeadersThatLie) {
  const std::string whole = ply("0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = whole;
    return text.replace(text.find(from), from.size(), to);
  };
  ASSERT_NO_THROW(read_surface(folder_.write("whole.ply", whole), notes_));
  for (const std::string& text :
       {with("element vertex 4\n", ""), with("element vertex 4", "element vertex 4000000000"),
        with("element face 4", "element face 18446744073709551615"), with("3 0 2 1\n", "300000000 0 2 1\n"),
        with("end_header\n", ""), std::string("ply\n")}) {
    expect_mentions(surface_error("a.ply", text), {"a.ply"});
  }
  expect_mentions(surface_error("a.off", "OFF\n4000000000 4000000000 0\n0 0 0\n"), {"a.off"});
  expect_mentions(surface_error("a.stl", std::string(80, ' ') + "\xff\xff\xff\xff"), {"a.stl"});
  TriangleSurface far = cube();
  far.nodes[3] *= 1e300;
  expect_mentions(surface_error("far.off", off(far)), {"far.off", "coordinate"});
}

TEST_F(HostileInput, FifosAndFoldersAreNoInput) {
  for (const std::string name : {"a.off", "a.inr", "a.png"}) {
    ASSERT_EQ(mkfifo((folder_.path() / name).c_str(), 0666), 0);
  }
  MeshOptions options;
  options.edge_length = 1.0;
  expect_mentions(error_of([&] { read_surface(folder_.path() / "a.off", notes_); }), {"is a FIFO"});
  expect_mentions(error_of([&] {
                    mesh_image({folder_.path() / "a.inr", {}, false}, options, notes_);
                  }),
                  {"is a FIFO"});
  expect_mentions(error_of([&] { read_picture({folder_.path() / "a.png"}); }), {"is a FIFO"});
  expect_mentions(error_of([&] { read_surface(folder_.path(), notes_); }), {"is a folder"});
}

/// A block of 4 x 4 x 4 voxels of label 1 in 6 x 6 x 6.
std::string inr(const std::string& from = "", const std::string& to = "") {
  std::string text =
      "#INRIMAGE-4#{\nXDIM=6\nYDIM=6\nZDIM=6\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\nSCALE=2**0\n"
      "CPU=decm\nVX=1\nVY=1\nVZ=1\n";
  if (!from.empty()) text.replace(text.find(from), from.size(), to);
  text.resize(252, '\n');
  text += "##}\n";
  for (int v = 0; v < 216; ++v) {
    const auto inner = [](int i) { return i > 0 && i < 5; };
    text += inner(v % 6) && inner(v / 6 % 6) && inner(v / 36) ? '\1' : '\0';
  }
  return text;
}

TEST_F(HostileInput, ImageHeadersThatLie) {
  MeshOptions options;
  options.mesher = Mesher::cgal;
  options.edge_length = 2.0;
  EXPECT_FALSE(mesh_image({folder_.write("whole.inr", inr()), {}, false}, options, notes_).nodes.empty());
  const std::vector<std::array<std::string, 3>> cases = {{"YDIM=6", "YDIM=1000000000", "YDIM 1000000000"},
                                                         {"YDIM=6", "YDIM=100000", "bytes"},
                                                         {"XDIM=6", "XDIM=7", "only 216 bytes"},
                                                         {"XDIM=6", "XDIM=0", "XDIM"},
                                                         {"ZDIM=6", "ZDIM=-6", "ZDIM"},
                                                         {"ZDIM=6", "ZDIM=18446744073709551622", "ZDIM"},
                                                         {"PIXSIZE=8", "PIXSIZE=800", "PIXSIZE"},
                                                         {"VY=1", "VY=1e-320", "VX, VY, VZ"},
                                                         {"VY=1", "VY=-1", "VX, VY, VZ"},
                                                         {"VY=1", "VY=nan", "image"},
                                                         {"VZ=1", "VZ=1000", "VX, VY, VZ"},
                                                         {"VX=1", "VX=1e300", "VX, VY, VZ"},
                                                         {"VZ=1\n", "VZ=1\nTX=1e30\n", "TX, TY, TZ"}};
  for (const auto& [from, to, piece] : cases) {
    expect_mentions(image_error("a.inr", inr(from, to)), {"a.inr", piece});
  }
  expect_mentions(image_error("fine.inr", inr(), 0.01), {"edge_length", "below its voxels"});
}

TEST_F(HostileInput, GzippedImageIsMeasuredUnpacked) {
  const auto write = [&](const std::string& name, const std::string& text) {
    const std::string path = (folder_.path() / name).string();
    gzFile_s* const file = gzopen(path.c_str(), "wb");
    gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
    gzclose(file);
    return path;
  };
  const auto check = [](const std::string& path) {
    return check_inr_header(open_file(path, OpenMode::read));
  };
  EXPECT_EQ(check(write("a.inr.gz", inr())), 216);
  expect_mentions(error_of([&] { check(write("b.inr.gz", inr("XDIM=6", "XDIM=7"))); }),
                  {"XDIM 7 x YDIM 6 x ZDIM 6", "only 216 bytes"});
}

TEST(MeshSize, CountsRegularTetrahedra) {
  // The integral of 6 sqrt(2) / (h + g d)^3 over a slab of area 2 x 5 and thickness 2 x 3, by the midpoint
  // rule.
  const double h = 0.2, g = 0.5;
  double sum = 0.0;
  for (int i = 0; i < 30'000; ++i) {
    sum += 6.0 * std::sqrt(2.0) / std::pow(h + g * (i + 0.5) * 1e-4, 3) * 2.0 * 5.0 * 1e-4;
  }
  EXPECT_NEAR(expected_elements(30.0, 10.0, h, g), sum, 1e-4 * sum);
  EXPECT_NEAR(expected_elements(2.0, 12.0, 0.1, 0.0), 2.0 * 6.0 * std::sqrt(2.0) * 1e3, 1e-6);

  MeshOptions options;
  options.edge_length = 1e-4;
  options.grading = 0.0;
  expect_mentions(error_of([&] { meshing_limits(expected_size(cube(), options), options, "a.off"); }),
                  {"a.off", "8e+12 elements", "edge_length"});
  options.edge_length = 1e300;
  EXPECT_EQ(expected_size(cube(), options).elements, 0.0);
  options.edge_length = 1e-300;
  expect_mentions(error_of([&] { meshing_limits(expected_size(cube(), options), options, "a.off"); }),
                  {"a.off", "countless elements", "edge_length"});
}

TEST(MeshSize, CountsRegularTriangles) {
  // The integral of 2 / sqrt(3) / (h + g d)^2 over a strip of length 10 and width 2 x 3, by the midpoint
  // rule.
  const double h = 0.2, g = 0.5;
  double sum = 0.0;
  for (int i = 0; i < 30'000; ++i)
    sum += 2.0 / std::sqrt(3.0) / std::pow(h + g * (i + 0.5) * 1e-4, 2) * 2.0 * 10.0 * 1e-4;
  EXPECT_NEAR(expected_plane_nodes(60.0, 20.0, h, g), sum, 1e-4 * sum);
  EXPECT_NEAR(expected_plane_nodes(3.0, 8.0, 0.1, 0.0), 3.0 * 2.0 / std::sqrt(3.0) * 100.0, 1e-9);
}

TEST(MeshSize, MoreThanMemoryHoldsIsRefused) {
  const auto bytes = static_cast<double>(allotted_memory());
  ASSERT_GT(bytes, 0.0);
  for (const ElementType element :
       {ElementType::tet4, ElementType::tet10, ElementType::hex8, ElementType::tri3, ElementType::quad4}) {
    EXPECT_NO_THROW(check_mesh_room(1e-6 * bytes, element, "a.off"));
    expect_mentions(error_of([&] { check_mesh_room(bytes, element, "a.off"); }),
                    {"a.off", "elements takes some", "GB are free", "edge_length"});
  }
}

TEST_F(HostileInput, ObjNumbersThatNoReaderHolds) {
  const std::string body = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
  EXPECT_NO_THROW(read_surface(folder_.write("whole.obj", body + "f 1 4 3\n"), notes_));
  for (const std::string number : {"99999999999", "-99999999999", "99999999999/1/1", "2147483648",
                                   "340282366920938463463374607431768211456"}) {
    expect_mentions(surface_error("a.obj", body + "  f\t1 4 " + number + "\n"),
                    {"a.obj:8", number.substr(0, 10)});
    expect_mentions(error_of([&] { repair_surface(folder_.path() / "a.obj", SurfaceParts::largest, 500); }),
                    {"a.obj:8"});
  }
}

TEST_F(HostileInput, RemeshingToNothingIsRefused) {
  const std::filesystem::path file = folder_.write("cube.off", off(cube()));
  const TriangleSurface surface = read_surface(file, notes_);
  expect_mentions(error_of([&] { remesh_surface(file, surface, 1e-5); }),
                  {"cube.off", "triangles", "edge_length"});
}

}  // namespace
}  // namespace palpate::hostile_test
