// The core by itself, on a body that no mesh or file has told of: a cube whose nodes give way as a covariance
// that is positive definite says. No test framework, so that Eigen is all that it takes.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <new>
#include <vector>

#include "runtime/core/tick/step.h"

namespace {

long allocations = 0;

}  // namespace

void* operator new(std::size_t bytes) {
  ++allocations;
  if (void* memory = std::malloc(bytes)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

namespace palpate {
namespace {

constexpr int cells = 8;           // along each edge of the cube
constexpr double size = 0.1;       // of the cube [m]
constexpr double softness = 1e-3;  // Xi of a node by itself [m/N]
constexpr double width = 0.03;     // over which neighbours go along [m]

int failures = 0;

void expect(bool holds, const char* what, double seen) {
  if (holds) return;
  ++failures;
  std::printf("FAILED: %s (%.17g)\n", what, seen);
}

/// Displacement along an axis of one place by a unit force along it on another [m/N]; other axes do not move.
double influence(const Vec3& a, const Vec3& b) {
  return softness * std::exp(-(a - b).norm() / width);
}

/// The cube's surface, held at the bottom.
struct Cube {
  std::vector<Vec3> nodes;       // on the surface
  std::vector<Index> simplices;  // outward
  std::vector<Index> stored;     // of each node, -1 at the bottom
  std::vector<Index> free;       // node of each stored one

  Cube() {
    std::map<std::array<int, 3>, Index> number;
    const auto node = [&](const std::array<int, 3>& k) {
      const auto [found, is_new] = number.try_emplace(k, static_cast<Index>(nodes.size()));
      if (is_new) {
        nodes.emplace_back(size / cells * Vec3(k[0], k[1], k[2]));
        stored.push_back(k[2] > 0 ? static_cast<Index>(free.size()) : -1);
        if (k[2] > 0) free.push_back(found->second);
      }
      return found->second;
    };
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool far : {false, true}) {
        for (int i = 0; i < cells; ++i) {
          for (int j = 0; j < cells; ++j) {
            const auto corner = [&](int a, int b) {
              std::array<int, 3> k{};
              k[static_cast<std::size_t>(axis)] = far ? cells : 0;
              k[static_cast<std::size_t>((axis + 1) % 3)] = i + a;
              k[static_cast<std::size_t>((axis + 2) % 3)] = j + b;
              return node(k);
            };
            const std::array<Index, 4> c = {corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)};
            for (const std::array<int, 3>& t : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
              for (int k = 0; k < 3; ++k)
                simplices.push_back(
                    c[static_cast<std::size_t>(t[static_cast<std::size_t>(far ? k : 2 - k)])]);
            }
          }
        }
      }
    }
  }
};

ElasticBody make_body(const Cube& cube) {
  const auto order = static_cast<std::int64_t>(3 * cube.free.size());
  const auto entries = std::make_shared<std::vector<double>>(static_cast<std::size_t>(packed_size(order)));
  for (std::int64_t j = 0; j < order; ++j) {
    for (std::int64_t i = j; i < order; ++i) {
      if (i % 3 != j % 3) continue;
      const auto place = [&](std::int64_t dof) {
        return cube.nodes[static_cast<std::size_t>(cube.free[static_cast<std::size_t>(dof / 3)])];
      };
      (*entries)[static_cast<std::size_t>(packed_index(i, j, order))] = influence(place(i), place(j));
    }
  }
  BodyParts parts{
      .name = "cube",
      .greens = make_greens(PackedGreens({entries, entries->data()}, order, Precision::double_precision), 3)};
  parts.simplices = cube.simplices;
  parts.friction.assign(cube.simplices.size() / 3, 0.3);
  parts.rest = cube.nodes;
  parts.surface_stored = cube.stored;
  for (const Index stored : cube.stored) {
    if (stored >= 0) {
      parts.free.push_back(stored);
      parts.part_stored.push_back(stored);
      parts.part_weight.push_back(1.0);
    }
    parts.first_part.push_back(static_cast<Index>(parts.part_stored.size()));
  }
  return ElasticBody(std::move(parts));
}

/// From above the cube down to `depth` below its top at x, y; then one tick after the other there.
ToolPose lower(const ElasticBody& body, State& state, double x, double y, double depth) {
  const double radius = state.tools[0].tool.radius;
  ToolPose pose;
  for (int tick = 0; tick <= 300; ++tick) {
    const double height = tick < 200 ? 0.01 * (1.0 - tick / 200.0) : 0.0;
    pose.position =
        Vec3(x, y, size + radius + height - (tick < 200 ? 0.0 : depth * std::min(1.0, (tick - 199) / 50.0)));
    step(body, state, pose);
  }
  return pose;
}

/// A pin on a node: F = depth / Xi.
void press_a_node(const ElasticBody& body) {
  State state(body, {.tools = {Tool{.friction = 0.0}}});
  lower(body, state, 0.5 * size, 0.5 * size, 0.002);
  const double force = state.tools[0].contact_wrench.force.z();
  expect(std::abs(force - 0.002 / softness) < 1e-4 * force, "force of a pin on a node [N]", force);
}

/// Signorini's and Coulomb's conditions at every contact of a ball, by this body's own influence.
void press_a_ball(const ElasticBody& body, const Cube& cube, double friction) {
  const double radius = 0.03;
  State state(body, {.tools = {Tool{.radius = radius, .friction = friction}}});
  ToolPose pose = lower(body, state, 0.47 * size, 0.52 * size, 0.006);
  const long before = allocations;
  for (int tick = 0; tick < 200; ++tick) {
    pose.position.x() += 2e-5;
    step(body, state, pose);
  }
  expect(allocations == before, "no tick takes memory", static_cast<double>(allocations - before));

  std::vector<Vec3> u(cube.nodes.size(), Vec3::Zero()), f(cube.nodes.size(), Vec3::Zero());
  Vec3 sum = Vec3::Zero();
  std::size_t pressed = 0;
  const NearField& near = state.surface.near;
  for (Index place = 0; place < near.count(); ++place) {
    f[static_cast<std::size_t>(near.node(place))] = near.force(place);
    sum += near.force(place);
    pressed += near.force(place).norm() > 1e-6 ? 1 : 0;
  }
  expect(pressed >= 4, "the ball rests on several nodes", static_cast<double>(pressed));
  expect((sum + state.tools[0].contact_wrench.force).norm() < 1e-9 * sum.norm(), "action is reaction",
         (sum + state.tools[0].contact_wrench.force).norm());
  for (std::size_t i = 0; i < u.size(); ++i) {
    for (std::size_t j = 0; j < u.size(); ++j) {
      if (cube.stored[i] >= 0 && cube.stored[j] >= 0) u[i] += influence(cube.nodes[i], cube.nodes[j]) * f[j];
    }
  }
  double deepest = 0.0;
  for (std::size_t i = 0; i < u.size(); ++i)
    deepest = std::max(deepest, radius - (cube.nodes[i] + u[i] - pose.position).norm());
  expect(deepest < 2e-5, "no node is inside the ball [m]", deepest);
  for (const ContactPoint& point : state.contacts()) {
    const Vec3 n = point.frame.col(0);
    const double normal = point.force.dot(n);
    const double tangential = (point.force - normal * n).norm();
    expect(normal >= -1e-9, "contacts push", normal);
    expect(friction == 0.0 || tangential <= (friction + 1e-6) * normal + 1e-9, "friction is within its cone",
           tangential);
  }
  // Without friction each force goes through the ball's centre, whose normal turns with it within the tick.
  const double torque = state.tools[0].contact_wrench.torque.norm();
  expect(friction > 0.0 || torque < 1e-9 * radius * sum.norm(), "a ball without friction is not turned",
         torque);
  expect(friction == 0.0 || std::abs(sum.x()) > 0.1 * friction * std::abs(sum.z()),
         "a ball that slides is held back", sum.x());
}

/// A grab of a node follows the hand: the pull is what the node's own stiffness says.
void pull_a_node(const ElasticBody& body) {
  State state(body, {.tools = {Tool{.reach = 0.001}}});
  ToolPose pose;
  pose.position = Vec3(0.5 * size, 0.5 * size, size + 0.0005);
  step(body, state, pose);
  pose.grab = true;
  step(body, state, pose);
  for (int tick = 0; tick < 200; ++tick) {
    pose.position.z() += 1e-5;
    step(body, state, pose);
  }
  const double force = -state.tools[0].contact_wrench.force.z();
  expect(std::abs(force - 0.002 / softness) < 1e-3 * force, "force of a pulled node [N]", force);
}

}  // namespace
}  // namespace palpate

int main() {
  const palpate::Cube cube;
  const palpate::ElasticBody body = palpate::make_body(cube);
  palpate::press_a_node(body);
  palpate::press_a_ball(body, cube, 0.0);
  palpate::press_a_ball(body, cube, 0.3);
  palpate::pull_a_node(body);
  std::printf(palpate::failures == 0 ? "the core holds\n" : "%d expectations failed\n", palpate::failures);
  return palpate::failures == 0 ? 0 : 1;
}
