// What contact of many points keeps from tick to tick, against the same made anew.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/tick/step.h"
#include "runtime/core/touch/compliance.h"
#include "tests/support/bodies/runtime_model.h"
#include "tests/support/runtime_tool.h"

namespace palpate::many_contacts_test {
namespace {

using test::go;
using test::hold;
using test::plain;
using test::pose;

const Body& cube() {
  static const Body body(test::unit_model(3, 8, Scope::surface, Precision::double_precision));
  return body;
}

/// Rows of J between surface nodes that move, and their compliance.
class Compliance : public testing::Test {
 protected:
  Compliance() {
    for (Index node = 0; node < static_cast<Index>(cube().surface_rest_positions().size()); ++node) {
      if (cube().surface_moves(node)) nodes_.push_back(node);
    }
    std::shuffle(nodes_.begin(), nodes_.end(), random_);
  }

  /// Of one node, as contact at a vertex has it, or of three.
  ContactRow row(std::size_t first, int nodes) {
    ContactRow row;
    std::normal_distribution<double> entry;
    for (int n = 0; n < nodes; ++n) {
      const Index node = nodes_[first + static_cast<std::size_t>(n)];
      EXPECT_TRUE(near_.want(cube(), node));
      row.places[static_cast<std::size_t>(n)] = near_.place_of(node);
      row.body[static_cast<std::size_t>(n)] = nodes == 1
                                                  ? Vec3::Unit(static_cast<int>(first % 3))
                                                  : Vec3(entry(random_), entry(random_), entry(random_));
    }
    return row;
  }

  /// Moves the rows' nodes to where they are in the near field now.
  void find_places() {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (std::size_t n = 0; n < 3; ++n) {
        if (rows_[i].places[n] >= 0) rows_[i].places[n] = near_.place_of(named_[i][n]);
      }
    }
  }
  void name_nodes() {
    named_.clear();
    for (const ContactRow& row : rows_) {
      std::array<Index, 3> names{-1, -1, -1};
      for (std::size_t n = 0; n < 3; ++n) names[n] = row.places[n] < 0 ? -1 : near_.node(row.places[n]);
      named_.push_back(names);
    }
  }

  void assemble(Index tilts, bool apart = false, bool single = true) {
    const auto count = static_cast<Index>(rows_.size());
    problem_.clear(single);
    for (Index i = 0; i < count; ++i) problem_.add(0.0, false);
    compliance_.assemble(near_, rows_, count - tilts, apart, problem_);
  }

  Eigen::MatrixXd exact() {
    const auto count = static_cast<Eigen::Index>(rows_.size());
    const Eigen::Index width = Eigen::Index{3} * near_.count();
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(count, width), C(width, width);
    for (Eigen::Index i = 0; i < width; ++i)
      C.row(i) = Eigen::Map<const Eigen::RowVectorXd>(near_.row(static_cast<Index>(i)).data(), width);
    for (Eigen::Index i = 0; i < count; ++i) {
      const ContactRow& row = rows_[static_cast<std::size_t>(i)];
      for (std::size_t n = 0; n < 3; ++n) {
        if (row.places[n] >= 0)
          J.row(i).segment<3>(Eigen::Index{3} * row.places[n]) += row.body[n].transpose();
      }
    }
    return J * C * J.transpose();
  }

  void expect_exact() {
    const MatrixRows<float> W =
        compliance_.body(MatrixRows<float>{problem_.single_row(0), problem_.single_stride});
    const auto count = static_cast<Eigen::Index>(rows_.size());
    const Eigen::MatrixXd exact = this->exact();
    for (Eigen::Index i = 0; i < count; ++i) {
      const float* w = W[static_cast<Index>(i)];
      for (Eigen::Index j = 0; j < count; ++j)
        ASSERT_NEAR(w[j], exact(i, j), 2e-6 * std::sqrt(exact(i, i) * exact(j, j))) << i << " " << j;
      for (Eigen::Index j = count; j < problem_.single_stride && j < (count + 15) / 16 * 16; ++j)
        ASSERT_EQ(w[j], 0.0F) << i << " " << j;
    }
  }

