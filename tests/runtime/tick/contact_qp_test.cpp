// Frictionless contact against a quadratic program of the whole mesh: the sparse K, no Green's function, and
// all of the surface must stay out of the tools.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "runtime/body/body.h"
#include "runtime/core/solve/active_set.h"
#include "runtime/core/solve/contact_problem.h"
#include "runtime/core/solve/nearest_on_disc.h"
#include "runtime/core/tick/contact_detection.h"
#include "runtime/core/tick/step.h"
#include "runtime/core/touch/tool_geometry.h"
#include "tests/support/bodies/runtime_model.h"

namespace palpate::contact_qp_test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// A row of the quadratic program: gap + jacobian . (u - u now) >= 0.
struct Constraint {
  std::vector<Eigen::Index> dofs;  // of all nodes
  std::vector<double> jacobian;
  double gap = 0.0;
  std::size_t tool = 0;
  Vec3 direction = Vec3::Zero();  // of the force on the tool
  Vec3 position = Vec3::Zero();
};

/// What makes a constraint the same one in the next iteration: tool, place on the tool, nodes.
using Feature = std::pair<std::pair<std::size_t, std::size_t>, std::vector<Index>>;
using Constraints = std::map<Feature, Constraint>;

double value(const Constraint& constraint, const Eigen::VectorXd& change) {
  double gap = constraint.gap;
  for (std::size_t k = 0; k < constraint.dofs.size(); ++k)
    gap += constraint.jacobian[k] * change[constraint.dofs[k]];
  return gap;
}

/// K of the free dofs and its factor.
class WholeMesh {
 public:
  explicit WholeMesh(const Model& model) : K_(test::assemble_stiffness(model)) {
    for (Eigen::Index dof = 0; dof < K_.rows(); ++dof) {
      if (model.fixed[static_cast<std::size_t>(dof / model.dimension())] == 0) free_.push_back(dof);
    }
    factor_.compute(Eigen::MatrixXd(K_(free_, free_)).sparseView());
  }

  [[nodiscard]] Eigen::Index dofs() const { return K_.rows(); }

  /// Displacement by a force on one constraint's dofs; fixed ones do not move.
  [[nodiscard]] Eigen::VectorXd response(const Constraint& constraint) const {
    Eigen::VectorXd f = Eigen::VectorXd::Zero(dofs());
    for (std::size_t k = 0; k < constraint.dofs.size(); ++k) f[constraint.dofs[k]] += constraint.jacobian[k];
    Eigen::VectorXd u = Eigen::VectorXd::Zero(dofs());
    const Eigen::VectorXd f_free = f(free_);
    u(free_) = Eigen::VectorXd(factor_.solve(f_free));
    return u;
  }

  /// Forces on the free dofs that hold the body at u; 0 at fixed ones.
  [[nodiscard]] Eigen::VectorXd force(const Eigen::VectorXd& u) const {
    Eigen::VectorXd f = Eigen::VectorXd::Zero(dofs());
    f(free_) = Eigen::VectorXd((K_ * u)(free_));
    return f;
  }

 private:
  Eigen::MatrixXd K_;
  std::vector<Eigen::Index> free_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

/// lambda >= 0, b + W lambda >= 0, one of them zero, by block principal pivoting (Judice & Pires 1994): all
/// rows on the wrong side change sides, and where they do not become fewer the first of them alone (Murty
/// 1974), which ends for definite W. `closed` is where it begins.
Eigen::VectorXd solve_complementarity(const Eigen::MatrixXd& W, const Eigen::VectorXd& b,
                                      std::vector<bool> closed) {
  constexpr double rounding = 1e-15;
  std::size_t fewest = closed.size() + 1;
  int tries = 0;
  for (int pivot = 0; pivot < 10000; ++pivot) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < b.size(); ++i) {
      if (closed[static_cast<std::size_t>(i)]) rows.push_back(i);
    }
    Eigen::VectorXd lambda = Eigen::VectorXd::Zero(b.size());
    lambda(rows) = Eigen::VectorXd(Eigen::MatrixXd(W(rows, rows)).ldlt().solve(-b(rows)));
    const Eigen::VectorXd gap = b + W * lambda;
    std::vector<std::size_t> wrong;
    for (std::size_t i = 0; i < closed.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      if (closed[i] ? lambda[row] < 0.0 : gap[row] < -rounding) wrong.push_back(i);
    }
    if (wrong.empty()) return lambda;
    tries = wrong.size() < fewest ? 0 : tries + 1;
    fewest = std::min(fewest, wrong.size());
    if (tries > 5) wrong.resize(1);
    for (const std::size_t i : wrong) closed[i] = !closed[i];
  }
  ADD_FAILURE() << "the complementarity problem is not solved";
  return Eigen::VectorXd::Zero(b.size());
}

