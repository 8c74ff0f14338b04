// Neo-Hookean patches in a linear body: against the body with its fine mesh as one sparse system, and under
// the tick.
#include "runtime/background/hyperelastic_patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "runtime/background/patch_source.h"
#include "runtime/core/body/near_field.h"
#include "runtime/core/tick/step.h"
#include "tests/support/bodies/mixed_body.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::hyperelastic_patch_test {
namespace {

using Eigen::VectorXd;
using test::MixedBody;

constexpr double infinity = std::numeric_limits<double>::infinity();

struct Case {
  ElementType element;
  int cells;
  int refinement;
  int rings;
  double rest = 0.0;  // size of the displacement by the file's loads [m]
};

std::string name_of(const testing::TestParamInfo<Case>& tested) {
  const Case& c = tested.param;
  return std::string(traits(c.element).name) + "Cells" + std::to_string(c.cells) + "Refinement" +
         std::to_string(c.refinement) + "Rings" + std::to_string(c.rings) + (c.rest > 0.0 ? "Loaded" : "");
}

Model model_of(const Case& c) {
  Model model = test::unit_model(c.element, c.cells, Scope::full, Precision::double_precision);
  test::set_rest(model, c.rest);
  return model;
}

class HyperelasticPatches : public testing::TestWithParam<Case> {
 protected:
  Body body_{model_of(GetParam()), {}, GetParam().refinement};
  int d_ = body_.dimension();
  Index centre_ = body_.mesh_node(body_.nearest_surface_node(test::top_middle(d_)).node);
  Vec3 top_ = body_.model().mesh.nodes[static_cast<std::size_t>(centre_)];

  [[nodiscard]] PatchMesh mesh() const {
    const ElementsAtNodes at(body_.model().mesh);
    return make_patch_mesh(body_.model(), at,
                           rings_round(body_.model().mesh, at, {&centre_, 1}, GetParam().rings),
                           GetParam().refinement);
  }

  /// The surface node nearest to a point of the mesh.
  [[nodiscard]] Index node_at(const Vec3& point) const {
    const std::vector<Vec3> nodes = body_.surface_in_mesh();
    const auto found = std::min_element(nodes.begin(), nodes.end(), [&](const Vec3& a, const Vec3& b) {
      return (a - point).squaredNorm() < (b - point).squaredNorm();
    });
    return static_cast<Index>(found - nodes.begin());
  }

  /// Under the tool: nodes around the middle of the top, pressed down and to the side; and one beside it.
  struct Push {
    std::vector<Index> nodes;
    std::vector<Vec3> forces;
  };
  [[nodiscard]] Push push(double size) const {
    const double fine = 1.0 / (GetParam().cells * GetParam().refinement);
    Push push;
    const auto add = [&](double along, double share) {
      push.nodes.push_back(node_at(top_ + Vec3(along * fine, 0.0, 0.0)));
      push.forces.push_back(size * share * test::upright(d_, 0.3, 0.1, -1.0));
    };
    add(0.0, 1.0);
    add(-1.0, 0.7);
    add(1.0, 0.6);
    push.nodes.push_back(node_at(test::upright(d_, 0.0, 0.0, 1.0)));  // a corner
    push.forces.push_back(0.1 * size * test::upright(d_, -0.2, 0.0, -1.0));
    return push;
  }
  /// Large enough for strains of tens of per cent.
  [[nodiscard]] double large() const { return d_ == 2 ? 0.06 : 0.012; }

  /// Displacement of a surface node by a displacement of the body's and the fine mesh's nodes.
  [[nodiscard]] Vec3 at_surface(const PatchMesh& mesh, const VectorXd& body, const VectorXd& local,
                                Index node) const {
    const Vec3 place = body_.surface_in_mesh()[static_cast<std::size_t>(node)];
    Vec3 u = Vec3::Zero();
    for (std::size_t k = 0; k < mesh.local.nodes.size(); ++k) {
      if ((mesh.local.nodes[k] - place).norm() > 1e-9) continue;
      u.head(d_) = local.segment(d_ * static_cast<Eigen::Index>(k), d_);
      return u;
    }
    const SurfaceParts parts = body_.surface_parts(node);
    for (std::size_t p = 0; p < parts.stored.size(); ++p) {
      const Eigen::Index mesh_node = body_.mesh_node(parts.stored[p]);
      u.head(d_) += parts.weights[p] * body.segment(d_ * mesh_node, d_);
    }
    return u;
  }

