// The tick takes no memory and makes no system call. A program of its own, as it replaces malloc.
#include <gtest/gtest.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <tuple>
#include <vector>

#include "runtime/background/motion_source.h"
#include "runtime/background/patch_source.h"
#include "runtime/background/surface_frames.h"
#include "runtime/background/surface_stress.h"
#include "runtime/body/prescribed_nodes.h"
#include "runtime/core/tick/step.h"
#include "runtime/depth/deep_body.h"
#include "runtime/library/palpate.h"
#include "tests/support/bodies/bent_bodies.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/compression/hierarchical_sample.h"
#include "tests/support/folders.h"
#include "tests/support/live_session.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PALPATE_OWN_MALLOC 0  // sanitizers have their own
#else
#define PALPATE_OWN_MALLOC 1
#endif

#if PALPATE_OWN_MALLOC
namespace {
thread_local bool counting = false;
thread_local long heap_calls = 0;

void count_call() noexcept {
  if (counting) ++heap_calls;
}
}  // namespace

// operator new and delete of libstdc++ come here too.
extern "C" {
void* __libc_malloc(std::size_t size);  // NOLINT(bugprone-reserved-identifier): glibc's names
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void* p, std::size_t size);                 // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT(bugprone-reserved-identifier)
void __libc_free(void* p);                                       // NOLINT(bugprone-reserved-identifier)

void* malloc(std::size_t size) {
  count_call();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  count_call();
  return __libc_calloc(count, size);
}
void* realloc(void* p, std::size_t size) {
  count_call();
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count_call();
  return __libc_memalign(alignment, size);
}
void free(void* p) {
  if (p != nullptr) count_call();
  __libc_free(p);
}
}
#endif

namespace palpate::heap_test {
namespace {

/// Ticks that touch, grab, move, miss, let go and send nonsense; beside them nodes that are held and dropped.
void exercise(const Body& body, State& state, PrescribedNodes& held, std::span<double> u,
              const std::vector<ToolPose>& poses) {
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const auto node = static_cast<Index>(k % 30);
    if (k % 3 == 0) held.hold(body, node);
    if (k % 7 == 0) held.release(node);
    if (k % 100 == 99) held.release_all();
    held.prescribe(node, Vec3(0.0, 0.001, 0.001));
    held.solve();
    step(body, state, poses[k]);
    if (k % 10 == 0) held.displace(body, u);
    if (k % 10 == 5) surface_displacement(body, state, u);
  }
}

class Tick : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    for (int k = 0; k < 1000; ++k) {
      ToolPose tool;
      tool.position = test::upright(GetParam(), 0.001 * (k % 50), 0.5, k % 200 < 20 ? 9.0 : 1.0);
      if (k % 333 == 0) tool.position.x() = std::numeric_limits<double>::quiet_NaN();
      tool.grab = k % 40 > 10;
      poses_.push_back(tool);
    }
  }

  Body body_{
      test::unit_model(GetParam(), GetParam() == 3 ? 4 : 20, Scope::surface, Precision::single_precision)};
  State state_{body_, {.tools = {Tool{.reach = 0.3}}}};
  PrescribedNodes held_{body_, 24};
  std::vector<double> u_ = std::vector<double>(static_cast<std::size_t>(body_.greens().order()));
  std::vector<ToolPose> poses_;
};

INSTANTIATE_TEST_SUITE_P(Dimension, Tick, testing::Values(2, 3));

TEST_P(Tick, MakesNoHeapCall) {
#if PALPATE_OWN_MALLOC
  counting = true;
  { const std::vector<int> proof(100); }
  counting = false;
  ASSERT_EQ(heap_calls, 2) << "the counter does not count";

  heap_calls = 0;
  counting = true;
  exercise(body_, state_, held_, u_, poses_);
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#else
  exercise(body_, state_, held_, u_, poses_);  // for the sanitizer, which has taken malloc
#endif
  EXPECT_EQ(state_.ticks, 1000);
}

/// Runs in a process that the kernel kills at the first system call but write and exit.
[[maybe_unused]] void expect_no_system_call(const std::function<bool()>& run) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) _exit(77);
    syscall(SYS_exit, run() ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 77) GTEST_SKIP() << "no seccomp here";
  EXPECT_FALSE(WIFSIGNALED(status)) << "signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_P(Tick, MakesNoHeapCallWhereContactsAreLeftOut) {
  State few(body_, {.tools = {Tool{.radius = 1.0}}, .max_contacts = 2});
  ToolPose pose;
  Index left_out = 0;
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
  counting = true;