struct Closed {
  double lambda;
  Constraint constraint;
};

struct Solution {
  Eigen::VectorXd u;                 // [dN]
  std::map<Feature, Closed> closed;  // constraints that carry force
};

/// u of min u^T K u / 2 under the constraints, linear about `now`. Rows that turn out violated come in one
/// after the other; in the end all hold.
Solution solve_quadratic_program(const WholeMesh& mesh, const Constraints& constraints, const Solution& now) {
  std::vector<Constraints::const_iterator> rows;
  std::vector<Eigen::VectorXd> responses;
  std::vector<bool> closed;
  const auto take = [&](const Constraints::const_iterator& row, bool is_closed) {
    rows.push_back(row);
    responses.push_back(mesh.response(row->second));
    closed.push_back(is_closed);
  };
  for (auto row = constraints.begin(); row != constraints.end(); ++row) {
    const bool was_closed = now.closed.count(row->first) > 0;
    if (was_closed || row->second.gap < 0.0) take(row, was_closed);
  }
  for (;;) {
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd W(n, n);
    Eigen::VectorXd b(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      Constraint row = rows[static_cast<std::size_t>(i)]->second;
      b[i] = value(row, -now.u);
      row.gap = 0.0;
      for (Eigen::Index j = 0; j < n; ++j) W(i, j) = value(row, responses[static_cast<std::size_t>(j)]);
    }
    const Eigen::VectorXd lambda = solve_complementarity(W, b, closed);
    Solution solution{.u = Eigen::VectorXd::Zero(mesh.dofs()), .closed = {}};
    for (Eigen::Index i = 0; i < n; ++i) {
      solution.u += lambda[i] * responses[static_cast<std::size_t>(i)];
      const auto& [feature, constraint] = *rows[static_cast<std::size_t>(i)];
      if (lambda[i] > 0.0) solution.closed[feature] = {lambda[i], constraint};
    }
    const Eigen::VectorXd change = solution.u - now.u;
    const std::size_t before = rows.size();
    for (auto row = constraints.begin(); row != constraints.end(); ++row) {
      if (value(row->second, change) < -1e-13 &&
          std::find(rows.begin(), rows.begin() + n, row) == rows.begin() + n)
        take(row, true);
    }
    if (rows.size() == before) return solution;
  }
}

struct Pair {
  Eigen::VectorXd weights;  // of the piece's corners
  Vec3 on_core = Vec3::Zero();
  Vec3 on_piece = Vec3::Zero();
  double distance = infinity;
};

std::vector<Eigen::Index> chosen(unsigned choice) {
  std::vector<Eigen::Index> points;
  for (Eigen::Index k = 0; choice >> k != 0; ++k) {
    if ((choice >> k & 1U) != 0) points.push_back(k);
  }
  return points;
}

