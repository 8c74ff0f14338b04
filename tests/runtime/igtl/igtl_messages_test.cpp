// What OpenIGTLink clients are sent, read back by the OpenIGTLink library and held against the body itself.
#include "runtime/igtl/igtl_messages.h"

#include <gtest/gtest.h>
#include <igtlPolyDataMessage.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "runtime/body/patch_maker.h"
#include "runtime/igtl/igtl_broadcast.h"
#include "tests/support/igtl_reader.h"
#include "tests/support/runtime_model.h"
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

  [[nodiscard]] DrawnPicture drawn() const {
    return {std::make_shared<const Scene>(make_scene(body, 1)), nullptr, picture};
  }

  Body body;
  State state;
  SurfacePicture picture;
};

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

void expect_points(igtl::PolyDataMessage& message, const std::vector<Vec3>& expected) {
  ASSERT_EQ(message.GetPoints()->GetNumberOfPoints(), std::ssize(expected));
  for (std::size_t k = 0; k < expected.size(); ++k) {
    Eigen::Vector3f p;
    message.GetPoints()->GetPoint(static_cast<unsigned>(k), p.data());
    EXPECT_LT((p.cast<double>() - 1e3 * expected[k]).norm(), 2e-4) << k;  // float at 1000 mm
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
  const DrawnPicture drawn = pressed.drawn();
  const auto message = test::unpack<igtl::PolyDataMessage>(igtl_surface(drawn));
  ASSERT_TRUE(message);
  EXPECT_STREQ(message->GetDeviceName(), "Palpate surface");
  EXPECT_EQ(test::time_of(*message), 3.25);
  const std::vector<Vec3> moved = moved_nodes(pressed);
  std::vector<Vec3> expected;
  for (const Index node : pressed.body.surface_mesh_nodes())
    expected.push_back(moved[static_cast<std::size_t>(node)]);
  expect_points(*message, expected);
  expect_cells(message->GetPolygons(), drawn.scene->triangles);

  ASSERT_EQ(message->GetNumberOfAttributes(), 3);
  const std::vector<float> displacement = scalars(*message, 0, "displacement [mm]");
  float largest = 0.0F;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const auto node = static_cast<std::size_t>(pressed.body.surface_mesh_nodes()[k]);
    const double size = 1e3 * (expected[k] - pressed.body.model().mesh.nodes[node]).norm();
    EXPECT_NEAR(displacement[k], size, 1e-4) << k;
    largest = std::max(largest, displacement[k]);
  }
  EXPECT_GT(largest, 20.0F);  // it is pressed by centimetres
  EXPECT_EQ(scalars(*message, 1, "von Mises stress [Pa]").size(), expected.size());
  const std::vector<float> pressure = scalars(*message, 2, "contact pressure [Pa]");
  EXPECT_EQ(pressure, pressed.picture.frame.pressure);
  EXPECT_GT(*std::ranges::max_element(pressure), 0.0F);
}

TEST(IgtlMessages, StressIsNotANumberWhereItIsNotKnown) {
  const Pressed pressed(3);
  const auto message = test::unpack<igtl::PolyDataMessage>(igtl_surface(pressed.drawn()));
  const std::vector<float> stress = scalars(*message, 1, "von Mises stress [Pa]");
  const std::vector<float>& expected = pressed.picture.frame.von_mises;
  ASSERT_EQ(stress.size(), expected.size());
  std::size_t unknown = 0;
  for (std::size_t k = 0; k < stress.size(); ++k) {
    unknown += std::isnan(stress[k]) ? 1 : 0;
    EXPECT_TRUE(stress[k] == expected[k] || (std::isnan(stress[k]) && std::isnan(expected[k]))) << k;
  }
  EXPECT_GT(unknown, 0U);  // at the clamped side
  EXPECT_LT(unknown, stress.size() / 2);
}

