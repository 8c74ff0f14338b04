#include "runtime/core/body/coarse_field.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {
namespace {

constexpr double least_extent = 1e-3;  // of a grid across a layer of nodes, of its longest
constexpr double least_share =
    1e-8;  // of a node's values that others do not have; less is no field of its own

/// Lattice nodes along an axis.
Index along(int dimension, const std::array<Index, 3>& cells, int axis) {
  return axis < dimension ? 2 * cells[static_cast<std::size_t>(axis)] + 1 : 1;
}

/// Renumbers the nodes whose values at some points are independent, given their Gram matrix; others become
/// -1.
Index number_independent(const Eigen::MatrixXd& gram, std::vector<Index>& number) {
  const Eigen::LDLT<Eigen::MatrixXd> pivoted(gram);
  Eigen::VectorXi order =
      Eigen::VectorXi::LinSpaced(static_cast<int>(gram.rows()), 0, static_cast<int>(gram.rows()) - 1);
  order = pivoted.transpositionsP() * order;
  const double least = least_share * pivoted.vectorD().cwiseAbs().maxCoeff();
  std::vector<Index> kept(number.size(), -1);
  for (Eigen::Index k = 0; k < gram.rows(); ++k)
    if (pivoted.vectorD()[k] > least) kept[static_cast<std::size_t>(order[k])] = 0;
  Index count = 0;
  for (Index& k : kept)
    if (k == 0) k = count++;
  number = std::move(kept);
  return count;
}

}  // namespace

CoarseField::CoarseField(int dimension, const Vec3& low, const Vec3& high, const std::array<Index, 3>& cells,
                         std::span<const Vec3> points)
    : dimension_(dimension), low_(low), edge_(Vec3::Ones()), cells_(cells) {
  for (int axis = 0; axis < dimension; ++axis)
    edge_[axis] = (high - low)[axis] / static_cast<double>(cells[static_cast<std::size_t>(axis)]);
  const Index nx = along(dimension, cells, 0), ny = along(dimension, cells, 1);
  std::vector<Index> number(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
                                static_cast<std::size_t>(along(dimension, cells, 2)),
                            -1);
  const Index layers = dimension == 3 ? cells[2] : 1;
  for (Index cell = 0; cell < cells[0] * cells[1] * layers; ++cell) {  // by nodes of the whole lattice
    const Index i = cell % cells[0], j = cell / cells[0] % cells[1], k = cell / cells[0] / cells[1];
    for (Index n = 0; n < 27; ++n) {
      const bool is_there = dimension == 3 || n < 9;
      const Index x = 2 * i + n % 3, y = 2 * j + n / 3 % 3, z = 2 * k + n / 9;
      node_.push_back(is_there ? (z * ny + y) * nx + x : -1);
    }
  }
  for (const Vec3& x : points) {  // the nodes of cells that hold some
    for_each_node(place(x), [&](Index node, double, const Vec3&) {
      if (number[static_cast<std::size_t>(node)] < 0) number[static_cast<std::size_t>(node)] = nodes_++;
    });
  }
  for (Index& node : node_)
    if (node >= 0) node = number[static_cast<std::size_t>(node)];
}

void CoarseField::drop_dependent(std::span<const Vec3> points) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(nodes_, nodes_);
  std::array<std::pair<Index, double>, 27> weights;
  for (const Vec3& x : points) {
    std::size_t count = 0;
    for_each_node(place(x), [&](Index node, double weight, const Vec3&) {
      weights[count++] = {node, weight};
    });
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = 0; b < count; ++b)
        gram(weights[a].first, weights[b].first) += weights[a].second * weights[b].second;
    }
  }
  std::vector<Index> kept(static_cast<std::size_t>(nodes_));
  nodes_ = number_independent(gram, kept);
  for (Index& node : node_)
    if (node >= 0) node = kept[static_cast<std::size_t>(node)];
}