  /// As stages behind do: a spring at the row itself.
  void change_diagonal() {
    for (Index i = 0; i < problem_.rows; ++i) problem_.single_row(i)[i] *= 1.5F;
  }

  std::mt19937 random_{11};
  std::vector<Index> nodes_;
  NearField near_{cube(), 90};
  std::vector<ContactRow> rows_;
  std::vector<std::array<Index, 3>> named_;
  ContactProblem problem_{3, 60, 60, 60};
  BodyCompliance compliance_{60, 60, 3 * 90};
};

TEST_F(Compliance, IsThatOfTheBodyWhateverIsKept) {
  near_.begin_tick();
  for (std::size_t k = 0; k < 30; ++k) rows_.push_back(row(k, 1));
  for (std::size_t k = 0; k < 6; ++k) rows_.push_back(row(40 + 3 * k, 3));
  assemble(6);
  EXPECT_EQ(compliance_.renewed(), 36);
  expect_exact();
  change_diagonal();
  assemble(6);
  EXPECT_EQ(compliance_.renewed(), 0);
  expect_exact();

  change_diagonal();
  rows_[4] = row(31, 1);
  rows_[33] = row(32, 3);
  assemble(6);
  EXPECT_EQ(compliance_.renewed(), 2);
  expect_exact();

  change_diagonal();
  rows_.resize(20);  // and fewer
  assemble(0);
  EXPECT_EQ(compliance_.renewed(), 0);
  expect_exact();

  change_diagonal();
  for (std::size_t k = 0; k < 12; ++k) rows_.push_back(row(60 + k, 1));
  assemble(0);
  EXPECT_EQ(compliance_.renewed(), 12);
  expect_exact();
}

TEST_F(Compliance, GoesWithNodesThatMoveInTheNearField) {
  near_.begin_tick();
  static_cast<void>(row(70, 3));  // comes first, and goes
  for (std::size_t k = 0; k < 24; ++k) rows_.push_back(row(k, 1));
  name_nodes();
  assemble(0);
  const Index first = near_.place_of(named_[23][0]);
  for (int tick = 0; tick < 400; ++tick) {
    near_.begin_tick();
    for (const auto& names : named_) ASSERT_TRUE(near_.want(cube(), names[0]));
  }
  find_places();
  ASSERT_NE(rows_[23].places[0], first) << "the last one takes the place of one that goes";
  rows_[3] = row(50, 1);
  assemble(0);
  EXPECT_EQ(compliance_.renewed(), 1);
  expect_exact();
}

TEST_F(Compliance, IsMadeAnewWithAnotherOverlayAndWhereItWasForgotten) {
  near_.begin_tick();
  for (std::size_t k = 0; k < 24; ++k) rows_.push_back(row(k, 1));
  name_nodes();
  assemble(0);
  ASSERT_TRUE(near_.change_patch(cube(), nullptr));
  find_places();
  assemble(0);
  EXPECT_EQ(compliance_.renewed(), 24);
  compliance_.forget();
  assemble(0);
  EXPECT_EQ(compliance_.renewed(), 24);
  expect_exact();
}

// What couplings give way is added to the problem's W, not to what is kept.
TEST_F(Compliance, IsKeptApartWhereWIsToBeAddedTo) {
  near_.begin_tick();
  for (std::size_t k = 0; k < 24; ++k) rows_.push_back(row(k, 1));
  assemble(0);
  assemble(0, true);
  EXPECT_EQ(compliance_.renewed(), 24) << "it is elsewhere now";
  std::fill(problem_.single_W.begin(), problem_.single_W.end(), 1.0F);
  assemble(0, true);
  EXPECT_EQ(compliance_.renewed(), 0);
  EXPECT_EQ(problem_.single_W[5], 1.0F);
  expect_exact();
}

// Rows of one node and of three, as vertices, edges and faces have them.
TEST_F(Compliance, IsExactInDoublePrecision) {
  near_.begin_tick();
  for (std::size_t k = 0; k < 12; ++k) rows_.push_back(row(k, 1));
  for (std::size_t k = 0; k < 12; ++k) rows_.push_back(row(20 + 3 * k, 3));
  assemble(0);
  assemble(0, false, false);
  const Eigen::MatrixXd W = exact();
  for (Index i = 0; i < 24; ++i) {
    for (Index j = 0; j < 24; ++j)
      ASSERT_NEAR(problem_.w(i, j), W(i, j), 1e-14 * std::sqrt(W(i, i) * W(j, j))) << i << " " << j;
  }
  assemble(0);
  EXPECT_EQ(compliance_.renewed(), 24) << "contacts were few in between";
}

struct Case {
  const char* name;
  double friction;
  double coupling;
  int tools;
};

void PrintTo(const Case& c, std::ostream* out) {  // NOLINT(readability-identifier-naming): GoogleTest's
  *out << c.name;
}

constexpr double infinite = std::numeric_limits<double>::infinity();

class ManyContacts : public testing::TestWithParam<Case> {
 protected:
  [[nodiscard]] State begin(const Body& body) const {
    Tool tool =
        plain({.radius = 2.0, .coupling_stiffness = GetParam().coupling, .friction = GetParam().friction});
    tool.coupling_torsion = GetParam().coupling;
    return State(body, {.tools = std::vector<Tool>(static_cast<std::size_t>(GetParam().tools), tool),
                        .max_contacts = 256});
  }
  [[nodiscard]] std::vector<ToolPose> poses(int tick) const {
    const double x = 0.35 + 0.0006 * std::max(0, tick - 150);
    const double z = 3.0 + 0.02 - 0.0007 * std::min(150, tick);
    std::vector<ToolPose> all = {pose({x, 0.5, z})};
    if (GetParam().tools > 1) all.push_back(pose({3.0 + 0.01 - 0.0004 * std::min(150, tick), 0.5, 0.55}));
    return all;
  }
};
INSTANTIATE_TEST_SUITE_P(Tools, ManyContacts,
                         testing::Values(Case{"rigid", 0.3, infinite, 1}, Case{"coupled", 0.3, 3.0, 1},
                                         Case{"two", 0.3, 3.0, 2}, Case{"two rigid", 0.2, infinite, 2}));

// A state that keeps W goes as one that does not, to the last bit, and computes a few rows in a tick.
TEST_P(ManyContacts, KeepWhatDoesNotChange) {
  const Body& body = cube();
  State state = begin(body);
  std::vector<double> shares;
  double largest = 0.0;
  for (int tick = 0; tick < 500; ++tick) {
    const auto to = poses(tick);
    std::optional<State> anew;
    if (tick > 120 && tick % 10 == 0) anew = state;
    step(body, state, to);
    const Scratch& scratch = state.scratch;
    largest = std::max(largest, state.tools.front().contact_wrench.force.norm());
    if (!scratch.problem.single) continue;
    if (tick > 150)
      shares.push_back(static_cast<double>(scratch.assembly.compliance.renewed()) /
                       static_cast<double>(scratch.problem.rows));
    if (!anew) continue;
    anew->scratch.assembly.compliance.forget();
    step(body, *anew, to);
    ASSERT_EQ(anew->scratch.assembly.compliance.renewed(), anew->scratch.problem.rows) << tick;
    for (std::size_t k = 0; k < state.tools.size(); ++k) {
      ASSERT_EQ(state.tools[k].contact_wrench.force, anew->tools[k].contact_wrench.force) << tick;
      ASSERT_EQ(state.tools[k].local.stiffness, anew->tools[k].local.stiffness) << tick;
    }
  }
  EXPECT_GT(largest, 0.0);
  ASSERT_GT(shares.size(), 200U);
  std::nth_element(shares.begin(), shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2),
                   shares.end());
  EXPECT_LT(shares[shares.size() / 2], 0.1);
}