  /// Where forces take all surface nodes, by the sparse system. [S]
  [[nodiscard]] std::vector<Vec3> reference(const PatchMesh& mesh, const Push& push,
                                            LiveLaw law = LiveLaw::neo_hookean) const {
    MixedBody mixed(body_.model(), mesh, LiveLaw::linear, law);
    VectorXd force = VectorXd::Zero(mixed.dofs());
    for (std::size_t k = 0; k < push.nodes.size(); ++k) {
      const Vec3 place = body_.surface_in_mesh()[static_cast<std::size_t>(push.nodes[k])];
      const auto put = [&](const MixedBody::Sparse& Z, std::ptrdiff_t node, const Vec3& on_node) {
        VectorXd f = VectorXd::Zero(Z.rows());
        f.segment(d_ * node, d_) = on_node.head(d_);
        force += Z.transpose() * f;
      };
      const auto in_patch = std::find_if(mesh.local.nodes.begin(), mesh.local.nodes.end(),
                                         [&](const Vec3& node) { return (node - place).norm() < 1e-9; });
      if (in_patch != mesh.local.nodes.end()) {
        put(mixed.of_patch(), in_patch - mesh.local.nodes.begin(), push.forces[k]);
        continue;
      }
      const SurfaceParts parts = body_.surface_parts(push.nodes[k]);
      for (std::size_t part = 0; part < parts.stored.size(); ++part)
        put(mixed.of_body(), body_.mesh_node(parts.stored[part]), parts.weights[part] * push.forces[k]);
    }
    VectorXd q = VectorXd::Zero(mixed.dofs()), multipliers;
    const MixedBody::Sparse none(0, mixed.dofs());
    EXPECT_TRUE(mixed.find(force, none, VectorXd(0), q, multipliers));
    const VectorXd body = mixed.of_body() * q, local = mixed.of_patch() * q;
    std::vector<Vec3> u;
    for (Index node = 0; node < std::ssize(body_.surface_rest_positions()); ++node)
      u.push_back(at_surface(mesh, body, local, node));
    return u;
  }

  /// Where forces take all surface nodes, as the tick has it with a patch. [S]
  [[nodiscard]] std::vector<Vec3> felt(const std::shared_ptr<const Patch>& patch, const Push& push) const {
    const auto g = static_cast<Index>(patch->stored_nodes().size());
    NearField near(body_, static_cast<Index>(push.nodes.size()) + 8, g);
    near.begin_tick();
    EXPECT_TRUE(near.change_patch(body_, patch));
    for (const Index node : push.nodes) EXPECT_TRUE(near.want(body_, node));
    for (std::size_t k = 0; k < push.nodes.size(); ++k)
      near.load(near.place_of(push.nodes[k]), push.forces[k]);
    near.displace();
    std::vector<double> stored(static_cast<std::size_t>(body_.greens().order()));
    std::vector<Vec3> u(body_.surface_rest_positions().size());
    surface_displacement(body_, near.load(), stored, u);
    for (Index place = 0; place < near.count(); ++place) {
      const Vec3& by_load = u[static_cast<std::size_t>(near.node(place))];
      EXPECT_LT((near.displacement(place) - by_load).norm(), 1e-10 * (1e-3 + by_load.norm()));
    }
    return u;
  }

  static double largest(const std::vector<Vec3>& u) {
    double most = 0.0;
    for (const Vec3& at : u) most = std::max(most, at.norm());
    return most;
  }
  /// Of the largest of b.
  static double apart(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double most = 0.0;
    for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, (a[k] - b[k]).norm());
    return most / largest(b);
  }
};

INSTANTIATE_TEST_SUITE_P(Elements, HyperelasticPatches,
                         testing::Values(Case{ElementType::tri3, 4, 3, 1}, Case{ElementType::quad4, 4, 2, 1},
                                         Case{ElementType::tet4, 4, 2, 1},
                                         Case{ElementType::tet4, 3, 2, 1, 0.03},
                                         Case{ElementType::hex8, 3, 2, 1},
                                         Case{ElementType::tet4, 2, 2, 4}),  // the whole body
                         name_of);

TEST_P(HyperelasticPatches, BalanceWhereTheMixedBodyDoes) {
  HyperelasticPatch patch(body_, mesh());
  const Push push = this->push(large());
  const PatchBalance report = patch.find(push.nodes, push.forces, {.tolerance = 1e-11, .most_steps = 60});
  EXPECT_TRUE(report.converged) << report.residual;
  EXPECT_EQ(report.inverted, 0);
  const std::vector<Vec3> truth = reference(patch.mesh(), push);
  EXPECT_LT(apart(felt(patch.linearise(), push), truth), 1e-8);
  // It is another place than where the linear body is, or this would tell nothing.
  EXPECT_GT(apart(reference(patch.mesh(), push, LiveLaw::linear), truth), 0.02);
}

