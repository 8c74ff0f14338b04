// Binary messages, decoded by the text of web/PROTOCOL.md, and files of what is seen.
#include "runtime/viewer/wire.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <random>

#include "base/error.h"
#include "runtime/body/patch_maker.h"
#include "runtime/scene/node_order.h"
#include "runtime/scene/seen_surface.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/files/viewer_decoder.h"

namespace palpate::wire_test {
namespace {

constexpr double half_unit = 0.5 + 1e-9;  // to which values are rounded
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

Body body_of(ElementType element, int refinement = 1, int cells = 3) {
  return Body(test::unit_model(element, cells, Scope::full, Precision::double_precision), {}, refinement);
}

/// Displacement (0.1 x, -0.2 x, 0.05) of what is at x.
std::vector<float> sheared(const std::vector<Vec3>& nodes) {
  std::vector<float> u;
  for (const Vec3& node : nodes) {
    for (const double x : {0.1 * node.x(), -0.2 * node.x(), 0.05}) u.push_back(static_cast<float>(x));
  }
  return u;
}

SurfacePicture picture_of(const Body& body) {
  SurfacePicture picture;
  picture.frame.tick = 5'000'000'000;
  picture.frame.time = 12.25;
  picture.frame.displacement = sheared(body.surface_in_mesh());
  picture.tool.position = Vec3(1, 2, 3);
  picture.device.position = Vec3(4, 5, 6);
  picture.device.orientation = Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5);
  picture.on_body = {Vec3(0.5, 1.5, -2.5), Vec3(7, 8, 9)};
  picture.status = StepStatus::inside_body | StepStatus::pose_limited;
  picture.force_error = 0.375;
  picture.left_out = 300;
  picture.greens_error = 0.0625;
  return picture;
}

std::size_t node_at(const Scene& scene, std::size_t place) {
  return static_cast<std::size_t>(scene.order.at(place));
}

std::vector<Index> all_of(std::vector<Index> order) {
  std::sort(order.begin(), order.end());
  return order;
}

/// Each displacement of the scene's nodes within half a unit of `displacement` [S x 3], which is the body's
/// order.
void expect_displacements(const test::DecodedFrame& frame, const Scene& scene,
                          const std::vector<float>& displacement) {
  ASSERT_GE(frame.u.size(), 3 * scene.nodes.size());
  for (std::size_t k = 0; k < 3 * scene.nodes.size(); ++k)
    EXPECT_NEAR(frame.u[k], displacement[3 * node_at(scene, k / 3) + k % 3], half_unit * frame.unit_u);
}

TEST(ViewerWire, SceneComesBack) {
  const Scene scene = make_scene(body_of(ElementType::tet4), 9);
  const test::DecodedScene decoded = test::decode_scene(encode_scene(scene));
  EXPECT_EQ(decoded.scene, 9U);
  EXPECT_EQ(decoded.dimension, 3U);
  const std::vector<Index> sorted = all_of(scene.order);
  for (std::size_t k = 0; k < sorted.size(); ++k) EXPECT_EQ(sorted[k], static_cast<Index>(k));
  ASSERT_EQ(decoded.position.size(), 3 * scene.nodes.size());
  for (std::size_t k = 0; k < decoded.position.size(); ++k)
    EXPECT_EQ(decoded.position[k],
              static_cast<float>(scene.nodes[node_at(scene, k / 3)][static_cast<Eigen::Index>(k % 3)]));
  ASSERT_EQ(decoded.triangle.size(), 3 * scene.triangles.size());
  for (std::size_t k = 0; k < decoded.triangle.size(); ++k)
    EXPECT_EQ(node_at(scene, decoded.triangle[k]), static_cast<std::size_t>(scene.triangles[k / 3][k % 3]));
  ASSERT_EQ(decoded.edge.size(), 2 * scene.edges.size());
  for (std::size_t k = 0; k < decoded.edge.size(); ++k)
    EXPECT_EQ(node_at(scene, decoded.edge[k]), static_cast<std::size_t>(scene.edges[k / 2][k % 2]));
  ASSERT_EQ(decoded.held.size(), scene.held.size());
  for (std::size_t k = 0; k < decoded.held.size(); ++k)
    EXPECT_EQ(decoded.held[k], scene.held[node_at(scene, k)]);
}

TEST(ViewerWire, SceneOfTwoMaterialsComesBack) {
  const Scene scene = make_scene(Body(test::two_materials(ElementType::hex8, 3), {}, 1), 9);
  const test::DecodedScene decoded = test::decode_scene(encode_scene(scene));
  EXPECT_EQ(decoded.held.size(), scene.held.size());
  EXPECT_EQ(decoded.material, scene.materials);
  EXPECT_EQ(decoded.inside, scene.inner.inside);
  EXPECT_EQ(decoded.outside, scene.inner.outside);
  ASSERT_EQ(decoded.inner_triangle.size(), 3 * scene.inner.triangles.size());
  ASSERT_EQ(decoded.inner_position.size(), 3 * scene.inner.nodes.size());
  for (std::size_t k = 0; k < decoded.inner_triangle.size(); ++k)
    EXPECT_EQ(decoded.inner_triangle[k], static_cast<std::uint32_t>(scene.inner.triangles[k / 3][k % 3]));
}

TEST(ViewerWire, FrameComesBackToItsUnits) {
  const Body body = body_of(ElementType::tet4);
  const Scene scene = make_scene(body, 2);
  SurfacePicture picture = picture_of(body);
  const std::size_t nodes = scene.nodes.size();
  picture.frame.von_mises.assign(nodes, 100.0F);
  picture.frame.von_mises[1] = not_a_number;
  picture.frame.von_mises[2] = 0.0F;
  picture.frame.von_mises[3] = 65534.0F;
  picture.frame.pressure.assign(nodes, 0.0F);
  picture.frame.pressure[4] = 12.5F;
  picture.contacts = {{Vec3(1, 2, 3), Vec3(0, 0, 1), Vec3(4, 5, 6), true}, {}};
  ASSERT_TRUE(fits(picture, scene, nullptr));
  const test::DecodedFrame frame = test::decode_frame(encode_frame(picture, scene, nullptr), nodes);
  EXPECT_EQ(frame.scene, 2U);
  EXPECT_EQ(frame.tick, 5e9);
  EXPECT_EQ(frame.time, 12.25);
  EXPECT_EQ(frame.tool, (std::vector<float>{1, 2, 3, 0, 0, 0, 1}));
  EXPECT_EQ(frame.device, (std::vector<float>{4, 5, 6, -0.5, 0.5, 0.5, 0.5}));
  EXPECT_EQ(frame.force, (std::vector<float>{0.5, 1.5, -2.5}));
  EXPECT_EQ(frame.torque, (std::vector<float>{7, 8, 9}));
  EXPECT_EQ(frame.status, (1U << 6) | (1U << 7));
  EXPECT_EQ(frame.force_error, 0.375F);
  EXPECT_EQ(frame.left_out, 300U);
  EXPECT_EQ(frame.greens_error, 0.0625F);
  EXPECT_EQ(frame.patch, 0U);
  EXPECT_EQ(frame.patch_nodes, 0U);
  ASSERT_EQ(frame.contact.size(), 20U);
  EXPECT_EQ(std::vector<float>(frame.contact.begin(), frame.contact.begin() + 10),
            (std::vector<float>{1, 2, 3, 0, 0, 1, 4, 5, 6, 1}));
  EXPECT_EQ(frame.contact[19], 0.0F);
  ASSERT_EQ(frame.pressure_node.size(), 1U);
  EXPECT_EQ(node_at(scene, frame.pressure_node[0]), 4U);
  EXPECT_EQ(frame.pressure, std::vector<float>{12.5F});
  EXPECT_EQ(frame.exponent_u, -15);  // 0.2 is 6554 units
  expect_displacements(frame, scene, picture.frame.displacement);
  EXPECT_EQ(frame.unit_stress, 8.0);  // 65534 is 8192 units, nearly
  for (std::size_t k = 0; k < nodes; ++k) {
    const float stress = picture.frame.von_mises[node_at(scene, k)];
    if (std::isnan(stress)) {
      EXPECT_EQ(frame.stress[k], -1.0);
    } else {
      EXPECT_NEAR(frame.stress[k], stress, half_unit * frame.unit_stress);
    }
  }
}

TEST(ViewerWire, FrameOfUnknownStressOfRestAndOfWhatIsNotFinite) {
  const Body body = body_of(ElementType::tet4);
  const Scene scene = make_scene(body, 2);
  SurfacePicture picture = picture_of(body);
  picture.frame.displacement.assign(3 * scene.nodes.size(), 0.0F);
  test::DecodedFrame frame = test::decode_frame(encode_frame(picture, scene, nullptr), scene.nodes.size());
  EXPECT_EQ(frame.u, std::vector<double>(3 * scene.nodes.size(), 0.0));
  EXPECT_EQ(frame.stress, std::vector<double>(scene.nodes.size(), -1.0));
  picture.frame.displacement[0] = not_a_number;
  picture.frame.displacement[1] = std::numeric_limits<float>::infinity();
  picture.frame.displacement[2] = -2.0F;
  frame = test::decode_frame(encode_frame(picture, scene, nullptr), scene.nodes.size());
  const auto first =
      static_cast<std::size_t>(std::find(scene.order.begin(), scene.order.end(), 0) - scene.order.begin());
  EXPECT_EQ(frame.u[3 * first], 0.0);
  EXPECT_EQ(frame.u[3 * first + 1], 0.0);
  EXPECT_EQ(frame.u[3 * first + 2], -2.0);
}

TEST(ViewerWire, PicturesOfOtherBodiesDoNotFit) {
  const Body body = body_of(ElementType::tet4);
  const Scene scene = make_scene(body, 1);
  SurfacePicture picture = picture_of(body);
  EXPECT_TRUE(fits(picture, scene, nullptr));
  picture.frame.displacement.pop_back();
  EXPECT_FALSE(fits(picture, scene, nullptr));
  const Body plate = body_of(ElementType::quad4);
  SurfacePicture of_plate = picture_of(plate);
  EXPECT_FALSE(fits(of_plate, make_scene(plate, 1), nullptr));
  of_plate.plane_displacement.assign(3 * plate.model().mesh.nodes.size(), 0.0F);
  EXPECT_TRUE(fits(of_plate, make_scene(plate, 1), nullptr));
}

struct Patched {
  Body body;
  Scene scene = make_scene(body, 1);
  ScenePatch patch;

