// Each kind of child, with the library that runs in it: at its end, before it answers, it tries what no
// reader may do.
#include <gtest/gtest.h>
#include <png.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <zlib.h>

#include <atomic>
#include <string>

#include "base/limits/child_seal.h"
#include "formats/contents.h"
#include "formats/writer/hdf5_file.h"
#include "formats/writer/hdf5_walk.h"
#include "precompute/geometry/cgal_surface_mesh.h"
#include "precompute/geometry/image_mesh.h"
#include "precompute/geometry/picture_reader.h"
#include "precompute/geometry/plane_mesh.h"
#include "precompute/geometry/tetgen_mesh.h"
#include "precompute/surfaces/surface_repair.h"
#include "tests/support/bodies/geometry_shapes.h"
#include "tests/support/forbidden_calls.h"

namespace palpate::sealed_children_test {
namespace {

/// Seen by the children as well.
struct Shared {
  std::atomic<pid_t> parent = 0;  // 0: nobody is watched
  std::atomic<int> children = 0;  // that have tried
};

Shared* shared() {
  static auto* const memory =
      new (::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared;
  return memory;
}

/// Before the first byte that a child sends.
void try_all_in_child() {
  const pid_t parent = shared()->parent;
  if (parent == 0 || parent == ::getpid()) return;
  static bool tried = false;
  if (tried) return;
  tried = true;
  ++shared()->children;
  if (!test::calls_that_are_not_refused(parent).empty()) ::_exit(66);
}

using testing::TempFolder;

class SealedChildren : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!can_seal()) GTEST_SKIP() << "this kernel has no seccomp filters";
    shared()->children = 0;
    shared()->parent = ::getpid();
  }
  void TearDown() override { shared()->parent = 0; }

  static int children() { return shared()->children; }

  TempFolder folder_;
  std::vector<std::string> notes_;
};

TEST_F(SealedChildren, OfSurfaces) {
  const TriangleSurface body = testing::cube();
  const std::filesystem::path off = folder_.write("a.off", testing::off(body));
  EXPECT_EQ(read_surface(off, notes_).triangles.size(), body.triangles.size());
  EXPECT_EQ(children(), 1);
  EXPECT_TRUE(repair_surface(off, SurfaceParts::largest, 500).repairs.empty());
  EXPECT_EQ(children(), 2);
  EXPECT_EQ(remesh_surface(off, body, 0.5).problem, "");
  EXPECT_EQ(children(), 3);
  EXPECT_FALSE(wrapped_surface(body, 0.3, usual_wrap_offset, "a.off").triangles.empty());
  EXPECT_EQ(children(), 4);
}

TEST_F(SealedChildren, OfMeshers) {
  MeshOptions options;
  options.edge_length = 0.5;
  EXPECT_FALSE(mesh_surface(testing::cube(), options, "a.off").nodes.empty());
  EXPECT_EQ(children(), 1);
  EXPECT_FALSE(mesh_surface_with_cgal(testing::cube(), options, "a.off").nodes.empty());
  EXPECT_EQ(children(), 2);
  PolygonGeometry square;
  square.points = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)};
  EXPECT_FALSE(mesh_polygon(square, options, "polygon", notes_).nodes.empty());
  EXPECT_EQ(children(), 3);
}

TEST_F(SealedChildren, OfImages) {
  std::string voxels(1000, '\0');
  for (int v = 0; v < 1000; ++v)
    if (v % 10 > 1 && v % 10 < 8 && v / 10 % 10 > 1 && v / 10 % 10 < 8 && v / 100 > 1 && v / 100 < 8)
      voxels[static_cast<std::size_t>(v)] = 1;
  std::string inr =
      "#INRIMAGE-4#{\nXDIM=10\nYDIM=10\nZDIM=10\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\nSCALE=2**0\n"
      "CPU=decm\nVX=1\nVY=1\nVZ=1\n##}\n";
  std::string nifti(352, '\0');
  const auto put = [&]<class T>(std::size_t at, T value) {
    std::copy_n(reinterpret_cast<const char*>(&value), sizeof value,
                nifti.begin() + static_cast<std::ptrdiff_t>(at));
  };
  put(0, std::int32_t{348});
  for (const std::size_t k : {0U, 1U, 2U, 3U}) {
    put(40 + 2 * k, k == 0 ? std::int16_t{3} : std::int16_t{10});
    put(76 + 4 * k, 1.0F);
  }
  put(70, std::int16_t{2});
  put(72, std::int16_t{8});
  put(108, 352.0F);
  nifti.replace(344, 3, "n+1");
  const std::string nrrd = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 10 10 10\nencoding: raw\n\n";
  MeshOptions options;
  options.edge_length = 2.0;
  options.mesher = Mesher::cgal;
  int expected = 0;
  for (const auto& [name, bytes] : {std::pair<const char*, std::string>{"a.inr", inr + voxels},
                                    {"a.nii", nifti + voxels},
                                    {"a.nrrd", nrrd + voxels}}) {
    EXPECT_FALSE(mesh_image({folder_.write(name, bytes), {}, false}, options, notes_).nodes.empty()) << name;
    expected += 2;  // the reader and the mesher
    EXPECT_EQ(children(), expected) << name;
  }
}

TEST_F(SealedChildren, OfPictures) {
  const std::filesystem::path file = folder_.path() / "a.png";
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = image.height = 8;
  image.format = PNG_FORMAT_GRAY;
  const std::string white(64, '\xff');
  ASSERT_NE(png_image_write_to_file(&image, file.c_str(), 0, white.data(), 0, nullptr), 0);
  EXPECT_EQ(read_picture({file}).width, 8);
  EXPECT_EQ(children(), 1);
}

TEST_F(SealedChildren, OfHdf5) {
  const std::filesystem::path path = folder_.path() / "a.h5";
  const std::vector<double> values = {1.0, 2.0, 3.0};
  const std::array<std::int64_t, 1> dims = {3};
  hdf5::File file = hdf5::File::create(path);
  file.write("/x", number_type<double>(), dims, values.data());
  file.close();
  const Contents contents =
      Contents::of(open_file(path, OpenMode::read), hdf5::index_of(open_file(path, OpenMode::read)));
  EXPECT_EQ(contents.locate("/x", number_type<double>(), 1).bytes, 24);
  EXPECT_EQ(children(), 1);
}

}  // namespace
}  // namespace palpate::sealed_children_test

/// In place of the C library's, for all of this program.
extern "C" ssize_t write(int fd, const void* bytes, std::size_t size) {
  palpate::sealed_children_test::try_all_in_child();
  return ::syscall(SYS_write, fd, bytes, size);
}