TEST_P(HyperelasticPatches, AreTheLinearOverlayForSmallForces) {
  HyperelasticPatch patch(body_, mesh());
  Push push = this->push(1e-6 * large());
  ASSERT_TRUE(patch.find(push.nodes, push.forces, {.tolerance = 1e-9, .most_steps = 20}).converged);
  const auto linear = make_patch(body_, patch.mesh(), condense(body_.model(), patch.mesh()));
  // Under loads the patch is deformed at rest, and another body.
  const double most = GetParam().rest > 0.0 ? 0.2 : 1e-4;
  EXPECT_LT(apart(felt(patch.linearise(), push), felt(linear, push)), most);
}

// Differences of the balance under other forces, in the patch and beside it.
TEST_P(HyperelasticPatches, HaveTheTangentOfTheirBalance) {
  HyperelasticPatch patch(body_, mesh());
  const Push push = this->push(large());
  const PatchEffort exact{.tolerance = 1e-12, .most_steps = 60};
  patch.find(push.nodes, push.forces, exact);
  const std::shared_ptr<const Patch> tangent = patch.linearise();
  const std::vector<Vec3> here = felt(tangent, push);
  for (const std::size_t changed : {std::size_t{0}, push.nodes.size() - 1}) {
    for (int axis = 0; axis < d_; ++axis) {
      const double by = 1e-4 * large();
      std::vector<std::vector<Vec3>> moved;
      Push other = push;
      for (const double side : {-1.0, 1.0}) {
        other = push;
        other.forces[changed][axis] += side * by;
        patch.find(other.nodes, other.forces, exact);
        moved.push_back(felt(patch.linearise(), other));
      }
      const std::vector<Vec3> by_tangent = felt(tangent, other);
      std::vector<Vec3> expected, found;
      for (std::size_t node = 0; node < here.size(); ++node) {
        expected.emplace_back(0.5 * (moved[1][node] - moved[0][node]));
        found.emplace_back(by_tangent[node] - here[node]);
      }
      EXPECT_LT(apart(found, expected), 1e-3) << "force " << changed << " along " << axis;
    }
  }
}

// What does not balance yet is not lost: the tick goes on with Newton's method.
TEST_P(HyperelasticPatches, GoOnWithNewtonsMethodUnderTheTick) {
  HyperelasticPatch patch(body_, mesh()), at_once(body_, mesh());
  const Push push = this->push(0.3 * large());
  patch.find(push.nodes, push.forces, {.tolerance = 1e-12, .most_steps = 1});
  at_once.find(push.nodes, push.forces, {.tolerance = 1e-12, .most_steps = 2});
  const VectorXd u = at_once.local_displacement();
  const std::vector<Vec3> next = felt(patch.linearise(), push);
  for (std::size_t k = 0; k < push.nodes.size() - 1; ++k) {
    const Vec3 there = at_surface(patch.mesh(), {}, u, push.nodes[k]);
    EXPECT_LT((next[static_cast<std::size_t>(push.nodes[k])] - there).norm(), 1e-8 * there.norm());
  }
}

// Forces that turn elements inside out: no step is left without an end, and nothing is not a number.
TEST_P(HyperelasticPatches, SurviveForcesThatTurnElementsInsideOut) {
  HyperelasticPatch patch(body_, mesh());
  const Push push = this->push(100.0 * large());
  int cuts = 0;
  Index inverted = 0;
  for (int job = 0; job < 20; ++job) {
    const PatchBalance report = patch.find(push.nodes, push.forces, {});
    cuts += report.cuts;
    inverted = std::max(inverted, report.inverted);
    ASSERT_TRUE(std::isfinite(report.residual));
    const std::shared_ptr<const Patch> tangent = patch.linearise();
    ASSERT_NE(tangent, nullptr);
    ASSERT_TRUE(tangent->offset().allFinite());
    for (Index dof = 0; dof < tangent->offset().size(); ++dof)
      ASSERT_TRUE(std::isfinite(tangent->compliance(dof)[dof]));
  }
  EXPECT_GT(cuts + inverted, 0);
  // Once the tool has let go, a new one begins at rest.
  HyperelasticPatch anew(body_, mesh());
  const Push light = this->push(1e-3 * large());
  PatchBalance report;
  for (int job = 0; job < 40 && !report.converged; ++job) report = anew.find(light.nodes, light.forces, {});
  EXPECT_TRUE(report.converged) << report.residual;
  EXPECT_EQ(report.inverted, 0);
}

