// What OpenIGTLink clients are sent of a run's messages to pages, read back by the OpenIGTLink library and
// held against the body itself.
#include "runtime/igtl/igtl_messages.h"

#include <gtest/gtest.h>
#include <igtlPolyDataMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "runtime/body/patch_maker.h"
#include "runtime/scene/drawn_picture.h"
#include "runtime/viewer/wire.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/files/igtl_reader.h"
#include "tests/support/runtime_tool.h"

namespace palpate::igtl_messages_test {
namespace {

/// A body with rest loads that a tilted ball presses, and its picture.
struct Pressed {
  explicit Pressed(int dimension, Scope scope = Scope::full)
      : body([&] {
          Model model = test::unit_model(dimension, 4, scope, Precision::double_precision);
          test::set_rest(model, 0.02);
          return Body(std::move(model));
        }()),
        state(body, {.tools = {test::plain(Tool{.radius = 0.1})}}) {
    const Vec3 top = test::top_middle(dimension);
    ToolPose at = test::pose(top + test::upright(dimension, 0.06, 0.03, 0.02));
    if (dimension == 3) at.orientation = Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, 3.0).normalized());
    test::go(body, state, top + test::upright(dimension, 0.0, 0.0, 0.4), at, 50);
    SurfaceFrames frames(body, state, {.ticks_per_frame = 1, .in_background = false},
                         [this](SurfacePicture seen) { picture = std::move(seen); });
    frames.post(state, 51, 3.25);
  }

  /// As a program that is sent it gets it.
  [[nodiscard]] WatchedPicture watched() const {
    PictureReader reader;
    EXPECT_FALSE(reader.take(encode_scene(scene)));
    EXPECT_TRUE(reader.take(encode_frame(picture, scene, nullptr)));
    return reader.picture();
  }

  Body body;
  State state;
  SurfacePicture picture;
  Scene scene = make_scene(body, 1);
};

/// Values at nodes of the scene in the order in which they are sent.
template <class Value>
std::vector<Value> in_order(const Scene& scene, const std::vector<Value>& values) {
  std::vector<Value> ordered;
  for (const Index node : scene.order) ordered.push_back(values[static_cast<std::size_t>(node)]);
  return ordered;
}

/// Simplices of the scene by the places of their nodes in that order.
template <std::size_t corners>
std::vector<std::array<Index, corners>> in_order(const Scene& scene,
                                                 std::vector<std::array<Index, corners>> simplices) {
  std::vector<Index> places(scene.order.size());
  for (std::size_t k = 0; k < places.size(); ++k)
    places[static_cast<std::size_t>(scene.order[k])] = static_cast<Index>(k);
  for (auto& nodes : simplices)
    for (Index& node : nodes) node = places[static_cast<std::size_t>(node)];
  return simplices;
}

/// Where each node of the mesh is, from the tick's own displacements.
std::vector<Vec3> moved_nodes(const Pressed& pressed) {
  const Model& model = pressed.body.model();
  std::vector<double> u(static_cast<std::size_t>(pressed.body.greens().order()));
  surface_displacement(pressed.body, pressed.state, u);
  std::vector<Vec3> nodes = model.mesh.nodes;
  const auto d = static_cast<std::size_t>(pressed.body.dimension());
  for (std::size_t node = 0; node < nodes.size(); ++node) {
    nodes[node] += model.rest_displacement[node];
    const Index stored = pressed.body.stored_node(static_cast<Index>(node));
    for (std::size_t axis = 0; stored >= 0 && axis < d; ++axis)
      nodes[node][static_cast<Eigen::Index>(axis)] += u[d * static_cast<std::size_t>(stored) + axis];
  }
  return nodes;
}

/// Pages are sent displacements to 1/10 000 of the largest component, here some centimetres [mm].
constexpr double rounding = 0.02;

void expect_points(igtl::PolyDataMessage& message, const std::vector<Vec3>& expected) {
  ASSERT_EQ(message.GetPoints()->GetNumberOfPoints(), std::ssize(expected));
  for (std::size_t k = 0; k < expected.size(); ++k) {
    Eigen::Vector3f p;
    message.GetPoints()->GetPoint(static_cast<unsigned>(k), p.data());
    EXPECT_LT((p.cast<double>() - 1e3 * expected[k]).norm(), rounding) << k;
  }
}

template <std::size_t corners>
void expect_cells(igtl::PolyDataCellArray* cells, const std::vector<std::array<Index, corners>>& expected) {
  ASSERT_NE(cells, nullptr);
  ASSERT_EQ(cells->GetNumberOfCells(), expected.size());
  for (std::size_t t = 0; t < expected.size(); ++t) {
    std::array<igtlUint32, corners> cell{};
    ASSERT_EQ(cells->GetCellSize(static_cast<unsigned>(t)), corners);
    cells->GetCell(static_cast<unsigned>(t), cell.data());
    EXPECT_TRUE(
        std::ranges::equal(cell, expected[t], [](auto a, auto b) { return static_cast<Index>(a) == b; }));
  }
}

