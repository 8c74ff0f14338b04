// Quadrature rules against the integrals of monomials.
#include <gtest/gtest.h>

#include <array>
#include <numeric>

#include "tests/support/bodies/meshes_elements.h"

namespace palpate::quadrature_test {
namespace {

using namespace test;

class Quadrature : public testing::TestWithParam<ElementType> {};
INSTANTIATE_TEST_SUITE_P(Kinds, Quadrature,
                         testing::Values(ElementType::line2, ElementType::tri3, ElementType::tri6,
                                         ElementType::quad4, ElementType::tet4, ElementType::tet10,
                                         ElementType::hex8),
                         name_of);

/// x^a y^b z^c.
double monomial(const Vec3& x, const std::array<int, 3>& power) {
  return std::pow(x[0], power[0]) * std::pow(x[1], power[1]) * std::pow(x[2], power[2]);
}

/// All powers of d coordinates, each up to `highest`.
std::vector<std::array<int, 3>> powers_up_to(int highest, int d) {
  std::vector<std::array<int, 3>> powers;
  for (int a = 0; a <= highest; ++a) {
    for (int b = 0; b <= (d > 1 ? highest : 0); ++b) {
      for (int c = 0; c <= (d > 2 ? highest : 0); ++c) powers.push_back({a, b, c});
    }
  }
  return powers;
}

double simplex_integral(const std::array<int, 3>& power, int d) {
  const auto factorial = [](int n) { return std::tgamma(n + 1.0); };
  return factorial(power[0]) * factorial(power[1]) * factorial(power[2]) /
         factorial(power[0] + power[1] + power[2] + d);
}

double cube_integral(const std::array<int, 3>& power, int d) {
  double integral = 1.0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(d); ++k) {
    integral *= power[k] % 2 == 0 ? 2.0 / (power[k] + 1.0) : 0.0;
  }
  return integral;
}

template <class Rule>
double integral(const Rule& rule, const std::array<int, 3>& power) {
  double sum = 0.0;
  for (const QuadraturePoint& q : rule) sum += q.weight * monomial(q.xi, power);
  return sum;
}

/// Checks a rule against the closed forms: simplices to this total degree, cubes to it in each coordinate.
template <class Rule>
void expect_exact(ElementType type, const Rule& rule, int degree) {
  const int d = traits(type).dimension;
  for (const std::array<int, 3>& power : powers_up_to(degree, d)) {
    if (is_simplex(type) && std::accumulate(power.begin(), power.end(), 0) > degree) continue;
    const double exact = is_simplex(type) ? simplex_integral(power, d) : cube_integral(power, d);
    EXPECT_NEAR(integral(rule, power), exact, 1e-14) << power[0] << ' ' << power[1] << ' ' << power[2];
  }
}

bool is_inside(ElementType type, const Vec3& xi) {
  const auto coordinates = xi.head(traits(type).dimension).array();
  if (is_simplex(type)) return (coordinates > 0.0).all() && coordinates.sum() < 1.0;
  return (coordinates.abs() < 1.0).all();
}

TEST_P(Quadrature, IsExactToItsDegreeAndNoFurther) {
  struct Expected {
    std::size_t points;
    int degree;
  };
  constexpr std::array<Expected, 7> expected = {{{2, 3}, {1, 1}, {3, 2}, {4, 3}, {1, 1}, {4, 2}, {8, 3}}};
  const auto [points, degree] = expected[static_cast<std::size_t>(GetParam())];
  const std::span<const QuadraturePoint> rule = quadrature(GetParam());
  EXPECT_EQ(rule.size(), points);
  expect_exact(GetParam(), rule, degree);
  const int d = traits(GetParam()).dimension;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(d); ++axis) {
    std::array<int, 3> next{};
    next[axis] = degree + 1;
    const double exact = is_simplex(GetParam()) ? simplex_integral(next, d) : cube_integral(next, d);
    EXPECT_GT(std::abs(integral(rule, next) - exact), 1e-4);
  }
  for (const QuadraturePoint& q : rule) {  // inside, and positive: so that K is positive semidefinite
    EXPECT_GT(q.weight, 0.0);
    EXPECT_TRUE(is_inside(GetParam(), q.xi)) << q.xi.transpose();
  }
}

TEST_P(Quadrature, OfTheTestsThemselvesIsExactToItsDegreeToo) {
  const int n = 4, d = traits(GetParam()).dimension;
  expect_exact(GetParam(), gauss_rule(GetParam(), n), is_simplex(GetParam()) ? 2 * n - d : 2 * n - 1);
}

}  // namespace
}  // namespace palpate::quadrature_test
