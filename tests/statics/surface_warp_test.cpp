// Surfaces that turn as their linear displacement says.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "base/error.h"
#include "statics/surface_change.h"
#include "tests/support/bodies/warp_cases.h"

namespace palpate::surface_warp_test {
namespace {

constexpr double quarter = 0.5 * std::numbers::pi;

/// A box whose surface is held at one node, the origin, or along an edge of it. Nothing is asked of its
/// Green's functions.
Body hinged(int dimension) {
  Model model = test::unit_model(dimension, 3, Scope::surface, Precision::double_precision);
  const auto all = static_cast<std::uint8_t>((1U << dimension) - 1U);
  std::vector<bool> on_surface(model.mesh.nodes.size(), false);
  for (const Index node : model.surface) on_surface[static_cast<std::size_t>(node)] = true;
  model.stored_nodes.clear();
  for (std::size_t node = 0; node < model.fixed.size(); ++node) {
    const bool held = model.mesh.nodes[node].norm() < 1e-9;
    model.fixed[node] = held ? all : std::uint8_t{0};
    if (!held && on_surface[node]) model.stored_nodes.push_back(static_cast<Index>(node));
  }
  model.greens = test::pack(test::random_definite(model.stored_dofs(), 3), Precision::double_precision);
  return Body(warped_model(std::move(model)), {}, 1, ContactModel::warped);
}

std::vector<double> random_numbers(std::size_t count, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-size, size);
  std::vector<double> numbers(count);
  for (double& number : numbers) number = entry(random);
  return numbers;
}

class SurfaceWarpOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Dimension, SurfaceWarpOf, testing::Values(2, 3));

// A small rotation of the whole body, made large: the body turns about what holds it, undistorted.
TEST_P(SurfaceWarpOf, RigidTurnsAreExact) {
  const Body body = hinged(GetParam());
  const SurfaceWarp warp(warp_surface(body));
  SurfaceWarp::Place place(warp);
  const Vec3 axis = GetParam() == 2 ? Vec3(0, 0, 1) : Vec3(Vec3(1, 2, -2) / 3.0);
  std::vector<double> u(static_cast<std::size_t>(body.greens().order()));
  std::vector<Mat3> R;
  for (const double angle : {0.1, 1.0, quarter, 3.0}) {
    for (Index k = 0; k < body.greens().nodes(); ++k)
      set_vector(u, GetParam(), k, angle * axis.cross(body.rest_position(k)));
    warp.warp(u, place);
    const Mat3 turn = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    for (std::size_t node = 0; node < place.x.size(); ++node)
      EXPECT_LT((place.x[node] - turn * body.surface_rest_positions()[node]).norm(), 1e-12);
    warp.rotations(place, R);
    for (const Mat3& at : R) EXPECT_LT((at - turn).norm(), 1e-12);
    std::vector<Vec3> moved = place.x;
    for (std::size_t node = 0; node < moved.size(); ++node)
      moved[node] -= body.surface_rest_positions()[node];
    const SurfaceChange change =
        surface_change(body.dimension(), body.simplices(), body.surface_rest_positions(), moved);
    EXPECT_NEAR(change.rotation, angle, 1e-7);
    EXPECT_LT(change.strain, 1e-12);
  }
}

TEST_P(SurfaceWarpOf, IsTheLinearDisplacementToFirstOrder) {
  const Body body = hinged(GetParam());
  const SurfaceWarp warp(warp_surface(body));
  SurfaceWarp::Place place(warp);
  const std::vector<double> u = random_numbers(static_cast<std::size_t>(body.greens().order()), 1.0, 5);
  const auto off = [&](double size) {
    std::vector<double> small = u, x(u.size());
    for (double& value : small) value *= size;
    warp.warp(small, place);
    warp.displacement(place, x);
    double largest = 0.0;
    for (std::size_t k = 0; k < x.size(); ++k) largest = std::max(largest, std::abs(x[k] - small[k]));
    return largest / size;
  };
  EXPECT_NEAR(off(1e-4) / off(1e-5), 10.0, 0.1);
}

