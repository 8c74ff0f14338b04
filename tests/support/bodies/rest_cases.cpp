#include "tests/support/bodies/rest_cases.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace palpate::test {
namespace {

constexpr int press_ticks = 200;
constexpr int wait_ticks = 20;
constexpr int move_ticks = 140;

/// Numbers that are the same with every standard library.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : bits_(seed) {}
  std::uint64_t integer() { return bits_(); }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(bits_() >> 11U) * 0x1p-53;
  }
  Vec3 direction() {
    const double z = between(-1.0, 1.0);
    const double angle = between(-std::numbers::pi, std::numbers::pi);
    const double r = std::sqrt(1.0 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

 private:
  std::mt19937_64 bits_;
};

/// A place of the surface over which the sphere is free.
RestSurface::Place choose_place(const Body& body, const RestSurface& surface, double radius, Chance& chance) {
  for (;;) {
    const Vec3 node = surface.free_node(chance.integer()).position;
    const double away = body.mean_surface_edge() * chance.between(0.0, 1.0);
    const RestSurface::Place place = surface.nearest(node + away * chance.direction());
    if (surface.distance(place.position + 1.3 * radius * place.normal) >= 1.1 * radius) return place;
  }
}

}  // namespace

RestCase rest_case(const Body& body, const RestSurface& surface, std::uint64_t number, bool grab) {
  Chance chance(2 * number + (grab ? 1 : 0));
  const double R = body.mean_surface_edge() * chance.between(0.5, 3.0);
  RestCase made;
  made.tool.radius = R;
  made.tool.hand_over = std::numeric_limits<double>::infinity();
  made.tool.friction = std::array<double, 3>{0.0, 0.2, 0.5}[chance.integer() % 3];
  const RestSurface::Place place = choose_place(body, surface, R, chance);
  const double depth = R * chance.between(0.05, 0.4);
  const Vec3 start = place.position + 1.3 * R * place.normal;
  const Vec3 pressed = place.position + (R - depth) * place.normal;
  const double way = R * chance.between(0.0, 1.0);
  const Vec3 moved = pressed + way * chance.direction();
  const double angle = chance.between(0.0, 0.3);
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(angle, chance.direction()));
  const bool moves = chance.integer() % 3 != 0;
  const bool turns = chance.integer() % 3 != 0;

  const auto add = [&](const Vec3& position, bool holds) {
    made.poses.push_back({.position = position, .grab = holds});
  };
  for (int k = 0; k <= press_ticks; ++k) add(start + (pressed - start) * k / press_ticks, false);
  for (int k = 0; k < wait_ticks; ++k) add(pressed, grab);
  for (int k = 1; k <= move_ticks; ++k) {
    const double share = static_cast<double>(k) / move_ticks;
    add(moves ? Vec3(pressed + share * (moved - pressed)) : pressed, grab);
    if (turns) made.poses.back().orientation = Eigen::Quaterniond::Identity().slerp(share, turned);
  }
  made.poses.insert(made.poses.end(), ticks_of_rest, ToolPose(made.poses.back()));
  return made;
}

}  // namespace palpate::test
