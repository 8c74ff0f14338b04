#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "meshes/error.h"
#include "runtime/loop.h"
#include "tests/runtime_model.h"

namespace palpate {
namespace {

const char* const press =
    "t,x,y,z,grab\n0,0.5,0.5,1.5,1\n0.1,0.5,0.5,1,1\n0.2,0.5,0.5,0.9,1\n0.3,0.5,0.5,1.0,0\n";

class Loop : public testing::Test {
 protected:
  Body body_{test::unit_model(3, 4, Scope::surface, Precision::double_precision)};
  State state_{body_, {.reach = 0.012, .max_nodes = 1}};
  std::atomic<bool> stop_ = false;
};

TEST_F(Loop, StepsThroughTheScriptAndReports) {
  const ScriptDevice device = ScriptDevice::parse(press, "press.csv");
  const LoopReport report = run_loop(body_, state_, device, nullptr, true, stop_);
  EXPECT_EQ(report.ticks, 301);
  EXPECT_EQ(state_.ticks, 301);
  EXPECT_FALSE(report.interrupted);
  EXPECT_EQ(report.deadline_misses, 0);
  // In reach from 1.012 m down, that is after 0.488 of the 0.5 m in 0.1 s: held in ticks 98 to 299.
  EXPECT_EQ(report.status_ticks[0], 98) << status_names[0].second;
  EXPECT_EQ(report.ticks_held, 202);
  EXPECT_DOUBLE_EQ(report.largest_force_time, 0.2);
  const Index top = body_.nearest_surface_node(Vec3(0.5, 0.5, 1.0)).node;
  const Vec3 deepest(0.0, 0.0, 0.9 - device.pose(0.098).position.z());
  EXPECT_NEAR(report.largest_force, (body_.greens().block(top, top).inverse() * deepest).norm(), 1e-12);
  EXPECT_GT(report.compute.worst(), 0);
}

TEST_F(Loop, KeepsTheClockWhenItIsReal) {
  const ScriptDevice device = ScriptDevice::parse("t,x,y,z\n0,0.5,0.5,1\n0.05,0.5,0.5,0.9\n", "short.csv");
  timespec begin{};
  timespec end{};
  clock_gettime(CLOCK_MONOTONIC, &begin);
  const LoopReport report = run_loop(body_, state_, device, nullptr, false, stop_);
  clock_gettime(CLOCK_MONOTONIC, &end);
  const double seconds = static_cast<double>(end.tv_sec - begin.tv_sec) +
                         1e-9 * static_cast<double>(end.tv_nsec - begin.tv_nsec);
  EXPECT_EQ(report.ticks, 51);
  EXPECT_GE(seconds, 0.05) << "no tick may come before its time";
  EXPECT_GT(report.worst_lateness, 0);
}

TEST_F(Loop, StopsWhenAsked) {
  stop_ = true;
  const LoopReport report =
      run_loop(body_, state_, ScriptDevice::parse(press, "press.csv"), nullptr, false, stop_);
  EXPECT_TRUE(report.interrupted);
  EXPECT_EQ(report.ticks, 0);
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// 70 s: more ticks than the recorder's ring holds.
TEST_F(Loop, FastRunsLeaveTheSameRecordingToTheLastBit) {
  const ScriptDevice device = ScriptDevice::parse("t,x,y,z\n0,0.5,0.5,1\n70,0.5,0.4,0.9\n", "long.csv");
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "palpate_runtime_recordings";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  for (const char* name : {"one.h5", "two.h5"}) {
    State state(body_, {.reach = 0.01, .max_nodes = 1});
    Recorder recorder(folder / name, "box.palpate.hdf", "0123");
    EXPECT_EQ(run_loop(body_, state, device, &recorder, true, stop_).ticks, 70001);
    recorder.finish();
    EXPECT_EQ(recorder.dropped(), 0);
  }
  const std::string one = bytes_of(folder / "one.h5");
  EXPECT_GT(one.size(), 70001U * 90U);
  EXPECT_TRUE(one == bytes_of(folder / "two.h5"));
  { const Recorder abandoned(folder / "three.h5", "box.palpate.hdf", "0123"); }
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, 2U) << "something half-written was left";
  std::filesystem::remove_all(folder);
}

TEST(PlaneLoop, IgnoresTheScriptsZ) {
  const Body body(test::unit_model(2, 4, Scope::surface, Precision::double_precision));
  const std::atomic<bool> stop = false;
  double largest[2] = {};
  for (const int z : {0, 5}) {
    State state(body, {.reach = 0.1});
    const std::string rows = "t,x,y,z\n0,0.5,1,0\n0.1,0.5,0.95," + std::to_string(z) + "\n";
    const LoopReport report =
        run_loop(body, state, ScriptDevice::parse(rows, "plane.csv"), nullptr, true, stop);
    EXPECT_EQ(report.ticks_held, 101);
    largest[z == 0 ? 0 : 1] = report.largest_force;
  }
  const Index top = body.nearest_surface_node(Vec3(0.5, 1.0, 0.0)).node;
  const Eigen::VectorXd f = body.greens().block(top, top).inverse() * Eigen::Vector2d(0.0, -0.05);
  EXPECT_NEAR(largest[0], f.norm(), 1e-13);
  EXPECT_EQ(largest[0], largest[1]);
}

TEST(Recorder, SaysWhereItCannotWrite) {
  try {
    const Recorder recorder("no/such/folder/out.h5", "box.palpate.hdf", "0123");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(error.where().find("out.h5"), std::string::npos) << error.where();
  }
}

TEST(CountTicks, CountsTheLastRow) {
  const auto ticks = [](const std::string& end) {
    return count_ticks(ScriptDevice::parse("t,x,y,z\n" + end + ",0,0,0\n", "end.csv"));
  };
  EXPECT_EQ(ticks("0"), 1);
  EXPECT_EQ(ticks("0.003"), 4);
  EXPECT_EQ(ticks("0.0035"), 4);
  EXPECT_EQ(ticks("4.35"), 4351);
}

TEST(TimeHistogram, GivesPercentilesOfWhatItCounted) {
  TimeHistogram histogram;
  EXPECT_EQ(histogram.percentile(0.5), 0);
  for (std::int64_t ns = 1; ns <= 1000; ++ns) histogram.add(ns);
  EXPECT_EQ(histogram.percentile(0.5), 500);
  EXPECT_EQ(histogram.percentile(0.999), 999);
  EXPECT_EQ(histogram.worst(), 1000);
  histogram.add(5'000'000);
  EXPECT_EQ(histogram.percentile(1.0), 5'000'000);
  EXPECT_EQ(histogram.percentile(0.999), 1000);
}

}  // namespace
}  // namespace palpate