// Forces do the same work on the linear body as on the warped one: J^T by differences of x.
TEST_P(SurfaceWarpOf, PullsForcesBackByTheWorkTheyDo) {
  const Body body = hinged(GetParam());
  const SurfaceWarp warp(warp_surface(body));
  SurfaceWarp::Place place(warp), other(warp);
  const auto n = static_cast<std::size_t>(body.greens().order());
  for (const double size : {0.0, 0.02, 0.3}) {
    const std::vector<double> u = random_numbers(n, size, 1), f = random_numbers(n, 1.0, 2);
    std::vector<double> g(n), plus(n), minus(n);
    warp.warp(u, place);
    warp.pull_back(place, f, g);
    for (std::size_t dof = 0; dof < n; dof += 5) {
      std::vector<double> near = u;
      const double h = 1e-6;
      near[dof] += h;
      warp.warp(near, other);
      warp.displacement(other, plus);
      near[dof] -= 2 * h;
      warp.warp(near, other);
      warp.displacement(other, minus);
      double work = 0.0;
      for (std::size_t k = 0; k < n; ++k) work += f[k] * (plus[k] - minus[k]) / (2 * h);
      EXPECT_NEAR(g[dof], work, 1e-7 * (1.0 + std::abs(work)));
    }
  }
}

// What goes forth and what goes back are of one J.
TEST_P(SurfaceWarpOf, PushesForwardByTheSameDerivative) {
  const Body body = hinged(GetParam());
  const SurfaceWarp warp(warp_surface(body));
  SurfaceWarp::Place place(warp);
  const auto n = static_cast<std::size_t>(body.greens().order());
  warp.warp(random_numbers(n, 0.3, 1), place);
  for (unsigned seed = 2; seed < 6; ++seed) {
    const std::vector<double> f = random_numbers(n, 1.0, seed), du = random_numbers(n, 1.0, seed + 10);
    std::vector<double> g(n), dx(n);
    warp.pull_back(place, f, g);
    warp.push_forward(place, du, dx);
    double back = 0.0, forth = 0.0, size = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      back += g[k] * du[k];
      forth += f[k] * dx[k];
      size += std::abs(f[k] * dx[k]);
    }
    EXPECT_NEAR(back, forth, 1e-12 * size);
  }
}

TEST_P(SurfaceWarpOf, TurnedBlocksAreTurned) {
  const int d = GetParam();
  for (const Precision precision :
       {Precision::double_precision, Precision::single_precision, Precision::split_precision}) {
    const Model model = test::unit_model(d, 3, Scope::full, precision);
    for (const std::int64_t most_bytes : {std::int64_t{-1}, std::int64_t{0}}) {
      const std::shared_ptr<const Greens> made =
          make_greens(model.greens, d, {.jobs = 1, .max_square_bytes = most_bytes});
      const Greens& greens = *made;
      std::vector<Mat3> R;
      for (Index k = 0; k < greens.nodes(); ++k) {
        const Vec3 axis = d == 2 ? Vec3(0, 0, 1) : Vec3(std::sin(k), std::cos(k), 0.3).normalized();
        R.push_back(Eigen::AngleAxisd(0.7 * k, axis).toRotationMatrix());
      }
      const Eigen::MatrixXd left = Eigen::MatrixXd::Random(greens.order(), d), right = 0.1 * left;
      const std::shared_ptr<const Greens> made_turned = palpate::turned(made, R, left, right);
      const Greens& turned = *made_turned;
      const auto rotation = [&](Index k) { return R[static_cast<std::size_t>(k)].topLeftCorner(d, d); };
      std::vector<Index> nodes;  // more than one part of a product
      for (Index k = 0; k < 300; ++k) nodes.push_back((7 * k) % greens.nodes());
      const std::vector<double> f = random_numbers(static_cast<std::size_t>(d) * nodes.size(), 1.0, 9);
      std::vector<double> u(static_cast<std::size_t>(greens.order()));
      turned.displacement(nodes, f, u);
      double largest = 0.0;
      for (const double value : u) largest = std::max(largest, std::abs(value));
      for (Index row = 0; row < greens.nodes(); ++row) {
        Eigen::VectorXd sum = Eigen::VectorXd::Zero(d);
        for (std::size_t k = 0; k < nodes.size(); ++k) {
          const Eigen::MatrixXd block =
              rotation(row) * greens.block(row, nodes[k]) * rotation(nodes[k]).transpose() +
              left.middleRows(d * row, d) * right.middleRows(d * nodes[k], d).transpose();
          if (row < 4 && k < 20) {
            EXPECT_LT((turned.block(row, nodes[k]) - block).norm(), 1e-14 * block.norm());
          }
          for (int i = 0; i < d; ++i) {
            for (int j = 0; j < d; ++j)
              sum[i] += block(i, j) * f[static_cast<std::size_t>(d) * k + static_cast<std::size_t>(j)];
          }
        }
        for (int i = 0; i < d; ++i)
          EXPECT_NEAR(u[static_cast<std::size_t>(d * row + i)], sum[i], 1e-12 * largest);
      }
    }
  }
}

