// palpate.h: the same as the C++ step, behind functions that never throw.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <regex>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/vectors.h"
#include "formats/model_file.h"
#include "runtime/background/patch_source.h"
#include "runtime/background/surface_frames.h"
#include "runtime/core/tick/status.h"
#include "runtime/core/tick/step.h"
#include "runtime/library/palpate.h"
#include "tests/support/files/meshes_files.h"
#include "tests/support/folders.h"

namespace palpate::c_interface_test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

struct Ended {
  void operator()(palpate_session* session) const { palpate_destroy(session); }
};
using Session = std::unique_ptr<palpate_session, Ended>;

std::string golden(const std::string& name) {
  return palpate::test::source_file("tests/golden/" + name + "/" + name + ".palpate.hdf");
}

palpate_tool sphere(double radius) {
  palpate_tool tool = PALPATE_TOOL_INIT;
  tool.radius = radius;
  return tool;
}

Session open(const std::string& name, const std::vector<palpate_tool>& tools) {
  char error[300];
  Session session(palpate_create(golden(name).c_str(), tools.data(), static_cast<int>(tools.size()), 24,
                                 error, sizeof error));
  EXPECT_NE(session, nullptr) << error;
  EXPECT_STREQ(error, "");
  return session;
}

palpate_result result_of(const palpate_session* session, int tool) {
  palpate_result result = PALPATE_RESULT_INIT;
  palpate_get(session, tool, &result);
  return result;
}

palpate_counts counts_of(const palpate_session* session) {
  palpate_counts counts = PALPATE_COUNTS_INIT;
  EXPECT_EQ(palpate_surface_counts(session, &counts), 0);
  return counts;
}