  explicit Patched(ElementType element, int cells = 3) : body(body_of(element, 2, cells)) {
    const Index centre = body.nearest_surface_node(test::top_middle(body.dimension())).node;
    patch = make_scene_patch(body, scene, *PatchMaker(body, 1).make({&centre, 1}));
    patch.number = 5;
  }
};

TEST(ViewerWire, PatchAndItsFrameComeBack) {
  const Patched patched(ElementType::tet4);
  const ScenePatch& patch = patched.patch;
  const test::DecodedPatch decoded = test::decode_patch(encode_patch(1, patch));
  EXPECT_EQ(decoded.scene, 1U);
  EXPECT_EQ(decoded.patch, 5U);
  EXPECT_TRUE(std::equal(decoded.hidden.begin(), decoded.hidden.end(), patch.hidden.begin(),
                         patch.hidden.end(),
                         [](std::uint32_t a, Index b) { return static_cast<Index>(a) == b; }));
  ASSERT_EQ(decoded.position.size(), 3 * patch.nodes.size());
  EXPECT_EQ(decoded.position[5], static_cast<float>(patch.nodes[1].z()));
  ASSERT_EQ(decoded.triangle.size(), 3 * patch.triangles.size());
  EXPECT_EQ(decoded.triangle[4], static_cast<std::uint32_t>(patch.triangles[1][1]));
  ASSERT_EQ(decoded.outline.size(), 2 * patch.outline.size());
  EXPECT_EQ(decoded.outline[3], static_cast<std::uint32_t>(patch.outline[1][1]));

  SurfacePicture picture = picture_of(patched.body);
  // The pressure of a node of the body is that of the patch's node there too.
  const std::size_t S = patched.scene.nodes.size();
  picture.frame.pressure.assign(patched.body.surface_rest_positions().size(), 0.0F);
  const auto of_body = static_cast<std::size_t>(patch.surface_nodes.front());
  const auto fine = static_cast<std::size_t>(patch.surface_nodes.back());
  ASSERT_LT(of_body, S);
  ASSERT_GE(fine, S);
  picture.frame.pressure[of_body] = 2.0F;
  picture.frame.pressure[fine] = 3.0F;
  ASSERT_TRUE(fits(picture, patched.scene, &patch));
  const test::DecodedFrame frame = test::decode_frame(encode_frame(picture, patched.scene, &patch), S);
  EXPECT_EQ(frame.patch, 5U);
  ASSERT_EQ(frame.patch_nodes, patch.nodes.size());
  const std::vector<float> expected = sheared(patch.nodes);
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(frame.u[3 * S + k], expected[k], half_unit * frame.unit_u);
  ASSERT_EQ(frame.pressure_node.size(), 3U);
  EXPECT_EQ(node_at(patched.scene, frame.pressure_node[0]), of_body);
  EXPECT_EQ(frame.pressure_node[1], S);
  EXPECT_EQ(frame.pressure_node[2], S + patch.nodes.size() - 1);
  EXPECT_EQ(frame.pressure, (std::vector<float>{2, 2, 3}));
}

TEST(ViewerWire, FrameOfAPlateHasAllItsNodes) {
  const Body plate = body_of(ElementType::quad4);
  const Scene scene = make_scene(plate, 1);
  SurfacePicture picture = picture_of(plate);
  picture.plane_displacement = sheared(plate.model().mesh.nodes);
  picture.plane_von_mises.assign(scene.nodes.size(), 3.0F);
  picture.frame.pressure.assign(plate.surface_mesh_nodes().size(), 0.0F);
  picture.frame.pressure.back() = 4.0F;
  const test::DecodedFrame frame =
      test::decode_frame(encode_frame(picture, scene, nullptr), scene.nodes.size());
  expect_displacements(frame, scene, picture.plane_displacement);
  EXPECT_EQ(frame.stress.back(), 3.0);
  ASSERT_EQ(frame.pressure_node.size(), 1U);
  EXPECT_EQ(node_at(scene, frame.pressure_node[0]),
            static_cast<std::size_t>(plate.surface_mesh_nodes().back()));
}

TEST(ViewerWire, PatchOfAPlateOfAnOddNumberOfNodesComesBack) {
  const Patched patched(ElementType::quad4, 2);
  const std::size_t S = patched.scene.nodes.size();
  ASSERT_EQ(S % 2, 1U);  // so that its stresses end amid four bytes
  SurfacePicture picture = picture_of(patched.body);
  picture.plane_displacement = sheared(patched.body.model().mesh.nodes);
  const test::DecodedFrame frame =
      test::decode_frame(encode_frame(picture, patched.scene, &patched.patch), S);
  ASSERT_EQ(frame.patch_nodes, patched.patch.nodes.size());
  const std::vector<float> expected = sheared(patched.patch.nodes);
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(frame.u[3 * S + k], expected[k], half_unit * frame.unit_u);
}

/// A picture of a body of some nodes, of displacements and stresses as `value` has them.
struct Numbers {
  Scene scene;
  SurfacePicture picture;