// The same body of a file that keeps its interior too.
TEST_P(SurfaceWarpOf, LeavesTheInteriorOut) {
  for (const Precision precision : {Precision::double_precision, Precision::split_precision}) {
    Model full = test::unit_model(GetParam(), 3, Scope::full, precision);
    full.greens = full.greens.scaled(3.0);
    const PackedGreens all = full.greens;
    const std::vector<Index> stored = full.stored_nodes;
    const Model part = warped_model(std::move(full));
    ASSERT_LT(part.stored_nodes.size(), stored.size());
    std::vector<Index> place;
    for (const Index node : part.stored_nodes)
      place.push_back(static_cast<Index>(std::find(stored.begin(), stored.end(), node) - stored.begin()));
    const int d = GetParam();
    for (std::int64_t i = 0; i < part.stored_dofs(); ++i) {
      for (std::int64_t j = 0; j < part.stored_dofs(); ++j) {
        const auto dof = [&](std::int64_t k) {
          return std::int64_t{d} * place[static_cast<std::size_t>(k / d)] + k % d;
        };
        ASSERT_EQ(part.greens(i, j), all(dof(i), dof(j)));
      }
    }
  }
}

// A closed form: an end couple bends a cantilever to an arc, whose length stays.
TEST(Warping, ACoupleBendsABarToAnArc) {
  const Model model = test::bent_model(ElementType::quad4);
  const Body body(warped_model(model), {}, 1, ContactModel::warped);
  const test::BendingLaw law = test::warped(body);
  const test::EndFace face(model.mesh);
  std::vector<Vec3> x;
  double angle = 0.0;
  for (double couple = 0.0; angle < quarter; couple += 2e-4) {
    for (int round = 0; round < 30; ++round) {
      std::vector<Vec3> f = face.spread(Vec3::UnitX());
      const Vec3 across(std::cos(angle), std::sin(angle), 0.0);
      for (std::size_t k = 0; k < f.size(); ++k)
        f[k] = -couple / test::bent_height * (model.mesh.nodes[k].y() / test::bent_height - 0.5) * f[k].x() *
               across;
      x = law(f);
      angle = face.angle(x);
    }
  }
  const Vec3 arc(test::bent_length * (std::sin(angle) / angle - 1.0),
                 test::bent_length * (1.0 - std::cos(angle)) / angle, 0);
  EXPECT_LT((face.moved(x) - arc).norm(), 0.01 * arc.norm()) << angle;
}

