#include "tests/bench/palpation_paths.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "base/error.h"
#include "runtime/core/tick/clearance.h"
#include "runtime/core/tick/step.h"

namespace palpate::test {
namespace {

/// Numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}
  std::uint64_t integer() { return bits_(); }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(bits_() >> 11U) * 0x1p-53;
  }

 private:
  std::mt19937_64 bits_;
};

/// Goes to where it is sent without a jump of its speed (critically damped).
class Smooth {
 public:
  Smooth(double value, double time) : value_(value), rate_(tick / time) {}
  double follow(double target) {
    speed_ += rate_ * (rate_ * (target - value_) - 2.0 * speed_);
    return value_ += speed_;
  }
  void stay_at(double value) {
    value_ = value;
    speed_ = 0.0;
  }

 private:
  double value_;
  double speed_ = 0.0;  // a tick
  double rate_;
};

/// A point on the surface that walks about.
struct Walker {
  RestSurface::Place place;
  Vec3 heading;  // unit, tangential

  Walker(const RestSurface::Place& start, Random& random) : place(start) {
    turn(random.between(-std::numbers::pi, std::numbers::pi), start.normal.unitOrthogonal());
  }

  void turn(double angle, const Vec3& from) {
    const Vec3 tangent = from - place.normal * place.normal.dot(from);
    const Vec3 along = tangent.norm() > 1e-6 ? tangent.normalized() : place.normal.unitOrthogonal();
    heading = Eigen::AngleAxisd(angle, place.normal) * along;
  }

  [[nodiscard]] Vec3 centre(double radius, double depth) const {
    return place.position + (radius - depth) * place.normal;
  }
};

/// The walker after the step that moves the tool's centre by `length`, or a little less.
Walker walk(const RestSurface& surface, const Walker& from, double radius, double depth, double length) {
  const Vec3 begin = from.centre(radius, depth);
  double step = length;
  Walker to = from;
  for (int attempt = 0; attempt < 6; ++attempt) {
    to.place = surface.nearest(from.place.position + step * from.heading);
    const double moved = (to.centre(radius, depth) - begin).norm();
    if (moved <= length * 1.01) break;
    step *= length / moved;
  }
  to.turn(0.0, from.heading);
  return to;
}

/// What the hand wants for a while.
struct Wish {
  double speed;
  double depth;
  bool grab;
  std::int64_t until;  // tick
};