/// The same as the step with the patch that it wants, once it is there.
TEST(COverlay, FeelsAsTheStepWithItsPatch) {
  const palpate_tool tool = sphere(0.2);
  palpate_overlay overlay = PALPATE_OVERLAY_INIT;
  overlay.rings = 1;
  palpate_options options = PALPATE_OPTIONS_INIT;
  options.overlay = &overlay;
  char error[300];
  const Session session(
      palpate_create_with_options(golden("cube2").c_str(), &tool, 1, 64, &options, error, sizeof error));
  ASSERT_NE(session, nullptr) << error;
  const Body body(load_model(golden("cube2")), {}, 3);
  EXPECT_EQ(counts_of(session.get()).nodes, std::ssize(body.surface_rest_positions()));
  EXPECT_GT(body.surface_rest_positions().size(), body.surface_mesh_nodes().size());

  const auto pose = [](int tick) {
    return palpate_pose{
        sizeof(palpate_pose), {0.45, 0.5, 1.25 - 0.001 * std::min(tick, 100)}, {1.0, 0.0, 0.0, 0.0}, 0};
  };
  for (int tick = 0; tick < 20000; ++tick) {  // hovers until the builder has made the patch
    if (palpate_step(session.get(), std::array{pose(0)}.data()) == 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  State state(body,
              {.tools = {Tool{.radius = 0.2}}, .max_contacts = 64, .patch_nodes = patch_room(body, 1, 1)});
  PatchSource source(body, state, {.rings = 1, .in_background = false});
  for (int tick = 0; tick < 1000; ++tick) {
    palpate_step(session.get(), std::array{pose(tick)}.data());
    source.serve(state);
    const palpate_pose device = pose(tick);
    step(body, state, ToolPose{.position = Eigen::Map<const Vec3>(device.position)});
  }
  const palpate_result result = result_of(session.get(), 0);
  const Vec3 force = state.tools.front().wrench.force;
  EXPECT_GT(force.z(), 0.0);
  EXPECT_LT((Eigen::Map<const Vec3>(result.force) - force).norm(), 1e-6 * force.norm());

  std::vector<double> stored(static_cast<std::size_t>(body.greens().order()));
  std::vector<Vec3> u(body.surface_rest_positions().size());
  surface_displacement(body, state.surface.near.load(), stored, u);
  std::vector<double> xyz(3 * u.size());
  palpate_surface_displacement(session.get(), xyz.data());
  double largest = 0.0;
  for (const Vec3& displacement : u) largest = std::max(largest, displacement.norm());
  for (std::size_t node = 0; node < u.size(); ++node)
    EXPECT_LT((Eigen::Map<const Vec3>(&xyz[3 * node]) - u[node]).norm(), 1e-5 * largest);
}

TEST(COverlay, RefusesWhatCannotBe) {
  const palpate_tool tool = sphere(0.2);
  char error[300];
  for (const palpate_overlay& overlay : {palpate_overlay{sizeof(palpate_overlay), 1, 1, 1000},
                                         palpate_overlay{sizeof(palpate_overlay), 3, 0, 1000},
                                         palpate_overlay{sizeof(palpate_overlay), 99, 1, 1000}}) {
    palpate_options options = PALPATE_OPTIONS_INIT;
    options.overlay = &overlay;
    EXPECT_EQ(
        palpate_create_with_options(golden("cube2").c_str(), &tool, 1, 64, &options, error, sizeof error),
        nullptr);
    EXPECT_NE(std::string(error).find("overlay"), std::string::npos) << error;
  }
}

/// What is said when a session cannot be made.
std::string refusal(const char* file, const palpate_tool* tools, int count, int contacts) {
  char error[300];
  const Session session(palpate_create(file, tools, count, contacts, error, sizeof error));
  EXPECT_EQ(session, nullptr);
  return error;
}

std::vector<double> displacement_of(palpate_session* session) {
  std::vector<double> xyz(3 * static_cast<std::size_t>(counts_of(session).nodes), nan);
  palpate_surface_displacement(session, xyz.data());
  return xyz;
}

/// The cube or, in the plane, the plate of the golden files and two tools: a sphere with friction, and a
/// capsule that hangs on a spring.
class CInterface : public testing::TestWithParam<const char*> {
 protected:
  CInterface() {
    tools_[0].friction = 0.4;
    tools_[0].reach = 0.2;
    tools_[0].hand_over = 0.03;
    tools_[1].length = 0.1;
    tools_[1].coupling_stiffness = 0.5 * stiffness_;
    tools_[1].coupling_torsion = 0.1 * stiffness_;
    tools_[1].max_force = 0.002 * stiffness_;
  }

  [[nodiscard]] std::vector<Tool> cpp_tools() const {
    std::vector<Tool> tools;
    for (const palpate_tool& tool : tools_) {
      tools.push_back({.radius = tool.radius,
                       .length = tool.length,
                       .disc_radius = tool.disc_radius,
                       .coupling_stiffness = tool.coupling_stiffness,
                       .coupling_torsion = tool.coupling_torsion,
                       .max_force = tool.max_force,
                       .hand_over = tool.hand_over,
                       .reach = tool.reach,
                       .friction = {}});
    }
    tools[0].friction = tools_[0].friction;
    return tools;
  }

  /// A thousand ticks: down onto the body, along it, turning; a grab, nonsense, and up again.
  [[nodiscard]] std::vector<palpate_pose> poses(int tick) const {
    const double t = 0.001 * tick;
    const double height = 1.0 + 0.15 + 0.05 - 0.12 * std::sin(3.0 * t);
    palpate_pose first{sizeof(palpate_pose),
                       {0.4 + 0.2 * t, 0.5, height},
                       {1.0, 0.0, 0.0, 0.0},
                       tick > 400 && tick < 600 ? 7 : 0};
    palpate_pose second{
        sizeof(palpate_pose), {0.7, 0.4 + 0.1 * t, height - 0.04}, {2.0, 0.3 * t, 0.1, 0.2 * t}, 0};
    if (!in_space_) {  // the plate hangs: from below, and the capsule points up
      first.position[1] = 1.0 - height;
      second.position[1] = 0.9 - height;
    }
    if (tick == 700) first.position[0] = nan;
    if (tick == 701) std::fill_n(second.orientation, 4, 0.0);
    return {first, second};
  }

  /// The results of a thousand ticks, byte for byte.
  [[nodiscard]] std::vector<palpate_result> run(palpate_session* session) const {
    std::vector<palpate_result> results;
    for (int tick = 0; tick < 1000; ++tick) {
      palpate_step(session, poses(tick).data());
      results.push_back(result_of(session, 0));
      results.push_back(result_of(session, 1));
    }
    return results;
  }

  bool in_space_ = std::string(GetParam()) == "cube2";
  Body body_{load_model(golden(GetParam()))};
  double stiffness_ = body_.model().materials[0].youngs_modulus;
  std::vector<palpate_tool> tools_ = {sphere(0.15), sphere(0.15)};
};

INSTANTIATE_TEST_SUITE_P(Golden, CInterface, testing::Values("cube2", "plate2"),
                         [](const auto& chosen) { return std::string(chosen.param); });

ToolPose cpp_pose(const palpate_pose& pose) {
  ToolPose result;
  result.position = Vec3(pose.position[0], pose.position[1], pose.position[2]);
  result.orientation = {pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3]};
  result.grab = pose.grab != 0;
  return result;
}

Vec3 vector(const double* xyz) {
  return {xyz[0], xyz[1], xyz[2]};
}

TEST_P(CInterface, IsTheStepOfCppBitForBit) {
  const Session session = open(GetParam(), tools_);
  State state(body_, {.tools = cpp_tools(), .max_contacts = 24});
  std::uint32_t seen = 0;
  int touching[2] = {0, 0};
  for (int tick = 0; tick < 1000; ++tick) {
    const std::vector<palpate_pose> c = poses(tick);
    const std::vector<ToolPose> cpp = {cpp_pose(c[0]), cpp_pose(c[1])};
    const std::uint32_t status = palpate_step(session.get(), c.data());
    ASSERT_EQ(status, static_cast<std::uint32_t>(step(body_, state, cpp))) << "tick " << tick;
    seen |= status;
    for (int k = 0; k < 2; ++k) {
      const palpate_result result = result_of(session.get(), k);
      const ToolState& tool = state.tools[static_cast<std::size_t>(k)];
      ASSERT_EQ(vector(result.force), tool.wrench.force) << "tick " << tick;
      ASSERT_EQ(vector(result.torque), tool.wrench.torque) << "tick " << tick;
      ASSERT_EQ(vector(result.tool_position), tool.pose.position) << "tick " << tick;
      ASSERT_EQ(Eigen::Quaterniond(result.tool_orientation[0], result.tool_orientation[1],
                                   result.tool_orientation[2], result.tool_orientation[3])
                    .coeffs(),
                tool.pose.orientation.coeffs())
          << "tick " << tick;
      ASSERT_EQ(result.contacts, tool.contacts) << "tick " << tick;
      for (int i = 0; i < 9; ++i) ASSERT_EQ(result.local_stiffness[i], tool.local.stiffness(i / 3, i % 3));
      ASSERT_EQ(vector(result.local_point), tool.local.point) << "tick " << tick;
      ASSERT_EQ(result.local_radius, tool.local.radius) << "tick " << tick;
      ASSERT_EQ(result.force_error, tool.force_error) << "tick " << tick;
      ASSERT_EQ(result.left_out, tool.left_out) << "tick " << tick;
      ASSERT_EQ(result.greens_error, tool.greens_error) << "tick " << tick;
      if (result.contacts > 0) ++touching[k];
    }
  }
  EXPECT_GT(touching[0], 300) << "the sphere hardly ever touched";
  EXPECT_GT(touching[1], 300) << "the capsule hardly ever touched";
  EXPECT_TRUE((seen & PALPATE_POSE_NOT_FINITE) != 0) << seen;
  EXPECT_TRUE((seen & PALPATE_FORCE_LIMITED) != 0) << seen;
}

TEST_P(CInterface, SurfaceFollowsTheForces) {
  const Session session = open(GetParam(), tools_);
  State state(body_, {.tools = cpp_tools(), .max_contacts = 24});
  std::vector<double> u(static_cast<std::size_t>(body_.greens().order()));
  double largest = 0.0;
  int held = 0;
  for (int tick = 0; tick < 600; ++tick) {
    palpate_step(session.get(), poses(tick).data());
    step(body_, state, std::vector<ToolPose>{cpp_pose(poses(tick)[0]), cpp_pose(poses(tick)[1])});
    if (tick % 50 != 49) continue;
    const std::vector<double> seen = displacement_of(session.get());
    surface_displacement(body_, state, u);
    for (std::size_t node = 0; node < body_.surface_mesh_nodes().size(); ++node) {
      const Index stored = body_.stored_node(body_.surface_mesh_nodes()[node]);
      const Vec3 expected = stored < 0 ? Vec3::Zero() : vector_at(u, body_.dimension(), stored);
      ASSERT_EQ(vector(&seen[3 * node]), expected) << "node " << node << ", tick " << tick;
      largest = std::max(largest, expected.norm());
      held += stored < 0 ? 1 : 0;
    }
  }
  EXPECT_GT(largest, 0.01);
  EXPECT_GT(held, 0);
}

TEST_P(CInterface, ResetForgetsEverything) {
  const Session session = open(GetParam(), tools_);
  for (int tick = 0; tick < 500; ++tick) palpate_step(session.get(), poses(tick).data());
  palpate_reset(session.get());
  for (const double u : displacement_of(session.get())) ASSERT_EQ(u, 0.0);
  EXPECT_EQ(vector(result_of(session.get(), 0).force), Vec3::Zero());

  const std::vector<palpate_result> again = run(session.get());
  const std::vector<palpate_result> fresh = run(open(GetParam(), tools_).get());
  for (std::size_t k = 0; k < fresh.size(); ++k) {
    ASSERT_EQ(vector(again[k].force), vector(fresh[k].force)) << k;
    ASSERT_EQ(vector(again[k].tool_position), vector(fresh[k].tool_position)) << k;
    ASSERT_EQ(again[k].local_radius, fresh[k].local_radius) << k;
  }
}

/// Sum of the volumes, in the plane of the areas, of all elements at rest.
double content_of_elements(const Body& body) {
  const Model& model = body.model();
  double sum = 0.0;
  for (Index e = 0; e < model.mesh.elements(); ++e) {
    const auto nodes = model.mesh.element_nodes(e);
    const auto at = [&](std::size_t k) {
      const auto node = static_cast<std::size_t>(nodes[k]);
      return Vec3(model.mesh.nodes[node] + model.rest_displacement[node]);
    };
    if (model.dimension() == 3) {
      sum += (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / 6.0;
    } else {
      sum += (at(2) - at(0)).cross(at(3) - at(1)).z() / 2.0;
    }
  }
  return sum;
}

TEST_P(CInterface, SurfaceAtRestIsClosedAndFacesOutwards) {
  const Session session = open(GetParam(), tools_);
  const palpate_counts counts = counts_of(session.get());
  EXPECT_EQ(counts.corners, in_space_ ? 3 : 2);
  std::vector<double> xyz(3 * static_cast<std::size_t>(counts.nodes), nan);
  std::vector<std::int32_t> nodes(static_cast<std::size_t>(counts.corners * counts.simplices), -1);
  palpate_surface_rest(session.get(), xyz.data());
  palpate_surface_simplices(session.get(), nodes.data());

  const auto at = [&](std::size_t corner) {
    return vector(&xyz[3 * static_cast<std::size_t>(nodes[corner])]);
  };
  double content = 0.0;  // by the divergence theorem
  for (std::size_t k = 0; k < nodes.size(); k += static_cast<std::size_t>(counts.corners)) {
    content += in_space_ ? at(k).dot(at(k + 1).cross(at(k + 2))) / 6.0 : at(k).cross(at(k + 1)).z() / 2.0;
  }
  EXPECT_NEAR(content, content_of_elements(body_), 1e-12);
  EXPECT_GT(content, 0.5);
}

TEST(CInterfaceErrors, SayWhatIsWrongAndWhatToDo) {
  const palpate_tool good = sphere(0.1);
  const std::string file = golden("cube2");
  EXPECT_NE(refusal("/no/such.palpate.hdf", &good, 1, 8).find("/no/such.palpate.hdf"), std::string::npos);
  EXPECT_NE(refusal(nullptr, &good, 1, 8).find("file name"), std::string::npos);
  EXPECT_NE(refusal(file.c_str(), nullptr, 1, 8).find("no tool"), std::string::npos);
  EXPECT_NE(refusal(file.c_str(), &good, 0, 8).find("no tool"), std::string::npos);
  EXPECT_NE(refusal(file.c_str(), &good, 1, 0).find("room for 0 contacts"), std::string::npos);
  EXPECT_NE(refusal(file.c_str(), &good, 1, 257).find("1 to 256"), std::string::npos);
  const palpate_tool bad[] = {good, sphere(-0.5)};
  EXPECT_NE(refusal(file.c_str(), bad, 2, 8).find("radius of tool 1 is -0.5"), std::string::npos);
  palpate_tool rough = good;
  rough.friction = nan;
  EXPECT_NE(refusal(file.c_str(), &rough, 1, 8).find("friction of tool 0"), std::string::npos);
  for (const char* piece : {"error: ", "\nhint: "})
    EXPECT_NE(refusal(file.c_str(), bad, 2, 8).find(piece), std::string::npos);
}

TEST(CInterfaceErrors, CodesTellWhatKindTheyAre) {
  const palpate_tool good = sphere(0.1), bad = sphere(-0.5);
  const std::string file = golden("cube2");
  EXPECT_NE(refusal("/no/such.palpate.hdf", &good, 1, 8), "");
  EXPECT_EQ(palpate_last_code(), PALPATE_ERROR_FILE);
  for (const palpate_tool* tool : {static_cast<const palpate_tool*>(nullptr), &bad}) {
    EXPECT_NE(refusal(file.c_str(), tool, 1, 8), "");
    EXPECT_EQ(palpate_last_code(), PALPATE_ERROR_ARGUMENT);
  }
  const Session session = open("cube2", {good});
  EXPECT_EQ(palpate_last_code(), PALPATE_OK);
  std::set<std::string> names;
  for (int code = PALPATE_OK; code <= PALPATE_ERROR_INTERNAL; ++code) names.insert(palpate_code_name(code));
  EXPECT_EQ(names.size(), 7U);
  EXPECT_STREQ(palpate_code_name(PALPATE_ERROR_FILE), "file");
  EXPECT_EQ(palpate_code_name(-1), nullptr);
  EXPECT_EQ(palpate_code_name(PALPATE_ERROR_INTERNAL + 1), nullptr);
}

/// palpate_record with these options; the code, which the text tells of.
int record(palpate_session* session, const char* file, const palpate_record_options* options) {
  char error[400];
  const int code = palpate_record(session, file, options, error, sizeof error);
  EXPECT_EQ(code == PALPATE_OK, std::string(error).empty()) << error;
  EXPECT_EQ(palpate_last_code(), code);
  return code;
}

int end_recording(palpate_session* session) {
  char error[400];
  const int code = palpate_record_end(session, error, sizeof error);
  EXPECT_EQ(code == PALPATE_OK, std::string(error).empty()) << error;
  return code;
}

struct Closed {
  void operator()(palpate_recording* recording) const { palpate_recording_close(recording); }
};
using Recorded = std::unique_ptr<palpate_recording, Closed>;

palpate_pose pressing(int tick) {
  return {sizeof(palpate_pose),
          {0.5, 0.5, 1.15 - 0.0004 * std::min(tick, 200)},
          {1.0, 0.0, 0.0, 0.0},
          tick > 250 ? 1 : 0};
}

TEST(CInterfaceRecording, HoldsWhatWasWantedAndFelt) {
  const auto file = std::filesystem::temp_directory_path() / "palpate_c_interface_recording.mcap";
  const Session session = open("cube2", {sphere(0.1), sphere(0.05)});
  const palpate_pose far{sizeof(palpate_pose), {5.0, 5.0, 5.0}, {1.0, 0.0, 0.0, 0.0}, 0};
  for (int tick = 0; tick < 100; ++tick)  // what was before is not in it
    palpate_step(session.get(), std::array{pressing(tick + 100), far}.data());
  palpate_record_options options = PALPATE_RECORD_OPTIONS_INIT;
  options.pictures = 100.0;
  ASSERT_EQ(record(session.get(), file.c_str(), &options), PALPATE_OK);
  std::vector<palpate_result> felt;
  std::vector<std::uint32_t> status;
  std::vector<double> last(3 * static_cast<std::size_t>(counts_of(session.get()).nodes));
  for (int tick = 0; tick < 300; ++tick) {
    if (tick == 150) palpate_reset(session.get());  // a recording is of one run
    status.push_back(palpate_step(session.get(), std::array{pressing(tick), far}.data()));
    felt.push_back(result_of(session.get(), 0));
    std::this_thread::sleep_for(std::chrono::microseconds(200));  // pictures are made meanwhile
  }
  palpate_surface_displacement(session.get(), last.data());
  ASSERT_EQ(end_recording(session.get()), PALPATE_OK);
  palpate_step(session.get(), std::array{pressing(0), far}.data());  // and after it

  char error[400];
  const Recorded read(palpate_recording_open(file.c_str(), error, sizeof error));
  ASSERT_NE(read, nullptr) << error;
  palpate_recording_counts counts = PALPATE_RECORDING_COUNTS_INIT;
  ASSERT_EQ(palpate_recording_count(read.get(), &counts), 0);
  ASSERT_EQ(counts.ticks, 300);
  EXPECT_EQ(counts.rate, 1000);
  EXPECT_EQ(counts.nodes, counts_of(session.get()).nodes);
  EXPECT_EQ(counts.simplices, counts_of(session.get()).simplices);
  EXPECT_EQ(counts.corners, 3);
  for (int tick = 0; tick < 300; ++tick) {
    const auto k = static_cast<std::size_t>(tick);
    palpate_recorded_tick told = PALPATE_RECORDED_TICK_INIT;
    ASSERT_EQ(palpate_recording_tick(read.get(), tick, &told), 0);
    EXPECT_EQ(told.time, tick / 1000.0);
    EXPECT_EQ(vector(told.position), vector(pressing(tick).position));
    EXPECT_EQ(told.grab, pressing(tick).grab);
    EXPECT_EQ(vector(told.force), vector(felt[k].force)) << tick;
    EXPECT_EQ(vector(told.torque), vector(felt[k].torque));
    EXPECT_EQ(vector(told.tool_position), vector(felt[k].tool_position));
    EXPECT_EQ(told.contacts, felt[k].contacts);
    EXPECT_EQ(told.status, status[k]);
  }
  EXPECT_GT(felt.back().force[2], 0.0);
  palpate_recorded_tick none = PALPATE_RECORDED_TICK_INIT;
  none.time = 7.0;
  for (const int tick : {-1, 300}) EXPECT_EQ(palpate_recording_tick(read.get(), tick, &none), -1);
  EXPECT_EQ(none.time, 0.0);

  std::vector<double> rest(last.size()), wanted(last.size());
  palpate_recording_rest(read.get(), rest.data());
  palpate_surface_rest(session.get(), wanted.data());
  EXPECT_EQ(rest, wanted);
  std::vector<std::int32_t> corners(static_cast<std::size_t>(3 * counts.simplices)), same(corners.size());
  palpate_recording_simplices(read.get(), corners.data());
  palpate_surface_simplices(session.get(), same.data());
  EXPECT_EQ(corners, same);
  ASSERT_GT(counts.pictures, 1);
  std::vector<float> picture(last.size());
  double time = 0.0;
  ASSERT_EQ(
      palpate_recording_picture(read.get(), counts.pictures - 1, picture.data(), &time, error, sizeof error),
      0);
  EXPECT_GT(time, 0.2);  // while it is held, which displaces the same
  for (std::size_t k = 0; k < last.size(); ++k) EXPECT_NEAR(picture[k], last[k], 1e-6);
  EXPECT_EQ(
      palpate_recording_picture(read.get(), counts.pictures, picture.data(), &time, error, sizeof error),
      PALPATE_ERROR_ARGUMENT);
  std::filesystem::remove(file);
}

TEST(CInterfaceRecording, WhatCannotBeIsRefused) {
  const auto file = std::filesystem::temp_directory_path() / "palpate_c_interface_refused.mcap";
  const Session session = open("cube2", {sphere(0.1)});
  palpate_record_options good = PALPATE_RECORD_OPTIONS_INIT;
  EXPECT_EQ(end_recording(session.get()), PALPATE_ERROR_STATE);
  EXPECT_EQ(record(session.get(), nullptr, &good), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(record(session.get(), file.c_str(), nullptr), PALPATE_ERROR_ARGUMENT);
  for (const int tool : {-1, 1}) {
    palpate_record_options bad = good;
    bad.tool = tool;
    EXPECT_EQ(record(session.get(), file.c_str(), &bad), PALPATE_ERROR_ARGUMENT);
  }
  for (const double pictures : {-1.0, nan, HUGE_VAL}) {
    palpate_record_options bad = good;
    bad.pictures = pictures;
    EXPECT_EQ(record(session.get(), file.c_str(), &bad), PALPATE_ERROR_ARGUMENT);
  }
  palpate_record_options unset = good;
  unset.size = 0;
  EXPECT_EQ(record(session.get(), file.c_str(), &unset), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(record(session.get(), "/no/such/folder/a.mcap", &good), PALPATE_ERROR_FILE);
  EXPECT_FALSE(std::filesystem::exists(file));
  palpate_record_options rare = good;
  rare.pictures = 1e-300;  // none but the first
  ASSERT_EQ(record(session.get(), file.c_str(), &rare), PALPATE_OK);
  EXPECT_EQ(record(session.get(), file.c_str(), &good), PALPATE_ERROR_STATE);
  EXPECT_EQ(end_recording(session.get()), PALPATE_OK);

  palpate_options slow = PALPATE_OPTIONS_INIT;
  slow.tick = 0.0007;
  const palpate_tool tool = sphere(0.1);
  char error[400];
  const Session odd(
      palpate_create_with_options(golden("cube2").c_str(), &tool, 1, 24, &slow, error, sizeof error));
  ASSERT_NE(odd, nullptr) << error;
  EXPECT_EQ(record(odd.get(), file.c_str(), &good), PALPATE_ERROR_ARGUMENT);

  palpate_recording* none = palpate_recording_open("/no/such.mcap", error, sizeof error);
  EXPECT_EQ(none, nullptr);
  EXPECT_EQ(palpate_last_code(), PALPATE_ERROR_FILE);
  none = palpate_recording_open(golden("cube2").c_str(), error, sizeof error);
  EXPECT_EQ(none, nullptr);
  EXPECT_NE(std::string(error).find("hint: "), std::string::npos);
  palpate_recording_close(nullptr);
  std::filesystem::remove(file);
}

/// The rules of the programs' outputs (docs/errors.md): nothing but an earlier recording or an empty file is
/// replaced, under whatever name, and what stands there stays.
TEST(CInterfaceRecording, ReplacesNothingButARecording) {
  namespace fs = std::filesystem;
  const test::ScratchFolder folder;
  const fs::path model = folder.path() / "mine.palpate.hdf", text = folder.path() / "notes.txt";
  fs::copy_file(golden("cube2"), model);
  std::ofstream(text) << "of a stranger";
  fs::copy_file(text, folder.path() / "source.csv");
  fs::create_symlink("mine.palpate.hdf", folder.path() / "soft.mcap");
  fs::create_symlink("soft.mcap", folder.path() / "twice.mcap");
  fs::create_symlink("nothing", folder.path() / "dangling.mcap");
  fs::create_symlink("loop.mcap", folder.path() / "loop.mcap");
  fs::create_hard_link(model, folder.path() / "hard.mcap");
  fs::create_directory(folder.path() / "folder.mcap");
  fs::create_symlink("/dev/null", folder.path() / "null.mcap");
  ASSERT_EQ(::mkfifo((folder.path() / "pipe.mcap").c_str(), 0600), 0);
  const auto bytes = [](const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string whole = bytes(model);
  const palpate_tool tool = sphere(0.1);
  char error[600];
  const Session session(palpate_create(model.c_str(), &tool, 1, 24, error, sizeof error));
  ASSERT_NE(session, nullptr) << error;
  const palpate_record_options options = PALPATE_RECORD_OPTIONS_INIT;
  for (const char* name :
       {"mine.palpate.hdf", "soft.mcap", "twice.mcap", "hard.mcap", "folder.mcap/../mine.palpate.hdf",
        "notes.txt", "dangling.mcap", "loop.mcap", "folder.mcap", "null.mcap", "pipe.mcap", ""}) {
    const std::string file = *name == '\0' ? "" : (folder.path() / name).string();
    EXPECT_EQ(palpate_record(session.get(), file.c_str(), &options, error, sizeof error), PALPATE_ERROR_FILE)
        << name;
    EXPECT_NE(std::string(error).find("hint: "), std::string::npos) << name;
    EXPECT_EQ(std::string(error).find("--force"), std::string::npos) << "there is none here: " << error;
  }
  EXPECT_EQ(palpate_record(session.get(), "/dev/null", &options, error, sizeof error), PALPATE_ERROR_FILE);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(bytes(model), whole);
  EXPECT_EQ(bytes(text), "of a stranger");
  EXPECT_TRUE(fs::is_symlink(folder.path() / "soft.mcap"));
  EXPECT_TRUE(fs::is_fifo(folder.path() / "pipe.mcap"));

  const palpate_pose pose = PALPATE_POSE_INIT;
  std::ofstream(folder.path() / "empty.mcap").flush();
  const std::string file = folder.path() / "empty.mcap";
  ASSERT_EQ(palpate_record(session.get(), file.c_str(), &options, error, sizeof error), PALPATE_OK) << error;
  palpate_step(session.get(), &pose);
  ASSERT_EQ(end_recording(session.get()), PALPATE_OK);
  EXPECT_EQ(palpate_record(session.get(), file.c_str(), &options, error, sizeof error), PALPATE_ERROR_FILE);
  EXPECT_NE(std::string(error).find("is a recording already"), std::string::npos) << error;
}

TEST(CInterfaceErrors, AFileThatIsNoModelIsNamed) {
  const auto file = std::filesystem::temp_directory_path() / "palpate_c_interface_no_model.hdf";
  std::ofstream(file) << "not a model";
  const palpate_tool tool = sphere(0.1);
  EXPECT_NE(refusal(file.c_str(), &tool, 1, 8).find("palpate_c_interface_no_model.hdf"), std::string::npos);
  std::filesystem::remove(file);
}

TEST(CInterfaceErrors, TextIsCutToItsRoomAndMayBeMissing) {
  const palpate_tool tool = sphere(0.1);
  char error[12];
  std::memset(error, 'x', sizeof error);
  EXPECT_EQ(palpate_create("/no/such", &tool, 1, 8, error, 8), nullptr);
  EXPECT_STREQ(error, "error: ");
  EXPECT_EQ(std::string(error + 8, 4), "xxxx");
  EXPECT_EQ(palpate_create("/no/such", &tool, 1, 8, nullptr, 0), nullptr);
  EXPECT_EQ(palpate_create("/no/such", &tool, 1, 8, error, 0), nullptr);
  EXPECT_STREQ(error, "error: ") << "no room is no room";
}

TEST(CInterfaceErrors, NothingHappensWithoutPosesOrATool) {
  palpate_destroy(nullptr);
  const Session session = open("cube2", {sphere(0.1)});
  const palpate_pose touching{sizeof(palpate_pose), {0.5, 0.5, 1.08}, {1.0, 0.0, 0.0, 0.0}, 0};
  const palpate_pose above{sizeof(palpate_pose), {0.5, 0.5, 1.2}, {1.0, 0.0, 0.0, 0.0}, 0};
  palpate_step(session.get(), &above);
  palpate_step(session.get(), &touching);
  const palpate_result before = result_of(session.get(), 0);
  EXPECT_GT(before.force[2], 0.0) << "it pushes the hand up";
  EXPECT_EQ(palpate_step(session.get(), nullptr), static_cast<std::uint32_t>(PALPATE_POSE_NOT_FINITE));
  EXPECT_EQ(vector(result_of(session.get(), 0).force), vector(before.force));
  for (const int tool : {-1, 1, 1000}) {
    palpate_result none = PALPATE_RESULT_INIT;
    none.local_radius = 1.0;
    EXPECT_EQ(palpate_get(session.get(), tool, &none), -1);
    EXPECT_EQ(vector(none.force), Vec3::Zero());
    EXPECT_EQ(none.tool_orientation[0], 0.0);
    EXPECT_EQ(none.local_radius, 0.0);
  }
}

/// On a sphere a contact lies on its surface, and the normals point to its middle.
TEST(CInterface, ContactsLieOnTheToolAndAddUpToItsForce) {
  const Session session = open("cube2", {sphere(0.4), sphere(0.1)});
  palpate_pose poses[] = {{sizeof(palpate_pose), {0.5, 0.5, 0.0}, {1.0, 0.0, 0.0, 0.0}, 0},
                          PALPATE_POSE_INIT};
  poses[1].position[2] = 5.0;
  for (int tick = 0; tick < 400; ++tick) {
    poses[0].position[2] = std::max(1.35, 1.5 - 0.001 * tick);
    palpate_step(session.get(), poses);
  }
  const palpate_result felt = result_of(session.get(), 0);
  std::vector<palpate_contact> found(40, PALPATE_CONTACT_INIT);
  int count = -1;
  ASSERT_EQ(palpate_get_contacts(session.get(), 0, found.data(), 40, &count), 0);
  ASSERT_EQ(count, felt.contacts);
  ASSERT_GT(count, 0);
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < count; ++k) {
    const palpate_contact& contact = found[static_cast<std::size_t>(k)];
    const Vec3 apart = vector(felt.tool_position) - vector(contact.position);
    EXPECT_NEAR(apart.norm(), 0.4, 1e-3);
    EXPECT_NEAR(vector(contact.normal).norm(), 1.0, 1e-12);
    EXPECT_GT(vector(contact.normal).dot(apart.normalized()), 0.99);
    EXPECT_GT(vector(contact.normal).dot(vector(contact.force)), 0.0);
    sum += vector(contact.force);
  }
  EXPECT_LT((sum - vector(felt.force)).norm(), 1e-6 * sum.norm());

  int counted = -1;
  EXPECT_EQ(palpate_get_contacts(session.get(), 0, nullptr, 0, &counted), 0);
  EXPECT_EQ(counted, count);
  EXPECT_EQ(palpate_get_contacts(session.get(), 1, found.data(), 40, &counted), 0);
  EXPECT_EQ(counted, 0) << "the other tool touches nothing";
  for (const int tool : {-1, 2})
    EXPECT_EQ(palpate_get_contacts(session.get(), tool, found.data(), 40, &counted), -1);
  EXPECT_EQ(palpate_get_contacts(session.get(), 0, found.data(), -1, &counted), -1);
  found[0].size = 3;
  EXPECT_EQ(palpate_get_contacts(session.get(), 0, found.data(), 40, &counted), -1);
}

// What a program compiled with an older palpate.h has: the first members only.
struct OldTool {
  std::size_t size;
  double radius;
  double length;
};
struct OldPose {
  std::size_t size;
  double position[3];
};
struct OldOptions {
  std::size_t size;
  const palpate_overlay* overlay;
};
struct OldResult {
  std::size_t size;
  double force[3];
  double behind;  // not its own
};

// What a program compiled with a newer palpate.h has: a member at the end.
template <typename Struct>
struct Newer {
  Struct known;
  double unknown;
};

palpate_session* create(const void* tools, int count, const void* options, std::string& why) {
  char error[400];
  palpate_session* session =
      palpate_create_with_options(golden("cube2").c_str(), static_cast<const palpate_tool*>(tools), count, 24,
                                  static_cast<const palpate_options*>(options), error, sizeof error);
  why = error;
  return session;
}

TEST(CInterfaceSizes, InitsAreTheDefaultsOfCpp) {
  const palpate_tool tool = PALPATE_TOOL_INIT;
  const Tool cpp;
  EXPECT_EQ(tool.size, sizeof tool);
  EXPECT_EQ(tool.radius, cpp.radius);
  EXPECT_EQ(tool.length, cpp.length);
  EXPECT_EQ(tool.disc_radius, cpp.disc_radius);
  EXPECT_EQ(tool.coupling_stiffness, cpp.coupling_stiffness);
  EXPECT_EQ(tool.coupling_torsion, cpp.coupling_torsion);
  EXPECT_EQ(tool.max_force, cpp.max_force);
  EXPECT_LT(tool.friction, 0.0);
  EXPECT_EQ(tool.reach, cpp.reach);
  EXPECT_EQ(tool.hand_over, cpp.hand_over);
  const palpate_options options = PALPATE_OPTIONS_INIT;
  EXPECT_EQ(options.tick, StateOptions{}.tick);
  const palpate_overlay overlay = PALPATE_OVERLAY_INIT;
  EXPECT_EQ(overlay.memory, PatchSourceOptions{}.memory);
}

palpate_pose place(double x, double y, double z) {
  return {sizeof(palpate_pose), {x, y, z}, {1.0, 0.0, 0.0, 0.0}, 0};
}

/// Presses on the cube, then slides.
palpate_pose rubbing(int tick) {
  return place(0.4 + 0.001 * std::clamp(tick - 100, 0, 150), 0.5, 1.2 - 0.001 * std::min(tick, 130));
}

TEST(CInterfaceTool, BecomesWhatIsToldFromTheNextTickOn) {
  palpate_tool rubs = sphere(0.1);
  rubs.friction = 0.5;
  rubs.coupling_stiffness = 300.0;
  const Session created = open("cube2", {rubs}), changed = open("cube2", {sphere(0.1)});
  ASSERT_EQ(palpate_set_tool(changed.get(), 0, &rubs), 0);
  for (int tick = 0; tick < 250; ++tick) {
    const palpate_pose pose = rubbing(tick);
    palpate_step(created.get(), &pose);
    palpate_step(changed.get(), &pose);
    ASSERT_EQ(vector(result_of(changed.get(), 0).force), vector(result_of(created.get(), 0).force)) << tick;
  }
  const palpate_result felt = result_of(created.get(), 0);
  EXPECT_LT(felt.force[0], -0.1 * felt.force[2]);  // it rubs
  rubs.friction = 0.0;
  ASSERT_EQ(palpate_set_tool(created.get(), 0, &rubs), 0);
  const palpate_pose still = rubbing(249);
  for (int tick = 0; tick < 500; ++tick) palpate_step(created.get(), &still);
  EXPECT_GT(result_of(created.get(), 0).force[0], 0.5 * felt.force[0]);  // no longer
}

TEST(CInterfaceTool, StaysWhereItCannotBecomeWhatIsTold) {
  const palpate_tool good = sphere(0.1);
  const Session session = open("cube2", {good}), untouched = open("cube2", {good});
  std::vector<palpate_tool> refused(9, good);
  refused[0].radius = 0.2;
  refused[1].length = 0.1;
  refused[2].disc_radius = 0.3;
  refused[3].coupling_stiffness = 0.0;
  refused[4].coupling_torsion = nan;
  refused[5].max_force = -1.0;
  refused[6].hand_over = 0.0;
  refused[7].reach = HUGE_VAL;
  refused[8].size = 0;
  for (const palpate_tool& tool : refused)
    EXPECT_EQ(palpate_set_tool(session.get(), 0, &tool), -1) << &tool - refused.data();
  EXPECT_EQ(palpate_set_tool(session.get(), 1, &good), -1);
  EXPECT_EQ(palpate_set_tool(session.get(), -1, &good), -1);
  for (int tick = 0; tick < 200; ++tick) {
    const palpate_pose pose = rubbing(tick);
    palpate_step(session.get(), &pose);
    palpate_step(untouched.get(), &pose);
  }
  EXPECT_EQ(vector(result_of(session.get(), 0).force), vector(result_of(untouched.get(), 0).force));
}

/// Stress and pressure are those of a frame that is computed beside the same ticks.
TEST(CInterfaceStress, IsThatOfTheSurfacesFrames) {
  constexpr int ticks = 150;
  const palpate_tool tool = sphere(0.1);
  palpate_options options = PALPATE_OPTIONS_INIT;
  options.stress_ticks = 10;
  std::string why;
  const Session session(create(&tool, 1, &options, why));
  ASSERT_NE(session, nullptr) << why;
  const Body body(load_model(golden("cube2")));
  State state(body, {.tools = {Tool{.radius = 0.1}}, .max_contacts = 24});
  SurfaceFrame expected;
  SurfaceFrames frames(body, state, {.ticks_per_frame = 10, .in_background = false},
                       [&](SurfacePicture picture) { expected = std::move(picture.frame); });
  std::vector<float> von_mises(body.surface_rest_positions().size(), -1.0F), pressure = von_mises;
  EXPECT_EQ(palpate_surface_stress(session.get(), von_mises.data(), pressure.data()), -1);
  EXPECT_EQ(von_mises[0], -1.0F);
  for (int tick = 0; tick < ticks; ++tick) {
    const palpate_pose pose = rubbing(tick);
    palpate_step(session.get(), &pose);
    step(body, state, cpp_pose(pose));
    frames.post(state, tick, 0.0);
  }
  ASSERT_EQ(expected.tick, 140);
  std::int64_t found = -1;
  for (int wait = 0; wait < 60000 && found != expected.tick; ++wait) {
    found = palpate_surface_stress(session.get(), von_mises.data(), pressure.data());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_EQ(found, expected.tick);
  EXPECT_EQ(pressure, expected.pressure);
  EXPECT_GT(*std::max_element(pressure.begin(), pressure.end()), 0.0F);
  for (std::size_t node = 0; node < von_mises.size(); ++node) {
    EXPECT_TRUE(von_mises[node] == expected.von_mises[node] ||
                (std::isnan(von_mises[node]) && std::isnan(expected.von_mises[node])))
        << node;
  }
  EXPECT_EQ(palpate_surface_stress(session.get(), nullptr, nullptr), expected.tick);
  const Session without = open("cube2", {tool});
  EXPECT_EQ(palpate_surface_stress(without.get(), von_mises.data(), nullptr), -1);
  options.stress_ticks = -1;
  EXPECT_EQ(create(&tool, 1, &options, why), nullptr);
  EXPECT_NE(why.find("each -1 ticks"), std::string::npos) << why;
}

/// The wider the flat tool, the more it has to push away.
TEST(CInterfaceDisc, IsWiderThanItsEdge) {
  double last = 0.0;
  for (const double disc_radius : {0.05, 0.2, 0.4}) {
    palpate_tool tool = sphere(0.05);
    tool.disc_radius = disc_radius;
    tool.hand_over = HUGE_VAL;
    const Session session = open("cube2", {tool});
    for (const double z : {1.2, 1.03, 1.03}) {
      const palpate_pose pose{sizeof(palpate_pose), {0.5, 0.5, z}, {1.0, 0.0, 0.0, 0.0}, 0};
      for (int tick = 0; tick < 20; ++tick) palpate_step(session.get(), &pose);
    }
    const double force = result_of(session.get(), 0).force[2];
    EXPECT_GT(force, 1.2 * last) << disc_radius;
    last = force;
  }
  palpate_tool narrow = sphere(0.1);
  narrow.disc_radius = 0.05;
  EXPECT_NE(refusal(golden("cube2").c_str(), &narrow, 1, 8).find("disc radius"), std::string::npos);
}

TEST(CInterfaceSizes, SmallerStructsOfAnOlderProgramTakeDefaults) {
  std::string why;
  const OldTool old_tools[] = {{sizeof(OldTool), 0.1, 0.0}, {sizeof(OldTool), 0.15, 0.1}};
  const OldOptions old_options{sizeof(OldOptions), nullptr};
  const Session session(create(old_tools, 2, &old_options, why));
  ASSERT_NE(session, nullptr) << why;
  palpate_tool second = sphere(0.15);
  second.length = 0.1;
  const Session today = open("cube2", {sphere(0.1), second});
  for (const double z : {1.2, 1.08}) {
    const OldPose old_poses[] = {{sizeof(OldPose), {0.3, 0.5, z}}, {sizeof(OldPose), {0.7, 0.5, z + 0.05}}};
    const palpate_pose poses[] = {{sizeof(palpate_pose), {0.3, 0.5, z}, {1.0, 0.0, 0.0, 0.0}, 0},
                                  {sizeof(palpate_pose), {0.7, 0.5, z + 0.05}, {1.0, 0.0, 0.0, 0.0}, 0}};
    EXPECT_EQ(palpate_step(session.get(), reinterpret_cast<const palpate_pose*>(old_poses)), 0U);
    EXPECT_EQ(palpate_step(today.get(), poses), 0U);
  }
  for (const int tool : {0, 1}) {
    const palpate_result expected = result_of(today.get(), tool);
    EXPECT_GT(expected.force[2], 0.0);
    OldResult result{offsetof(OldResult, behind), {}, -7.0};
    EXPECT_EQ(palpate_get(session.get(), tool, reinterpret_cast<palpate_result*>(&result)), 0);
    EXPECT_EQ(vector(result.force), vector(expected.force));
    EXPECT_EQ(result.size, offsetof(OldResult, behind));
    EXPECT_EQ(result.behind, -7.0);
  }
}

TEST(CInterfaceSizes, LargerStructsOfANewerProgramMustLeaveWhatIsUnknownZero) {
  std::string why;
  Newer<palpate_tool> tools[] = {{sphere(0.1), 0.0}, {sphere(0.1), 0.0}};
  for (auto& tool : tools) tool.known.size = sizeof tool;
  const palpate_options options = PALPATE_OPTIONS_INIT;
  const Session session(create(tools, 2, &options, why));
  ASSERT_NE(session, nullptr) << why;
  tools[1].unknown = 1.0;
  EXPECT_EQ(create(tools, 2, &options, why), nullptr);
  EXPECT_NE(why.find("tool 1"), std::string::npos) << why;
  EXPECT_NE(why.find("as new as the palpate.h"), std::string::npos) << why;

  Newer<palpate_pose> poses[] = {{PALPATE_POSE_INIT, 0.0}, {PALPATE_POSE_INIT, 0.0}};
  for (auto& pose : poses) pose.known.size = sizeof pose;
  for (auto& pose : poses) pose.known.position[2] = 1.5;
  EXPECT_EQ(palpate_step(session.get(), &poses[0].known), 0U);
  poses[1].unknown = 1.0;
  EXPECT_EQ(palpate_step(session.get(), &poses[0].known),
            static_cast<std::uint32_t>(PALPATE_POSE_NOT_FINITE));

  Newer<palpate_result> result{PALPATE_RESULT_INIT, 5.0};
  result.known.size = sizeof result;
  EXPECT_EQ(palpate_get(session.get(), 0, &result.known), 0);
  EXPECT_EQ(result.known.tool_position[2], 1.5);
  EXPECT_EQ(result.unknown, 0.0);
}

TEST(CInterfaceSizes, SizesThatCannotBeAreRefused) {
  std::string why;
  const palpate_tool good = sphere(0.1);
  const palpate_options options = PALPATE_OPTIONS_INIT;
  for (const std::size_t size :
       {std::size_t{0}, sizeof(std::size_t), sizeof(palpate_tool) - 1, std::size_t{1} << 40}) {
    palpate_tool tool = good;
    tool.size = size;
    EXPECT_EQ(create(&tool, 1, &options, why), nullptr) << size;
    EXPECT_NE(why.find("size of tool 0 is " + std::to_string(size)), std::string::npos) << why;
    EXPECT_NE(why.find("PALPATE_TOOL_INIT"), std::string::npos) << why;
  }
  palpate_options unsized = options;
  unsized.size = 0;
  EXPECT_EQ(create(&good, 1, &unsized, why), nullptr);
  EXPECT_NE(why.find("PALPATE_OPTIONS_INIT"), std::string::npos) << why;
  palpate_overlay overlay = PALPATE_OVERLAY_INIT;
  overlay.size = 0;
  unsized = options;
  unsized.overlay = &overlay;
  EXPECT_EQ(create(&good, 1, &unsized, why), nullptr);
  EXPECT_NE(why.find("PALPATE_OVERLAY_INIT"), std::string::npos) << why;
  palpate_tool mixed[] = {good, good};
  mixed[1].size = 16;
  EXPECT_EQ(create(mixed, 2, &options, why), nullptr);
  EXPECT_NE(why.find("cannot read tool 1"), std::string::npos) << why;

  const Session session = open("cube2", {good});
  palpate_pose pose = PALPATE_POSE_INIT;
  pose.size = 0;
  EXPECT_EQ(palpate_step(session.get(), &pose), static_cast<std::uint32_t>(PALPATE_POSE_NOT_FINITE));
  palpate_result result = PALPATE_RESULT_INIT;
  result.size = 0;
  result.local_radius = 3.0;
  EXPECT_EQ(palpate_get(session.get(), 0, &result), -1);
  EXPECT_EQ(result.local_radius, 3.0);
  palpate_counts counts = PALPATE_COUNTS_INIT;
  counts.size = 0;
  EXPECT_EQ(palpate_surface_counts(session.get(), &counts), -1);
  EXPECT_EQ(counts.nodes, 0);
}

TEST(CInterfaceStatus, HasANameForEachBitAndNoOther) {
  EXPECT_STREQ(palpate_status_name(PALPATE_NOTHING_IN_REACH), "nothing_in_reach");
  EXPECT_STREQ(palpate_status_name(PALPATE_FORCE_LIMITED), "force_limited");
  EXPECT_STREQ(palpate_status_name(PALPATE_NOT_STEPPED), "not_stepped");
  EXPECT_EQ(palpate_status_name(0), nullptr);
  EXPECT_EQ(palpate_status_name(PALPATE_FORCE_LIMITED | PALPATE_CAPACITY_FULL), nullptr);
  EXPECT_EQ(palpate_status_name(1U << 31), nullptr);
}

/// A function of palpate.h with arguments that make sense.
struct Call {
  std::string name;
  std::function<bool()> refused;             ///< with these arguments
  std::vector<std::function<bool()>> nulls;  ///< likewise with each pointer NULL, one after the other
  bool has_handle = false;                   ///< its first argument is a session or a recording
};

bool is_refusal(std::uint32_t status) {
  return (status & PALPATE_NOT_STEPPED) != 0;
}
bool is_refusal(int code) {
  return code != 0;
}
bool is_refusal(std::int64_t tick) {
  return tick < 0;
}
bool is_refusal(const char* name) {
  return name == nullptr;
}
bool is_refusal(palpate_session* session) {
  palpate_destroy(session);
  return session == nullptr;
}
bool is_refusal(palpate_recording* recording) {
  palpate_recording_close(recording);
  return recording == nullptr;
}

template <typename Result, typename... Arguments>
Call call_of(const std::string& name, Result (*function)(Arguments...), std::tuple<Arguments...> arguments) {
  using All = std::tuple<Arguments...>;
  const auto outcome = [function](const All& given) {
    if constexpr (std::is_void_v<Result>) {
      std::apply(function, given);
      return true;
    } else {
      return is_refusal(std::apply(function, given));
    }
  };
  Call call{.name = name, .refused = [=] { return outcome(arguments); }, .nulls = {}};
  [&]<std::size_t... k>(std::index_sequence<k...>) {
    [[maybe_unused]] const auto add = [&]<std::size_t at>(std::integral_constant<std::size_t, at>) {
      using Argument = std::tuple_element_t<at, All>;
      if constexpr (std::is_pointer_v<Argument>) {
        All given = arguments;
        std::get<at>(given) = nullptr;
        call.nulls.emplace_back([=] { return outcome(given); });
        using Object = std::remove_const_t<std::remove_pointer_t<Argument>>;
        call.has_handle |=
            std::is_same_v<Object, palpate_session> || std::is_same_v<Object, palpate_recording>;
      }
    };
    (add(std::integral_constant<std::size_t, k>()), ...);
  }
  (std::index_sequence_for<Arguments...>());
  return call;
}

/// Room that functions write to.
struct Room {
  palpate_tool tool = PALPATE_TOOL_INIT;
  palpate_pose pose = PALPATE_POSE_INIT;
  palpate_options options = PALPATE_OPTIONS_INIT;
  palpate_record_options record_options = PALPATE_RECORD_OPTIONS_INIT;
  palpate_result result = PALPATE_RESULT_INIT;
  palpate_contact contact = PALPATE_CONTACT_INIT;
  int count = 0;
  palpate_counts counts = PALPATE_COUNTS_INIT;
  palpate_recording_counts recording_counts = PALPATE_RECORDING_COUNTS_INIT;
  palpate_recorded_tick tick = PALPATE_RECORDED_TICK_INIT;
  std::vector<double> xyz = std::vector<double>(1000);
  std::vector<float> floats = std::vector<float>(1000);
  std::vector<std::int32_t> corners = std::vector<std::int32_t>(1000);
  double time = 0.0;
  std::array<char, 400> error{};
  std::string model = golden("cube2"), record, recorded;
};

/// All functions of palpate.h; a test holds this to the header.
std::vector<Call> calls(palpate_session* session, palpate_recording* recording, Room& room) {
  char* const error = room.error.data();
  const std::size_t size = room.error.size();
  const char* const model = room.model.c_str();
#define PALPATE_CALL(name, ...) call_of(#name, &(name), {__VA_ARGS__})
  return {
      PALPATE_CALL(palpate_status_name, 1U),
      PALPATE_CALL(palpate_code_name, 1),
      call_of("palpate_last_code", &palpate_last_code, {}),
      PALPATE_CALL(palpate_create, model, &room.tool, 1, 8, error, size),
      PALPATE_CALL(palpate_create_with_options, model, &room.tool, 1, 8, &room.options, error, size),
      PALPATE_CALL(palpate_step, session, &room.pose),
      PALPATE_CALL(palpate_get, session, 0, &room.result),
      PALPATE_CALL(palpate_get_contacts, session, 0, &room.contact, 1, &room.count),
      PALPATE_CALL(palpate_set_tool, session, 0, &room.tool),
      PALPATE_CALL(palpate_reset, session),
      PALPATE_CALL(palpate_record, session, room.record.c_str(), &room.record_options, error, size),
      PALPATE_CALL(palpate_record_end, session, error, size),
      PALPATE_CALL(palpate_surface_counts, session, &room.counts),
      PALPATE_CALL(palpate_surface_rest, session, room.xyz.data()),
      PALPATE_CALL(palpate_surface_simplices, session, room.corners.data()),
      PALPATE_CALL(palpate_surface_displacement, session, room.xyz.data()),
      PALPATE_CALL(palpate_surface_stress, session, room.floats.data(), room.floats.data()),
      PALPATE_CALL(palpate_recording_open, room.recorded.c_str(), error, size),
      PALPATE_CALL(palpate_recording_count, recording, &room.recording_counts),
      PALPATE_CALL(palpate_recording_tick, recording, std::int64_t{0}, &room.tick),
      PALPATE_CALL(palpate_recording_rest, recording, room.xyz.data()),
      PALPATE_CALL(palpate_recording_simplices, recording, room.corners.data()),
      PALPATE_CALL(palpate_recording_picture, recording, std::int64_t{0}, room.floats.data(), &room.time,
                   error, size),
      PALPATE_CALL(palpate_recording_close, recording),
      PALPATE_CALL(palpate_destroy, session),
  };
#undef PALPATE_CALL
}

/// A session, a recording that was made with it, and room.
class CInterfaceMisuse : public testing::Test {
 protected:
  CInterfaceMisuse() {
    std::fill_n(room.pose.position, 3, 5.0);
    room.recorded = (folder.path() / "recorded.mcap").string();
    room.record = (folder.path() / "other.mcap").string();
    session = open("cube2", {room.tool}).release();
    EXPECT_EQ(record(session, room.recorded.c_str(), &room.record_options), PALPATE_OK);
    palpate_step(session, &room.pose);
    EXPECT_EQ(end_recording(session), PALPATE_OK);
    recording = palpate_recording_open(room.recorded.c_str(), room.error.data(), room.error.size());
    EXPECT_NE(recording, nullptr) << room.error.data();
  }
  ~CInterfaceMisuse() override {
    palpate_destroy(session);
    palpate_recording_close(recording);
  }

  test::ScratchFolder folder;
  Room room;
  palpate_session* session = nullptr;
  palpate_recording* recording = nullptr;
};

TEST_F(CInterfaceMisuse, EveryFunctionIsTried) {
  std::ifstream in(test::source_file("runtime/library/palpate.h"));
  const std::string header(std::istreambuf_iterator<char>(in), {});
  const std::regex function(R"((palpate_\w+)\()");
  std::set<std::string> declared, tried;
  for (std::sregex_iterator at(header.begin(), header.end(), function), end; at != end; ++at)
    declared.insert((*at)[1]);
  for (const Call& call : calls(session, recording, room)) tried.insert(call.name);
  EXPECT_EQ(tried, declared) << "add what is new to calls()";
}

TEST_F(CInterfaceMisuse, NullIsRefusedOrHarmless) {
  for (const Call& call : calls(session, recording, room)) {
    for (std::size_t k = 0; k < call.nulls.size(); ++k) {
      const bool refused = call.nulls[k]();
      EXPECT_TRUE(refused || k > 0 || !call.has_handle) << call.name;
      palpate_record_end(session, nullptr, 0);  // where only `error` was NULL
      std::filesystem::remove(room.record);
    }
  }
  EXPECT_EQ(palpate_step(session, &room.pose), 0U);
}

TEST_F(CInterfaceMisuse, WhatHasEndedIsRefused) {
  for (int times = 0; times < 3; ++times) {
    palpate_destroy(session);
    palpate_recording_close(recording);
  }
  for (const Call& call : calls(session, recording, room)) {
    EXPECT_TRUE(!call.has_handle || call.refused()) << call.name;
  }
  EXPECT_EQ(palpate_get(session, 0, &room.result), PALPATE_ERROR_STATE);
  EXPECT_EQ(palpate_record_end(session, room.error.data(), room.error.size()), PALPATE_ERROR_STATE);
  EXPECT_NE(std::string(room.error.data()).find("ended"), std::string::npos) << room.error.data();
}

/// With all threads that a session can have.
TEST(CInterfaceThreads, EndsWhileOthersAreInIt) {
  const test::ScratchFolder folder;
  const palpate_tool tool = sphere(0.1);
  palpate_overlay overlay = PALPATE_OVERLAY_INIT;
  overlay.rings = 1;
  palpate_options options = PALPATE_OPTIONS_INIT;
  options.overlay = &overlay;
  options.stress_ticks = 4;
  const palpate_record_options record_options = PALPATE_RECORD_OPTIONS_INIT;
  for (int run = 0; run < 12; ++run) {
    char error[400];
    palpate_session* session =
        palpate_create_with_options(golden("cube2").c_str(), &tool, 1, 24, &options, error, sizeof error);
    ASSERT_NE(session, nullptr) << error;
    const std::string file = (folder.path() / (std::to_string(run) + ".mcap")).string();
    ASSERT_TRUE(run % 2 == 0 || record(session, file.c_str(), &record_options) == PALPATE_OK);
    std::vector<double> xyz(3 * static_cast<std::size_t>(counts_of(session).nodes));
    std::atomic<int> ticks = 0, pictures = 0;
    std::thread loop([&] {
      palpate_result result = PALPATE_RESULT_INIT;
      for (palpate_pose pose = pressing(0); (palpate_step(session, &pose) & PALPATE_NOT_STEPPED) == 0;
           ++ticks) {
        palpate_get(session, 0, &result);
        pose = pressing(ticks);
      }
      EXPECT_EQ(palpate_get(session, 0, &result), PALPATE_ERROR_STATE);
    });
    std::thread eye([&] {
      while (palpate_surface_displacement(session, xyz.data()) == 0) ++pictures;
    });
    while (ticks < 20 || pictures < 5) std::this_thread::yield();
    palpate_destroy(session);
    loop.join();
    eye.join();
  }
}

TEST(CInterfaceThreads, OfTwoThatStepOneIsRefused) {
  const Session session = open("cube2", {sphere(0.1)}), other = open("cube2", {sphere(0.1)});
  std::atomic<int> done = 0, refused = 0;
  const auto step_until_refused = [&] {
    const palpate_pose pose = pressing(200);
    while (refused == 0) ++((palpate_step(session.get(), &pose) & PALPATE_NOT_STEPPED) != 0 ? refused : done);
  };
  std::thread first(step_until_refused), second(step_until_refused);
  first.join();
  second.join();
  EXPECT_GT(done, 0);
  EXPECT_EQ(palpate_reset(session.get()), 0);
  for (int tick = 0; tick < 250; ++tick) {
    const palpate_pose pose = pressing(tick);
    EXPECT_EQ(palpate_step(session.get(), &pose), palpate_step(other.get(), &pose));
  }
  EXPECT_GT(result_of(other.get(), 0).force[2], 0.0);
  EXPECT_EQ(vector(result_of(session.get(), 0).force), vector(result_of(other.get(), 0).force));
}

TEST(CInterfaceThreads, AnotherThreadSeesWholeTicksOnly) {
  palpate_tool point = PALPATE_TOOL_INIT;
  point.reach = 0.05;
  const Session session = open("cube2", {point});
  const auto press = [&](double depth,
                         int grab = 1) {  // the node in the middle of the top, held from 0.02 above
    const palpate_pose pose{sizeof(palpate_pose), {0.5, 0.5, 1.02 - depth}, {1.0, 0.0, 0.0, 0.0}, grab};
    palpate_step(session.get(), &pose);
  };
  press(0.0, 0);
  press(0.0);
  press(0.05);
  const std::vector<double> shape = displacement_of(session.get());
  const auto largest = static_cast<std::size_t>(
      std::max_element(shape.begin(), shape.end(),
                       [](double a, double b) { return std::abs(a) < std::abs(b); }) -
      shape.begin());
  ASSERT_NEAR(shape[largest], -0.05, 1e-8) << "the node that is held";

  std::atomic<bool> done = false;
  std::thread loop([&] {
    for (int tick = 0; !done; ++tick) press(0.05 + 0.04 * std::sin(0.01 * tick));
  });
  std::set<double> depths;
  double worst = 0.0;
  for (int picture = 0; picture < 100'000'000 && depths.size() < 500; ++picture) {
    const std::vector<double> seen = displacement_of(session.get());
    const double share =
        seen[largest] / shape[largest];  // one force: all ticks look alike but for their size
    for (std::size_t k = 0; k < seen.size(); ++k)
      worst = std::max(worst, std::abs(seen[k] - share * shape[k]));
    depths.insert(seen[largest]);
  }
  done = true;
  loop.join();
  EXPECT_LT(worst, 1e-12);
  EXPECT_EQ(depths.size(), 500U);
  press(0.02);
  EXPECT_NEAR(displacement_of(session.get())[largest], -0.02, 1e-8) << "not the latest tick";
}

}  // namespace
}  // namespace palpate::c_interface_test