/// The same body with a sphere on its top.
class UnderTheTick : public HyperelasticPatches {
 protected:
  double radius_ = 0.3;
  Index room_ = patch_room(body_, GetParam().rings, 1);
  Vec3 surface_ = [this] {
    const auto node = static_cast<std::size_t>(body_.nearest_surface_node(top_).node);
    return body_.rest_position(static_cast<Index>(node));
  }();

  [[nodiscard]] State state() const {
    return State(body_, {.tools = {Tool{.radius = radius_, .hand_over = infinity}}, .patch_nodes = room_});
  }
  [[nodiscard]] PatchSourceOptions options(PatchLaw law, bool in_background = false) const {
    return {.rings = GetParam().rings, .law = law, .in_background = in_background};
  }
  [[nodiscard]] ToolPose pose(double depth) const {
    return {.position = surface_ + test::upright(d_, 0.013, 0.007, radius_ - depth)};
  }
  /// Down to `depth`, and then it rests.
  void press(State& state, PatchSource& source, double depth, int resting = 150) const {
    for (int tick = 0; tick < 100 + resting; ++tick) {
      source.serve(state);
      step(body_, state, pose(depth * std::min(1.0, tick / 50.0 - 1.0)));
    }
  }
  void press_on(State& state, PatchSource& source, double depth, int ticks) const {
    for (int tick = 0; tick < ticks; ++tick) {
      source.serve(state);
      step(body_, state, pose(depth));
    }
  }
};

INSTANTIATE_TEST_SUITE_P(Elements, UnderTheTick,
                         testing::Values(Case{ElementType::tri3, 4, 3, 1}, Case{ElementType::quad4, 4, 2, 2},
                                         Case{ElementType::tet4, 4, 2, 1},
                                         Case{ElementType::tet4, 3, 2, 1, 0.03}),
                         name_of);

TEST_P(UnderTheTick, IsFeltAtRestAsTheMixedBodyIs) {
  State state = this->state();
  PatchSource source(body_, state, options(PatchLaw::neo_hookean));
  press(state, source, 0.12);
  ASSERT_GT(state.tools.front().contacts, 0);
  EXPECT_EQ(state.status, StepStatus::ok);
  EXPECT_EQ(source.tangents()->telling().failed, 0);

  // The mixed body under the forces of the contacts is where the tick has it,
  PatchMaker maker(body_, GetParam().rings);
  const Index centre = source.centre();
  const PatchMesh mesh = maker.mesh({&centre, 1});
  Push push;
  Vec3 sum = Vec3::Zero();
  const NearField& near = state.surface.near;
  for (Index place = 0; place < near.count(); ++place) {
    push.nodes.push_back(near.node(place));
    push.forces.push_back(near.force(place));
    sum -= near.force(place);
  }
  const std::vector<Vec3> truth = reference(mesh, push);
  for (Index place = 0; place < near.count(); ++place) {
    const Vec3& u = truth[static_cast<std::size_t>(near.node(place))];
    EXPECT_LT((near.displacement(place) - u).norm(), 1e-6 * largest(truth));
    const Vec3 at = body_.surface_rest_positions()[static_cast<std::size_t>(near.node(place))] + u;
    EXPECT_LT((state.surface.tree.position(near.node(place)) - at).norm(), 1e-6 * largest(truth));
  }
  // so that these are the forces of its contact: nothing is in the tool, and what carries force is on it.
  for (const ContactPoint& contact : state.contacts()) {
    EXPECT_GT(contact.gap, -1e-6);
    EXPECT_TRUE(contact.force.isZero(0.0) || std::abs(contact.gap) < 1e-6) << contact.gap;
  }
  const Vec3 felt = state.tools.front().contact_wrench.force;
  EXPECT_LT((felt - sum).norm(), 1e-9 * felt.norm());

  // It is not that of a linear overlay.
  State other = this->state();
  PatchSource linear(body_, other, options(PatchLaw::linear));
  press(other, linear, 0.12);
  EXPECT_GT((other.tools.front().contact_wrench.force - felt).norm(), 0.01 * felt.norm());
  EXPECT_EQ(linear.tangents(), nullptr);
}

