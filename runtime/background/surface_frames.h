// The displacement of the whole surface, at display rate, beside the tick.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "base/latest.h"
#include "formats/recording.h"
#include "runtime/background/picture_maker.h"
#include "runtime/background/seen_contact.h"
#include "runtime/body/free_motion.h"
#include "runtime/tick/state.h"

namespace palpate {

struct SurfaceFramesOptions {
  std::int64_t ticks_per_frame = 16;
  bool in_background = true;   ///< else `post` computes the frame itself: equal runs stay equal
  bool contacts_only = false;  ///< nothing is computed: of a picture `loads` alone, with tick and time
};

/// What is seen at one moment.
struct SurfacePicture {
  SurfaceFrame frame;
  ContactLoads loads;  ///< SurfaceFramesOptions::contacts_only
  ToolPose device;     ///< where the hand wants the tool
  ToolPose tool;       ///< where it is
  Wrench on_body;      ///< the opposite of what the hand feels
  StepStatus status = StepStatus::ok;
  double force_error = 0.0;            ///< how far the force may be off, where it is a best effort [N]
  Index left_out = 0;                  ///< contact points that found no room
  double greens_error = 0.0;           ///< ToolState::greens_error [N]
  std::vector<SeenContact> contacts;   ///< those that are closed
  std::shared_ptr<const Patch> patch;  ///< null: no overlay
  /// In the plane, where all free nodes are stored: of all mesh nodes, without an overlay's refinement; else
  /// empty.
  std::vector<float> plane_displacement;  ///< [N x 3] node + displacement is what is seen [m]
  std::vector<float> plane_von_mises;     ///< [N] [Pa]
};

/// Takes a frame each `ticks_per_frame` ticks, from the first one on, and hands it to `sink`. In the
/// background a thread of its own computes it; where that takes too long, frames are left out.
class SurfaceFrames {
 public:
  using Sink = std::function<void(SurfacePicture)>;

  /// `body` must live as long; `state` is one that the loop will use, or a copy. `sink` is called by one
  /// thread and does not throw.
  SurfaceFrames(const Body& body, const State& state, const SurfaceFramesOptions& options, Sink sink);
  ~SurfaceFrames();  ///< after the last frame that was posted
  SurfaceFrames(const SurfaceFrames&) = delete;
  SurfaceFrames& operator=(const SurfaceFrames&) = delete;

  /// After each tick, with its number and time [s]. In the background it is real-time safe.
  void post(const State& state, std::int64_t tick, double time) noexcept;

 private:
  struct Moment {
    ToolPose device{};
    ToolPose tool{};
    SurfaceLoad load;
    MotionSnapshot motion;
    std::vector<SeenContact> touches;  // [most contacts] the first `touch_count`
    std::vector<NodalPress> presses;  // [3 most contacts + most nodes near the tools] the first `press_count`
    std::vector<NodalForce> forces;   // [2 x most nodes near the tools] the first `force_count`
    std::size_t touch_count = 0;
    std::size_t press_count = 0;
    std::size_t force_count = 0;
    Wrench on_body{};
    std::int64_t tick = -1;
    double time = 0.0;
    StepStatus status = StepStatus::ok;
    double force_error = 0.0;
    Index left_out = 0;
    double greens_error = 0.0;
  };
  /// The interior of a body in the plane.
  struct Interior {
    StressRows rows;
    std::vector<Vec3> u;         // [N] u0 + u
    std::vector<Stress> stress;  // [N]
    std::vector<Mat3> turn;      // [N] of the nodes' frames, where parts of the body turn
  };

  void take_contacts(const State& state, Moment& moment) const noexcept;
  void work();
  void compute(const Moment& moment);
  void show_interior(SurfacePicture& picture);

  const Body& body_;
  SurfaceFramesOptions options_;
  Sink sink_;
  Latest<Moment> moments_;
  std::optional<PictureMaker> maker_;  // none of contacts alone
  std::optional<Interior> interior_;   // in the plane, where all of it is known
  std::int64_t computed_ = -1;         // tick of the last frame
  std::atomic<bool> stop_ = false;
  std::thread worker_;
};

/// The surface of a body as a recording keeps it.
RecordedSurface recorded_surface(const Body& body);

}  // namespace palpate
