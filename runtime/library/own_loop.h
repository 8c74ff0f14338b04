// The session behind palpate_session of palpate.h.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/latest.h"
#include "runtime/background/motion_source.h"
#include "runtime/background/patch_source.h"
#include "runtime/background/surface_frames.h"
#include "runtime/body/body.h"
#include "runtime/body/met_surface.h"
#include "runtime/core/tick/state.h"
#include "runtime/core/touch/tool_geometry.h"
#include "runtime/depth/deep_body.h"
#include "runtime/library/guarded.h"
#include "runtime/library/palpate.h"
#include "runtime/library/session_recording.h"

namespace palpate {

inline void copy(const Vec3& vector, double* xyz) noexcept {
  std::copy_n(vector.data(), 3, xyz);
}

/// State of a tick, for display.
struct Shown {
  SurfaceLoad load;
  MotionSnapshot motion;
};

/// Stress and pressure at the surface nodes.
struct FoundStress {
  std::int64_t tick = -1;
  std::vector<float> von_mises, pressure;  // [S] [Pa]
};

/// Options with capacity for the nodes of patches too, where there are overlays.
inline StateOptions with_room(StateOptions options, const Body& body, const palpate_overlay& overlay) {
  if (overlay.refinement > 1) options.patch_nodes = patch_room(body, overlay.rings, options.tools.size());
  return options;
}

/// The body that tools meet: for an overlay of refinement 0 with a LocalCompliance that suits the smallest
/// tool.
inline Body make_body(Model model, const StateOptions& options, const palpate_overlay& overlay,
                      ContactModel contact) {
  const bool is_deep = contact == ContactModel::two_level;
  if (overlay.refinement > 0 && !is_deep) return Body(std::move(model), {}, overlay.refinement, contact);
  double radius = std::numeric_limits<double>::infinity();
  for (const Tool& tool : options.tools) radius = std::min(radius, is_compact(tool) ? tool.radius : 0.0);
  const bool is_static = contact != ContactModel::dynamic && overlay.refinement == 0 && is_even(model);
  const MetSurface met = is_static && radius > 0.0 ? met_surface(model, radius) : MetSurface{};
  if (is_deep) return deep_body(std::move(model), met.refinement, met.is_local);
  return Body(std::move(model), {}, met.refinement, contact, met.is_local);
}

/// A session.
struct OwnLoop {
  OwnLoop(std::string name, Model model, const StateOptions& options, const palpate_overlay& overlay,
          ContactModel contact, std::int64_t stress_ticks)
      : file(std::move(name)),
        state_options(options),
        overlay_options(overlay),
        body(make_body(std::move(model), options, overlay, contact)),
        untouched(body, with_room(options, body, overlay)),
        state(untouched),
        poses(options.tools.size()),
        shown(Shown{.load = state.surface.near.load(), .motion = MotionSnapshot(body)}),
        stored_displacement(static_cast<std::size_t>(body.greens().order())),
        displacement(body.surface_rest_positions().size()) {
    publish();
    if (overlay.refinement > 1)
      overlays.emplace(body, state, PatchSourceOptions{.rings = overlay.rings, .memory = overlay.memory});
    if (body.swing().method == DynamicsMethod::packed) motion.emplace(body, state, MotionSourceOptions{});
    if (stress_ticks > 0) {
      frames.emplace(body, state, SurfaceFramesOptions{.ticks_per_frame = stress_ticks},
                     [this](SurfacePicture picture) {
                       stress.next() = {picture.frame.tick, std::move(picture.frame.von_mises),
                                        std::move(picture.frame.pressure)};
                       stress.publish();
                     });
    }
  }

  /// Passes the result of the last tick to the thread that draws.
  void publish() noexcept {
    Shown& next = shown.next();
    next.load = state.surface.near.load();
    state.surface.motion.snapshot(next.motion);
    shown.publish();
  }

  void reset() noexcept {
    state = untouched;
    publish();
  }

  std::string file;
  StateOptions state_options;
  palpate_overlay overlay_options;
  Body body;
  State untouched;
  State state;
  std::vector<ToolPose> poses;
  Latest<Shown> shown;
  std::mutex drawing;                       // held by the thread that draws
  std::vector<double> stored_displacement;  // workspace for drawing
  std::vector<Vec3> displacement;
  std::optional<PatchSource> overlays;
  std::optional<MotionSource> motion;
  std::int64_t ticks = 0;
  Latest<FoundStress> stress{FoundStress{}};
  std::optional<SurfaceFrames> frames;  // last member: its thread publishes the stress
  std::optional<SessionRecording> recording;
  std::size_t recorded_tool = 0;
};

}  // namespace palpate

struct palpate_session : palpate::Guarded<palpate::OwnLoop> {
  using Guarded::Guarded;
};