Wish next_wish(const Palpation& palpation, Random& random, std::int64_t now, double depth) {
  const auto ticks = [&](double seconds) { return now + static_cast<std::int64_t>(seconds / tick); };
  if (palpation.steady) return {palpation.most_speed, palpation.most_depth, false, now + 1'000'000'000};
  const double chance = random.between(0.0, 1.0);
  if (chance < 0.2 && depth > 0.2 * palpation.most_depth) {
    return {random.between(0.0, 0.01), random.between(-palpation.most_depth, palpation.most_depth), true,
            ticks(random.between(0.3, 1.2))};
  }
  const double speed = random.between(0.0, palpation.most_speed);
  if (chance < 0.35) return {speed, -random.between(0.002, 0.01), false, ticks(random.between(0.2, 0.6))};
  return {speed, random.between(0.0, palpation.most_depth), false, ticks(random.between(0.3, 2.0))};
}

/// Turns the device at this speed [rad/s] about an axis that wanders. It draws random numbers of its own, so
/// that the way is the same with and without.
void turn_device(std::vector<ToolPose>& poses, double speed, std::uint64_t seed) {
  Random random(seed);
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Vec3 axis = Vec3::UnitZ();
  for (ToolPose& pose : poses) {
    const Vec3 push(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    axis = (axis + std::sqrt(tick / 0.5) * push).normalized();
    orientation = (Eigen::AngleAxisd(speed * tick, axis) * orientation).normalized();
    pose.orientation = orientation;
  }
}

/// The sphere's centre where it just touches the body on its way from `from` along `inward`, at most `most`
/// on.
std::optional<double> touch(const Body& body, State& rest, const Vec3& from, const Vec3& inward,
                            double most) {
  const auto clear = [&](double way) {
    return is_clear(body, rest.surface.tree, rest.scratch.detection, rest.tools.front().tool,
                    {.position = from + way * inward});
  };
  if (!clear(0.0)) return std::nullopt;
  const double stride = 0.5 * rest.tools.front().tool.radius;
  double low = 0.0;
  double high = stride;
  for (; clear(high); high += stride) {
    low = high;
    if (high > most) return std::nullopt;
  }
  for (int bisection = 0; bisection < 40; ++bisection) {
    const double middle = 0.5 * (low + high);
    (clear(middle) ? low : high) = middle;
  }
  return low;
}

std::optional<Track> lay_track(const Body& body, const RestSurface& surface, State& rest, double length,
                               Random& random) {
  constexpr double spacing = 5e-5;  // a tick at 50 mm/s
  constexpr double height = 0.03;   // above the surface, from where the sphere comes
  const RestSurface::Place middle = surface.free_node(random.integer());
  const Vec3 normal = surface.mean_normal(middle.position, 0.5 * length);
  const double radius = rest.tools.front().tool.radius;
  const Vec3 along = Eigen::AngleAxisd(random.between(-std::numbers::pi, std::numbers::pi), normal) *
                     normal.unitOrthogonal();
  Track track{.centres = {}, .inward = -normal, .spacing = spacing};
  double way_before = 0.0;
  double s = -0.5 * length;  // along the track, from its middle
  while (s <= 0.5 * length) {
    const double begin = track.centres.empty() ? 0.0 : std::max(0.0, way_before - radius);
    const Vec3 from = middle.position + s * along + (height - begin) * normal;
    const std::optional<double> way = touch(body, rest, from, track.inward, 2.0 * height);
    if (!way) return std::nullopt;
    if (!track.centres.empty() && std::abs(begin + *way - way_before) > spacing) return std::nullopt;
    way_before = begin + *way;
    track.centres.emplace_back(from + *way * track.inward);
    const RestSurface::Place under = surface.nearest(track.centres.back());
    if (!under.free) return std::nullopt;
    s += spacing;
  }
  return track;
}

}  // namespace

RestSurface::RestSurface(const Body& body)
    : body_(body),
      tree_(body.simplices(), body.dimension(), body.surface_rest_positions(),
            0.1 * body.mean_surface_edge()),
      normals_(body.surface_rest_positions().size(), Vec3::Zero()) {
  if (body.dimension() != 3) throw Error("the body is in the plane", body.model().name, "take one in space");
  const std::span<const Index> simplices = body.simplices();
  for (std::size_t f = 0; f < simplices.size(); f += 3) {
    const Vec3& a = body.surface_rest_positions()[static_cast<std::size_t>(simplices[f])];
    const Vec3& b = body.surface_rest_positions()[static_cast<std::size_t>(simplices[f + 1])];
    const Vec3& c = body.surface_rest_positions()[static_cast<std::size_t>(simplices[f + 2])];
    for (std::size_t k = 0; k < 3; ++k)
      normals_[static_cast<std::size_t>(simplices[f + k])] += (b - a).cross(c - a);
  }
  for (Vec3& normal : normals_) normal.normalize();
}

RestSurface::Place RestSurface::place(const NearestSimplex& found) const {
  Place place{.position = found.nearest.on_simplex, .normal = Vec3::Zero(), .free = true};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto node =
        static_cast<std::size_t>(body_.simplices()[3 * static_cast<std::size_t>(found.simplex) + k]);
    place.normal += found.nearest.weights[k] * normals_[node];
    const Index stored = body_.surface_stored_nodes()[node];
    place.free = place.free && stored >= 0 &&
                 body_.model().fixed[static_cast<std::size_t>(body_.mesh_node(stored))] == 0;
  }
  place.normal.normalize();
  return place;
}

RestSurface::Place RestSurface::nearest(const Vec3& point) const {
  return place(tree_.nearest(point));
}

RestSurface::Place RestSurface::free_node(std::uint64_t choice) const {
  const std::vector<Index>& nodes = body_.free_surface_nodes();
  return nearest(body_.rest_position(nodes[choice % nodes.size()]));
}

double RestSurface::distance(const Vec3& point) const {
  const double distance = std::sqrt(tree_.nearest(point).nearest.squared_distance);
  return tree_.inside(point) ? -distance : distance;
}

Vec3 RestSurface::mean_normal(const Vec3& point, double within) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t node = 0; node < normals_.size(); ++node) {
    if ((body_.surface_rest_positions()[node] - point).norm() <= within) sum += normals_[node];
  }
  return sum.normalized();
}

