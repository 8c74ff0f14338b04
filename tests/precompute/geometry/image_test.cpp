// Labelled images: voxels, distances and meshes.
#include <gtest/gtest.h>

#include <numbers>

#include "meshes/check.h"
#include "meshes/quality.h"
#include "meshes/surface.h"
#include "meshes/topology.h"
#include "precompute/geometry/distance_field.h"
#include "precompute/geometry/image_mesh.h"
#include "precompute/geometry/interface_crossings.h"
#include "tests/support/bodies/geometry_shapes.h"

namespace palpate::image_test {
namespace {

using testing::error_of;
using testing::expect_mentions;
using testing::TempFolder;
using testing::volume;

/// Labelled image in memory, written as INR (one byte a voxel).
struct TestImage {
  std::array<int, 3> size{};
  Vec3 spacing = Vec3::Ones();
  std::vector<unsigned char> labels;

  TestImage(std::array<int, 3> n, const Vec3& h) : size(n), spacing(h) {
    labels.assign(testing::at(n[0]) * testing::at(n[1]) * testing::at(n[2]), 0);
  }

  unsigned char& operator()(int i, int j, int k) {
    return labels[testing::at(i) +
                  testing::at(size[0]) * (testing::at(j) + testing::at(size[1]) * testing::at(k))];
  }

  [[nodiscard]] std::string inr() const {
    std::string text = "#INRIMAGE-4#{\nXDIM=" + std::to_string(size[0]) +
                       "\nYDIM=" + std::to_string(size[1]) + "\nZDIM=" + std::to_string(size[2]) +
                       "\nVDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\nSCALE=2**0\nCPU=decm\nVX=" +
                       std::to_string(spacing[0]) + "\nVY=" + std::to_string(spacing[1]) +
                       "\nVZ=" + std::to_string(spacing[2]) + "\n";
    text.resize(252, '\n');
    text += "##}\n";
    return text + std::string(labels.begin(), labels.end());
  }
};

double ball_volume(double radius) {
  return 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
}

constexpr double ball_radius = 20.0;
const Vec3 ball_center(30.0, 31.0, 29.0);

/// Ball of label 2 within a shell of label 5, both together of radius 20 mm, in voxels of 1 x 1 x 1.5 mm.
TestImage ball_image() {
  TestImage image({62, 62, 40}, {1.0, 1.0, 1.5});
  for (int k = 0; k < 40; ++k) {
    for (int j = 0; j < 62; ++j) {
      for (int i = 0; i < 62; ++i) {
        const double r = (Vec3(i, j, 1.5 * k) - ball_center).norm();
        image(i, j, k) = static_cast<unsigned char>(r > ball_radius ? 0 : r > 0.8 * ball_radius ? 5 : 2);
      }
    }
  }
  return image;
}

MeshOptions edges(double length, Mesher mesher = Mesher::cgal) {
  MeshOptions options;
  options.mesher = mesher;
  options.edge_length = length;
  return options;
}

class ImageMesh : public ::testing::Test {
 protected:
  Mesh mesh(const TestImage& image, const MeshOptions& options, std::vector<int> labels = {}) {
    return mesh_image({folder_.write("scan.inr", image.inr()), std::move(labels), false}, options, notes_);
  }
  Mesh regions(const TestImage& image, const MeshOptions& options) {
    return mesh_image({folder_.write("scan.inr", image.inr()), {}, true}, options, notes_);
  }