// Stored figures of scripts/studies/warp: against a corotational body of the same mesh, pushed by a force
// that turns with the end. Small strain leaves 5 % in displacement at 7 degrees; warping stays within 2 % to
// a right angle, as what is left is that shear and strain are those of the body at rest.
TEST(Warping, StaysNearTheCorotationalBodyUpToARightAngle) {
  const Model model = test::bent_model(ElementType::quad4);
  const Body body(warped_model(model), {}, 1, ContactModel::warped);
  const double degree = std::numbers::pi / 180.0;
  const double force =
      1e-6 * 3.0 * degree /
      test::bend(model.mesh, test::small_strain(body), test::BendingLoad::follows, 1e-6, 1.0, 1).back().angle;
  const auto curve = [&](const test::BendingLaw& law, double most) {
    return test::bend(model.mesh, law, test::BendingLoad::follows, force, most * degree, 60);
  };
  const auto truth = curve(test::corotational(model), 93.0), warped = curve(test::warped(body), 100.0),
             linear = curve(test::small_strain(body), 100.0);
  const auto error = [&](const auto& of, double angle) {
    return test::bending_error(truth, of, angle * degree, 2);
  };
  for (const auto& [angle, of_force, of_displacement] :
       {std::array{30.0, 0.0016, 0.0016}, {60.0, 0.0067, 0.0059}, {90.0, 0.0176, 0.0118}}) {
    EXPECT_NEAR(error(warped, angle).force, of_force, 0.002) << angle;
    EXPECT_NEAR(error(warped, angle).displacement, of_displacement, 0.002) << angle;
  }
  EXPECT_NEAR(error(linear, 30.0).displacement, 0.215, 0.01);
  EXPECT_NEAR(error(linear, 30.0).force, 0.074, 0.01);
}

TEST(Warping, APartOfTheSurfaceThatNothingHoldsIsRefused) {
  Model model = test::unit_model(3, 3, Scope::surface, Precision::double_precision);
  for (std::uint8_t& fixed : model.fixed) fixed &= 6U;  // what is stored stays held elsewhere
  for (Index node = 0; node < std::ssize(model.mesh.nodes); ++node) {
    if (model.fixed[static_cast<std::size_t>(node)] != 0) model.stored_nodes.push_back(node);
  }
  model.greens = test::pack(test::random_definite(model.stored_dofs(), 3), Precision::double_precision);
  const Body body(warped_model(std::move(model)), {}, 1, ContactModel::warped);
  try {
    const SurfaceWarp warp(warp_surface(body));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("along x"), std::string::npos) << error.what();
  }
}

TEST(Warping, AStretchedSurfaceTellsItsStrain) {
  const Body body(test::unit_model(3, 2, Scope::surface, Precision::double_precision));
  const std::vector<Vec3> rest(body.surface_rest_positions().begin(), body.surface_rest_positions().end());
  std::vector<Vec3> u;
  for (const Vec3& x : rest) u.emplace_back(0.25 * x.x(), -0.1 * x.y(), 0.0);
  const SurfaceChange change = surface_change(body.dimension(), body.simplices(), rest, u);
  EXPECT_NEAR(change.strain, 0.25, 1e-12);
  EXPECT_NEAR(change.rotation, 0.0, 1e-7);
}

// The largest of many simplices is that of each by itself, however far the others have changed.
TEST(Warping, TheLargestChangeIsThatOfSomeSimplex) {
  for (const int dimension : {2, 3}) {
    const auto d = static_cast<std::size_t>(dimension);
    const std::vector<double> random = random_numbers(6 * 3 * 500, 1.0, 7);
    for (std::size_t round = 0; round + 6 * 3 * 10 <= random.size(); round += 6 * 3 * 10) {
      std::vector<Index> simplices;
      std::vector<Vec3> rest, u;
      SurfaceChange largest;
      for (std::size_t k = 0; k < 10; ++k) {
        const double* number = random.data() + round + 18 * k;
        const double size = 0.3 * std::abs(number[0]);
        for (std::size_t corner = 0; corner < d; ++corner, number += 6) {
          simplices.push_back(static_cast<Index>(rest.size()));
          rest.emplace_back(number[0], number[1], dimension == 3 ? number[2] : 0.0);
          u.emplace_back(size * number[3], size * number[4], dimension == 3 ? size * number[5] : 0.0);
        }
        const SurfaceChange alone =
            surface_change(dimension, std::span(simplices).subspan(d * k, d), rest, u);
        largest.rotation = std::max(largest.rotation, alone.rotation);
        largest.strain = std::max(largest.strain, alone.strain);
      }
      const SurfaceChange change = surface_change(dimension, simplices, rest, u);
      EXPECT_EQ(change.rotation, largest.rotation) << dimension;
      EXPECT_EQ(change.strain, largest.strain) << dimension;
    }
  }
}

}  // namespace
}  // namespace palpate::surface_warp_test
