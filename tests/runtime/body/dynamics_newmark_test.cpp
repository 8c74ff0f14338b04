// The runtime's Newmark steps, packed and modal, against a sparse solve in every step and each other.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "base/error.h"
#include "runtime/body/packed_newmark.h"
#include "runtime/core/body/greens.h"
#include "runtime/core/body/modal_newmark.h"
#include "tests/support/bodies/dynamics_sample.h"

namespace palpate::dynamics_newmark_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::span<double> span(VectorXd& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}
std::span<const double> span(const VectorXd& v) {
  return {v.data(), static_cast<std::size_t>(v.size())};
}
VectorXd vector(std::span<const double> v) {
  return Eigen::Map<const VectorXd>(v.data(), std::ssize(v));
}

MatrixXd unpack(const PackedGreens& packed) {
  MatrixXd A(packed.order(), packed.order());
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    for (Eigen::Index i = 0; i < A.rows(); ++i) A(i, j) = packed(i, j);
  }
  return A;
}

struct ProductCase {
  Eigen::Index order;
  int jobs;
  Precision precision;
};

class Product : public testing::TestWithParam<ProductCase> {};

TEST_P(Product, IsTheDenseOne) {
  const auto [order, jobs, precision] = GetParam();
  const PackedGreens packed = test::pack(test::random_definite(order, 3), precision);
  const VectorXd x = VectorXd::Random(order);
  VectorXd y = VectorXd::Constant(order, NAN);
  PackedProduct product(packed, jobs);
  const VectorXd expected = unpack(packed) * x;
  for (int repeat = 0; repeat < 3; ++repeat) {
    product.multiply(span(x), span(y));
    EXPECT_LT((y - expected).norm(), 1e-14 * static_cast<double>(order) * expected.norm());
  }
}

