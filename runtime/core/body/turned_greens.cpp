#include <algorithm>
#include <array>
#include <utility>

#include "runtime/core/body/greens_on_top.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr Index turned_forces = 128, turned_nodes = 64;  // of a part of a product

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

  /// Processes parts of the forces and nodes that fit on the stack.
  void displacement(std::span<const Index> nodes, std::span<const double> f,
                    std::span<const NodeRange> ranges, std::span<double> u) const noexcept override {
    const auto d = static_cast<std::size_t>(dimension());
    std::array<double, std::size_t{3} * turned_forces> turned_force;
    std::array<double, std::size_t{3} * turned_nodes> moved;
    std::array<double, most_turned_terms> sum{};  // right^T f
    const Eigen::Index terms = left_.cols();
    for (std::size_t k = 0; k < f.size() && terms > 0; ++k) {
      const auto dof = static_cast<Eigen::Index>(d) * nodes[k / d] + static_cast<Eigen::Index>(k % d);
      add(right_.row(dof).data(), f[k], sum.data(), terms);
    }
    double* out = u.data();
    for (const NodeRange& range : ranges) {
      for (Index first = range.first; first < range.end; first += turned_nodes) {
        const NodeRange part{first, std::min<Index>(first + turned_nodes, range.end)};
        const std::size_t dofs = d * static_cast<std::size_t>(part.end - part.first);
        std::fill_n(out, dofs, 0.0);
        for (std::size_t begin = 0; begin < nodes.size(); begin += turned_forces) {
          const std::size_t count = std::min<std::size_t>(turned_forces, nodes.size() - begin);
          for (std::size_t k = 0; k < count; ++k) {
            const Mat3& R = rotations_[static_cast<std::size_t>(nodes[begin + k])];
            const Eigen::Vector3d force =
                R.transpose() * vector_at(f, dimension(), static_cast<Index>(begin + k));
            set_vector(turned_force, dimension(), static_cast<Index>(k), force);
          }
          below().displacement(nodes.subspan(begin, count), {turned_force.data(), d * count}, {&part, 1},
                               {moved.data(), dofs});
          for (std::size_t k = 0; k < dofs; ++k) out[k] += moved[k];
        }
        const std::span<double> slice(out, dofs);
        for (Index k = 0; k < part.end - part.first; ++k) {
          const Mat3& R = rotations_[static_cast<std::size_t>(first + k)];
          set_vector(slice, dimension(), k, R * vector_at(slice, dimension(), k));
        }
        for (std::size_t k = 0; k < dofs && terms > 0; ++k)
          out[k] += dot(left_.row(static_cast<Eigen::Index>(d) * first + static_cast<Eigen::Index>(k)).data(),
                        sum.data(), terms);
        out += dofs;
      }
    }
  }

 private:
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
