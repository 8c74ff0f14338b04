#include "runtime/app/session.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "base/error.h"
#include "formats/mcap/reader.h"
#include "formats/recording.h"
#include "formats/recording_messages.h"
#include "runtime/background/picture_maker.h"
#include "runtime/background/surface_frames.h"
#include "runtime/core/tick/step.h"
#include "runtime/loop/recorder.h"
#include "runtime/safety/device.h"
#include "runtime/safety/fault.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::session_test {
namespace {

Model loaded_model() {
  Model model = test::unit_model(3, 4, Scope::surface, Precision::double_precision);
  test::set_rest(model, 0.01);
  return model;
}

class RecordedFrames : public testing::Test {
 protected:
  /// A ball that presses and slides.
  [[nodiscard]] static ToolPose pose(int tick) {
    ToolPose tool;
    tool.position = Vec3(0.3 + 0.001 * tick, 0.5, 1.2 - 0.001 * std::min(tick, 90));
    return tool;
  }

  Body body_{loaded_model()};
  State state_{body_, {.tools = {Tool{.radius = 0.15}}}};
};

/// u0 + u of a surface node by columns of the Green's functions.
Vec3 seen_displacement(const Body& body, const State& state, std::size_t node) {
  Vec3 u = body.model().rest_displacement[static_cast<std::size_t>(body.surface_mesh_nodes()[node])];
  const Index stored = body.surface_stored_nodes()[node];
  if (stored < 0) return u;
  const SurfaceLoad& load = state.surface.near.load();
  for (std::size_t k = 0; k < load.nodes().size(); ++k)
    u += body.greens().block(stored, load.nodes()[k]) * Vec3(load.forces().data() + 3 * k);
  return u;
}

TEST_F(RecordedFrames, AreTheDisplacementFromTheMesh) {
  std::vector<SurfaceFrame> frames;
  SurfaceFrames source(body_, state_, {.ticks_per_frame = 10, .in_background = false},
                       [&](SurfacePicture picture) { frames.push_back(std::move(picture.frame)); });
  const RecordedSurface surface = recorded_surface(body_);
  ASSERT_EQ(surface.nodes.size(), 98U);  // 5^3 - 3^3
  EXPECT_EQ(surface.corners, 3);
  EXPECT_EQ(surface.simplices.size(), 3U * 192U);
  double largest = 0.0;
  for (int tick = 0; tick < 100; ++tick) {
    step(body_, state_, pose(tick));
    source.post(state_, tick, 1e-3 * tick);
    ASSERT_EQ(frames.size(), static_cast<std::size_t>(tick / 10 + 1));
    if (tick % 10 != 0) continue;
    ASSERT_EQ(frames.back().tick, tick);
    ASSERT_EQ(frames.back().time, 1e-3 * tick);
    for (std::size_t node = 0; node < surface.nodes.size(); ++node) {
      ASSERT_EQ(surface.nodes[node],
                body_.model().mesh.nodes[static_cast<std::size_t>(body_.surface_mesh_nodes()[node])]);
      const Vec3 expected = seen_displacement(body_, state_, node);
      const float* u = frames.back().displacement.data() + 3 * node;
      ASSERT_LE((Vec3(u[0], u[1], u[2]) - expected).norm(), 1e-7) << tick << ' ' << node;
      largest = std::max(largest, expected.norm());
    }
  }
  EXPECT_GT(largest, 0.02) << "nothing was pressed";
}

TEST_F(RecordedFrames, OfTheThreadAreTheSame) {
  std::vector<SurfaceFrame> expected, frames;
  {
    State again = state_;
    SurfaceFrames at_once(body_, again, {.ticks_per_frame = 1, .in_background = false},
                          [&](SurfacePicture picture) { expected.push_back(std::move(picture.frame)); });
    SurfaceFrames beside(body_, state_, {.ticks_per_frame = 3},
                         [&](SurfacePicture picture) { frames.push_back(std::move(picture.frame)); });
    for (int tick = 0; tick < 300; ++tick) {
      step(body_, state_, pose(tick));
      step(body_, again, pose(tick));
      at_once.post(again, tick, 1e-3 * tick);
      beside.post(state_, tick, 1e-3 * tick);
      if (tick % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.back().tick, 297) << "the last one is not left out";
  std::int64_t before = -1;
  for (const SurfaceFrame& frame : frames) {
    EXPECT_EQ(frame.tick % 3, 0);
    EXPECT_GT(frame.tick, before);
    before = frame.tick;
    EXPECT_EQ(frame.displacement, expected[static_cast<std::size_t>(frame.tick)].displacement);
  }
}

// Contacts, wrench and pressure say the same, and stress is that of the surface as it is seen.
TEST_F(RecordedFrames, ShowWhatTouchesAndWhatThatDoes) {
  std::vector<SurfacePicture> pictures;
  SurfaceFrames source(body_, state_, {.ticks_per_frame = 1, .in_background = false},
                       [&](SurfacePicture picture) { pictures.push_back(std::move(picture)); });
  SurfaceStress stress(body_);
  const std::vector<Vec3> nodes = body_.surface_in_mesh();
  double most_pressure = 0.0;
  for (int tick = 0; tick < 100; ++tick) {
    const StepStatus status = step(body_, state_, pose(tick));
    source.post(state_, tick, 1e-3 * tick);
    const SurfacePicture& picture = pictures.back();
    const ToolState& tool = state_.tools.front();
    ASSERT_EQ(picture.status, status);
    ASSERT_EQ(picture.device.position, tool.device.position);
    ASSERT_EQ(picture.tool.position, tool.pose.position);
    ASSERT_EQ(picture.on_body.force, -tool.wrench.force);
    ASSERT_EQ(std::ssize(picture.contacts), tool.contacts);
    ASSERT_TRUE(picture.plane_displacement.empty());

    Vec3 force = Vec3::Zero();
    std::vector<Vec3> nodal(nodes.size(), Vec3::Zero());
    std::vector<double> pressure(nodes.size());
    for (const ContactPoint& contact : state_.contacts()) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (contact.nodes[k] < 0) continue;
        const auto node = static_cast<std::size_t>(contact.nodes[k]);
        pressure[node] += contact.weights[k] *
                          contact.force.dot(seen_contact(body_, state_, contact).normal) /
                          stress.areas()[node];
      }
    }
    const SurfaceLoad& load = state_.surface.near.load();
    for (std::size_t k = 0; k < load.nodes().size(); ++k)
      nodal[static_cast<std::size_t>(body_.surface_node_of_stored(load.nodes()[k]))] +=
          Vec3(load.forces().data() + 3 * k);
    for (const SeenContact& contact : picture.contacts) {
      force += contact.force;
      EXPECT_LE(contact.force.dot(contact.normal), 0.0) << "it presses";
      EXPECT_NEAR((contact.position - tool.pose.position).norm(), 0.15, 0.002) << "on the ball";
    }
    ASSERT_LE((force + tool.contact_wrench.force).norm(), 1e-12);
    std::vector<Vec3> u;
    for (std::size_t node = 0; node < nodes.size(); ++node)
      u.push_back(seen_displacement(body_, state_, node));
    std::vector<Stress> expected(nodes.size());
    stress.evaluate(u, nodal, nullptr, expected);
    for (std::size_t node = 0; node < nodes.size(); ++node) {
      const double here = von_mises(expected[node]);
      ASSERT_EQ(std::isnan(picture.frame.von_mises[node]), std::isnan(here));
      if (!std::isnan(here)) {
        ASSERT_NEAR(picture.frame.von_mises[node], here, 1e-5 * here + 1e-7);
      }
      ASSERT_NEAR(picture.frame.pressure[node], pressure[node], 1e-6 * std::abs(pressure[node]));
      most_pressure = std::max(most_pressure, pressure[node]);
    }
  }
  EXPECT_GT(most_pressure, 0.01);
}

/// As what a picture has when it is computed from contact forces in single precision.
void expect_same_picture(const SurfaceFrame& later, const SurfaceFrame& then) {
  ASSERT_EQ(later.tick, then.tick);
  ASSERT_EQ(later.time, then.time);
  const auto expect_near = [](const std::vector<float>& a, const std::vector<float>& b) {
    ASSERT_EQ(a.size(), b.size());
    float largest = 0.0F;
    for (const float x : b) largest = std::max(largest, std::isnan(x) ? 0.0F : std::abs(x));
    for (std::size_t k = 0; k < a.size(); ++k) {
      ASSERT_EQ(std::isnan(a[k]), std::isnan(b[k]));
      if (std::isnan(b[k])) continue;
      ASSERT_NEAR(a[k], b[k], 2e-6F * largest) << k;
    }
  };
  expect_near(later.displacement, then.displacement);
  expect_near(later.von_mises, then.von_mises);
  expect_near(later.pressure, then.pressure);
}

// What a recording keeps where Green's functions move the body.
TEST_F(RecordedFrames, FollowFromContactForcesAlone) {
  ASSERT_TRUE(pictures_follow_from_contacts(body_));
  PictureMaker maker(body_);
  for (const double radius : {0.02, 0.15, 0.6}) {  // a point, a ball, a large one on several nodes
    State state(body_, {.tools = {Tool{.radius = radius}}});
    std::vector<ContactLoads> loads;
    std::vector<SurfaceFrame> frames;
    SurfaceFrames short_ones(body_, state,
                             {.ticks_per_frame = 7, .in_background = false, .contacts_only = true},
                             [&](SurfacePicture picture) { loads.push_back(std::move(picture.loads)); });
    SurfaceFrames whole(body_, state, {.ticks_per_frame = 7, .in_background = false},
                        [&](SurfacePicture picture) { frames.push_back(std::move(picture.frame)); });
    std::size_t most = 0;
    for (int tick = 0; tick < 100; ++tick) {
      ToolPose at = pose(tick);
      at.position.z() += radius - 0.15;
      at.grab = tick > 60;
      step(body_, state, at);
      short_ones.post(state, tick, 1e-3 * tick);
      whole.post(state, tick, 1e-3 * tick);
    }
    ASSERT_EQ(loads.size(), frames.size());
    for (std::size_t k = 0; k < loads.size(); ++k) {
      ASSERT_TRUE(std::is_sorted(loads[k].node.begin(), loads[k].node.end()));
      most = std::max(most, loads[k].node.size());
      expect_same_picture(maker.picture(loads[k]), frames[k]);
    }
    EXPECT_GT(most, radius > 0.5 ? 2U : 0U) << radius;
  }
  EXPECT_THROW((void)maker.picture({.node = {98}, .force = {1, 2, 3}, .press = {1}}), Error);
  EXPECT_THROW((void)maker.picture({.node = {-1}, .force = {1, 2, 3}, .press = {1}}), Error);
}

// In the plane, where all nodes are stored: the interior too.
TEST(FramesInThePlane, ShowTheInterior) {
  for (const Scope scope : {Scope::full, Scope::surface}) {
    Model model = test::unit_model(ElementType::tri3, 6, scope, Precision::double_precision);
    test::set_rest(model, 0.01);
    const Body body(model);
    State state(body, {.tools = {Tool{.radius = 0.15}}});
    SurfacePicture picture;
    SurfaceFrames source(body, state, {.ticks_per_frame = 1, .in_background = false},
                         [&](SurfacePicture shown) { picture = std::move(shown); });
    for (int tick = 0; tick < 60; ++tick) {
      step(body, state, {.position = Vec3(0.5, 1.2 - 0.002 * tick, 0.0)});
      source.post(state, tick, 1e-3 * tick);
    }
    const std::size_t N = model.mesh.nodes.size();
    if (scope == Scope::surface) {
      EXPECT_TRUE(picture.plane_displacement.empty() && picture.plane_von_mises.empty());
      continue;
    }
    ASSERT_EQ(picture.plane_displacement.size(), 3 * N);
    ASSERT_EQ(picture.plane_von_mises.size(), N);
    double largest = 0.0;
    for (std::size_t k = 0; k < picture.frame.von_mises.size(); ++k) {  // the same on the surface
      const auto node = static_cast<std::size_t>(body.surface_mesh_nodes()[k]);
      for (std::size_t axis = 0; axis < 3; ++axis)
        ASSERT_EQ(picture.plane_displacement[3 * node + axis], picture.frame.displacement[3 * k + axis]);
    }
    for (std::size_t node = 0; node < N; ++node) {
      Vec3 u = model.rest_displacement[node];
      const SurfaceLoad& load = state.surface.near.load();
      const Index stored = body.stored_node(static_cast<Index>(node));
      for (std::size_t k = 0; stored >= 0 && k < load.nodes().size(); ++k)
        u.head<2>() += body.greens().block(stored, load.nodes()[k]) *
                       Eigen::Vector2d(load.forces()[2 * k], load.forces()[2 * k + 1]);
      for (std::size_t axis = 0; axis < 2; ++axis)
        ASSERT_NEAR(picture.plane_displacement[3 * node + axis], u[static_cast<Eigen::Index>(axis)], 1e-7);
      largest = std::max(largest, static_cast<double>(picture.plane_von_mises[node]));
    }
    EXPECT_GT(largest, 0.05);
  }
}

TEST(FramesInThePlane, RecordWhatIsHeld) {
  const Body body(test::unit_model(ElementType::quad4, 2, Scope::full, Precision::double_precision), {}, 2);
  const RecordedSurface surface = recorded_surface(body);
  ASSERT_EQ(surface.held.size(), surface.nodes.size());
  for (std::size_t node = 0; node < surface.nodes.size(); ++node)
    EXPECT_EQ(surface.held[node], surface.nodes[node].y() < 1e-9 ? 3 : 0) << surface.nodes[node].transpose();
}

class RecorderTest : public testing::Test {
 protected:
  RecorderTest() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directory(folder_);
  }
  ~RecorderTest() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("palpate_recorder." + std::to_string(getpid()));
  const std::filesystem::path file_ = folder_ / "a.mcap";
  const RecordedSurface triangle_ = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 3, {0, 1, 2}};
};

