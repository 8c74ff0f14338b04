#include "runtime/surface_frames.h"

#include <chrono>

#include "runtime/surface_load.h"

namespace palpate {
namespace {

constexpr auto pause = std::chrono::milliseconds(1);

}  // namespace

SurfaceFrames::SurfaceFrames(const Body& body, const State& state, const SurfaceFramesOptions& options,
                             Sink sink)
    : body_(body),
      options_(options),
      sink_(std::move(sink)),
      moments_(Moment{.load = state.near.load(), .motion = ShownMotion(body)}),
      rest_(body.surface_in_mesh()),
      stored_(static_cast<std::size_t>(body.greens().order())),
      u_(rest_.size()) {
  for (std::size_t node = 0; node < rest_.size(); ++node)
    rest_[node] = body.surface_rest_positions()[node] - rest_[node];
  if (options_.in_background) worker_ = std::thread([this] { work(); });
}

SurfaceFrames::~SurfaceFrames() {
  stop_ = true;
  if (worker_.joinable()) worker_.join();
}

void SurfaceFrames::post(const State& state, std::int64_t tick, double time) noexcept {
  if (tick % options_.ticks_per_frame != 0) return;
  Moment& next = moments_.next();
  next.load = state.near.load();
  state.motion.show(next.motion);
  next.tick = tick;
  next.time = time;
  if (options_.in_background) {
    moments_.publish();
  } else {
    compute(next);
  }
}

void SurfaceFrames::work() {
  for (;;) {
    const bool last = stop_;  // read before the moment: nothing is posted after stopping
    const Moment& moment = moments_.read();
    if (moment.tick != computed_) {
      compute(moment);
    } else if (last) {
      return;
    } else {
      std::this_thread::sleep_for(pause);
    }
  }
}

void SurfaceFrames::compute(const Moment& moment) {
  computed_ = moment.tick;
  surface_displacement(body_, moment.load, stored_, u_, &moment.motion);
  SurfacePicture picture;
  SurfaceFrame& frame = picture.frame;
  frame.tick = moment.tick;
  frame.time = moment.time;
  frame.displacement.reserve(3 * u_.size());
  for (std::size_t node = 0; node < u_.size(); ++node) {
    const Vec3 seen = rest_[node] + u_[node];
    for (const double x : seen) frame.displacement.push_back(static_cast<float>(x));
  }
  sink_(std::move(picture));
}

RecordedSurface recorded_surface(const Body& body) {
  return {body.surface_in_mesh(), body.dimension(), {body.simplices().begin(), body.simplices().end()}};
}

}  // namespace palpate