/// Where the hulls of a few points are nearest: the nearest places of the planes through each choice of
/// points, of those that lie within the hulls the nearest. The fewest points where choices are as near.
Pair nearest(const std::vector<Vec3>& core, const std::vector<Vec3>& piece) {
  const auto at = [](const std::vector<Vec3>& points, Eigen::Index k) {
    return points[static_cast<std::size_t>(k)];
  };
  Pair best;
  for (unsigned of_core = 1; of_core < 1U << core.size(); ++of_core) {
    for (unsigned of_piece = 1; of_piece < 1U << piece.size(); ++of_piece) {
      const std::vector<Eigen::Index> c = chosen(of_core);
      const std::vector<Eigen::Index> p = chosen(of_piece);
      const Eigen::VectorXd across = at(piece, p[0]) - at(core, c[0]);
      Eigen::MatrixXd along(3, std::ssize(c) + std::ssize(p) - 2);
      Eigen::Index column = 0;
      for (std::size_t k = 1; k < c.size(); ++k) along.col(column++) = at(core, c[k]) - at(core, c[0]);
      for (std::size_t k = 1; k < p.size(); ++k) along.col(column++) = at(piece, p[0]) - at(piece, p[k]);
      Eigen::VectorXd x;
      if (column > 0) {
        x = Eigen::MatrixXd(along.transpose() * along)
                .ldlt()
                .solve(Eigen::VectorXd(along.transpose() * across));
      }

      Eigen::VectorXd of_corner = Eigen::VectorXd::Zero(std::ssize(core));
      Pair pair;
      pair.weights = Eigen::VectorXd::Zero(std::ssize(piece));
      of_corner[c[0]] = 1.0;
      pair.weights[p[0]] = 1.0;
      column = 0;
      for (std::size_t k = 1; k < c.size(); ++k) of_corner[c[0]] -= of_corner[c[k]] = x[column++];
      for (std::size_t k = 1; k < p.size(); ++k) pair.weights[p[0]] -= pair.weights[p[k]] = x[column++];
      if (std::min(of_corner.minCoeff(), pair.weights.minCoeff()) < 0.0) continue;
      for (const Eigen::Index k : c) pair.on_core += of_corner[k] * at(core, k);
      for (const Eigen::Index k : p) pair.on_piece += pair.weights[k] * at(piece, k);
      pair.distance = (pair.on_core - pair.on_piece).norm();
      if (pair.distance < best.distance - 1e-14) best = pair;
    }
  }
  return best;
}

/// Where a disc and a corner, edge or triangle are nearest; nearest_on_disc_test has what it is nearest by.
Pair nearest_to_disc(const Core& core, const std::vector<Vec3>& piece) {
  const Disc disc{core.origin, core.axis, core.disc_radius};
  const NearestPoint found = piece.size() == 3
                                 ? nearest_of_disc_and_triangle(disc, piece[0], piece[1], piece[2])
                                 : nearest_of_disc_and_line(disc, piece.front(), piece.back());
  Pair pair{.weights = Eigen::VectorXd::Zero(std::ssize(piece)),
            .on_core = found.on_core,
            .on_piece = found.on_simplex,
            .distance = (found.on_core - found.on_simplex).norm()};
  for (Eigen::Index k = 0; k < pair.weights.size(); ++k)
    pair.weights[k] = piece.size() == 1 ? 1.0 : found.weights[static_cast<std::size_t>(k)];
  return pair;
}

struct Press {
  Tool tool;
  ToolPose pose;
};

/// Whether the edges between a simplex's corners are chords to a sphere, which touches the corners alone.
bool is_chord(const Model& model, const std::vector<Index>& nodes, const Tool& tool) {
  double edges = 0.0;
  const std::size_t pairs = nodes.size() == 2 ? 1 : 3;
  for (std::size_t n = 0; n < pairs; ++n) {
    const auto from = static_cast<std::size_t>(nodes[n]);
    const auto to = static_cast<std::size_t>(nodes[(n + 1) % nodes.size()]);
    edges += (model.mesh.nodes[to] - model.mesh.nodes[from]).norm();
  }
  return has_point_core(tool) && tool.radius > 3.0 * edges / static_cast<double>(pairs);
}