  Numbers(std::size_t nodes, const std::function<float(std::size_t node, std::size_t axis)>& value) {
    scene.number = 1;
    for (std::size_t k = 0; k < nodes; ++k)
      scene.nodes.emplace_back(static_cast<double>(k * 7 % nodes), static_cast<double>(k * k % 13), 0.0);
    scene.order = order_along_curve(scene.nodes);
    scene.held.resize(nodes);
    for (std::size_t k = 0; k < nodes; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) picture.frame.displacement.push_back(value(k, axis));
      picture.frame.von_mises.push_back(value(k, 3));
    }
  }
  [[nodiscard]] WireValues values(std::uint32_t number) const {
    return wire_values(picture, scene, nullptr, number);
  }
  [[nodiscard]] test::DecodedFrame decoded(const WireValues& own, const WireValues* base,
                                           const test::DecodedFrame* base_frame) const {
    return test::decode_frame(encode_frame(picture, scene, nullptr, own, base), scene.nodes.size(),
                              base_frame);
  }
};

TEST(ViewerWire, PicturesAreOffByATenThousandthOfTheLargest) {
  for (const double largest : {1e-12, 4.999e-3, 5.001e-3, 0.0078, 3.0, 1e6}) {
    const Numbers numbers(500, [&](std::size_t node, std::size_t axis) {
      return static_cast<float>(largest * std::sin(static_cast<double>(3 * node + axis) + 1.0));
    });
    const test::DecodedFrame frame = numbers.decoded(numbers.values(1), nullptr, nullptr);
    for (std::size_t k = 0; k < 500; ++k) {
      const std::size_t node = node_at(numbers.scene, k);
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_NEAR(frame.u[3 * k + axis], numbers.picture.frame.displacement[3 * node + axis],
                    1e-4 * largest);
      EXPECT_NEAR(frame.stress[k], std::max(0.0F, numbers.picture.frame.von_mises[node]), largest / 8192.0);
    }
  }
}