// While tools move, the forces' change is foreseen to first order.
TEST_P(ManyContacts, ForeseeTheirForces) {
  State state = begin(cube());
  std::vector<double> shares;
  for (int tick = 0; tick < 500; ++tick) {
    step(cube(), state, poses(tick));
    const ContactProblem& problem = state.scratch.problem;
    if (!problem.single || tick < 50) continue;
    const auto of_rows = [&](const std::vector<double>& values) {
      return Eigen::Map<const Eigen::VectorXd>(values.data(), problem.rows);
    };
    const Eigen::VectorXd change = of_rows(problem.lambda) - of_rows(problem.guess);
    if (change.isZero(0.0) || of_rows(problem.prediction).isZero(0.0)) continue;  // a second pass
    shares.push_back((of_rows(problem.prediction) - change).norm() / change.norm());
  }
  ASSERT_GT(shares.size(), 200U);
  const auto median = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
  std::nth_element(shares.begin(), median, shares.end());
  EXPECT_LT(*median, 0.5);
}

/// A tick in which a sphere slides and goes deeper.
struct Slide {
  bool has_many_contacts;
  Index blocks;
  bool repeats;  ///< the last pass began with other contact points than the tick
};

Slide slide(double radius, double friction, double by) {
  State state(cube(), {.tools = {plain({.radius = radius, .friction = friction})}, .max_contacts = 256});
  const Vec3 pressed(0.4, 0.5, 1.0 + radius - 0.06);
  go(cube(), state, Vec3(0.4, 0.5, 1.0 + radius + 0.01), pose(pressed), 200);
  hold(cube(), state, pose(pressed), 20);
  const std::vector<ContactPoint> before(state.contacts().begin(), state.contacts().end());
  step(cube(), state, pose(pressed + Vec3(by, 0.0, -0.2 * by)));
  const auto last =
      std::span(state.scratch.last.contacts).first(static_cast<std::size_t>(state.scratch.last.count));
  const bool same = std::equal(before.begin(), before.end(), last.begin(), last.end(),
                               [](const ContactPoint& a, const ContactPoint& b) {
                                 return a.feature == b.feature && a.position == b.position;
                               });
  return {state.scratch.problem.single, state.surface.near.added_blocks(), !same};
}

