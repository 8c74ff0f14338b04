// Displacement of the whole surface at display rate, computed beside the tick.
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
#include "runtime/core/body/free_motion.h"
#include "runtime/core/tick/state.h"

namespace palpate {

struct SurfaceFramesOptions {
  std::int64_t ticks_per_frame = 16;
  bool in_background = true;   ///< false: `post` computes the frame itself, so that equal runs stay equal
  bool contacts_only = false;  ///< nothing is computed: pictures have only `loads`, tick and time
};

/// The tool at one moment.
struct SeenTool {
  ToolPose device{};  ///< pose requested by the hand
  ToolPose tool{};    ///< actual pose
  Wrench on_body{};   ///< wrench on the body, opposite to that on the hand
  StepStatus status = StepStatus::ok;
  double force_error = 0.0;   ///< possible error of the force if it is a best effort [N]
  Index left_out = 0;         ///< contact points beyond the capacity
  double greens_error = 0.0;  ///< ToolState::greens_error [N]
};

/// Picture of one moment.
struct SurfacePicture : SeenTool {
  SurfaceFrame frame;
  ContactLoads loads;                  ///< with SurfaceFramesOptions::contacts_only
  std::vector<SeenContact> contacts;   ///< closed contacts
  std::shared_ptr<const Patch> patch;  ///< null if there is no overlay
  /// In the plane with all free nodes stored: values of all mesh nodes, without an overlay's refinement; else
  /// empty.
  std::vector<float> plane_displacement;  ///< [N x 3] displacement relative to the mesh [m]
  std::vector<float> plane_von_mises;     ///< [N] [Pa]
};

/// Takes a frame every `ticks_per_frame` ticks, from the first one on, and passes it to `sink`. In the
/// background a thread of its own computes it; if that is too slow, frames are dropped.
class SurfaceFrames {
 public:
  using Sink = std::function<void(SurfacePicture)>;

  /// `body` must outlive this; `state` is the loop's state or a copy. `sink` is called by one thread and must
  /// not throw.
  SurfaceFrames(const Body& body, const State& state, const SurfaceFramesOptions& options, Sink sink);
  ~SurfaceFrames();  ///< waits for the last posted frame
  SurfaceFrames(const SurfaceFrames&) = delete;
  SurfaceFrames& operator=(const SurfaceFrames&) = delete;

  /// Call after each tick, with its number and time [s]. Real-time safe in the background.
  void post(const State& state, std::int64_t tick, double time) noexcept;

 private:
  struct Moment {
    SeenTool seen{};
    SurfaceLoad load;
    MotionSnapshot motion;
    std::vector<SeenContact> touches;  // [most contacts] the first `touch_count`
    std::vector<NodalPress> presses;  // [3 most contacts + most nodes near the tools] the first `press_count`
    std::vector<NodalForce> forces;   // [2 x most nodes near the tools] the first `force_count`
    std::size_t touch_count = 0;
    std::size_t press_count = 0;
    std::size_t force_count = 0;
    std::int64_t tick = -1;
    double time = 0.0;
  };
  /// Interior of a body in the plane.
  struct Interior {
    StressRows rows;
    std::vector<Vec3> u;         // [N] u0 + u
    std::vector<Stress> stress;  // [N]
    std::vector<Mat3> turn;      // [N] rotations of the nodes' frames, if parts of the body rotate
  };

  void take_contacts(const State& state, Moment& moment) const noexcept;
  void work();
  void compute(const Moment& moment);
  [[nodiscard]] std::vector<float> coarse_field(const Moment& moment) const;
  void show_interior(SurfacePicture& picture);

  const Body& body_;
  SurfaceFramesOptions options_;
  Sink sink_;
  Latest<Moment> moments_;
  std::optional<PictureMaker> maker_;            // empty for contacts alone
  std::shared_ptr<const Greens> field_at_rest_;  // on two levels, for contacts alone; else null
  std::optional<Interior> interior_;             // in the plane, if all of it is known
  std::int64_t computed_ = -1;                   // tick of the last frame
  std::atomic<bool> stop_ = false;
  std::thread worker_;
};

/// Returns the surface of a body in the form of a recording.
RecordedSurface recorded_surface(const Body& body);

}  // namespace palpate