std::vector<ProductCase> product_cases() {
  std::vector<ProductCase> cases;
  for (const Eigen::Index order : {1, 2, 7, 8, 9, 64, 201, 1500}) {
    for (const int jobs : {1, 2, 5}) {
      for (const Precision precision :
           {Precision::single_precision, Precision::split_precision, Precision::double_precision})
        cases.push_back({order, jobs, precision});
    }
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Sizes, Product, testing::ValuesIn(product_cases()), [](const auto& tested) {
  const ProductCase& c = tested.param;
  return "Order" + std::to_string(c.order) + "Jobs" + std::to_string(c.jobs) + name_of(c.precision);
});

/// A body let go in the displacement by a few forces, and at that by others as velocity.
struct LetGoBody {
  explicit LetGoBody(const Model& model)
      : Xi(unpack(model.greens)), f(VectorXd::Zero(Xi.rows())), u(f), v(f) {
    for (Eigen::Index k = 0; k < 6; ++k) f[(7 * k) % f.size()] = std::sin(1.0 + static_cast<double>(k));
    VectorXd rate = VectorXd::Zero(f.size());
    rate[5] = 40.0;
    rate[8] = -25.0;
    u = Xi * f;
    v = Xi * rate;
    g_rate = rate;
  }
  MatrixXd Xi;
  VectorXd f, u, v, g_rate;
};

/// The usual parameters, of which some coefficients are zero or equal, and others.
constexpr Newmark usual{}, damping{.alpha = 0.3025, .delta = 0.6};

class NewmarkSteps : public testing::TestWithParam<ElementType> {};

TEST_P(NewmarkSteps, PackedIsTheSparseSolveOverAThousandSteps) {
  for (const bool lumped : {false, true}) {
    DynamicsOptions options = test::packed();
    options.lumped = lumped;
    options.newmark = lumped ? damping : usual;
    const Model model = test::swinging_model(GetParam(), options);
    const LetGoBody body(model);
    const test::SparseRoute sparse(model);
    test::NewmarkIntegrator reference = sparse.start(body.u, body.v);
    PackedNewmark newmark(model.dynamics, 2);
    newmark.let_go(span(body.f), span(body.u), span(body.v));
    EXPECT_LT((vector(newmark.acceleration()) - sparse.to_stored(reference.a())).norm(),
              1e-9 * reference.a().norm());
    double largest = 0.0;
    for (int step = 0; step < 1000; ++step) {
      newmark.predict();
      newmark.advance();
      reference.step();
      largest = std::max(largest, (vector(newmark.u()) - sparse.to_stored(reference.u())).norm());
    }
    EXPECT_LT(largest, 1e-9 * body.u.norm()) << (lumped ? "lumped" : "consistent");
  }
}

TEST_P(NewmarkSteps, PackedUnderForcesIsTheSparseSolve) {
  const Model model = test::swinging_model(GetParam(), test::packed());
  const test::SparseRoute sparse(model);
  const auto force = [&](double time) {
    VectorXd f = VectorXd::Zero(model.stored_dofs());
    f[4] = std::sin(60.0 * time);
    f[9] = time;
    return f;
  };
  test::Equation equation = sparse.equation;
  equation.f = [&](double time) { return sparse.from_stored(force(time)); };
  const VectorXd zero = VectorXd::Zero(equation.K.rows());
  test::NewmarkIntegrator reference(equation, sparse.newmark, zero, zero);
  PackedNewmark newmark(model.dynamics, 1);
  const MatrixXd inverse = unpack(model.dynamics.inverse);
  double size = 0.0;
  for (int step = 1; step <= 200; ++step) {
    const VectorXd added = inverse * force(step * sparse.newmark.time_step);
    newmark.predict();
    newmark.advance(span(added), {});
    reference.step();
    size = std::max(size, reference.u().norm());
    ASSERT_LT((vector(newmark.u()) - sparse.to_stored(reference.u())).norm(), 1e-10 * size + 1e-300);
  }
}

/// Modal steps of the same release.
struct ModalRun {
  ModalRun(const Model& model, const LetGoBody& body)
      : modes(model.dimension(), model.dynamics.omega, model.dynamics.shapes),
        newmark(modes.omega(), model.dynamics.damping, model.dynamics.newmark) {
    std::vector<Index> nodes;
    for (Index node = 0; node < static_cast<Index>(model.stored_nodes.size()); ++node) nodes.push_back(node);
    std::vector<double> g(static_cast<std::size_t>(modes.count())), rate(g.size());
    modes.add_projection(nodes, span(body.f), 1.0, g);
    modes.add_projection(nodes, span(body.g_rate), 1.0, rate);
    newmark.let_go(g, rate);
  }
  VectorXd u() const {
    VectorXd all(modes.dimension() * nodes());
    for (Index node = 0; node < nodes(); ++node)
      all.segment(modes.dimension() * node, modes.dimension()) =
          modes.displacement(node, newmark.q()).head(modes.dimension());
    return all;
  }
  Index nodes() const { return count; }
  void step() {
    newmark.predict();
    newmark.advance();
  }
  Modes modes;
  ModalNewmark newmark;
  Index count = 0;
};

TEST_P(NewmarkSteps, ModalWithAllModesIsThePackedOne) {
  for (const Newmark& newmark : {usual, damping}) {
    DynamicsOptions of_packed = test::packed(), of_modal = test::all_modes();
    of_packed.newmark = of_modal.newmark = newmark;
    const Model model = test::swinging_model(GetParam(), of_packed);
    const LetGoBody body(model);
    PackedNewmark packed(model.dynamics, 1);
    packed.let_go(span(body.f), span(body.u), span(body.v));
    const Model modal_model = test::swinging_model(GetParam(), of_modal);
    ASSERT_EQ(modal_model.dynamics.modes(), static_cast<Index>(model.stored_dofs()));
    EXPECT_TRUE(std::isinf(modal_model.dynamics.omega.back()));
    ModalRun modal(modal_model, body);
    modal.count = static_cast<Index>(model.stored_nodes.size());
    for (int step = 0; step < 1000; ++step) {
      packed.predict();
      packed.advance();
      modal.step();
      if (step % 50 == 0) {
        ASSERT_LT((modal.u() - vector(packed.u())).norm(), 1e-9 * body.u.norm()) << "step " << step;
      }
    }
  }
}

TEST_P(NewmarkSteps, ErrorFallsWithTheNumberOfModes) {
  const Model model = test::swinging_model(GetParam(), test::packed());
  const LetGoBody body(model);
  std::vector<double> errors;
  for (const Index count : {2, 8, 24}) {
    DynamicsOptions options = test::all_modes();
    options.modes = count;
    const Model few = test::swinging_model(GetParam(), options);
    ModalRun modal(few, body);
    modal.count = static_cast<Index>(model.stored_nodes.size());
    PackedNewmark packed(model.dynamics, 1);
    packed.let_go(span(body.f), span(body.u), span(body.v));
    double error = 0.0;
    for (int step = 0; step < 300; ++step) {
      packed.predict();
      packed.advance();
      modal.step();
      error = std::max(error, (modal.u() - vector(packed.u())).norm() / body.u.norm());
    }
    errors.push_back(error);
  }
  EXPECT_LT(errors[1], 0.8 * errors[0]);
  EXPECT_LT(errors[2], 0.8 * errors[1]);
}

// Without damping the discrete energy of a mode, (v^2 + omega^2 q^2) / 2, stays.
TEST(ModalNewmark, KeepsTheEnergy) {
  const std::vector<double> omega = {3.0, 50.0, 4000.0}, g = {1.0, -300.0, 1e7}, rate = {2.0, 1e4, -1e9};
  ModalNewmark newmark(omega, {}, {});
  newmark.let_go(g, rate);
  const auto energy = [&](std::size_t i) {
    return 0.5 * (std::pow(newmark.velocity()[i], 2) + std::pow(omega[i] * newmark.q()[i], 2));
  };
  const std::vector<double> before = {energy(0), energy(1), energy(2)};
  for (int step = 0; step < 10000; ++step) {
    newmark.predict();
    newmark.advance();
  }
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(energy(i), before[i], 1e-10 * before[i]);
}

// A motion that has died is exactly zero: no numbers that processors are slow with.
TEST(ModalNewmark, ComesToRest) {
  const std::vector<double> omega = {200.0}, g = {1.0}, rate = {0.0};
  ModalNewmark newmark(omega, {.mass = 100.0}, {});
  newmark.let_go(g, rate);
  for (int step = 0; step < 5000; ++step) {
    newmark.predict();
    newmark.advance();
  }
  EXPECT_EQ(newmark.q()[0], 0.0);
  EXPECT_EQ(newmark.velocity()[0], 0.0);
}

INSTANTIATE_TEST_SUITE_P(Elements, NewmarkSteps,
                         testing::Values(ElementType::tri3, ElementType::quad4, ElementType::tet4,
                                         ElementType::hex8),
                         [](const auto& tested) { return std::string(traits(tested.param).name); });

TEST(PackedNewmark, NeedsPackedDynamics) {
  EXPECT_THROW(PackedNewmark(StoredDynamics{}, 1), Error);
}

// K_bar^-1 of all modes is that of the body.
TEST(Greens, WithAllModesIsTheDynamicInverse) {
  const Model packed = test::swinging_model(ElementType::tet4, test::packed());
  const Body by_modes(test::swinging_model(ElementType::tet4, test::all_modes()), {}, 1,
                      ContactModel::dynamic);
  const Body by_inverse(test::swinging_model(ElementType::tet4, test::packed()), {}, 1,
                        ContactModel::dynamic);
  const MatrixXd inverse = unpack(packed.dynamics.inverse);
  const Index nodes = by_modes.greens().nodes();
  for (const Index i : {Index{0}, Index{5}, nodes - 1}) {
    for (const Index j : {Index{0}, Index{7}, nodes - 2}) {
      const MatrixXd expected = inverse.block<3, 3>(3 * i, 3 * j);
      EXPECT_LT((by_modes.greens().block(i, j) - expected).norm(), 1e-9 * inverse.norm());
      EXPECT_LT((by_inverse.greens().block(i, j) - expected).norm(), 1e-15 * inverse.norm());
    }
  }
  const std::vector<Index> loaded = {3, 1};
  const std::vector<double> f = {1.0, -2.0, 0.5, 3.0, 0.0, 1.0};
  VectorXd dense = VectorXd::Zero(inverse.rows());
  dense.segment<3>(9) = Eigen::Map<const Eigen::Vector3d>(f.data());
  dense.segment<3>(3) = Eigen::Map<const Eigen::Vector3d>(f.data() + 3);
  VectorXd u(3 * 4);
  by_modes.greens().displacement(loaded, f, 2, span(u));
  EXPECT_LT((u - (inverse * dense).segment(6, 12)).norm(), 1e-9 * (inverse * dense).norm());
}

}  // namespace
}  // namespace palpate::dynamics_newmark_test