/// All of the surface stays out of all of the tools: each end of a core from each simplex (its corners where
/// it is a chord), and a core that is a segment or disc from each corner and edge of it, a disc from its
/// face.
Constraints constraints_at(const Model& model, const std::vector<Press>& presses, const Eigen::VectorXd& u) {
  const int d = model.dimension();
  Constraints constraints;
  const auto place_of = [&](Index node) {
    Vec3 place = model.mesh.nodes[static_cast<std::size_t>(node)];
    place.head(d) += u.segment(Eigen::Index{d} * node, d);
    return place;
  };
  const auto add_pair = [&](std::size_t tool, std::size_t place, const auto& nearest_of,
                            const std::vector<Index>& nodes) {
    std::vector<Vec3> corners;
    for (const Index node : nodes) corners.push_back(place_of(node));
    const Pair pair = nearest_of(corners);
    Constraint constraint;
    constraint.tool = tool;
    constraint.direction = (pair.on_core - pair.on_piece) / pair.distance;
    constraint.position = pair.on_piece;
    constraint.gap = pair.distance - presses[tool].tool.radius;
    Feature feature{{tool, place}, {}};
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const double weight = pair.weights[static_cast<Eigen::Index>(k)];
      if (weight == 0.0) continue;
      feature.second.push_back(nodes[k]);
      for (int axis = 0; axis < d; ++axis) {
        constraint.dofs.push_back(Eigen::Index{d} * nodes[k] + axis);
        constraint.jacobian.push_back(-weight * constraint.direction[axis]);
      }
    }
    std::sort(feature.second.begin(), feature.second.end());
    constraints.emplace(feature, constraint);
  };
  const auto add = [&](std::size_t tool, std::size_t place, const std::vector<Vec3>& core,
                       const std::vector<Index>& nodes) {
    add_pair(
        tool, place, [&](const std::vector<Vec3>& corners) { return nearest(core, corners); }, nodes);
  };
  const auto corners = static_cast<std::size_t>(d);
  for (std::size_t simplex = 0; simplex < model.surface.size(); simplex += corners) {
    const std::vector<Index> nodes(model.surface.begin() + static_cast<std::ptrdiff_t>(simplex),
                                   model.surface.begin() + static_cast<std::ptrdiff_t>(simplex + corners));
    for (std::size_t k = 0; k < presses.size(); ++k) {
      const Core core = core_of(presses[k].tool, presses[k].pose, d);
      if (is_chord(model, nodes, presses[k].tool)) {
        for (const Index node : nodes) add(k, 0, {core.origin}, {node});
        continue;
      }
      if (core.disc_radius > 0.0) {
        const auto nearest_of = [&](const std::vector<Vec3>& piece) { return nearest_to_disc(core, piece); };
        for (std::size_t n = 0; n < corners; ++n) {
          add_pair(k, 2, nearest_of, {nodes[n]});
          add_pair(k, 2, nearest_of, {nodes[n], nodes[(n + 1) % 3]});
        }
        const Vec3 normal =
            (place_of(nodes[1]) - place_of(nodes[0])).cross(place_of(nodes[2]) - place_of(nodes[0]));
        if (normal.normalized().cross(core.axis).norm() > 0.2) {
          add_pair(k, 2, nearest_of, nodes);
          continue;
        }
        for (int place = 0; place < 8; ++place) {
          const Eigen::AngleAxisd turn(0.25 * M_PI * place, core.axis);
          const Vec3 on_rim = core.origin + core.disc_radius * (turn * core.diameter);
          add(k, 3 + static_cast<std::size_t>(place), {on_rim}, nodes);
        }
        continue;
      }
      add(k, 0, {core.origin}, nodes);
      if (has_point_core(presses[k].tool)) continue;
      add(k, 1, {core.end}, nodes);
      for (std::size_t n = 0; n < corners; ++n) {
        add(k, 2, {core.origin, core.end}, {nodes[n]});
        if (d == 3) add(k, 2, {core.origin, core.end}, {nodes[n], nodes[(n + 1) % 3]});
      }
    }
  }
  return constraints;
}

/// The contact on the deformed surface: quadratic programs about the last displacement until nothing changes.
/// Triangles tilt, which the linear gap does not know: only a share of each change is taken.
Solution solve_whole_mesh(const Model& model, const WholeMesh& mesh, const std::vector<Press>& presses) {
  Solution now{.u = Eigen::VectorXd::Zero(mesh.dofs()), .closed = {}};
  double share = 0.5;
  double last_change = infinity;
  for (int iteration = 0; iteration < 300; ++iteration) {
    Solution next = solve_quadratic_program(mesh, constraints_at(model, presses, now.u), now);
    const double change = (next.u - now.u).norm();
    if (change < 1e-11) return next;
    if (change > last_change) share *= 0.8;
    last_change = change;
    now.u += share * (next.u - now.u);
    now.closed = std::move(next.closed);
  }
  ADD_FAILURE() << "the whole mesh does not come to rest";
  return now;
}