  TempFolder folder_;
  std::vector<std::string> notes_;
};

TEST_F(ImageMesh, BallHasItsVolumeAndPlace) {
  TestImage image = ball_image();
  image(2, 2, 2) = 9;  // stray voxels
  image(60, 60, 38) = 5;
  image(30, 30, 20) = 0;  // and a cavity
  Mesh ball = mesh(image, edges(3.0));
  EXPECT_EQ(notes_.size(), 3U);
  expect_mentions(notes_.at(0), {"labels 2, 5 and 9 are one tissue"});
  expect_mentions(notes_.at(1), {"dropped 2 stray part(s)", "2 voxel(s)"});
  expect_mentions(notes_.at(2), {"filled 1 cavity(ies)"});

  const double exact = ball_volume(ball_radius);
  EXPECT_NEAR(volume(ball), exact, 0.03 * exact);
  orient_elements(ball, "ball");
  check_connected(ball, "ball");
  const Surface surface = extract_surface(ball);
  double edge_sum = 0.0;
  for (Index f = 0; f < surface.count(); ++f) {
    const auto nodes = surface.facet_nodes(f);
    edge_sum += (ball.nodes[testing::at(nodes[0])] - ball.nodes[testing::at(nodes[1])]).norm();
  }
  for (const Index node : surface.nodes) {
    EXPECT_NEAR((ball.nodes[testing::at(node)] - ball_center).norm(), ball_radius,
                1.0);  // half a voxel and smoothing
  }
  EXPECT_NEAR(edge_sum / surface.count(), 3.0, 0.6);
  EXPECT_GT(measure_quality(ball).min_angle, 5.0);
}

TEST_F(ImageMesh, SelectedLabelsAreTheBody) {
  const double exact = ball_volume(0.8 * ball_radius);
  EXPECT_NEAR(volume(mesh(ball_image(), edges(3.0), {2})), exact, 0.04 * exact);
}

TEST_F(ImageMesh, SameInputSameMesh) {
  MeshOptions options = edges(9.0);
  options.odt = options.lloyd = true;
  for (const Mesher mesher : {Mesher::cgal, Mesher::tetgen}) {
    options.mesher = mesher;
    const Mesh a = regions(ball_image(), options), b = regions(ball_image(), options);
    EXPECT_EQ(a.nodes, b.nodes);
    EXPECT_EQ(a.connectivity, b.connectivity);
    EXPECT_EQ(a.regions, b.regions);
  }
}

TEST_F(ImageMesh, InteriorIsGraded) {
  for (const Mesher mesher : {Mesher::cgal, Mesher::tetgen}) {
    MeshOptions uniform = edges(4.0, mesher);
    uniform.grading = 0.0;
    EXPECT_LT(mesh(ball_image(), edges(4.0, mesher)).elements(), mesh(ball_image(), uniform).elements() / 2);
  }
}

TEST_F(ImageMesh, OptimisationImprovesElements) {
  MeshOptions options = edges(4.0);
  options.perturb = options.exude = false;
  const auto quality = [&] { return measure_quality(mesh(ball_image(), options)); };
  const QualityReport plain = quality();
  options.odt = true;
  const QualityReport odt = quality();
  options.odt = false;
  options.lloyd = true;
  const QualityReport lloyd = quality();
  options.lloyd = false;
  options.exude = true;
  const QualityReport exuded = quality();
  options.exude = false;
  options.perturb = true;
  const QualityReport perturbed = quality();

  EXPECT_LT(plain.min_angle, 5.0);  // slivers
  EXPECT_GT(odt.mean_shape, plain.mean_shape + 0.01);
  EXPECT_GT(lloyd.mean_shape, plain.mean_shape + 0.005);
  EXPECT_GT(exuded.min_angle, plain.min_angle + 2.0);
  EXPECT_GT(perturbed.min_angle, 10.0);  // it stops at 12
}

TEST_F(ImageMesh, TetGenFillsTheSameSurface) {
  MeshOptions options = edges(3.0, Mesher::tetgen);
  Mesh ball = mesh(ball_image(), options);
  EXPECT_NEAR(volume(ball), ball_volume(ball_radius), 0.04 * ball_volume(ball_radius));
  orient_elements(ball, "ball");
  check_connected(ball, "ball");
  for (const Index node : extract_surface(ball).nodes) {
    EXPECT_NEAR((ball.nodes[testing::at(node)] - ball_center).norm(), ball_radius, 1.0);
  }
  EXPECT_EQ(std::count(ball.regions.begin(), ball.regions.end(), 0), ball.elements());
  EXPECT_GT(measure_quality(ball).min_angle, 5.0);
}

double region_volume(const Mesh& mesh, Index region) {
  double sum = 0.0;
  for (Index e = 0; e < mesh.elements(); ++e) {
    sum += mesh.regions[testing::at(e)] == region ? volume(mesh, e) : 0.0;
  }
  return sum;
}

TEST_F(ImageMesh, LabelsAreRegions) {
  const double inner = ball_volume(0.8 * ball_radius), shell = ball_volume(ball_radius) - inner;
  for (const Mesher mesher : {Mesher::cgal, Mesher::tetgen}) {
    TestImage image = ball_image();
    image(30, 30, 20) = 84;  // strays
    image(31, 30, 20) = 84;
    notes_.clear();
    MeshOptions options = edges(3.0, mesher);
    Mesh ball = regions(image, options);
    ASSERT_EQ(notes_.size(), 3U);
    expect_mentions(notes_[0], {"2 voxel(s) of label 84, in 1 part(s)"});
    expect_mentions(notes_[1], {"label 2: volume ", "in the image", "in the mesh (-"});
    expect_mentions(notes_[2], {"label 5: volume "});
    EXPECT_NEAR(region_volume(ball, 2), inner, 0.05 * inner);
    EXPECT_NEAR(region_volume(ball, 5), shell, 0.05 * shell);
    EXPECT_NEAR(region_volume(ball, 2) + region_volume(ball, 5), volume(ball), 1e-6);
    orient_elements(ball, "ball");
    check_connected(ball, "ball");

    const std::vector<ElementSide> sides = sorted_sides(ball);
    int interface = 0;
    for (std::size_t s = 1; s < sides.size(); ++s) {
      const ElementSide &a = sides[s - 1], &b = sides[s];
      if (a.corners == b.corners &&
          ball.regions[testing::at(a.element)] != ball.regions[testing::at(b.element)]) {
        ++interface;
        for (std::size_t i = 0; i < 3; ++i) {
          EXPECT_NEAR((ball.nodes[testing::at(a.corners[i])] - ball_center).norm(), 0.8 * ball_radius, 1.0);
        }
      }
    }
    EXPECT_GT(interface, 200);
  }
}

TEST_F(ImageMesh, SmallPartsOfALabelSurvive) {
  TestImage image({62, 62, 62}, {1, 1, 1});
  const Vec3 nodule(22, 34, 28);
  double voxels = 0.0;
  for (int k = 0; k < 62; ++k) {
    for (int j = 0; j < 62; ++j) {
      for (int i = 0; i < 62; ++i) {
        const Vec3 x(i, j, k);
        const double r = (x - Vec3(30, 30, 30)).norm(), from_axis = std::hypot(i - 40.0, j - 30.0);
        const bool is_vessel = (x - nodule).norm() < 4.0 || (from_axis < 2.5 && std::abs(k - 30) < 15);
        image(i, j, k) = r > 28.0 ? 0 : is_vessel ? 2 : 255;
        voxels += is_vessel ? 1.0 : 0.0;
      }
    }
  }
  for (const Mesher mesher : {Mesher::cgal, Mesher::tetgen}) {
    MeshOptions options = edges(8.0, mesher);  // much longer than the vessel is thick
    options.perturb = false;                   // it would take long to find little
    const Mesh organ = regions(image, options);
    double of_nodule = 0.0;
    for (Index e = 0; e < organ.elements(); ++e) {
      if (organ.regions[testing::at(e)] == 2 && (testing::corner(organ, e, 0) - nodule).norm() < 6.0) {
        of_nodule += volume(organ, e);
      }
    }
    EXPECT_GT(of_nodule, 0.5 * ball_volume(4.0));
    EXPECT_GT(region_volume(organ, 2), 0.6 * voxels);
    EXPECT_LT(region_volume(organ, 2), voxels);
    EXPECT_NEAR(volume(organ), ball_volume(28.0), 0.06 * ball_volume(28.0));
  }
}

TEST_F(ImageMesh, CavitiesStayEmpty) {
  TestImage image = ball_image();
  std::replace(image.labels.begin(), image.labels.end(), static_cast<unsigned char>(2),
               static_cast<unsigned char>(0));
  const double shell = ball_volume(ball_radius) - ball_volume(0.8 * ball_radius);
  for (const Mesher mesher : {Mesher::cgal, Mesher::tetgen}) {
    EXPECT_NEAR(volume(mesh(image, edges(4.0, mesher))), shell, 0.05 * shell);
  }
}

/// A block of 10 x 10 x 6 voxels with a plate of one voxel on it, so long.
TestImage block_with_fin(int length) {
  TestImage image({40, 20, 20}, {1, 1, 1});
  for (int k = 0; k < 20; ++k) {
    for (int j = 4; j < 14; ++j)
      for (int i = 4; i < 4 + length; ++i)
        if ((k >= 4 && k < 10 && i < 14) || k == 4) image(i, j, k) = 1;
  }
  return image;
}

TEST_F(ImageMesh, BodyOneVoxelThickIsRefusedAtOnce) {
  TestImage plate({40, 30, 14}, {4, 4, 4});
  for (int j = 4; j < 26; ++j)
    for (int i = 4; i < 36; ++i) plate(i, j, 6) = 1;
  TestImage slice({20, 20, 1}, {1, 1, 3});
  std::fill(slice.labels.begin(), slice.labels.end(), static_cast<unsigned char>(1));
  for (const TestImage& image : {plate, slice, block_with_fin(30)})
    expect_mentions(error_of([&] { mesh(image, edges(8.0)); }),
                    {"scan.inr", "too thin", "one voxel thick", "voxels a third as large"});
}

TEST_F(ImageMesh, ThinPartsAndVolumeThatAreLostAreTold) {
  mesh(block_with_fin(16), edges(2.0));
  ASSERT_FALSE(notes_.empty());
  expect_mentions(notes_.front(), {"a thin part", "one voxel thick, is lost"});
  notes_.clear();
  const double exact = ball_volume(ball_radius);
  const double lost = 1.0 - volume(mesh(ball_image(), edges(18.0))) / exact;
  ASSERT_GT(lost, 0.05);
  expect_mentions(notes_.back(), {"less volume than the image's body"});
}

TEST_F(ImageMesh, SmallBodiesKeepTheirVolume) {
  TestImage image({19, 19, 19}, {1, 1, 1});
  double voxels = 0.0;
  for (int k = 0; k < 19; ++k) {
    for (int j = 0; j < 19; ++j)
      for (int i = 0; i < 19; ++i)
        if (Vec3(i - 9, j - 9, k - 9).norm() < 4.6) voxels += image(i, j, k) = 1;
  }
  MeshOptions options = edges(0.7);
  options.facet_distance = 0.05;
  EXPECT_NEAR(volume(mesh(image, options)), voxels, 0.05 * voxels);  // smoothing alone takes 15 %
}

TEST(DistanceField, FlatSidesMoveByAsMuchAsIsMissing) {
  VoxelBody box;
  box.size = {14, 14, 14};
  box.inside.assign(box.voxels(), 0);
  for (Index k = 3; k < 11; ++k)
    for (Index j = 3; j < 11; ++j)
      for (Index i = 3; i < 11; ++i) box.inside[box.at(i, j, k)] = 1;
  DistanceField field(box, box.inside);
  field.grow_to(512.0);
  double samples = 0.0;
  for (int k = 0; k < 112; ++k) {
    for (int j = 0; j < 112; ++j)
      for (int i = 0; i < 112; ++i)
        samples += field((Vec3(i, j, k) + Vec3::Constant(0.5)) / 8.0 - Vec3::Constant(0.5)) > 0.0 ? 1.0 : 0.0;
  }
  EXPECT_NEAR(samples / 512.0, 512.0, 8.0);
}

TEST_F(ImageMesh, BodyThatTouchesTheRim) {
  TestImage image({20, 20, 20}, {1, 1, 1});
  std::fill(image.labels.begin(), image.labels.end(), static_cast<unsigned char>(1));
  EXPECT_NEAR(volume(mesh(image, edges(2.0))), 8000.0, 16.0);
}

/// Fills the voxels from `low` to, but without, `high`.
void fill(TestImage& image, const std::array<int, 3>& low, const std::array<int, 3>& high,
          unsigned char label) {
  for (int k = low[2]; k < high[2]; ++k)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i) image(i, j, k) = label;
}

/// A block of 16 x 11 x 6 voxels with a tower of 5 x 5 x 3 on it, in line with one of its sides.
TestImage tower(const Vec3& spacing, unsigned char label) {
  TestImage image({22, 17, 15}, spacing);
  fill(image, {3, 3, 3}, {19, 14, 9}, 1);
  fill(image, {8, 9, 9}, {13, 14, 12}, label);
  return image;
}

TEST_F(ImageMesh, EdgesOfBoxesAreKept) {
  for (const Mesher mesher : {Mesher::cgal, Mesher::tetgen}) {
    for (const double length : {0.6, 1.5, 4.0}) {
      const Vec3 spacing(1.0, 1.5, 0.8);
      const Mesh box = mesh(tower(spacing, 1), edges(length, mesher));
      Vec3 low = Vec3::Constant(1e9), high = -low;
      for (const Vec3& x : box.nodes) {
        low = low.cwiseMin(x);
        high = high.cwiseMax(x);
      }
      EXPECT_TRUE(low.isApprox(Vec3(2.5, 2.5, 2.5).cwiseProduct(spacing), 2e-3)) << low.transpose();
      EXPECT_TRUE(high.isApprox(Vec3(18.5, 13.5, 11.5).cwiseProduct(spacing), 2e-3)) << high.transpose();
      EXPECT_NEAR(volume(box) / ((16 * 11 * 6 + 5 * 5 * 3) * spacing.prod()), 1.0, 5e-3);
      EXPECT_GT(measure_quality(box).min_angle, 2.0);
    }
  }
}

TEST_F(ImageMesh, EdgesOfBoxesOfTwoLabelsAreKept) {
  const Mesh box = regions(tower({1.0, 1.0, 1.0}, 2), edges(1.5));
  EXPECT_NEAR(volume(box), 16 * 11 * 6 + 5 * 5 * 3, 5.0);
}

TEST_F(ImageMesh, EdgesALittleShorterAreTriedWhereTheMesherGivesUp) {
  TestImage image({10, 13, 13}, {1.0, 2.0, 1.0});
  fill(image, {2, 2, 2}, {8, 11, 11}, 1);
  EXPECT_NEAR(volume(mesh(image, edges(0.999))), 972.0,
              10.0);  // CGAL 5.5 does with 0.999, not with 0.97 of it
}

std::size_t count_sharp_edges(const TestImage& image) {
  VoxelBody body;
  for (std::size_t axis = 0; axis < 3; ++axis) body.size[axis] = image.size[axis];
  for (const unsigned char label : image.labels) body.inside.push_back(label != 0 ? 1 : 0);
  const SharpEdges sharp = sharp_edges(body);
  EXPECT_EQ(sharp.known.empty(), sharp.edges.empty());
  return sharp.edges.size();
}

TEST(SharpEdges, BoxesHaveThem) {
  TestImage image({20, 20, 20}, {1, 1, 1});
  fill(image, {4, 4, 4}, {15, 15, 9}, 1);
  EXPECT_EQ(count_sharp_edges(image), 12U);
  fill(image, {4, 4, 9}, {9, 15, 14}, 1);
  EXPECT_EQ(count_sharp_edges(image), 18U);  // an L
  EXPECT_EQ(count_sharp_edges(tower({1, 1, 1}, 1)), 24U);
}

TEST(SharpEdges, RoundBodiesAndThinSheetsHaveNone) {
  for (double radius = 2.5; radius < 14.0; radius += 0.37) {
    TestImage ball({32, 32, 32}, {1, 1, 1}), cut({32, 32, 32}, {1, 1, 1}), oblique({32, 32, 32}, {1, 1, 1});
    for (int k = 0; k < 32; ++k) {
      for (int j = 0; j < 32; ++j) {
        for (int i = 0; i < 32; ++i) {
          const Vec3 x(i - 15.6, j - 15.2, k - 15.9);
          ball(i, j, k) = x.norm() < radius ? 1 : 0;
          cut(i, j, k) = x.head<2>().norm() < radius && k > 8 && k < 22 ? 1 : 0;  // a cylinder
          oblique(i, j, k) =
              std::abs(x[0] + 0.2 * x[1] - 0.1 * x[2]) < 0.4 * radius && x.norm() < 14.0 ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(count_sharp_edges(ball), 0U) << radius;
    EXPECT_EQ(count_sharp_edges(cut), 0U) << radius;
    EXPECT_EQ(count_sharp_edges(oblique), 0U) << radius;
  }
  TestImage sheet({20, 20, 20}, {1, 1, 1});
  fill(sheet, {4, 4, 4}, {15, 15, 6}, 1);
  EXPECT_EQ(count_sharp_edges(sheet), 0U);
}

TEST_F(ImageMesh, VoxelsThatTouchAlongAnEdge) {
  TestImage image({40, 20, 20}, {1, 1, 1});
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 40; ++i) {
        image(i, j, k) =
            (i < 20) == (j < 10) || k < 8 ? 1 : 0;  // two blocks on a plate, a checkerboard from above
      }
    }
  }
  Mesh result = mesh(image, edges(3.0));
  orient_elements(result, "blocks");
  check_connected(result, "blocks");
  EXPECT_NEAR(volume(result), 11200.0, 600.0);
}

TEST_F(ImageMesh, BadImages) {
  const auto error = [&](const TestImage& image, std::vector<int> labels) {
    return error_of([&] { mesh(image, edges(5.0), std::move(labels)); });
  };
  const TestImage empty({10, 10, 10}, {1, 1, 1});
  expect_mentions(error(empty, {}), {"scan.inr", "image is empty"});
  expect_mentions(error(ball_image(), {2, 77}), {"no voxel", "label 77", "0, 2, 5"});
  const std::filesystem::path scan = folder_.write("scan.inr", ball_image().inr());
  expect_mentions(error_of([&] {
                    mesh_image({scan, {3}, true}, edges(5.0), notes_);
                  }),
                  {"no voxel", "label 3"});
  TestImage no_spacing({4, 4, 4}, {1, 0, 1});
  no_spacing(1, 1, 1) = 1;
  expect_mentions(error(no_spacing, {}), {"not a readable image", "positive VX, VY, VZ"});
  TestImage two({30, 10, 10}, {1, 1, 1});
  for (int i = 0; i < 8; ++i) {
    two(2 + i, 5, 5) = 1;
    two(15 + i, 5, 5) = 1;
  }
  expect_mentions(error(two, {}), {"disconnected parts", "8 voxels", "image units"});
}

TEST_F(ImageMesh, UnreadableFiles) {
  const auto error = [&](const std::string& name) {
    return error_of([&] { mesh_image({folder_.path() / name, {}, false}, edges(5.0), notes_); });
  };
  expect_mentions(error("none.inr"), {"none.inr", "No such file", "image ="});
  const std::string whole = ball_image().inr();
  std::string several = whole;
  several.replace(several.find("VDIM=1"), 6, "VDIM=2");
  folder_.write("several.inr", several);
  folder_.write("text.inr", "this is no image\n");
  folder_.write("empty.inr", "");
  folder_.write("header.inr", whole.substr(0, 120));
  folder_.write("cut.inr", whole.substr(0, whole.size() / 2));
  for (const std::string name : {"several.inr", "text.inr", "empty.inr", "header.inr", "cut.inr"}) {
    expect_mentions(error(name), {name, "image"});
  }
}

/// Distance to the nearest voxel of the other kind, by trying all of them.
double tried_distance(const VoxelBody& body, const std::array<Index, 3>& from) {
  const std::uint8_t own = body.inside[body.at(from[0], from[1], from[2])];
  double nearest = 1e30;
  for (Index k = 0; k < body.size[2]; ++k) {
    for (Index j = 0; j < body.size[1]; ++j) {
      for (Index i = 0; i < body.size[0]; ++i) {
        if (body.inside[body.at(i, j, k)] != own) {
          const Vec3 step(i - from[0], j - from[1], k - from[2]);
          nearest = std::min(nearest, step.cwiseProduct(body.spacing).norm());
        }
      }
    }
  }
  return own != 0 ? nearest : -nearest;
}

TEST(VoxelBody, DistancesAreExact) {
  VoxelBody body;
  body.size = {9, 7, 8};
  body.spacing = {0.6, 1.0, 1.7};
  body.origin = {-1.0, 4.0, 2.0};
  unsigned state = 1;
  for (int v = 0; v < 9 * 7 * 8; ++v) {
    state = state * 1664525U + 1013904223U;
    body.inside.push_back(state >> 30 == 0 ? 1 : 0);
  }
  const std::vector<float> distance = signed_distances(body, body.inside);
  for (Index k = 0; k < 8; ++k) {
    for (Index j = 0; j < 7; ++j) {
      for (Index i = 0; i < 9; ++i) {
        EXPECT_NEAR(distance[body.at(i, j, k)], tried_distance(body, {i, j, k}), 1e-5);
      }
    }
  }
}

TEST(VoxelBody, JoinsAcrossEdges) {
  VoxelBody body;
  body.size = {6, 6, 6};
  body.inside.assign(216, 0);
  for (const auto& [i, j, k] : {std::array{1, 1, 1}, {2, 2, 1}, {3, 2, 2}, {4, 4, 4}}) {
    body.inside[body.at(i, j, k)] = 1;
  }
  EXPECT_EQ(join_across_edges(body), 2U);  // between the first three; the fourth touches nothing
  EXPECT_EQ(std::count(body.inside.begin(), body.inside.end(), 1), 6);
  EXPECT_EQ(join_across_edges(body), 0U);
  std::vector<std::string> notes;
  EXPECT_NE(error_of([&] { keep_one_part(body, "here", notes); }).find("5 voxels"), std::string::npos);
}

TEST(VoxelBody, CropKeepsPlaces) {
  VoxelBody body;
  body.size = {6, 5, 4};
  body.spacing = {1, 2, 3};
  body.inside.assign(120, 0);
  body.inside[body.at(3, 2, 1)] = body.inside[body.at(4, 2, 1)] = 1;
  const VoxelBody small = crop(body, 2);
  EXPECT_EQ(small.size, (std::array<Index, 3>{6, 5, 5}));
  EXPECT_EQ(small.origin, Vec3(1, 0, -3));
  EXPECT_EQ(small.inside[small.at(2, 2, 2)] + small.inside[small.at(3, 2, 2)], 2);
  EXPECT_EQ(std::count(small.inside.begin(), small.inside.end(), 1), 2);
}

TEST(VoxelBody, FieldIsLinearBesideAPlane) {
  VoxelBody body;
  body.size = {12, 5, 5};
  body.spacing = {0.5, 1, 1};
  body.origin = {10, 0, 0};
  body.inside.assign(300, 0);
  for (Index i = 0; i < 6; ++i) {
    for (Index jk = 0; jk < 25; ++jk) {
      body.inside[body.at(i, jk % 5, jk / 5)] = 1;
    }
  }
  const DistanceField field(body, body.inside);
  EXPECT_NEAR(field({12.75, 2.0, 2.0}), 0.0, 1e-6);  // midway between the voxels 5 and 6
  EXPECT_NEAR(field({11.25, 2.3, 1.6}), 1.75, 1e-6);
  EXPECT_NEAR(field({14.25, 2.3, 1.6}), -1.75, 1e-6);
}

/// A row of voxels with these labels, no_label for empty ones.
VoxelBody row(const std::vector<Index>& labels) {
  VoxelBody body;
  body.size = {static_cast<Index>(labels.size()), 3, 3};
  body.inside.assign(9 * labels.size(), 0);
  body.labels.assign(9 * labels.size(), VoxelBody::no_label);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const std::size_t v = body.at(static_cast<Index>(i), 1, 1);
    body.inside[v] = labels[i] == VoxelBody::no_label ? 0 : 1;
    body.labels[v] = labels[i];
  }
  return body;
}

