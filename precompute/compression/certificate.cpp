#include "precompute/compression/certificate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

#include "matrices/error_bound.h"
#include "matrices/hierarchical_product.h"
#include "precompute/compression/selected_solver.h"
#include "precompute/numerics/touches.h"

namespace palpate {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr Index near_share = 16;    // one in this many of the nodes near a place is touched
constexpr double converged = 1e-8;  // of exact forces, in the norm of energy
constexpr int most_steps = 100;

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

/// Search for the forces f [d m, displacements] with C_0 f = u, by conjugate gradients with a C close to C_0
/// as preconditioner. The caller multiplies by C_0, for several touches at once, as that is quicker.
class ForceSearch {
 public:
  ForceSearch(const Rows& C, const Eigen::MatrixXd& u)
      : stored_(C), f_(Rows::Zero(u.rows(), u.cols())), rest_(u), direction_(f_) {
    if (has_begun()) turn();
  }

  [[nodiscard]] bool has_begun() const {
    return stored_.info() == Eigen::Success;
  }  ///< false: C is indefinite
  [[nodiscard]] bool is_over() const { return !has_begun() || over_; }
  [[nodiscard]] const Rows& direction() const { return direction_; }
  [[nodiscard]] const Rows& forces() const { return f_; }
  [[nodiscard]] Eigen::MatrixXd stored_forces(const Eigen::MatrixXd& u) const { return stored_.solve(u); }

  /// Gets C_0 of the direction.
  void go_on(const Rows& displaced) {
    const Eigen::ArrayXd curvature = direction_.cwiseProduct(displaced).colwise().sum().transpose();
    const Eigen::VectorXd length = (energy_ > 0.0).select(energy_ / curvature, 0.0).matrix();
    f_ += direction_ * length.asDiagonal();
    rest_ -= displaced * length.asDiagonal();
    turn();
  }

 private:
  void turn() {
    const Rows z = stored_.solve(rest_);
    const Eigen::ArrayXd before = energy_.max(std::numeric_limits<double>::min());
    energy_ = rest_.cwiseProduct(z).colwise().sum().transpose();
    if (first_.size() == 0) {
      first_ = energy_;
      direction_ = z;
    } else {
      direction_ = z + direction_ * (energy_ / before).matrix().asDiagonal();
    }
    over_ = (energy_ <= converged * converged * first_).all();
  }