std::vector<Wrench> wrenches(const std::vector<Press>& presses, const Solution& solution) {
  std::vector<Wrench> total(presses.size());
  for (const auto& [feature, closed] : solution.closed) {
    const Constraint& row = closed.constraint;
    const Vec3 force = closed.lambda * row.direction;
    total[row.tool].force += force;
    total[row.tool].torque += (row.position - presses[row.tool].pose.position).cross(force);
  }
  return total;
}

/// Within the 1e-6 of the largest, at all surface nodes.
void expect_equal_displacements(const Body& body, const Eigen::VectorXd& u, const Eigen::VectorXd& direct) {
  const Eigen::Index d = body.dimension();
  double largest = 0.0;
  double difference = 0.0;
  for (Eigen::Index dof = 0; dof < u.size(); ++dof) {
    const double expected = direct[d * body.mesh_node(static_cast<Index>(dof / d)) + dof % d];
    largest = std::max(largest, std::abs(expected));
    difference = std::max(difference, std::abs(u[dof] - expected));
  }
  EXPECT_LE(difference, 1e-6 * largest);
}

struct PunchCase {
  const char* name;
  int dimension;
  double slope;      // of the punch's face
  bool all_touches;  // or it stands on a part of its face
};

std::ostream& operator<<(std::ostream& out, const PunchCase& punch) {
  return out << punch.name;
}

class FlatPunch : public testing::TestWithParam<PunchCase> {};

// A rigid disc on nodes: one quadratic program, as all normals are upright and stay so.
TEST_P(FlatPunch, GivesTheSamePressures) {
  const auto [name, d, slope, all_touches] = GetParam();
  const Model model = test::unit_model(d, d == 3 ? 8 : 24, Scope::surface, Precision::double_precision);
  const Body body{Model(model)};
  std::vector<Index> under;
  for (const Index stored : body.free_surface_nodes()) {
    const Vec3 offset = body.rest_position(stored) - test::top_middle(d);
    if (offset[d - 1] > -1e-9 && offset.norm() < 0.3) under.push_back(stored);
  }
  const auto n = static_cast<Index>(under.size());
  ASSERT_GE(n, 14);
  ContactProblem problem(d, n, n);
  Constraints constraints;
  std::vector<double> blocks(under.size() * static_cast<std::size_t>(d * d));
  for (Index i = 0; i < n; ++i) {
    const Index stored = under[static_cast<std::size_t>(i)];
    const double gap = slope * (body.rest_position(stored) - test::top_middle(d)).x() - 0.05;
    problem.add(0.0, false);
    problem.b[static_cast<std::size_t>(i)] = gap;
    body.greens().gather(stored, under, blocks);
    for (Index j = 0; j < n; ++j)
      problem.w(i, j) = blocks[static_cast<std::size_t>((d - 1) * d * n + d * j + d - 1)];
    constraints[{{0, 0}, {i}}] = {
        .dofs = {Eigen::Index{d} * body.mesh_node(stored) + d - 1}, .jacobian = {-1.0}, .gap = gap};
  }
  ActiveSet active_set(n);
  ASSERT_TRUE(active_set.solve(problem));

  const WholeMesh mesh(model);
  const Solution direct =
      solve_quadratic_program(mesh, constraints, {.u = Eigen::VectorXd::Zero(mesh.dofs()), .closed = {}});
  EXPECT_EQ(std::ssize(direct.closed) == n, all_touches);
  double force = 0.0;
  double expected_force = 0.0;
  double largest = 0.0;
  for (const auto& [feature, closed] : direct.closed) largest = std::max(largest, closed.lambda);
  std::vector<double> f(under.size() * static_cast<std::size_t>(d));
  for (Index i = 0; i < n; ++i) {
    const double lambda = problem.lambda[static_cast<std::size_t>(i)];
    const auto found = direct.closed.find({{0, 0}, {i}});
    const double expected = found == direct.closed.end() ? 0.0 : found->second.lambda;
    EXPECT_NEAR(lambda, expected, 1e-6 * largest);
    force += lambda;
    expected_force += expected;
    f[static_cast<std::size_t>(d * i + d - 1)] = -lambda;
  }
  EXPECT_GT(expected_force, 0.01);
  EXPECT_NEAR(force, expected_force, 1e-6 * expected_force);
  Eigen::VectorXd u(body.greens().order());
  body.greens().displacement(under, f, {u.data(), static_cast<std::size_t>(u.size())});
  expect_equal_displacements(body, u, direct.u);
}

