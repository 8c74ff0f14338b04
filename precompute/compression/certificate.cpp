#include "precompute/compression/certificate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <random>

#include "matrices/error_bound.h"
#include "matrices/hierarchical_product.h"
#include "precompute/compression/selected_solver.h"
#include "precompute/numerics/touches.h"

namespace palpate {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr Index near_share = 16;  // one in this many of the nodes near a place is touched

/// Nodes of the k-th touch; the first is random.
std::vector<Index> touched_nodes(std::int64_t k, std::span<const Vec3> points,
                                 std::span<const Index> touchable, Index count, std::mt19937_64& random) {
  const auto all = static_cast<Index>(touchable.size());
  count = std::min(count, all);
  const Index centre = touchable[random() % touchable.size()];
  const Index among = k % 3 == 0 ? count : k % 3 == 1 ? std::min(near_share * count, all) : all;
  std::vector<Index> nodes(touchable.begin(), touchable.end());
  std::partial_sort(nodes.begin(), nodes.begin() + among, nodes.end(), [&](Index a, Index b) {
    const Vec3& c = points[static_cast<std::size_t>(centre)];
    const double da = (points[static_cast<std::size_t>(a)] - c).squaredNorm(),
                 db = (points[static_cast<std::size_t>(b)] - c).squaredNorm();
    return da < db || (da == db && a < b);
  });
  for (Index chosen = 1; chosen < count; ++chosen) {  // Fisher and Yates, the centre stays
    const auto other = chosen + static_cast<Index>(random() % static_cast<std::uint64_t>(among - chosen));
    std::swap(nodes[static_cast<std::size_t>(chosen)], nodes[static_cast<std::size_t>(other)]);
  }
  nodes.resize(static_cast<std::size_t>(count));
  return nodes;
}

/// Error of a touch's total force divided by its bound; 0 if the bound is 0.
double bound_share(const HierarchicalMatrix& matrix, std::span<const Index> nodes, const Rows& exact,
                   const Rows& C, const Eigen::MatrixXd& u) {
  const int d = matrix.dimension;
  const Eigen::LLT<Eigen::MatrixXd> reference(exact), stored(C);
  const Eigen::MatrixXd f_0 = reference.solve(u), f = stored.solve(u);
  ErrorBound bound(matrix, nodes.size());
  double largest = 0.0;
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    bound.carry(nodes, {f.col(k).data(), static_cast<std::size_t>(f.rows())});
    for (int axis = 0; axis < d; ++axis) {
      // The first displacements are motions by 1 along the axes.
      const double most = bound.work(nodes, {f.col(axis).data(), static_cast<std::size_t>(f.rows())});
      double off = 0.0;
      for (Eigen::Index i = axis; i < f.rows(); i += d) off += f(i, k) - f_0(i, k);
      if (most > 0.0) largest = std::max(largest, std::abs(off) / most);
    }
  }
  return largest;
}

}  // namespace

TouchablePoints touchable_points(const Model& model, std::span<const Index> stored_nodes) {
  std::vector<bool> on_surface(model.mesh.nodes.size(), false);
  for (const Index node : model.surface) on_surface[static_cast<std::size_t>(node)] = true;
  TouchablePoints result;
  for (const Index node : stored_nodes) {
    const auto k = static_cast<std::size_t>(node);
    if (on_surface[k] && model.fixed[k] == 0)
      result.touchable.push_back(static_cast<Index>(result.points.size()));
    result.points.push_back(model.mesh.nodes[k]);
  }
  return result;
}

std::vector<TouchErrors> certify(const HierarchicalMatrix& matrix, const Factor& factor,
                                 std::span<const std::int64_t> stored_dofs, std::span<const Vec3> points,
                                 std::span<const Index> touchable, std::int64_t touches, std::uint64_t seed,
                                 Sharing& sharing, const std::function<bool(double)>& progress) {
  const SelectedSolver solver(factor);
  std::vector<SelectedSolver::Workspace> workspaces(static_cast<std::size_t>(sharing.jobs()));
  std::vector<TouchErrors> result;
  result.reserve(std::size(certified_nodes));
  for (const Index nodes : certified_nodes) result.push_back({nodes, {}});
  struct Measured {
    double error = -1.0, bound_share = 0.0;  // -1: not yet
  };
  SharedItems items;
  items.count = touchable.empty() ? 0 : touches * std::ssize(result);
  std::vector<Measured> measured(static_cast<std::size_t>(items.count));
  items.work = [&](std::int64_t item, int worker) {
    const TouchErrors& of_count = result[static_cast<std::size_t>(item % std::ssize(result))];
    std::mt19937_64 random(seed + static_cast<std::uint64_t>(item));
    const std::vector<Index> nodes =
        touched_nodes(item / std::ssize(result), points, touchable, of_count.nodes, random);
    const int d = matrix.dimension;
    std::vector<std::int64_t> dofs;
    std::vector<Vec3> arms;
    for (const Index node : nodes) {
      for (int axis = 0; axis < d; ++axis)
        dofs.push_back(stored_dofs[static_cast<std::size_t>(std::int64_t{d} * node + axis)]);
      arms.push_back(points[static_cast<std::size_t>(node)] -
                     points[static_cast<std::size_t>(nodes.front())]);
    }
    Rows exact(std::ssize(dofs), std::ssize(dofs)), C = exact;
    solver.solve(dofs, dofs, workspaces[static_cast<std::size_t>(worker)],
                 {exact.data(), static_cast<std::size_t>(exact.size())});
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      gather_blocks(matrix, nodes[k], nodes,
                    {C.data() + std::int64_t{d} * static_cast<std::int64_t>(k) * C.cols(),
                     static_cast<std::size_t>(d * C.cols())});
    }
    const Eigen::MatrixXd u = touch_displacements(arms, d, random);
    measured[static_cast<std::size_t>(item)] = {touch_error(exact.cast<long double>(), C, u, d),
                                                bound_share(matrix, nodes, exact, C, u)};
  };
  items.carry = [&](std::int64_t item, Parcel& results) {
    results.carry(measured[static_cast<std::size_t>(item)].error);
    results.carry(measured[static_cast<std::size_t>(item)].bound_share);
  };
  items.done = progress;
  sharing.for_each(items);
  for (std::size_t item = 0; item < measured.size(); ++item) {
    if (measured[item].error < 0.0) continue;
    TouchErrors& of_count = result[item % result.size()];
    of_count.errors.push_back(measured[item].error);
    if (measured[item].bound_share > 0.0) of_count.bound_shares.push_back(measured[item].bound_share);
  }
  for (TouchErrors& of_count : result) {
    std::sort(of_count.errors.begin(), of_count.errors.end());
    std::sort(of_count.bound_shares.begin(), of_count.bound_shares.end());
  }
  return result;
}

}  // namespace palpate
