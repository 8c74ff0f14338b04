// The displacement of the whole surface, at display rate, beside the tick.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include "formats/recording.h"
#include "runtime/free_motion.h"
#include "runtime/latest.h"
#include "runtime/state.h"

namespace palpate {

struct SurfaceFramesOptions {
  std::int64_t ticks_per_frame = 16;
  bool in_background = true;  ///< else `post` computes the frame itself: equal runs stay equal
};

/// A contact point as it is seen.
struct SeenContact {
  Vec3 position;  ///< of the surface now [m]
  Vec3 normal;    ///< outward
  Vec3 force;     ///< on the body [N]
  bool held = false;
};

/// What is seen at one moment.
struct SurfacePicture {
  SurfaceFrame frame;
  ToolPose device;  ///< where the hand wants the tool
  ToolPose tool;    ///< where it is
  Wrench on_body;   ///< the opposite of what the hand feels
  StepStatus status = StepStatus::ok;
  std::vector<SeenContact> contacts;
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
    SurfaceLoad load;
    ShownMotion motion;
    std::int64_t tick = -1;
    double time = 0.0;
  };

  void work();
  void compute(const Moment& moment);

  const Body& body_;
  SurfaceFramesOptions options_;
  Sink sink_;
  Latest<Moment> moments_;
  std::vector<Vec3> rest_;      // [S] u0
  std::vector<double> stored_;  // [n] scratch
  std::vector<Vec3> u_;         // [S]
  std::int64_t computed_ = -1;  // tick of the last frame
  std::atomic<bool> stop_ = false;
  std::thread worker_;
};

/// The surface of a body as a recording keeps it.
RecordedSurface recorded_surface(const Body& body);

}  // namespace palpate