INSTANTIATE_TEST_SUITE_P(Cases, FlatPunch,
                         testing::Values(PunchCase{"flat", 3, 0.0, true}, PunchCase{"tilted", 3, 0.2, false},
                                         PunchCase{"flat_in_the_plane", 2, 0.0, true},
                                         PunchCase{"tilted_in_the_plane", 2, 0.2, false}),
                         [](const testing::TestParamInfo<PunchCase>& punch) {
                           return std::string(punch.param.name);
                         });

struct ContactCase {
  const char* name;
  ElementType element;
  int cells;
  std::vector<Press> presses;
  int least_contacts;
};

std::ostream& operator<<(std::ostream& out, const ContactCase& contact) {
  return out << contact.name;
}

class WholeMeshContact : public testing::TestWithParam<ContactCase> {};

TEST_P(WholeMeshContact, GivesTheSameForcesAndDisplacements) {
  const ContactCase& contact = GetParam();
  const Model model =
      test::unit_model(contact.element, contact.cells, Scope::surface, Precision::double_precision);
  const int d = model.dimension();
  const Body body{Model(model)};

  std::vector<Tool> tools;
  std::vector<ToolPose> away;
  std::vector<ToolPose> poses;
  for (const Press& press : contact.presses) {
    tools.push_back(press.tool);
    poses.push_back(press.pose);
    away.push_back(press.pose);
    away.back().position += 0.3 * test::upright(d, 0.0, 0.0, 1.0);
  }
  State state(body, {.tools = tools, .max_contacts = 256});
  step(body, state, away);
  StepStatus status = StepStatus::ok;
  for (int tick = 0; tick < 80; ++tick) status = step(body, state, poses);
  ASSERT_EQ(status, StepStatus::ok);

  const WholeMesh mesh(model);
  const Solution direct = solve_whole_mesh(model, mesh, contact.presses);
  EXPECT_GE(std::ssize(direct.closed), contact.least_contacts);
  const std::vector<Wrench> expected = wrenches(contact.presses, direct);
  for (std::size_t k = 0; k < tools.size(); ++k) {
    const Wrench& wrench = state.tools[k].contact_wrench;
    const double scale = expected[k].force.norm();
    EXPECT_GT(scale, 1e-3);
    EXPECT_LE((wrench.force - expected[k].force).norm(), 1e-6 * scale);
    EXPECT_LE((wrench.torque - expected[k].torque).norm(), 1e-6 * scale * extent(tools[k]));
  }

  Eigen::VectorXd u(body.greens().order());
  surface_displacement(body, state, {u.data(), static_cast<std::size_t>(u.size())});
  Eigen::VectorXd f = Eigen::VectorXd::Zero(mesh.dofs());
  for (std::size_t k = 0; k < state.surface.near.load().nodes().size(); ++k) {
    const Index node = body.mesh_node(state.surface.near.load().nodes()[k]);
    for (int axis = 0; axis < d; ++axis) {
      f[Eigen::Index{d} * node + axis] =
          state.surface.near.load()
              .forces()[static_cast<std::size_t>(d) * k + static_cast<std::size_t>(axis)];
    }
  }
  const Eigen::VectorXd f_direct = mesh.force(direct.u);
  EXPECT_LE((f - f_direct).lpNorm<Eigen::Infinity>(), 1e-6 * f_direct.lpNorm<Eigen::Infinity>());
  expect_equal_displacements(body, u, direct.u);
}