TEST(IgtlMessages, PlaneIsItsElementsOrItsBoundary) {
  const Pressed all(2);
  const auto elements = test::unpack<igtl::PolyDataMessage>(igtl_surface(all.drawn()));
  expect_points(*elements, moved_nodes(all));
  expect_cells(elements->GetPolygons(), all.drawn().scene->triangles);
  EXPECT_EQ(elements->GetPolygons()->GetNumberOfCells(), 32U);  // 4 x 4 squares

  const Pressed boundary(2, Scope::surface);
  const auto lines = test::unpack<igtl::PolyDataMessage>(igtl_surface(boundary.drawn()));
  const std::vector<Vec3> moved = moved_nodes(boundary);
  std::vector<Vec3> expected;
  for (const Index node : boundary.body.surface_mesh_nodes())
    expected.push_back(moved[static_cast<std::size_t>(node)]);
  expect_points(*lines, expected);
  expect_cells(lines->GetLines(), boundary.drawn().scene->edges);
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
  const auto message = test::unpack<igtl::PolyDataMessage>(igtl_surface(*drawn));
  std::vector<Vec3> expected = scene->nodes;
  expected.insert(expected.end(), drawn->patch->nodes.begin(), drawn->patch->nodes.end());
  expect_points(*message, expected);
  const std::size_t hidden = drawn->patch->hidden.size();
  ASSERT_GT(hidden, 0U);
  EXPECT_EQ(message->GetPolygons()->GetNumberOfCells(),
            scene->triangles.size() + (refinement * refinement - 1) * hidden);
}

TEST(IgtlMessages, ToolAndForceAreTheTicks) {
  const Pressed pressed(3);
  const ToolState& tool = pressed.state.tools.front();
  const auto transform = test::unpack<igtl::TransformMessage>(igtl_tool(pressed.picture));
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

  const auto text = test::unpack<igtl::StringMessage>(igtl_force(pressed.picture));
  ASSERT_TRUE(text);
  EXPECT_STREQ(text->GetDeviceName(), "Palpate force");
  EXPECT_EQ(test::time_of(*text), 3.25);
  const auto numbers = nlohmann::json::parse(text->GetString());
  ASSERT_GT(tool.wrench.force.z(), 1e-3);  // the hand is pushed up
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(numbers["force_N"][axis], tool.wrench.force[static_cast<Eigen::Index>(axis)]);
    EXPECT_EQ(numbers["torque_Nm"][axis], tool.wrench.torque[static_cast<Eigen::Index>(axis)]);
  }
}

/// Hands pictures of given times on.
class IgtlPace : public testing::Test {
 protected:
  void show(double time, IgtlBroadcast::Clock::time_point now = {}) {
    DrawnPicture drawn = pressed_.drawn();
    drawn.scene = scene_;
    drawn.picture.frame.time = time;
    broadcast_.set_picture(std::move(drawn), now);
  }
  double surface_time() {
    return test::time_of(*test::unpack<igtl::PolyDataMessage>(*broadcast_.surface_message()));
  }

  Pressed pressed_{2};
  std::shared_ptr<const Scene> scene_ = pressed_.drawn().scene;
  IgtlBroadcast broadcast_;
};

TEST_F(IgtlPace, ThirtySurfacesASecondAndEachTool) {
  for (int k = 0; k < 2000; ++k) show(0.001 * k);
  EXPECT_EQ(broadcast_.pictures(), 2000);
  EXPECT_EQ(broadcast_.surfaces(), 59);  // one each 34 ms
  EXPECT_NEAR(surface_time(), 1.972, 1e-9);
}

TEST_F(IgtlPace, PicturesAThirtiethApartAreAllSent) {
  for (int k = 0; k < 300; ++k) show(k / 30.0);
  EXPECT_EQ(broadcast_.surfaces(), 300);
}

TEST_F(IgtlPace, AnotherRunBeginsAtOnce) {
  show(5.0);
  show(0.0);
  EXPECT_EQ(broadcast_.surfaces(), 2);
  EXPECT_EQ(surface_time(), 0.0);
  scene_ = pressed_.drawn().scene;  // another body
  show(0.001);
  EXPECT_EQ(broadcast_.surfaces(), 3);
}

TEST_F(IgtlPace, WhatStandsIsSentInTheEnd) {
  using std::chrono::milliseconds;
  const IgtlBroadcast::Clock::time_point begin{};
  show(1.0, begin);
  show(1.001, begin + milliseconds(10));
  broadcast_.catch_up(begin + milliseconds(109));
  EXPECT_EQ(broadcast_.surfaces(), 1);
  broadcast_.catch_up(begin + milliseconds(110));
  EXPECT_EQ(broadcast_.surfaces(), 2);
  EXPECT_NEAR(surface_time(), 1.001, 1e-9);
  broadcast_.catch_up(begin + milliseconds(500));
  EXPECT_EQ(broadcast_.surfaces(), 2);
}

}  // namespace
}  // namespace palpate::igtl_messages_test