TEST(Passes, AreRepeatedWhereThereIsTime) {
  const Slide few = slide(0.15, 0.0, 0.1), far = slide(2.0, 0.0, 0.1), many = slide(2.0, 0.3, 0.01);
  EXPECT_FALSE(few.has_many_contacts);
  EXPECT_LE(few.blocks, tuning.passes.most_blocks);
  EXPECT_TRUE(few.repeats);
  EXPECT_FALSE(far.has_many_contacts);
  EXPECT_GT(far.blocks, tuning.passes.most_blocks);
  EXPECT_FALSE(far.repeats);
  EXPECT_TRUE(many.has_many_contacts);
  EXPECT_LE(many.blocks, tuning.passes.most_blocks);
  EXPECT_FALSE(many.repeats);
}

TEST(Remember, FindsContactsByTheirFeature) {
  State state(cube(), {.max_contacts = 100});
  std::mt19937_64 random(4);
  std::vector<ContactPoint> contacts(100);
  for (std::size_t k = 0; k < contacts.size(); ++k)
    contacts[k].feature =
        k < 50 ? static_cast<std::int64_t>(random() >> 1U) : static_cast<std::int64_t>(k) << 40U;
  state.scratch.last.remember(contacts);
  for (std::size_t k = 0; k < contacts.size(); ++k)
    EXPECT_EQ(state.scratch.last.number_of(contacts[k].feature), static_cast<Index>(k));
  EXPECT_EQ(state.scratch.last.number_of(12345), -1);
  state.scratch.last.remember(std::span(contacts).first(30));
  EXPECT_EQ(state.scratch.last.number_of(contacts[29].feature), 29);
  EXPECT_EQ(state.scratch.last.number_of(contacts[30].feature), -1) << "nothing older is left";
}

}  // namespace
}  // namespace palpate::many_contacts_test
