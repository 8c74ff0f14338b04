// Labelled images: voxels, distances and meshes.
#include <gtest/gtest.h>

#include <numbers>

#include "meshes/check.h"
#include "meshes/quality.h"
#include "meshes/surface.h"
#include "precompute/image_mesh.h"
#include "precompute/voxel_body.h"
#include "tests/geometry_shapes.h"

namespace palpate {
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

MeshOptions edges(double length) {
  MeshOptions options;
  options.edge_length = length;
  return options;
}

class ImageMesh : public ::testing::Test {
 protected:
  Mesh mesh(const TestImage& image, const MeshOptions& options, std::vector<int> labels = {}) {
    return mesh_image({folder_.write("scan.inr", image.inr()), std::move(labels)}, options, notes_);
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
  EXPECT_EQ(notes_.size(), 2U);
  expect_mentions(notes_.at(0), {"dropped 2 stray part(s)", "2 voxel(s)"});
  expect_mentions(notes_.at(1), {"filled 1 cavity(ies)"});

  const double exact = 4.0 / 3.0 * std::numbers::pi * std::pow(ball_radius, 3);
  EXPECT_NEAR(volume(ball), exact, 0.03 * exact);
  orient_elements(ball, "ball");
  check_connected(ball, "ball");
  const Surface surface = extract_surface(ball);
  double edge_sum = 0.0;
  for (const Triangle& t : surface.triangles) {
    edge_sum += (ball.nodes[testing::at(t[0])] - ball.nodes[testing::at(t[1])]).norm();
  }
  for (const Index node : surface.nodes) {
    EXPECT_NEAR((ball.nodes[testing::at(node)] - ball_center).norm(), ball_radius,
                1.0);  // half a voxel and smoothing
  }
  EXPECT_NEAR(edge_sum / static_cast<double>(surface.triangles.size()), 3.0, 0.6);
  EXPECT_GT(measure_quality(ball).min_dihedral, 5.0);
}

TEST_F(ImageMesh, SelectedLabelsAreTheBody) {
  const double exact = 4.0 / 3.0 * std::numbers::pi * std::pow(0.8 * ball_radius, 3);
  EXPECT_NEAR(volume(mesh(ball_image(), edges(3.0), {2})), exact, 0.04 * exact);
}

TEST_F(ImageMesh, SameInputSameMesh) {
  const Mesh a = mesh(ball_image(), edges(6.0)), b = mesh(ball_image(), edges(6.0));
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.tets, b.tets);
}

TEST_F(ImageMesh, InteriorIsGraded) {
  MeshOptions uniform = edges(4.0);
  uniform.grading = 0.0;
  EXPECT_LT(mesh(ball_image(), edges(4.0)).tets.size(), mesh(ball_image(), uniform).tets.size() / 2);
}

TEST_F(ImageMesh, BodyThatTouchesTheRim) {
  TestImage image({20, 20, 20}, {1, 1, 1});
  std::fill(image.labels.begin(), image.labels.end(), static_cast<unsigned char>(1));
  EXPECT_NEAR(volume(mesh(image, edges(2.0))), 8000.0, 320.0);  // smoothing and facets round its edges
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
    return error_of([&] { mesh_image({folder_.path() / name, {}}, edges(5.0), notes_); });
  };
  expect_mentions(error("none.inr"), {"none.inr", "no such image"});
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
  const std::vector<float> distance = signed_distances(body);
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
  const DistanceField field(body);
  EXPECT_NEAR(field({12.75, 2.0, 2.0}), 0.0, 1e-6);  // midway between the voxels 5 and 6
  EXPECT_NEAR(field({11.25, 2.3, 1.6}), 1.75, 1e-6);
  EXPECT_NEAR(field({14.25, 2.3, 1.6}), -1.75, 1e-6);
}

}  // namespace
}  // namespace palpate