// All of the surface, not only near the tool, is where the mixed body has it once it was renewed.
TEST_P(UnderTheTick, MovesTheFarSurfaceToo) {
  State state = this->state();
  PatchSource source(body_, state, options(PatchLaw::neo_hookean));
  press(state, source, 0.12, 300);
  PatchMaker maker(body_, GetParam().rings);
  const Index centre = source.centre();
  Push push;
  for (Index place = 0; place < state.surface.near.count(); ++place) {
    push.nodes.push_back(state.surface.near.node(place));
    push.forces.push_back(state.surface.near.force(place));
  }
  const std::vector<Vec3> truth = reference(maker.mesh({&centre, 1}), push);
  for (std::size_t node = 0; node < truth.size(); ++node) {
    const Vec3 u =
        state.surface.tree.position(static_cast<Index>(node)) - body_.surface_rest_positions()[node];
    EXPECT_LT((u - truth[node]).norm(), 1e-6 * largest(truth)) << node;
  }
}

TEST_P(UnderTheTick, FeelsTheSameByTheBuilderAndGoesBackToRest) {
  State at_once = this->state();
  PatchSource own(body_, at_once, options(PatchLaw::neo_hookean));
  press(at_once, own, 0.1);
  const Vec3 force = at_once.tools.front().contact_wrench.force;

  State state = this->state();
  PatchSource source(body_, state, options(PatchLaw::neo_hookean, true));
  press(state, source, 0.1, 0);
  const auto wait = [&](double depth, const auto& is_there) {
    for (int tick = 0; tick < 20000 && !is_there(); ++tick) {
      source.serve(state);
      step(body_, state, pose(depth));
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    return is_there();
  };
  EXPECT_TRUE(wait(0.1, [&] {
    return (state.tools.front().contact_wrench.force - force).norm() < 1e-6 * force.norm();
  })) << (state.tools.front().contact_wrench.force - force).norm() / force.norm();
  EXPECT_TRUE(state.surface.patch->has_offset());
  EXPECT_TRUE(wait(-0.1, [&] { return !state.surface.patch->has_offset(); }));
  EXPECT_TRUE(wait(-0.1, [&] {
    const std::span<const Vec3> rest = body_.surface_rest_positions();
    double most = 0.0;
    for (std::size_t node = 0; node < rest.size(); ++node)
      most = std::max(most, (state.surface.tree.position(static_cast<Index>(node)) - rest[node]).norm());
    return most < 1e-12;
  }));
}

// A push that turns elements inside out is felt all the same, and told.
TEST_P(UnderTheTick, TellsElementsInsideOut) {
  State state(body_,
              {.tools = {Tool{.radius = 0.0, .hand_over = infinity, .reach = 0.5}}, .patch_nodes = room_});
  PatchSource source(body_, state, options(PatchLaw::neo_hookean));
  for (int tick = 0; tick < 150; ++tick) {  // a node is taken hold of and pushed through those below it
    source.serve(state);
    step(body_, state,
         {.position = surface_ - test::upright(d_, 0.0, 0.0, 0.015 * std::clamp(tick - 20, -1, 100)),
          .grab = tick > 10});
  }
  const Vec3 force = state.tools.front().wrench.force;
  EXPECT_TRUE(force.allFinite());
  EXPECT_GT(force.norm(), 0.0);
  const PatchTangentTelling telling = source.tangents()->telling();
  EXPECT_GT(telling.made, 0);
  EXPECT_TRUE(d_ == 3 || telling.with_inverted + telling.cuts > 0);
  for (const Vec3& rest : body_.surface_rest_positions()) {
    const auto node = static_cast<Index>(&rest - body_.surface_rest_positions().data());
    EXPECT_TRUE(state.surface.tree.position(node).allFinite());
  }
}

// Deep enough that under forces that stay as they are the patch would give way: the contact holds it.
TEST_P(UnderTheTick, ComesToRestInADeepPush) {
  State state = this->state();
  PatchSource source(body_, state, options(PatchLaw::neo_hookean));
  press(state, source, 0.45, 300);
  EXPECT_LT(source.tangents()->telling().last_residual, 1e-6);
  const Vec3 force = state.tools.front().contact_wrench.force;
  press_on(state, source, 0.45, 20);
  EXPECT_LT((state.tools.front().contact_wrench.force - force).norm(), 1e-6 * force.norm());
}

TEST(HyperelasticPatch, RefusesInitialStrain) {
  Model model = test::unit_model(ElementType::tri3, 2, Scope::full, Precision::double_precision);
  model.materials[0].initial_strain[0] = 0.01;
  const Body body(std::move(model), {}, 2);
  const ElementsAtNodes at(body.model().mesh);
  EXPECT_THROW(HyperelasticPatch(body, make_patch_mesh(body.model(), at, {0}, 2)), Error);
}

}  // namespace
}  // namespace palpate::hyperelastic_patch_test