std::vector<float> scalars(igtl::PolyDataMessage& message, unsigned k, const std::string& name) {
  igtl::PolyDataAttribute* attribute = message.GetAttribute(k);
  EXPECT_EQ(attribute->GetName(), name);
  EXPECT_EQ(attribute->GetType(), igtl::PolyDataAttribute::POINT_SCALAR);
  std::vector<float> values(attribute->GetSize());
  attribute->GetData(values.data());
  return values;
}

TEST(IgtlMessages, SurfaceIsWhereTheBodysIs) {
  const Pressed pressed(3);
  const auto message = test::unpack<igtl::PolyDataMessage>(igtl_surface(pressed.watched()));
  ASSERT_TRUE(message);
  EXPECT_STREQ(message->GetDeviceName(), "Palpate surface");
  EXPECT_EQ(test::time_of(*message), 3.25);
  const std::vector<Vec3> moved = moved_nodes(pressed);
  std::vector<Vec3> expected, without_loads;
  for (const Index node : pressed.body.surface_mesh_nodes()) {
    expected.push_back(moved[static_cast<std::size_t>(node)]);
    without_loads.push_back(pressed.body.model().mesh.nodes[static_cast<std::size_t>(node)]);
  }
  expected = in_order(pressed.scene, expected);
  without_loads = in_order(pressed.scene, without_loads);
  expect_points(*message, expected);
  expect_cells(message->GetPolygons(), in_order(pressed.scene, pressed.scene.triangles));

  ASSERT_EQ(message->GetNumberOfAttributes(), 3);
  const std::vector<float> displacement = scalars(*message, 0, "displacement [mm]");
  float largest = 0.0F;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    EXPECT_NEAR(displacement[k], 1e3 * (expected[k] - without_loads[k]).norm(), rounding) << k;
    largest = std::max(largest, displacement[k]);
  }
  EXPECT_GT(largest, 20.0F);  // it is pressed by centimetres
  EXPECT_EQ(scalars(*message, 1, "von Mises stress [Pa]").size(), expected.size());
  const std::vector<float> pressure = scalars(*message, 2, "contact pressure [Pa]");
  EXPECT_EQ(pressure, in_order(pressed.scene, pressed.picture.frame.pressure));
  EXPECT_GT(*std::ranges::max_element(pressure), 0.0F);
}

TEST(IgtlMessages, StressIsNotANumberWhereItIsNotKnown) {
  const Pressed pressed(3);
  const auto message = test::unpack<igtl::PolyDataMessage>(igtl_surface(pressed.watched()));
  const std::vector<float> stress = scalars(*message, 1, "von Mises stress [Pa]");
  const std::vector<float> expected = in_order(pressed.scene, pressed.picture.frame.von_mises);
  ASSERT_EQ(stress.size(), expected.size());
  float largest = 0.0F;
  for (const float known : expected) largest = std::fmax(largest, known);
  std::size_t unknown = 0;
  for (std::size_t k = 0; k < stress.size(); ++k) {
    ASSERT_EQ(std::isnan(stress[k]), std::isnan(expected[k])) << k;
    unknown += std::isnan(stress[k]) ? 1 : 0;
    if (std::isnan(stress[k])) continue;
    EXPECT_NEAR(stress[k], expected[k], largest / 8192) << k;
  }
  EXPECT_GT(unknown, 0U);  // at the clamped side
  EXPECT_LT(unknown, stress.size() / 2);
}

TEST(IgtlMessages, PlaneIsItsElementsOrItsBoundary) {
  const Pressed all(2);
  const auto elements = test::unpack<igtl::PolyDataMessage>(igtl_surface(all.watched()));
  expect_points(*elements, in_order(all.scene, moved_nodes(all)));
  expect_cells(elements->GetPolygons(), in_order(all.scene, all.scene.triangles));
  EXPECT_EQ(elements->GetPolygons()->GetNumberOfCells(), 32U);  // 4 x 4 squares

  const Pressed boundary(2, Scope::surface);
  const auto lines = test::unpack<igtl::PolyDataMessage>(igtl_surface(boundary.watched()));
  const std::vector<Vec3> moved = moved_nodes(boundary);
  std::vector<Vec3> expected;
  for (const Index node : boundary.body.surface_mesh_nodes())
    expected.push_back(moved[static_cast<std::size_t>(node)]);
  expect_points(*lines, in_order(boundary.scene, expected));
  expect_cells(lines->GetLines(), in_order(boundary.scene, boundary.scene.edges));
  EXPECT_EQ(lines->GetLines()->GetNumberOfCells(), 16U);
}