namespace {

/// A field of some numbers at each node, and its slopes.
template <int numbers>
struct Sums {
  using Numbers = Eigen::Array<double, numbers, 1>;
  Numbers value = Numbers::Zero(), by_x = value, by_y = value, by_z = value;
};

/// Polynomials of each axis in turn: a sum over nodes of one axis, of these sums over the next, and so on.
template <int numbers>
Sums<numbers> sums_of(int planes, const Index* node, const CoarsePlace& at, const double* q) noexcept {
  using Numbers = typename Sums<numbers>::Numbers;
  Sums<numbers> sum;
  for (int c = 0; c < planes; ++c) {
    Numbers plane = Numbers::Zero(), along_x = plane, along_y = plane;
    for (int b = 0; b < 3; ++b) {
      Numbers line = Numbers::Zero(), slope = line;
      for (int a = 0; a < 3; ++a) {
        const Index number = node[9 * c + 3 * b + a];
        if (number < 0) continue;
        const Eigen::Map<const Numbers> of_node(q + std::ptrdiff_t{numbers} * number);
        line += at.value[a].x() * of_node;
        slope += at.slope[a].x() * of_node;
      }
      plane += at.value[b].y() * line;
      along_x += at.value[b].y() * slope;
      along_y += at.slope[b].y() * line;
    }
    sum.value += at.value[c].z() * plane;
    sum.by_x += at.value[c].z() * along_x;
    sum.by_y += at.value[c].z() * along_y;
    sum.by_z += at.slope[c].z() * plane;
  }
  return sum;
}

/// The first d numbers as a displacement.
template <int d, int numbers>
CoarseValue displacement_of(const Sums<numbers>& sum) noexcept {
  CoarseValue at;
  at.u.head<d>() = sum.value.template head<d>();
  at.gradient.col(0).head<d>() = sum.by_x.template head<d>();
  at.gradient.col(1).head<d>() = sum.by_y.template head<d>();
  at.gradient.col(2).head<d>() = sum.by_z.template head<d>();
  return at;
}

}  // namespace

CoarseValue CoarseField::value(const CoarsePlace& at, std::span<const double> q) const noexcept {
  const Index* const node = nodes_of(at);
  return dimension_ == 3 ? displacement_of<3>(sums_of<3>(3, node, at, q.data()))
                         : displacement_of<2>(sums_of<2>(1, node, at, q.data()));
}

std::pair<CoarseValue, Vec3> CoarseField::both(const CoarsePlace& at,
                                               std::span<const double> q_and_p) const noexcept {
  const Sums<8> sum = sums_of<8>(3, nodes_of(at), at, q_and_p.data());
  return {displacement_of<3>(sum), sum.value.segment<3>(4)};
}

CoarsePlace CoarseField::place(const Vec3& x) const noexcept {
  CoarsePlace at;
  at.x = x;
  Index cell = 0;
  for (int axis = 2; axis >= 0; --axis) {
    for (auto* all : {&at.value, &at.slope})
      for (Vec3& of_node : *all) of_node[axis] = 0.0;
    at.value[0][axis] = 1.0;  // of an axis that is not there
    if (axis >= dimension_) continue;
    const Index last = cells_[static_cast<std::size_t>(axis)] - 1;
    const double in_cells = (x[axis] - low_[axis]) / edge_[axis];
    const Index k = std::clamp(static_cast<Index>(std::floor(in_cells)), Index{0}, last);
    const double s = in_cells - static_cast<double>(k), per = 1.0 / edge_[axis];
    at.in_cell[axis] = 2.0 * s - 1.0;
    at.value[0][axis] = (1.0 - s) * (1.0 - 2.0 * s);
    at.value[1][axis] = 4.0 * s * (1.0 - s);
    at.value[2][axis] = s * (2.0 * s - 1.0);
    at.slope[0][axis] = (4.0 * s - 3.0) * per;
    at.slope[1][axis] = (4.0 - 8.0 * s) * per;
    at.slope[2][axis] = (4.0 * s - 1.0) * per;
    cell = cell * (last + 1) + k;
  }
  at.cell = cell;
  return at;
}

CoarseField coarse_field(int dimension, std::span<const Vec3> nodes, Index most_dofs) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : nodes) box.extend(x);
  const double longest = box.sizes().maxCoeff();
  for (int axis = 0; axis < dimension; ++axis)  // one layer of free nodes has no extent across
    if (box.sizes()[axis] < least_extent * longest)
      box.max()[axis] = box.min()[axis] + least_extent * longest;
  const auto field_of = [&](const std::array<Index, 3>& cells) {
    return CoarseField(dimension, box.min(), box.max(), cells, nodes);
  };
  std::array<Index, 3> cells = {1, 1, 1}, best = cells;
  for (int power = 0; power < 77; ++power) {  // edges from the whole body down to a fiftieth of it
    const double edge = longest * std::pow(0.95, power);
    std::array<Index, 3> finer = {1, 1, 1};
    for (int axis = 0; axis < dimension; ++axis)
      finer[static_cast<std::size_t>(axis)] =
          std::max(Index{1}, static_cast<Index>(std::lround(box.sizes()[axis] / edge)));
    if (finer == cells) continue;
    cells = finer;
    CoarseField next = field_of(cells);
    if (next.dofs() > most_dofs) next.drop_dependent(nodes);
    if (next.dofs() > most_dofs) break;
    best = cells;
  }
  CoarseField field = field_of(best);
  field.drop_dependent(nodes);
  return field;
}

}  // namespace palpate