std::vector<Index> labels_along(const VoxelBody& row) {
  std::vector<Index> labels;
  for (Index i = 0; i < row.size[0]; ++i) {
    labels.push_back(row.labels[row.at(i, 1, 1)]);
  }
  return labels;
}

TEST(VoxelBody, CompletesLabels) {
  constexpr Index none = VoxelBody::no_label;
  VoxelBody body = row({none, 7, 7, 7, 84, 84, 5, 5, 5, none, 5, 5, 9, 7, 7, 7, none});
  body.inside[body.at(9, 1, 1)] = 1;   // a filled cavity
  body.inside[body.at(15, 1, 1)] = 0;  // a dropped voxel
  std::vector<std::string> notes;
  complete_labels(body, 3, notes);
  EXPECT_EQ(labels_along(body),
            (std::vector<Index>{none, 7, 7, 7, 7, 5, 5, 5, 5, 5, 5, 5, 5, 5, 5, none, none}));
  ASSERT_EQ(notes.size(), 4U);  // of label 5, the two beyond the cavity; of label 7, the last two
  expect_mentions(notes[0], {"2 voxel(s) of label 5, in 1 part(s)"});
  expect_mentions(notes[1], {"2 voxel(s) of label 7, in 1 part(s)"});
  expect_mentions(notes[2], {"1 voxel(s) of label 9, in 1 part(s)"});
  expect_mentions(notes[3], {"2 voxel(s) of label 84, in 1 part(s)"});

  VoxelBody small = row({none, 1, 2, 2, none});
  complete_labels(small, 1000, notes);  // the largest part stays
  EXPECT_EQ(labels_along(small), (std::vector<Index>{none, 2, 2, 2, none}));
}

