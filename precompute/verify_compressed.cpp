#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <thread>

#include "matrices/hierarchical_product.h"
#include "precompute/compression/certificate.h"
#include "precompute/compression/selected_solver.h"
#include "precompute/machine/allotment.h"
#include "precompute/machine/blas_room.h"
#include "precompute/verify_matrix.h"

namespace palpate {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;

constexpr std::int64_t verified_touches = 16;  // per number of nodes
constexpr std::uint64_t seed = 1 << 20;        // differs from the certificate's

std::vector<Check> check_probes(const Model& model) {
  const double tolerance = model.compressed->tolerance;
  Check probes{"probes", 0.0, tolerance}, energy{"energy", 0.0, tolerance};
  std::vector<Index> nodes(model.stored_nodes.size());
  std::iota(nodes.begin(), nodes.end(), 0);
  for (const Probe& probe : model.probes) {
    Vector Xi_f(std::ssize(probe.force));
    const NodeRange all{0, model.compressed->tree.nodes};
    displace(*model.compressed, nodes, probe.force, {&all, 1}, {Xi_f.data(), probe.force.size()});
    const Eigen::Map<const Vector> f(probe.force.data(), Xi_f.size()),
        u(probe.displacement.data(), Xi_f.size());
    const double work = f.dot(Xi_f);
    probes.error = std::max(probes.error, (Xi_f - u).lpNorm<Eigen::Infinity>() / u.lpNorm<Eigen::Infinity>());
    energy.error = std::max(energy.error, work > 0.0 ? std::abs(work - f.dot(u)) / work : INFINITY);
  }
  return {probes, energy};
}

/// Checks columns of random nodes, their near and their far part.
std::vector<Check> check_columns(const Model& model, const Factor& factor,
                                 std::span<const std::int64_t> stored_dofs, double solver, int samples) {
  const HierarchicalMatrix& matrix = *model.compressed;
  Check near{"near pairs", 0.0,
             2.0 * unit_roundoff(Precision::single_precision) + sum_rounding + solver_safety * solver},
      far{"far pairs", 0.0, matrix.tolerance};
  const SelectedSolver solve(factor);
  SelectedSolver::Workspace workspace;
  const Eigen::Index d = matrix.dimension;
  std::vector<Index> nodes(model.stored_nodes.size());
  std::iota(nodes.begin(), nodes.end(), 0);
  Rows blocks(d, matrix.order()), exact(matrix.order(), d);
  std::mt19937_64 random(7);
  for (int sample = 0; sample < samples; ++sample) {
    const auto node = static_cast<Index>(random() % nodes.size());
    gather_blocks(matrix, node, nodes, {blocks.data(), static_cast<std::size_t>(blocks.size())});
    solve.solve(stored_dofs,
                stored_dofs.subspan(static_cast<std::size_t>(d * node), static_cast<std::size_t>(d)),
                workspace, {exact.data(), static_cast<std::size_t>(exact.size())});
    const double largest = exact.cwiseAbs().maxCoeff();
    const std::size_t leaf = static_cast<std::size_t>(matrix.tree.leaf_of(node) - matrix.tree.first_leaf());
    std::vector<bool> is_near(nodes.size(), false);
    for (std::int64_t p = matrix.near_from[leaf]; p < matrix.near_from[leaf + 1]; ++p) {
      const Index other = matrix.neighbour[static_cast<std::size_t>(p)][0];
      std::fill(is_near.begin() + matrix.tree.begin(other), is_near.begin() + matrix.tree.end(other), true);
    }
    for (const Index other : nodes) {
      const double difference = (blocks.middleCols(d * other, d).transpose() - exact.middleRows(d * other, d))
                                    .cwiseAbs()
                                    .maxCoeff();
      Check& check = is_near[static_cast<std::size_t>(other)] ? near : far;
      check.error = std::isnan(difference) ? INFINITY : std::max(check.error, difference / largest);
    }
  }
  return {near, far};
}

Check check_touches(const Model& model, const Factor& factor, std::span<const std::int64_t> stored_dofs) {
  const auto [points, touchable] = touchable_points(model, model.stored_nodes);
  const int jobs = threads_with_room(allotted_processors());
  take_blas_room(jobs);
  ThreadSharing threads(jobs);
  Check check{"touches", 0.0, model.compressed->tolerance};
  for (const TouchErrors& errors : certify(*model.compressed, factor, stored_dofs, points, touchable,
                                           verified_touches, seed, threads, [](double) { return true; }))
    check.error = std::max(check.error, errors.quantile(1.0));
  return check;
}

}  // namespace

std::vector<Check> verify_compressed(const Model& model, const Factor& factor,
                                     std::span<const std::int64_t> stored_dofs, double solver, int samples) {
  std::vector<Check> checks = check_probes(model);
  for (const Check& check : check_columns(model, factor, stored_dofs, solver, samples))
    checks.push_back(check);
  checks.push_back(check_touches(model, factor, stored_dofs));
  return checks;
}

}  // namespace palpate
