#include "runtime/background/surface_frames.h"

#include <pthread.h>

#include <chrono>

#include "base/vectors.h"
#include "runtime/background/element_stress.h"
#include "runtime/core/body/surface_load.h"
#include "runtime/core/body/two_level_greens.h"
#include "runtime/core/touch/contact_nodes.h"

namespace palpate {
namespace {

constexpr auto frame_pause = std::chrono::milliseconds(1);

/// True for a body in the plane all of whose movable nodes are stored.
bool knows_interior(const Body& body) {
  if (body.dimension() != 2) return false;
  const std::vector<std::uint8_t>& fixed = body.model().fixed;
  for (std::size_t node = 0; node < fixed.size(); ++node) {
    if ((fixed[node] & 3U) != 3U && body.stored_node(static_cast<Index>(node)) < 0) return false;
  }
  return true;
}

void append(const Vec3& vector, std::vector<float>& numbers) {
  for (const double x : vector) numbers.push_back(static_cast<float>(x));
}

/// A refined node is held along the axes along which all nodes of the body that it follows are held.
std::uint8_t held_axes(const Body& body, std::size_t node) {
  const FineSurface& fine = body.fine_surface();
  unsigned held = (1U << body.dimension()) - 1U;
  for (auto k = static_cast<std::size_t>(fine.first[node]);
       k < static_cast<std::size_t>(fine.first[node + 1]); ++k)
    held &= body.model().fixed[fine.parents[k]];
  return static_cast<std::uint8_t>(held);
}

}  // namespace

SurfaceFrames::SurfaceFrames(const Body& body, const State& state, const SurfaceFramesOptions& options,
                             Sink sink)
    : body_(body),
      options_(options),
      sink_(std::move(sink)),
      moments_(Moment{
          .load = state.surface.near.load(),
          .motion = MotionSnapshot(body),
          .touches = std::vector<SeenContact>(state.contact_points.size()),
          .presses = std::vector<NodalPress>(3 * state.contact_points.size() +
                                             static_cast<std::size_t>(state.surface.near.capacity())),
          .forces = std::vector<NodalForce>(2 * static_cast<std::size_t>(state.surface.near.capacity()))}) {
  if (!options_.contacts_only)
    maker_.emplace(body);
  else if (body.coarse() != nullptr)
    field_at_rest_ = two_levels(body.shared_greens(), at_rest(body.coarse()));
  if (maker_ && knows_interior(body)) {
    const std::size_t nodes = body.model().mesh.nodes.size();
    interior_ = {element_stress(body.model()), std::vector<Vec3>(nodes), std::vector<Stress>(nodes),
                 std::vector<Mat3>(parts_turn(body) ? nodes : 0)};
  }
  if (options_.in_background) worker_ = std::thread([this] { work(); });
}

SurfaceFrames::~SurfaceFrames() {
  stop_ = true;
  if (worker_.joinable()) worker_.join();
}

void SurfaceFrames::post(const State& state, std::int64_t tick, double time) noexcept {
  if (tick % options_.ticks_per_frame != 0) return;
  Moment& next = moments_.next();
  next.load = state.surface.near.load();
  state.surface.motion.snapshot(next.motion);
  take_contacts(state, next);
  const ToolState& tool = state.tools.front();
  next.seen = {.device = tool.device,
               .tool = tool.pose,
               .on_body = {Vec3::Zero() - tool.wrench.force, Vec3::Zero() - tool.wrench.torque},
               .status = state.status,
               .force_error = tool.force_error,
               .left_out = tool.left_out,
               .greens_error = tool.greens_error};
  next.tick = tick;
  next.time = time;
  if (options_.in_background) {
    moments_.publish();
  } else {
    compute(next);
  }
}

void SurfaceFrames::take_contacts(const State& state, Moment& moment) const noexcept {
  moment.touch_count = 0;
  moment.press_count = 0;
  for (const ContactPoint& contact : state.contacts()) {
    if (contact.force.isZero(0.0)) continue;
    const SeenContact seen = seen_contact(body_, state, contact);
    const double normal = -seen.force.dot(seen.normal);
    moment.touches[moment.touch_count++] = seen;
    for_each_node(body_, state.surface.near, contact, [&](Index node, double weight) {
      moment.presses[moment.press_count++] = {node, weight * normal};
    });
  }
  moment.force_count = 0;
  for (Index place = 0; place < state.surface.near.count(); ++place) {
    const Vec3 force = state.surface.near.force(place);
    if (force.isZero(0.0)) continue;
    const Index node = state.surface.near.node(place);
    const auto add = [&](Index loaded, const Vec3& f) { moment.forces[moment.force_count++] = {loaded, f}; };
    if (!state.surface.near.is_group(place)) {
      add(node, force);
      continue;
    }
    state.surface.near.for_each_member(
        place, [&](Index member, double, const Eigen::Matrix3d& map) { add(member, map * force); });
  }
}

void SurfaceFrames::work() {
  pthread_setname_np(pthread_self(), "pictures");
  for (;;) {
    const bool last = stop_;  // read before the moment: nothing is posted after stopping
    const Moment& moment = moments_.read();
    if (moment.tick != computed_) {
      compute(moment);
    } else if (last) {
      return;
    } else {
      std::this_thread::sleep_for(frame_pause);
    }
  }
}

void SurfaceFrames::compute(const Moment& moment) {
  computed_ = moment.tick;
  const std::span<const NodalForce> forces(moment.forces.data(), moment.force_count);
  const std::span<const NodalPress> presses(moment.presses.data(), moment.press_count);
  SurfacePicture picture;
  if (!maker_) {
    picture.loads = contact_loads(forces, presses);
    picture.loads.tick = moment.tick;
    picture.loads.time = moment.time;
    if (field_at_rest_ != nullptr) picture.loads.field = coarse_field(moment);
    return sink_(std::move(picture));
  }
  static_cast<SeenTool&>(picture) = moment.seen;
  picture.patch = moment.load.patch != nullptr ? moment.load.patch : maker_->fine_part(moment.load);
  picture.frame.tick = moment.tick;
  picture.frame.time = moment.time;
  maker_->show(moment.load, &moment.motion, forces, presses, picture.frame);
  for (std::size_t k = 0; k < moment.touch_count; ++k) picture.contacts.push_back(moment.touches[k]);
  if (interior_) show_interior(picture);
  sink_(std::move(picture));
}

/// The motion's, and what the forces of the tick add to it.
std::vector<float> SurfaceFrames::coarse_field(const Moment& moment) const {
  const auto n = static_cast<std::size_t>(body_.greens().order());
  std::vector<double> q(moment.motion.u.size() - n);
  const Greens& W = moment.load.compliance != nullptr ? *moment.load.compliance : *field_at_rest_;
  W.coarse_displacement(moment.load.nodes(), moment.load.forces(), q);
  std::vector<float> field;
  for (std::size_t k = 0; k < q.size(); ++k)
    field.push_back(static_cast<float>(q[k] + moment.motion.u[n + k]));
  return field;
}

void SurfaceFrames::show_interior(SurfacePicture& picture) {
  Interior& interior = *interior_;
  for (std::size_t node = 0; node < interior.u.size(); ++node) {
    interior.u[node] = body_.model().rest_displacement[node];
    const Index stored = body_.stored_node(static_cast<Index>(node));
    if (stored >= 0) interior.u[node] += vector_at(maker_->stored_displacement(), body_.dimension(), stored);
    append(interior.u[node], picture.plane_displacement);
  }
  if (interior.turn.empty()) {
    interior.rows.apply(interior.u, interior.stress);
  } else {
    interior.rows.apply_turned(body_.model().mesh.nodes, true, interior.u, interior.turn, interior.stress);
  }
  for (const Stress& stress : interior.stress)
    picture.plane_von_mises.push_back(static_cast<float>(von_mises(stress)));
}

RecordedSurface recorded_surface(const Body& body) {
  RecordedSurface surface{body.surface_in_mesh(), body.dimension(), body.drawn_simplices()};
  if (body.local() != nullptr) {
    const auto own = surface.nodes.begin() + std::ssize(body.surface_stored_nodes());
    surface.finer.assign(own, surface.nodes.end());
    surface.nodes.erase(own, surface.nodes.end());
  }
  for (std::size_t node = 0; node < surface.nodes.size(); ++node)
    surface.held.push_back(held_axes(body, node));
  return surface;
}

}  // namespace palpate