#endif
  for (int k = 0; k < 100; ++k) {
    pose.position = test::upright(GetParam(), 0.5, 0.5, 2.01 - 0.002 * k);
    step(body_, few, pose);
    left_out = std::max(left_out, few.tools[0].left_out);
  }
#if PALPATE_OWN_MALLOC
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#endif
  EXPECT_GT(left_out, 0);
}

TEST_P(Tick, MakesNoHeapCallWhereContactsAreMergedAndParted) {
  State few(body_,
            {.tools = {Tool{.radius = 2.0, .friction = 0.3}}, .max_contacts = GetParam() == 3 ? 16 : 4});
  ToolPose pose;
  int changes = 0;
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
  counting = true;
#endif
  for (int k = 0; k < 200; ++k) {
    pose.position = test::upright(GetParam(), 0.5, 0.5, 3.01 - 0.002 * std::min(k, 199 - k));
    step(body_, few, pose);
    changes += few.scratch.merging.has_changed ? 1 : 0;
  }
#if PALPATE_OWN_MALLOC
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#endif
  EXPECT_GT(changes, 1);
}

/// The same body with a finer surface, flat or rounded, and patches that take turns.
class OverlayTick : public Tick {
 protected:
  explicit OverlayTick(bool rounded = false) : rounded_(rounded) {}
  void SetUp() override {
    Tick::SetUp();
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      const double height = k % 200 < 20 ? 1.1 : 1.04;
      poses_[k].position = test::upright(GetParam(), 0.2 + 0.001 * static_cast<double>(k % 50), 0.5, height);
    }
    PatchMaker maker(overlaid_, 1, finest);
    for (const double x : {0.0, 0.3, 0.6}) {
      const Index stored = overlaid_.nearest_surface_node(test::upright(GetParam(), x, 0.5, 1.0)).node;
      const Index centre = rounded_ ? overlaid_.surface_node_of_stored(stored) : stored;
      patches_.push_back(maker.make({&centre, 1}));
    }
    patches_.push_back(nullptr);
  }
  void exercise_patches() {
    for (std::size_t k = 0; k < poses_.size(); ++k) {
      if (k % 13 == 0) with_.surface.patch = patches_[k / 13 % patches_.size()];
      step(overlaid_, with_, poses_[k]);
      touching_ += with_.tools.front().contacts > 0 ? 1 : 0;
      load_ = with_.surface.near.load();
      if (k % 10 == 5) {
        surface_displacement(overlaid_, load_, stored_, surface_);
        surface_stress_.evaluate(surface_, force_, load_.patch.get(), stress_);
      }
      if (frames_) frames_->post(with_, static_cast<std::int64_t>(k), 0.001 * static_cast<double>(k));
    }
  }

  void exercise_beside(const PatchSourceOptions& options);

  static constexpr double finest = 0.1;  // of rounded ones
  static constexpr int most_rounds = 2000;

  bool rounded_;
  Body overlaid_{
      test::unit_model(GetParam(), GetParam() == 3 ? 4 : 20, Scope::full, Precision::double_precision),
      {},
      3,
      ContactModel::quasi_static,
      rounded_};
  Index room_ = patch_room(overlaid_, 1, 1);
  State with_{overlaid_, {.tools = {Tool{.radius = 0.05, .reach = 0.3}}, .patch_nodes = room_}};
  int touching_ = 0;
  SurfaceLoad load_ = with_.surface.near.load();
  std::vector<std::shared_ptr<const Patch>> patches_;
  std::vector<double> stored_ = std::vector<double>(static_cast<std::size_t>(overlaid_.greens().order()));
  std::vector<Vec3> surface_ = std::vector<Vec3>(overlaid_.surface_rest_positions().size());
  SurfaceStress surface_stress_{overlaid_};
  std::vector<Vec3> force_ = std::vector<Vec3>(surface_.size(), Vec3(0.1, 0.2, 0.0));
  std::vector<Stress> stress_ = std::vector<Stress>(surface_.size());
  std::optional<SurfaceFrames> frames_;
};

INSTANTIATE_TEST_SUITE_P(Dimension, OverlayTick, testing::Values(2, 3));