std::vector<ToolPose> palpation_poses(const Body& body, const Palpation& palpation, std::int64_t ticks) {
  constexpr double start_depth = -0.01;
  const RestSurface surface(body);
  Random random(palpation.seed);
  RestSurface::Place start = surface.free_node(random.integer());
  while (!start.free || surface.distance(start.position + (palpation.radius - start_depth) * start.normal) <
                            palpation.radius) {
    start = surface.free_node(random.integer());
  }
  Walker walker(start, random);
  Smooth depth(start_depth, 0.06);
  Smooth speed(0.0, 0.1);
  double turning = 0.0;  // [rad/s]
  double depth_now = start_depth;
  double felt_now = start_depth;
  Wish wish = next_wish(palpation, random, 0, depth_now);

  std::vector<ToolPose> poses;
  poses.reserve(static_cast<std::size_t>(ticks));
  for (std::int64_t now = 0; now < ticks; ++now) {
    if (now >= wish.until) wish = next_wish(palpation, random, now, depth_now);
    turning += tick / 0.3 * (random.between(-60.0, 60.0) - turning);
    Walker next = walker;
    next.turn(turning * tick, walker.heading);
    const double wanted = depth.follow(wish.depth);
    const double pressed = std::abs(wanted - depth_now);
    const double length = std::min(speed.follow(wish.speed), palpation.most_speed) * tick;
    next = walk(surface, next, palpation.radius, wanted,
                std::max(0.0, length - (palpation.steady ? 0.0 : pressed)));

    const Vec3 centre = next.centre(palpation.radius, wanted);
    const double felt = palpation.radius - surface.distance(centre);  // more where the surface is hollow
    const double hollow = 0.3 * std::min(palpation.radius, palpation.most_depth);
    const bool too_deep = felt > felt_now && felt > std::max(0.0, wanted) + hollow;
    if (next.place.free && !too_deep) {
      walker = next;
      depth_now = wanted;
      felt_now = felt;
    } else {
      walker.turn(random.between(-0.5, 0.5), -walker.heading);
      depth.stay_at(depth_now);
    }
    poses.push_back({.orientation = Eigen::Quaterniond::Identity(),
                     .position = walker.centre(palpation.radius, depth_now),
                     .grab = wish.grab});
  }
  if (palpation.turning > 0.0) turn_device(poses, palpation.turning, palpation.seed);
  return poses;
}

std::vector<Track> lay_tracks(const Body& body, double radius, double length, int count) {
  const RestSurface surface(body);
  State rest(body, {.tools = {Tool{.radius = radius}}});
  Random random(1);
  std::vector<Track> tracks;
  for (int attempt = 0; attempt < 50 * count && static_cast<int>(tracks.size()) < count; ++attempt) {
    if (std::optional<Track> track = lay_track(body, surface, rest, length, random))
      tracks.push_back(std::move(*track));
  }
  return tracks;
}

Slide slide_along(const Track& track, double depth, double speed) {
  constexpr std::size_t press_ticks = 1000;
  constexpr std::size_t wait_ticks = 100;
  constexpr double speed_up = 0.1;  // [s]
  constexpr double height = 0.001;  // above the surface, where it begins
  Slide slide;
  for (std::size_t k = 0; k < press_ticks + wait_ticks; ++k) {
    const double share = std::min(1.0, static_cast<double>(k) / press_ticks);
    const double smooth = share * share * (3.0 - 2.0 * share);
    slide.poses.push_back(
        {.position = track.centres.front() + (smooth * (depth + height) - height) * track.inward});
  }
  slide.first_slide = slide.poses.size();
  double at = 0.0;
  for (double time = tick;; time += tick) {
    const auto passed = static_cast<std::size_t>(at);
    at += tick * speed * std::min(1.0, time / speed_up) /
          (track.centres[passed + 1] - track.centres[passed]).norm();
    const auto before = static_cast<std::size_t>(at);
    if (before + 1 >= track.centres.size()) return slide;
    const double share = at - static_cast<double>(before);
    const Vec3 centre = (1.0 - share) * track.centres[before] + share * track.centres[before + 1];
    slide.poses.push_back({.position = centre + depth * track.inward});
  }
}

}  // namespace palpate::test