/// As they come one after the other, each is what it is alone: whatever the units were before, and where
/// stresses become known or are so no more.
TEST(ViewerWire, PicturesFollowFromTheOneBefore) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-1.0F, 1.0F);
  constexpr std::size_t nodes = 333;
  std::optional<WireValues> base;
  std::optional<test::DecodedFrame> base_frame;
  std::uint32_t number = 0;
  for (const float largest : {1.0F, 1.0F, 2.9F, 0.3F, 1e-3F, 0.0F, 0.1F, 300.0F, 310.0F, 1e-30F, 5.0F}) {
    const Numbers numbers(nodes, [&](std::size_t node, std::size_t axis) {
      return axis == 3 && (node + number) % 50 == 0 ? not_a_number : largest * any(random);
    });
    const WireValues values = numbers.values(++number);
    const test::DecodedFrame alone = numbers.decoded(values, nullptr, nullptr);
    const test::DecodedFrame next =
        numbers.decoded(values, base ? &*base : nullptr, base_frame ? &*base_frame : nullptr);
    EXPECT_EQ(next.base, number - 1);
    EXPECT_EQ(alone.base, 0U);
    for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(next.numbers[c], alone.numbers[c]) << number << ' ' << c;
    base = values;
    base_frame = next;
  }
}

TEST(ViewerWire, PicturesAreAsLargeAsWhatMoved) {
  constexpr std::size_t nodes = 100'000;
  const auto still = [](std::size_t node, std::size_t axis) {
    return 1e-3F * static_cast<float>((node * 17 + axis * 5) % 1000);
  };
  const Numbers before(nodes, still);
  const Numbers same(nodes, still);
  const WireValues base = before.values(1);
  const std::string head = encode_frame(Numbers(0, still).picture, Numbers(0, still).scene, nullptr);
  EXPECT_LE(encode_frame(same.picture, same.scene, nullptr, same.values(2), &base).size(), head.size() + 30);
  Numbers moved(nodes, still);  // one node in a thousand, by half of the largest
  for (std::size_t k = 0; k < nodes; k += 1000) moved.picture.frame.displacement[3 * k + 1] += 0.3F;
  const std::size_t bytes = encode_frame(moved.picture, moved.scene, nullptr, moved.values(2), &base).size();
  EXPECT_LE(bytes, head.size() + std::size_t{100} * 50);  // 100 of 12 500 blocks, and what lies between
}