TEST_P(OverlayTick, MakesNoHeapCall) {
  frames_.emplace(overlaid_, with_, SurfaceFramesOptions{.ticks_per_frame = 1}, [](const SurfacePicture&) {});
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
  counting = true;
  exercise_patches();
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#else
  exercise_patches();
#endif
  EXPECT_EQ(with_.ticks, 1000);
  EXPECT_GT(touching_, 500);
}

// With the thread that builds patches and lets them go beside it, which takes memory all the time.
TEST_P(OverlayTick, MakesNoHeapCallBesideTheBuilder) {
  exercise_beside({.rings = 1, .memory = 1 << 16});
}

TEST_P(OverlayTick, MakesNoHeapCallBesideTheBuilderOfNeoHookeanPatches) {
  exercise_beside({.rings = 1, .law = PatchLaw::neo_hookean, .memory = 1 << 16});
}

class GradedTick : public OverlayTick {
 protected:
  GradedTick() : OverlayTick(true) {}
};

INSTANTIATE_TEST_SUITE_P(Dimension, GradedTick, testing::Values(3));

TEST_P(GradedTick, MakesNoHeapCall) {
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
  counting = true;
  exercise_patches();
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#else
  exercise_patches();
#endif
  EXPECT_GT(touching_, 500);
}

TEST_P(GradedTick, MakesNoHeapCallBesideTheBuilder) {
  exercise_beside({.rings = 1, .finest = finest, .memory = 1 << 22});
}

void OverlayTick::exercise_beside(const PatchSourceOptions& options) {
  PatchSource source(overlaid_, with_, options);
  const auto is_done = [&] {  // once the builder, which a busy machine holds up, has made some
    return source.built() > 1 && (source.tangents() == nullptr || source.tangents()->telling().made > 1);
  };
  const auto exercise = [&] {
    for (int round = 0; round < 20 || (round < most_rounds && !is_done()); ++round) {
      for (ToolPose pose : poses_) {
        pose.position.x() += 0.04 * (round % 20);
        source.serve(with_);
        step(overlaid_, with_, pose);
      }
    }
  };
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
  counting = true;
  exercise();
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#else
  exercise();
#endif
  EXPECT_TRUE(is_done());
}

TEST_P(OverlayTick, MakesNoSystemCall) {
#if !PALPATE_OWN_MALLOC
  GTEST_SKIP() << "sanitizers make system calls";
#else
  expect_no_system_call([&] {
    exercise_patches();
    return with_.ticks == 1000;
  });
#endif
}

TEST_P(Tick, MakesNoSystemCall) {
#if !PALPATE_OWN_MALLOC
  GTEST_SKIP() << "sanitizers make system calls";
#else
  expect_no_system_call([&] {
    exercise(body_, state_, held_, u_, poses_);
    return state_.ticks == 1000;
  });
#endif
}

/// A cube that swings, by numbers that need not be its own.
Model swinging_model(DynamicsMethod method) {
  Model model = test::unit_model(3, 4, Scope::full, Precision::double_precision);
  const auto n = static_cast<std::size_t>(model.stored_dofs());
  StoredDynamics& dynamics = model.dynamics;
  dynamics.method = method;
  dynamics.damping = {.mass = 1.0, .stiffness = 0.0};
  if (method == DynamicsMethod::modal) {
    dynamics.omega = {20.0, 30.0, 50.0, 80.0};
    for (std::size_t k = 0; k < 3 * n; ++k)
      dynamics.shapes.push_back(0.3 * std::sin(0.7 * static_cast<double>(k)));
  } else {
    dynamics.inverse = test::pack(
        1e-7 * Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n)),
        Precision::double_precision);
    for (std::size_t dof = 0; dof < n; ++dof) {
      dynamics.matrices.start.push_back(static_cast<std::int64_t>(dof));
      dynamics.matrices.row.push_back(static_cast<Index>(dof));
    }
    dynamics.matrices.start.push_back(static_cast<std::int64_t>(n));
    dynamics.matrices.mass.assign(n, 2.0);
    dynamics.matrices.damping.assign(n, 2.0);
  }
  return model;
}

class MovingTick : public testing::TestWithParam<std::tuple<DynamicsMethod, ContactModel>> {
 protected:
  /// Grabs, pulls, lets go and is struck.
  void exercise_motion() {
    for (int k = 0; k < 1000; ++k) {
      ToolPose tool;
      tool.position = Vec3(0.5, 0.5, 1.05 + 0.001 * (k % 100));
      tool.grab = k % 100 > 20 && k % 100 < 60;
      if (source_) source_->receive(state_);
      step(body_, state_, tool);
      if (source_) source_->post(state_);
      if (frames_) frames_->post(state_, k, 0.001 * k);
      if (k % 10 == 0) state_.surface.motion.snapshot(shown_);
    }
  }