  Eigen::LLT<Eigen::MatrixXd> stored_;
  Rows f_, rest_, direction_;
  Eigen::ArrayXd energy_, first_;  // [displacements]
  bool over_ = false;
};

/// A touch of the certificate.
struct Touch {
  std::vector<Index> nodes;
  std::vector<std::int64_t> dofs;
  Eigen::MatrixXd u;
  ForceSearch search;
};

/// Multiplies the directions of all touches that are not over, in one solve. False if there are none.
bool go_on(std::span<Touch> touches, const SelectedSolver& solver, SelectedSolver::Workspace& workspace) {
  std::vector<std::int64_t> dofs;
  std::int64_t columns = 0;
  for (const Touch& touch : touches) {
    if (touch.search.is_over()) continue;
    dofs.insert(dofs.end(), touch.dofs.begin(), touch.dofs.end());
    columns += touch.u.cols();
  }
  if (dofs.empty()) return false;
  Rows f = Rows::Zero(std::ssize(dofs), columns), displaced = f;
  const auto for_each_block = [&](auto&& use) {
    Eigen::Index row = 0, column = 0;
    for (Touch& touch : touches) {
      if (touch.search.is_over()) continue;
      const Eigen::Index rows = touch.u.rows(), width = touch.u.cols();
      use(touch, row, column, rows, width);
      row += rows;
      column += width;
    }
  };
  for_each_block([&](const Touch& touch, auto... block) { f.block(block...) = touch.search.direction(); });
  solver.multiply(dofs, columns, {f.data(), static_cast<std::size_t>(f.size())}, workspace,
                  {displaced.data(), static_cast<std::size_t>(displaced.size())});
  for_each_block([&](Touch& touch, auto... block) { touch.search.go_on(displaced.block(block...)); });
  return true;
}

/// Error of a touch's total force divided by its bound; 0 if the bound is 0. f and f_0: stored and exact
/// forces by the touch's displacements.
double bound_share(const HierarchicalMatrix& matrix, std::span<const Index> nodes, const Eigen::MatrixXd& f,
                   const Rows& f_0) {
  const int d = matrix.dimension;
  ErrorBound bound(matrix, nodes.size());
  double largest = 0.0;
  for (Eigen::Index k = 0; k < f.cols(); ++k) {
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

namespace {

/// A random touch of these nodes.
Touch chosen_touch(const HierarchicalMatrix& matrix, std::span<const std::int64_t> stored_dofs,
                   std::span<const Vec3> points, const std::vector<Index>& nodes, std::mt19937_64& random) {
  const int d = matrix.dimension;
  std::vector<std::int64_t> dofs;
  std::vector<Vec3> arms;
  for (const Index node : nodes) {
    for (int axis = 0; axis < d; ++axis)
      dofs.push_back(stored_dofs[static_cast<std::size_t>(std::int64_t{d} * node + axis)]);
    arms.push_back(points[static_cast<std::size_t>(node)] - points[static_cast<std::size_t>(nodes.front())]);
  }
  Rows C(std::ssize(dofs), std::ssize(dofs));
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    gather_blocks(matrix, nodes[i], nodes,
                  {C.data() + std::int64_t{d} * static_cast<std::int64_t>(i) * C.cols(),
                   static_cast<std::size_t>(d * C.cols())});
  }
  const Eigen::MatrixXd u = touch_displacements(arms, d, random);
  return {nodes, dofs, u, ForceSearch(C, u)};
}

struct Measured {
  double error = -1.0, bound_share = 0.0;  // -1: not yet
};

Measured measured_errors(const HierarchicalMatrix& matrix, const Touch& touch) {
  const auto& [nodes, dofs, u, search] = touch;
  if (!search.has_begun() || !search.is_over()) return {std::numeric_limits<double>::infinity(), 0.0};
  const Eigen::MatrixXd f = search.stored_forces(u);
  return {force_error(f.cast<long double>(), search.forces().cast<long double>(), matrix.dimension),
          bound_share(matrix, nodes, f, search.forces())};
}

}  // namespace

std::vector<TouchErrors> certify(const HierarchicalMatrix& matrix, const Factor& factor,
                                 std::span<const std::int64_t> stored_dofs, std::span<const Vec3> points,
                                 std::span<const Index> touchable, std::int64_t touches, std::uint64_t seed,
                                 Sharing& sharing, const std::function<bool(double)>& progress) {
  const SelectedSolver solver(factor, sharing.jobs());
  std::vector<SelectedSolver::Workspace> workspaces(static_cast<std::size_t>(sharing.jobs()));
  std::vector<TouchErrors> result;
  result.reserve(std::size(certified_nodes));
  for (const Index nodes : certified_nodes) result.push_back({nodes, {}});
  const std::size_t counts = result.size();
  std::vector<Measured> measured(touchable.empty() ? 0 : static_cast<std::size_t>(touches) * counts);
  const auto chosen = [&](std::int64_t k, std::size_t count) {
    std::mt19937_64 random(seed + static_cast<std::uint64_t>(k) * counts + count);
    return chosen_touch(matrix, stored_dofs, points,
                        touched_nodes(k, points, touchable, result[count].nodes, random), random);
  };
  SharedItems items;  // one touch of each number of nodes
  items.count = std::ssize(measured) / std::ssize(result);
  items.work = [&](std::int64_t k, int worker) {
    std::vector<Touch> together;
    for (std::size_t count = 0; count < counts; ++count) together.push_back(chosen(k, count));
    for (int step = 0; step < most_steps; ++step)
      if (!go_on(together, solver, workspaces[static_cast<std::size_t>(worker)])) break;
    for (std::size_t count = 0; count < counts; ++count)
      measured[static_cast<std::size_t>(k) * counts + count] = measured_errors(matrix, together[count]);
  };
  items.carry = [&](std::int64_t k, Parcel& results) {
    for (std::size_t count = 0; count < counts; ++count) {
      Measured& of_touch = measured[static_cast<std::size_t>(k) * counts + count];
      results.carry(of_touch.error);
      results.carry(of_touch.bound_share);
    }
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