/// Of a patch that goes on the change is sent, of one that comes anew all.
TEST(ViewerWire, PatchesFollowFromTheOneBefore) {
  Patched patched(ElementType::tet4);
  const std::size_t S = patched.scene.nodes.size();
  SurfacePicture picture = picture_of(patched.body);
  const WireValues base = wire_values(picture, patched.scene, &patched.patch, 1);
  const test::DecodedFrame first =
      test::decode_frame(encode_frame(picture, patched.scene, &patched.patch, base, nullptr), S);
  for (float& u : picture.frame.displacement) u *= 1.25F;
  for (const std::uint32_t number : {5U, 6U}) {
    patched.patch.number = number;
    const WireValues values = wire_values(picture, patched.scene, &patched.patch, 2);
    const test::DecodedFrame frame =
        test::decode_frame(encode_frame(picture, patched.scene, &patched.patch, values, &base), S, &first);
    const std::vector<float> expected = sheared(patched.patch.nodes);
    for (std::size_t k = 0; k < expected.size(); ++k)
      EXPECT_NEAR(frame.u[3 * S + k], 1.25 * expected[k], half_unit * frame.unit_u + 1e-7);
  }
}

TEST(NodeOrder, NeighboursFollowEachOther) {
  for (const bool is_plane : {true, false}) {
    std::vector<Vec3> nodes;
    for (int x = 0; x < 16; ++x) {
      for (int y = 0; y < 16; ++y) {
        for (int z = 0; z < (is_plane ? 1 : 16); ++z) nodes.emplace_back(x * 7 % 16, y * 5 % 16, z);
      }
    }
    const std::vector<Index> order = order_along_curve(nodes);
    const std::vector<Index> sorted = all_of(order);
    for (std::size_t k = 0; k < nodes.size(); ++k) EXPECT_EQ(sorted[k], static_cast<Index>(k));
    double way = 0.0;
    for (std::size_t k = 1; k < nodes.size(); ++k)
      way +=
          (nodes[static_cast<std::size_t>(order[k])] - nodes[static_cast<std::size_t>(order[k - 1])]).norm();
    // A curve through all cells goes from each to one beside it; a plane cuts off some of its ways.
    EXPECT_LE(way / static_cast<double>(nodes.size() - 1), is_plane ? 1.5 : 1.0 + 1e-9);
  }
  EXPECT_TRUE(order_along_curve({}).empty());
  EXPECT_EQ(order_along_curve(std::vector<Vec3>(3, Vec3::Ones())), (std::vector<Index>{0, 1, 2}));
}