  Body body_{swinging_model(std::get<0>(GetParam())), {}, 1, std::get<1>(GetParam())};
  State state_{body_, {.tools = {Tool{.radius = 0.04, .coupling_stiffness = 2.0, .reach = 0.3}}}};
  MotionSnapshot shown_{body_};
  std::optional<MotionSource> source_;
  std::atomic<int> shown_frames_ = 0;
  std::optional<SurfaceFrames> frames_;
};

INSTANTIATE_TEST_SUITE_P(Bodies, MovingTick,
                         testing::Combine(testing::Values(DynamicsMethod::modal, DynamicsMethod::packed),
                                          testing::Values(ContactModel::quasi_static,
                                                          ContactModel::dynamic)));

// Beside threads that step packed dynamics and make frames, and take what memory they like.
TEST_P(MovingTick, MakesNoHeapCall) {
  frames_.emplace(body_, state_, SurfaceFramesOptions{.ticks_per_frame = 2},
                  [this](const SurfacePicture&) { ++shown_frames_; });
  if (std::get<0>(GetParam()) == DynamicsMethod::packed)
    source_.emplace(body_, state_, MotionSourceOptions{.in_background = true, .jobs = 2});
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
  counting = true;
  exercise_motion();
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#else
  exercise_motion();
#endif
  EXPECT_TRUE(state_.surface.motion.active());
  frames_.reset();
  EXPECT_GT(shown_frames_, 0);
}

TEST_P(MovingTick, MakesNoSystemCall) {
#if !PALPATE_OWN_MALLOC
  GTEST_SKIP() << "sanitizers make system calls";
#else
  expect_no_system_call([&] {
    exercise_motion();
    return state_.surface.motion.active();
  });
#endif
}

/// Beside the thread that steps a body and renews its compliance, as a tool that comes from `above` bends it.
void expect_no_heap_call(const Body& body, const Vec3& above, const Vec3& down) {
  State state(body, {.tools = {Tool{.radius = 0.006, .reach = 0.01}}});
  MotionSource source(body, state, {.in_background = true});
  SurfaceFrames frames(body, state, {.ticks_per_frame = 5}, [](const SurfacePicture&) {});
  const Greens* last = nullptr;
  int changes = 0;
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
#endif
  for (int k = 0; k < 3000; ++k) {
    ToolPose pose;
    pose.position = above + 2e-5 * std::min(k, 3000 - k) * down;
    while (state.surface.motion.job().step > source.steps())
      std::this_thread::sleep_for(std::chrono::microseconds(50));
#if PALPATE_OWN_MALLOC
    counting = true;
#endif
    source.receive(state);
    step(body, state, pose);
    source.post(state);
    frames.post(state, k, 0.001 * k);
#if PALPATE_OWN_MALLOC
    counting = false;
#endif
    const Greens* now = state.surface.near.load().compliance.get();
    changes += now != last ? 1 : 0;
    last = now;
  }
#if PALPATE_OWN_MALLOC
  EXPECT_EQ(heap_calls, 0);
#endif
  EXPECT_GT(changes, 2);
}

TEST(LiveTick, MakesNoHeapCallWhereTheComplianceIsRenewed) {
  const Body body = test::live_bar(3, {.solver = LiveLaw::corotational});
  expect_no_heap_call(body, Vec3(0.07, 0.027, 0.01), -Vec3::UnitY());
}

TEST(TwoLevelTick, MakesNoHeapCallWhereTheComplianceIsRenewed) {
  for (const int refinement : {1, 2}) {
    const Body body = deep_body(test::bent_model(ElementType::tet4), refinement, refinement > 1);
    EXPECT_EQ(body.local() != nullptr, refinement > 1);
    expect_no_heap_call(body, Vec3(0.07, 0.005, 0.017), -0.5 * Vec3::UnitZ());
  }
}

/// Rows and displacements of compressed Green's functions, more at once than is kept of them.
class CompressedGreens : public testing::TestWithParam<int> {
 protected:
  bool exercise_products() {
    for (Index row = 0; row < greens_.nodes(); row += 17) greens_.gather(row, nodes_, blocks_);
    greens_.displacement(nodes_, f_, u_);
    greens_.displacement({nodes_.data(), 30}, {f_.data(), 30 * d_}, 100, {u_.data(), 64 * d_});
    bound_.carry(nodes_, f_);
    return std::isfinite(u_.front()) && std::isfinite(blocks_.back()) &&
           std::isfinite(bound_.work(nodes_, f_));
  }