SurfaceFrame frame(std::int64_t tick) {
  return {tick, 1e-3 * static_cast<double>(tick), std::vector<float>(9, static_cast<float>(tick))};
}

TEST_F(RecorderTest, SaysWhereItCannotWrite) {
  try {
    const Recorder recorder("no/such/folder/out.mcap", {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(error.where().find("out.mcap"), std::string::npos) << error.where();
  }
}

// Frames come from another thread than ticks.
TEST_F(RecorderTest, KeepsTicksAndFrames) {
  constexpr int ticks = 40'000;  // more than there is room for
  Recorder recorder(file_, {}, triangle_);
  std::thread beside([&] {
    for (int k = 0; k < 1000; ++k) recorder.push_picture_waiting(frame(std::int64_t{40} * k));
  });
  for (int k = 0; k < ticks; ++k) {
    recorder.push_waiting({.time = 1e-3 * k});
    if (k == ticks / 2) std::this_thread::sleep_for(std::chrono::milliseconds(600));  // a checkpoint
  }
  beside.join();
  recorder.finish();
  EXPECT_EQ(recorder.dropped(), 0);
  EXPECT_EQ(recorder.dropped_pictures(), 0);
  const RecordingFile recording(file_);
  ASSERT_EQ(recording.ticks(), ticks);
  for (int k = 0; k < ticks; ++k) ASSERT_EQ(recording.tick(k).time, 1e-3 * k);
  ASSERT_EQ(recording.pictures().size(), 1000U);
  for (int k = 0; k < 1000; ++k) {
    ASSERT_EQ(recording.pictures()[static_cast<std::size_t>(k)].tick, 40 * k);
    ASSERT_EQ(recording.frame(k).displacement[8], static_cast<float>(40 * k));
  }
}

TEST_F(RecorderTest, WithoutFinishIsLeftAsIfItWereKilled) {
  {
    Recorder recorder(file_, {}, triangle_);
    for (int k = 0; k < 100; ++k) recorder.push({.time = 1e-3 * k});
    recorder.push_picture(frame(0));
  }
  EXPECT_FALSE(RecordingFile(file_).finished());
  EXPECT_EQ(session(file_, true, false), exit_ok);
  EXPECT_FALSE(RecordingFile(file_).finished()) << "nobody asked for that";
  EXPECT_EQ(session(file_, true, true), exit_ok);
  const RecordingFile recording(file_);
  EXPECT_TRUE(recording.finished());
  EXPECT_EQ(recording.ticks(), 100);
  EXPECT_EQ(recording.pictures().size(), 1U);
}

/// The texts of the events in a recording, in their order.
std::vector<std::string> events_of(const std::filesystem::path& path) {
  const FileDescriptor file = open_file(path, OpenMode::read);
  std::vector<std::string> texts;
  std::vector<char> text;
  for (const mcap::ChunkPlace& chunk : mcap::read_layout(file).chunks) {
    const std::string records = mcap::read_chunk(file, chunk);
    for (const mcap::Message& message : mcap::messages_of(path, records)) {
      if (message.channel != static_cast<std::uint16_t>(RecordedChannel::events)) continue;
      CdrReader reader(message.data);
      (void)reader.number<std::int32_t>();  // seconds
      (void)reader.number<std::uint32_t>();
      (void)reader.number<std::uint8_t>();  // level
      for (int k = 0; k < 2; ++k) {         // who says it, and what
        reader.get(text);
        if (k == 1) texts.emplace_back(text.data());
      }
    }
  }
  return texts;
}

TEST_F(RecorderTest, SaysInWordsWhatHappened) {
  Recorder recorder(file_, {});
  auto push = [&, k = 0](SafetyPhase phase, Fault fault, DeviceEvent event) mutable {
    recorder.push({.time = 1e-3 * k++,
                   .phase = static_cast<std::uint8_t>(phase),
                   .fault = static_cast<std::uint8_t>(fault),
                   .event = static_cast<std::uint8_t>(event)});
  };
  push(SafetyPhase::waiting, Fault::none, DeviceEvent::none);
  push(SafetyPhase::active, Fault::none, DeviceEvent::lifted);
  push(SafetyPhase::active, Fault::none, DeviceEvent::lifted);  // goes on
  push(SafetyPhase::faulted, Fault::device_lost, DeviceEvent::lost);
  push(SafetyPhase::active, Fault::none, DeviceEvent::opened_again);
  recorder.finish();
  EXPECT_EQ(events_of(file_),
            (std::vector<std::string>{"the tool was lifted", "phase: active", "the device is lost",
                                      "phase: faulted", "fault: device_lost", "the device is back",
                                      "phase: active", "fault: none"}));
}

// Each picture follows its tick: equal runs make equal files, however their threads met.
TEST_F(RecorderTest, OfTicksThatAreWaitedForIsTheSameEachTime) {
  std::vector<std::string> files;
  for (int run = 0; run < 3; ++run) {
    Recorder recorder(file_, {}, triangle_);
    for (int k = 0; k < 20'000; ++k) {
      recorder.push_waiting({.time = 1e-3 * k});
      if (k % 10 == 0)
        recorder.push_picture_waiting(
            ContactLoads{.tick = k, .time = 1e-3 * k, .node = {1}, .force = {1, 2, 3}, .press = {4}});
      if (run == 1 && k % 1000 == 0) std::this_thread::yield();
    }
    recorder.finish();
    std::ifstream in(file_, std::ios::binary);
    files.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  EXPECT_GT(files[0].size(), 20'000U * 420U);
  EXPECT_TRUE(files[0] == files[1] && files[0] == files[2]);
}

// A limit on the size of files stands for a full disk.
TEST_F(RecorderTest, LetsTheRunGoOnWhereTheDiskIsFull) {
  Recorder recorder(file_, {}, triangle_);
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small = {20'000, before.rlim_max};
  auto* const action = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  std::int64_t pushed = 0;
  const auto begin = std::chrono::steady_clock::now();
  while (recorder.dropped_pictures() < 100 &&
         std::chrono::steady_clock::now() - begin < std::chrono::seconds(60)) {
    recorder.push({.time = 1e-3 * static_cast<double>(pushed)});
    if (recorder.dropped() > 0) recorder.push_picture(frame(pushed));
    if (++pushed % 10 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  recorder.push_waiting({});  // does not wait for ever
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, action);
  EXPECT_EQ(recorder.dropped(), pushed + 1);  // also those that were on their way
  EXPECT_EQ(recorder.dropped_pictures(), 100);
  EXPECT_THROW(recorder.finish(), Error);
  EXPECT_EQ(RecordingFile(file_).ticks(), 0);
}

TEST(SessionSummary, CountsWhatTheTicksSay) {
  std::vector<TickRecord> ticks;
  ticks.reserve(8);
  const auto add = [&](int k) -> TickRecord& {
    return ticks.emplace_back(TickRecord{.time = k / 500.0, .begun_ns = 2'000'000L * k});
  };
  add(10).compute_ns = 2'000'000;  // in time, just
  add(11).compute_ns = 2'000'001;
  TickRecord& late = add(12);
  late.begun_ns += 1'500'000;
  late.compute_ns = 600'000;
  late.force[0] = 3;
  late.force[2] = -4;
  late.contacts = 2;
  add(14).shown_force[1] = -2;  // 13 is missing
  ticks.back().fault = static_cast<std::uint8_t>(Fault::too_fast);
  add(15).fault = static_cast<std::uint8_t>(Fault::too_fast);
  add(16);
  add(17).fault = static_cast<std::uint8_t>(Fault::device_lost);
  Summarising sums(500);  // 2 ms
  EXPECT_EQ(sums.summary().ticks, 0);
  for (const TickRecord& tick : ticks) sums.add(tick);
  const SessionSummary& summary = sums.summary();
  EXPECT_EQ(summary.ticks, 7);
  EXPECT_EQ(summary.missing, 1);
  EXPECT_DOUBLE_EQ(summary.seconds, 0.016);
  EXPECT_EQ(summary.in_contact, 1);
  EXPECT_DOUBLE_EQ(summary.largest_force, 5);
  EXPECT_DOUBLE_EQ(summary.largest_force_time, 0.024);
  EXPECT_DOUBLE_EQ(summary.largest_shown, 2);
  EXPECT_DOUBLE_EQ(summary.largest_shown_time, 0.028);
  EXPECT_EQ(summary.deadline_misses, 2);
  EXPECT_EQ(summary.worst_lateness, 1'500'000);
  EXPECT_EQ(summary.compute.worst(), 2'000'001);
  ASSERT_EQ(summary.faults.size(), 2U);
  EXPECT_EQ(summary.faults[0].fault, Fault::too_fast);
  EXPECT_DOUBLE_EQ(summary.faults[0].time, 0.028);
  EXPECT_EQ(summary.faults[1].fault, Fault::device_lost);
  EXPECT_DOUBLE_EQ(summary.faults[1].time, 0.034);
}

}  // namespace
}  // namespace palpate::session_test
