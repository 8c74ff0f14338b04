#include <algorithm>
#include <array>
#include <utility>

#include "runtime/core/body/greens_on_top.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::size_t turned_forces = 128;  // of a part of a product
constexpr Index turned_nodes = 64;

class TurnedGreens final : public GreensOnTop {
 public:
  TurnedGreens(std::shared_ptr<const Greens> greens, std::vector<Mat3> rotations, const Eigen::MatrixXd& left,
               const Eigen::MatrixXd& right)
      : GreensOnTop(std::move(greens)), rotations_(std::move(rotations)), left_(left), right_(right) {}

  [[nodiscard]] const Mat3& rotation(Index node) const noexcept override {
    return rotations_[static_cast<std::size_t>(node)];
  }

  void gather(Index row, std::span<const Index> columns, std::span<double> blocks) const noexcept override {
    below().gather(row, columns, blocks);
    const auto d = static_cast<Eigen::Index>(dimension());
    const auto width = d * std::ssize(columns);
    const Mat3& R = rotations_[static_cast<std::size_t>(row)];
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const Mat3& Q = rotations_[static_cast<std::size_t>(columns[k])];
      double* block = blocks.data() + d * static_cast<Eigen::Index>(k);
      Mat3 B = Mat3::Zero();
      for (Eigen::Index i = 0; i < d; ++i) {
        for (Eigen::Index j = 0; j < d; ++j) B(i, j) = block[i * width + j];
      }
      B = R * B * Q.transpose();
      for (Eigen::Index i = 0; i < d && left_.cols() > 0; ++i) {
        for (Eigen::Index j = 0; j < d; ++j)
          B(i, j) += dot(left_.row(d * row + i).data(), right_.row(d * columns[k] + j).data(), left_.cols());
      }
      for (Eigen::Index i = 0; i < d; ++i) {
        for (Eigen::Index j = 0; j < d; ++j) block[i * width + j] = B(i, j);
      }
    }
  }

  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    const auto d = static_cast<std::size_t>(dimension());
    std::array<double, std::size_t{3} * turned_forces> turned;
    std::size_t count = turn_back(nodes, f, 0, turned);
    below().displacement(nodes.first(count), {turned.data(), d * count}, ranges, u);
    for (std::size_t begin = count; begin < nodes.size(); begin += count) {
      count = turn_back(nodes, f, begin, turned);
      add_displacement(nodes.subspan(begin, count), {turned.data(), d * count}, ranges, u);
    }
    std::array<double, most_turned_terms> sum{};  // right^T f
    const Eigen::Index terms = left_.cols();
    for (std::size_t k = 0; k < f.size() && terms > 0; ++k) {
      const auto dof = static_cast<Eigen::Index>(d) * nodes[k / d] + static_cast<Eigen::Index>(k % d);
      add(right_.row(dof).data(), f[k], sum.data(), terms);
    }
    Index place = 0;
    for (const NodeRange& range : ranges) {
      for (Index node = range.first; node < range.end; ++node, ++place) {
        const Mat3& R = rotations_[static_cast<std::size_t>(node)];
        set_vector(u, dimension(), place, R * vector_at(u, dimension(), place));
        for (std::size_t axis = 0; axis < d && terms > 0; ++axis) {
          const auto dof = static_cast<Eigen::Index>(d) * node + static_cast<Eigen::Index>(axis);
          u[d * static_cast<std::size_t>(place) + axis] += dot(left_.row(dof).data(), sum.data(), terms);
        }
      }
    }
  }

 private:
  /// Forces from `begin` on, as many as fit, in the frames of their nodes; how many they are.
  std::size_t turn_back(std::span<const Index> nodes, std::span<const double> f, std::size_t begin,
                        std::span<double> turned) const noexcept {
    const std::size_t count = std::min(turned_forces, nodes.size() - begin);
    for (std::size_t k = 0; k < count; ++k) {
      const Mat3& R = rotations_[static_cast<std::size_t>(nodes[begin + k])];
      const Vec3 force = R.transpose() * vector_at(f, dimension(), static_cast<Index>(begin + k));
      set_vector(turned, dimension(), static_cast<Index>(k), force);
    }
    return count;
  }

  /// Adds what forces in the frames of their nodes do, by parts of the nodes that fit on the stack.
  void add_displacement(std::span<const Index> nodes, std::span<const double> f,
                        std::span<const NodeRange> ranges, std::span<double> u) const noexcept {
    std::array<double, std::size_t{3} * turned_nodes> moved;
    double* out = u.data();
    for (const NodeRange& range : ranges) {
      for (Index first = range.first; first < range.end; first += turned_nodes) {
        const NodeRange part{first, std::min<Index>(first + turned_nodes, range.end)};
        const auto dofs = static_cast<std::size_t>(dimension() * (part.end - part.first));
        below().displacement(nodes, f, {&part, 1}, {moved.data(), dofs});
        for (std::size_t k = 0; k < dofs; ++k) out[k] += moved[k];
        out += dofs;
      }
    }
  }

  using Terms = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  std::vector<Mat3> rotations_;  // [nodes]
  Terms left_, right_;           // [n x terms]
};

}  // namespace

std::shared_ptr<const Greens> turned(std::shared_ptr<const Greens> greens, std::vector<Mat3> rotations,
                                     const Eigen::MatrixXd& left, const Eigen::MatrixXd& right) {
  return std::make_shared<const TurnedGreens>(std::move(greens), std::move(rotations), left, right);
}

}  // namespace palpate