  std::size_t d_ = static_cast<std::size_t>(GetParam());
  std::shared_ptr<const Greens> made_ = make_greens(std::make_shared<const HierarchicalMatrix>(
      test::random_hierarchical({.dimension = GetParam(), .nodes = 331, .levels = 5}, 1)));
  const Greens& greens_ = *made_;
  ErrorBound bound_{*greens_.compressed_form(), 500};
  std::vector<Index> nodes_ = [] {
    std::vector<Index> nodes;
    for (Index k = 0; k < 700; ++k) nodes.push_back(k * 37 % 331);
    return nodes;
  }();
  std::vector<double> f_ = std::vector<double>(d_ * nodes_.size(), 1.0), u_ = std::vector<double>(d_ * 331),
                      blocks_ = std::vector<double>(d_ * d_ * nodes_.size());
};

INSTANTIATE_TEST_SUITE_P(Dimension, CompressedGreens, testing::Values(2, 3));

TEST_P(CompressedGreens, MakeNoHeapCall) {
#if PALPATE_OWN_MALLOC
  heap_calls = 0;
  counting = true;
  const bool finite = exercise_products();
  counting = false;
  EXPECT_EQ(heap_calls, 0);
#else
  const bool finite = exercise_products();
#endif
  EXPECT_TRUE(finite);
}

TEST_P(CompressedGreens, MakeNoSystemCall) {
#if !PALPATE_OWN_MALLOC
  GTEST_SKIP() << "sanitizers make system calls";
#else
  expect_no_system_call([&] { return exercise_products(); });
#endif
}

// libpalpate.so calls this program's malloc too.
TEST(OwnLoop, MakesNoHeapCall) {
  palpate_tool tool = PALPATE_TOOL_INIT;
  tool.radius = 0.2;
  tool.friction = 0.3;
  const std::string file = palpate::test::source_file("tests/golden/cube2/cube2.palpate.hdf");
  palpate_session* session = palpate_create(file.c_str(), &tool, 1, 8, nullptr, 0);
  ASSERT_NE(session, nullptr);
  palpate_counts counts = PALPATE_COUNTS_INIT;
  palpate_surface_counts(session, &counts);
  std::vector<double> xyz(3 * static_cast<std::size_t>(counts.nodes));
  palpate_result result = PALPATE_RESULT_INIT;
  std::vector<palpate_contact> contacts(32, PALPATE_CONTACT_INIT);
  int touching = 0;
  const auto loop = [&] {
    for (int tick = 0; tick < 1000; ++tick) {
      const double depth = 0.1 * (tick % 200) / 200.0 - 0.02;
      const palpate_pose pose{sizeof pose,
                              {0.3 + 0.0004 * tick, 0.5, 1.2 - depth},
                              {1.0, 0.1, 0.0, 0.0},
                              tick % 300 > 250 ? 1 : 0};
      palpate_step(session, &pose);
      palpate_get(session, 0, &result);
      int found = 0;
      EXPECT_EQ(palpate_get_contacts(session, 0, contacts.data(), 32, &found), 0);
      tool.friction = 0.3 + 1e-4 * tick;
      EXPECT_EQ(palpate_set_tool(session, 0, &tool), 0);
      palpate_surface_displacement(session, xyz.data());
      if (result.contacts > 0) ++touching;
      if (tick == 500) palpate_reset(session);
    }
  };
  const auto count = [&] {
#if PALPATE_OWN_MALLOC
    heap_calls = 0;
    counting = true;
    loop();
    counting = false;
    EXPECT_EQ(heap_calls, 0);
#else
    loop();
#endif
  };
  count();
  EXPECT_GT(touching, 500);
  const std::string recording = testing::TempDir() + "palpate_heap_own_loop.mcap";
  const palpate_record_options options = PALPATE_RECORD_OPTIONS_INIT;
  ASSERT_EQ(palpate_record(session, recording.c_str(), &options, nullptr, 0), PALPATE_OK);
  count();
  palpate_destroy(session);
  std::filesystem::remove(recording);
}

static_assert(noexcept(step(std::declval<const Body&>(), std::declval<State&>(),
                            std::declval<const ToolPose&>())));

}  // namespace
}  // namespace palpate::heap_test