Press sphere(int dimension, double radius, double x, double y, double depth) {
  return {.tool = {.radius = radius, .hand_over = infinity},
          .pose = {.position = test::upright(dimension, x, y, 1.0 + radius - depth)}};
}

/// Lying on the top, `steep` radians lower at its far end; the origin at (x, y).
Press capsule(int dimension, double radius, double length, double x, double y, double turned, double steep,
              double depth) {
  const Vec3 axis = test::upright(dimension, std::cos(steep) * std::cos(turned),
                                  std::cos(steep) * std::sin(turned), -std::sin(steep));
  ToolPose pose;
  pose.position = test::upright(dimension, x, y, 1.0 + radius - depth);
  pose.orientation = Eigen::Quaterniond::FromTwoVectors(dimension == 3 ? Vec3::UnitZ() : Vec3::UnitY(), axis);
  return {.tool = {.radius = radius, .length = length, .hand_over = infinity}, .pose = pose};
}

/// On the top, `steep` radians lower on the side that `turned` says; its middle at (x, y), its face there
/// `depth` under the top.
Press disc(int dimension, double radius, double edge, double x, double y, double turned, double steep,
           double depth) {
  const Vec3 axis = test::upright(dimension, std::sin(steep) * std::cos(turned),
                                  std::sin(steep) * std::sin(turned), std::cos(steep));
  ToolPose pose;
  pose.position = test::upright(dimension, x, y, 1.0 + edge - depth);
  pose.orientation = Eigen::Quaterniond::FromTwoVectors(dimension == 3 ? Vec3::UnitZ() : Vec3::UnitY(), axis);
  return {.tool = {.radius = edge, .disc_radius = radius, .hand_over = infinity}, .pose = pose};
}

std::vector<ContactCase> contact_cases() {
  return {
      {"two_spheres",
       ElementType::tet4,
       8,
       {sphere(3, 0.5, 0.3, 0.37, 0.08), sphere(3, 0.35, 0.72, 0.61, 0.06)},
       8},
      {"two_circles",
       ElementType::quad4,
       24,
       {sphere(2, 0.24, 0.31, 0.0, 0.06), sphere(2, 0.2, 0.77, 0.0, 0.05)},
       6},
      {"two_large_circles",  // against the edges
       ElementType::quad4,
       24,
       {sphere(2, 0.5, 0.31, 0.0, 0.06), sphere(2, 0.3, 0.77, 0.0, 0.05)},
       8},
      {"capsule", ElementType::tet4, 8, {capsule(3, 0.25, 0.4, 0.28, 0.33, 0.6, 0.1, 0.04)}, 7},
      {"capsule_in_the_plane", ElementType::quad4, 24, {capsule(2, 0.2, 0.3, 0.33, 0.0, 0.0, 0.1, 0.03)}, 11},
      {"disc", ElementType::tet4, 8, {disc(3, 0.32, 0.05, 0.47, 0.56, 0.7, 0.005, 0.02)}, 12},
      {"tilted_disc", ElementType::tet4, 8, {disc(3, 0.32, 0.06, 0.47, 0.56, 0.7, 0.06, 0.01)}, 5},
      {"disc_on_its_edge", ElementType::tet4, 8, {disc(3, 0.3, 0.1, 0.4, 0.53, 0.4, 0.9, -0.11)}, 3},
      {"small_disc", ElementType::tet4, 4, {disc(3, 0.12, 0.04, 0.33, 0.56, 0.3, 0.3, 0.005)}, 1},
      {"disc_in_the_plane", ElementType::quad4, 24, {disc(2, 0.27, 0.05, 0.46, 0.0, 0.0, 0.03, 0.02)}, 6},
      {"capsule_along_edges", ElementType::tet4, 8, {capsule(3, 0.25, 0.4, 0.3, 0.5, 0.0, 0.05, 0.04)}, 7},
  };
}

INSTANTIATE_TEST_SUITE_P(Cases, WholeMeshContact, testing::ValuesIn(contact_cases()),
                         [](const testing::TestParamInfo<ContactCase>& contact) {
                           return std::string(contact.param.name);
                         });

}  // namespace
}  // namespace palpate::contact_qp_test