TEST(ViewerWire, TicksComeBack) {
  std::vector<TickNote> notes(3);
  for (std::size_t k = 0; k < notes.size(); ++k) {
    notes[k].number = 100 + 4 * static_cast<std::int64_t>(k);
    notes[k].force = Vec3(1, 2, static_cast<double>(k));
    notes[k].shown = 0.5;
    notes[k].depth = 0.001;
    notes[k].lateness_ns = 2500;
    notes[k].compute_ns = 1500;
    notes[k].contacts = k == 2 ? 1000 : static_cast<std::int32_t>(k);
    notes[k].status = k == 1 ? StepStatus::not_converged : StepStatus::ok;
    notes[k].force_error = 0.25 * static_cast<double>(k);
    notes[k].left_out = k == 2 ? 70'000 : 0;
  }
  const test::DecodedTicks ticks = test::decode_ticks(encode_ticks(8, notes, 4));
  EXPECT_EQ(ticks.scene, 8U);
  EXPECT_EQ(ticks.first, 100.0);
  EXPECT_EQ(ticks.stride, 4U);
  EXPECT_EQ(ticks.force, (std::vector<float>{1, 2, 0, 1, 2, 1, 1, 2, 2}));
  EXPECT_EQ(ticks.shown, std::vector<float>(3, 0.5F));
  EXPECT_EQ(ticks.depth, std::vector<float>(3, 0.001F));
  EXPECT_EQ(ticks.late_us, std::vector<float>(3, 2.5F));
  EXPECT_EQ(ticks.compute_us, std::vector<float>(3, 1.5F));
  EXPECT_EQ(ticks.contacts, (std::vector<std::uint8_t>{0, 1, 255}));
  EXPECT_EQ(ticks.status, (std::vector<std::uint32_t>{0, 1U << 8, 0}));
  EXPECT_EQ(ticks.force_error, (std::vector<float>{0, 0.25, 0.5}));
  EXPECT_EQ(ticks.left_out, (std::vector<std::uint32_t>{0, 0, 70'000}));
}

/// Volume that an STL's triangles enclose.
double stl_volume(const std::string& stl) {
  test::Bytes bytes(stl.substr(80));
  const std::uint32_t triangles = bytes.u32();
  double volume = 0.0;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    Mat3 corners;
    Vec3 normal;
    for (double& x : normal) x = bytes.take<float>();
    for (Eigen::Index k = 0; k < 9; ++k) corners(k % 3, k / 3) = bytes.take<float>();
    (void)bytes.take<std::uint16_t>();
    EXPECT_GT(normal.dot((corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0))), 0.0);
    volume += corners.determinant() / 6.0;
  }
  EXPECT_TRUE(bytes.at_end());
  return volume;
}

TEST(SeenSurface, StlHoldsTheVolumeOfTheStretchedCube) {
  for (const bool with_patch : {false, true}) {
    const Patched patched(ElementType::tet4);
    SurfacePicture picture = picture_of(patched.body);  // x by 1.1; the rest is shear and shift
    const ScenePatch* patch = with_patch ? &patched.patch : nullptr;
    const std::string stl = surface_stl(picture, patched.scene, patch);
    EXPECT_NEAR(stl_volume(stl), 1.1, 1e-6);
    const std::size_t triangles =
        patched.scene.triangles.size() + (with_patch ? 3 * patched.patch.hidden.size() : 0);  // each is four
    EXPECT_EQ(stl.size(), 84 + 50 * triangles);
    const std::string vtu = surface_vtu(picture, patched.scene, patch);
    EXPECT_NE(vtu.find("NumberOfCells=\"" + std::to_string(triangles) + "\""), std::string::npos);
    for (const char* name : {"displacement", "von_mises", "pressure"})
      EXPECT_NE(vtu.find(std::string("Name=\"") + name + "\""), std::string::npos) << name;
  }
}

TEST(SeenSurface, OfAPlatesBoundaryIsLines) {
  const Body body(test::unit_model(ElementType::quad4, 4, Scope::surface, Precision::double_precision));
  const Scene scene = make_scene(body, 1);
  const SurfacePicture picture = picture_of(body);
  EXPECT_THROW(surface_stl(picture, scene, nullptr), Error);
  EXPECT_NE(surface_vtu(picture, scene, nullptr).find("NumberOfCells=\"16\""), std::string::npos);
}

}  // namespace
}  // namespace palpate::wire_test