TEST(IgtlMessages, OverlayIsInPlaceOfWhatItRefines) {
  constexpr int refinement = 3;
  const Body body(test::unit_model(3, 4, Scope::full, Precision::double_precision), {}, refinement);
  const Index centre = body.nearest_surface_node(test::top_middle(3)).node;
  SurfacePicture picture;
  picture.patch = PatchMaker(body, 1).make({&centre, 1});
  picture.frame.displacement.resize(3 * body.surface_in_mesh().size());
  picture.frame.von_mises.resize(body.surface_in_mesh().size());
  PictureDrawing drawing;
  EXPECT_FALSE(drawing.draw(picture, &body)) << "there is no scene yet";
  const auto scene = std::make_shared<const Scene>(make_scene(body, 1));
  drawing.set_scene(scene);
  const std::optional<DrawnPicture> drawn = drawing.draw(picture, &body);
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawing.draw(picture, &body)->patch, drawn->patch) << "it is drawn once";

  PictureReader reader;
  EXPECT_FALSE(reader.take(encode_scene(*scene)));
  EXPECT_FALSE(reader.take(encode_patch(1, *drawn->patch)));
  EXPECT_TRUE(reader.take(encode_frame(drawn->picture, *scene, drawn->patch.get())));
  const auto message = test::unpack<igtl::PolyDataMessage>(igtl_surface(reader.picture()));
  std::vector<Vec3> expected = in_order(*scene, scene->nodes);
  expected.insert(expected.end(), drawn->patch->nodes.begin(), drawn->patch->nodes.end());
  expect_points(*message, expected);
  const std::size_t hidden = drawn->patch->hidden.size();
  ASSERT_GT(hidden, 0U);
  EXPECT_EQ(message->GetPolygons()->GetNumberOfCells(),
            scene->triangles.size() + (refinement * refinement - 1) * hidden);

  picture.patch.reset();  // and gone again
  EXPECT_TRUE(reader.take(encode_frame(picture, *scene, nullptr)));
  const auto without = test::unpack<igtl::PolyDataMessage>(igtl_surface(reader.picture()));
  expect_points(*without, in_order(*scene, scene->nodes));
  expect_cells(without->GetPolygons(), in_order(*scene, scene->triangles));
}

TEST(IgtlMessages, ToolAndForceAreTheTicks) {
  const Pressed pressed(3);
  const ToolState& tool = pressed.state.tools.front();
  const auto transform = test::unpack<igtl::TransformMessage>(igtl_tool(pressed.watched()));
  ASSERT_TRUE(transform);
  EXPECT_STREQ(transform->GetDeviceName(), "Palpate tool");
  EXPECT_EQ(test::time_of(*transform), 3.25);
  igtl::Matrix4x4 matrix;
  transform->GetMatrix(matrix);
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, 3.0).normalized()).toRotationMatrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) EXPECT_NEAR(matrix[row][column], rotation(row, column), 1e-6);
    EXPECT_NEAR(matrix[row][3], 1e3 * tool.pose.position[row], 1e-4);
  }

  const auto text = test::unpack<igtl::StringMessage>(igtl_force(pressed.watched()));
  ASSERT_TRUE(text);
  EXPECT_STREQ(text->GetDeviceName(), "Palpate force");
  EXPECT_EQ(test::time_of(*text), 3.25);
  const auto numbers = nlohmann::json::parse(text->GetString());
  ASSERT_GT(tool.wrench.force.z(), 1e-3);  // the hand is pushed up
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    EXPECT_FLOAT_EQ(numbers["force_N"][axis], static_cast<float>(tool.wrench.force[axis]));
    EXPECT_FLOAT_EQ(numbers["torque_Nm"][axis], static_cast<float>(tool.wrench.torque[axis]));
  }
}

/// A message that is cut short is refused, and one of another body not taken; a byte that is another harms
/// nothing.
TEST(WatchedPictures, AreReadStrictly) {
  const Pressed pressed(3);
  const std::string scene = encode_scene(pressed.scene);
  const std::string frame = encode_frame(pressed.picture, pressed.scene, nullptr);
  for (std::size_t size = 0; size < frame.size(); size += 7) {
    PictureReader reader;
    EXPECT_FALSE(reader.take(scene));
    EXPECT_THROW(static_cast<void>(reader.take(frame.substr(0, size))), std::out_of_range) << size;
  }
  EXPECT_THROW(static_cast<void>(PictureReader().take(scene.substr(0, scene.size() / 2))), std::out_of_range);
  const WireValues base = wire_values(pressed.picture, pressed.scene, nullptr, 1);
  WireValues next = base;
  next.number = 2;
  PictureReader of_whole_ones;
  EXPECT_FALSE(of_whole_ones.take(scene));
  EXPECT_THROW(static_cast<void>(
                   of_whole_ones.take(encode_frame(pressed.picture, pressed.scene, nullptr, next, &base))),
               std::out_of_range);
  PictureReader of_another;
  EXPECT_FALSE(of_another.take(encode_scene(make_scene(pressed.body, 2))));
  EXPECT_FALSE(of_another.take(frame));
  for (std::size_t at = 0; at < frame.size(); ++at) {
    std::string changed = frame;
    changed[at] = static_cast<char>(changed[at] ^ 0x41);
    PictureReader reader;
    EXPECT_FALSE(reader.take(scene));
    try {
      static_cast<void>(reader.take(changed));
    } catch (const std::out_of_range&) {
    }
  }
}

}  // namespace
}  // namespace palpate::igtl_messages_test