/// Slabs along x in a block of 7 x 7 voxels that ends two voxels before the rim.
VoxelBody slabs(const std::vector<std::pair<Index, int>>& layers) {
  VoxelBody body;
  std::vector<Index> labels(2, VoxelBody::no_label);
  for (const auto& [label, thickness] : layers) {
    labels.insert(labels.end(), static_cast<std::size_t>(thickness), label);
  }
  labels.insert(labels.end(), 2, VoxelBody::no_label);
  body.size = {static_cast<Index>(labels.size()), 31, 31};
  for (Index jk = 0; jk < 31 * 31; ++jk) {
    const bool is_rim = std::min(jk % 31, jk / 31) < 2 || std::max(jk % 31, jk / 31) > 28;
    for (const Index label : labels) {
      body.labels.push_back(is_rim ? VoxelBody::no_label : label);
      body.inside.push_back(body.labels.back() == VoxelBody::no_label ? 0 : 1);
    }
  }
  return body;
}

TEST(LabelField, LabelsMeetMidway) {
  const LabelField field(slabs({{30, 10}, {20, 10}}));
  EXPECT_EQ(field.labels(), (std::vector<Index>{20, 30}));
  const auto at = [&](double x) { return field({x, 15.0, 15.0}); };
  EXPECT_EQ(at(1.4).number, 0);
  EXPECT_EQ(at(1.6).number, 2);  // 30, between the centres of voxels 1 and 2
  EXPECT_EQ(at(11.4).number, 2);
  EXPECT_EQ(at(11.6).number, 1);
  EXPECT_EQ(at(21.4).number, 1);
  EXPECT_EQ(at(21.6).number, 0);
  EXPECT_NEAR(at(8.0).depth, 4.0, 1e-5);  // to voxel 12
  EXPECT_EQ(at(30.0).depth, 0.0);
}

TEST(LabelField, CrossingsAreDenseWhereALabelIsThin) {
  const auto nearest = [](const std::vector<Crossing>& crossings, Index x) {
    double least = 1e30;
    for (const Crossing& a : crossings) {
      EXPECT_NEAR((a.from - a.to).norm(), 1.0, 1e-12);
      for (const Crossing& b : crossings) {
        if (&a != &b && a.from[0] == x && b.from[0] == x) {
          least = std::min(least, (a.from - b.from).norm());
        }
      }
    }
    return least;
  };
  const VoxelBody thick = slabs({{1, 15}, {2, 15}}), thin = slabs({{1, 15}, {2, 3}, {1, 15}});
  const auto wide = interface_crossings(thick, LabelField(thick), 6.0);
  const auto dense = interface_crossings(thin, LabelField(thin), 6.0);
  EXPECT_GE(nearest(wide, 16), 6.0);
  EXPECT_GT(wide.size(), 9U);
  EXPECT_LE(nearest(dense, 16), 2.0);  // half of 3 voxels
  EXPECT_GT(dense.size(), 10 * wide.size());
}

}  // namespace
}  // namespace palpate::image_test
