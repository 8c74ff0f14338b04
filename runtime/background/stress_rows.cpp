#include "runtime/background/stress_rows.h"

#include <cmath>

#include "statics/polar.h"

namespace palpate {

Stress stress_of(const Mat3& tensor) noexcept {
  Stress stress;
  stress << tensor(0, 0), tensor(1, 1), tensor(2, 2), tensor(0, 1), tensor(1, 2), tensor(2, 0);
  return stress;
}

double von_mises(const Stress& s) noexcept {
  const double xy = s[0] - s[1], yz = s[1] - s[2], zx = s[2] - s[0];
  const double shear = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  return std::sqrt(0.5 * (xy * xy + yz * yz + zx * zx) + 3.0 * shear);
}

HookesLaw::HookesLaw(const Material& material, Analysis analysis)
    : initial(Mat3::Zero()), is_plane(analysis != Analysis::solid) {
  const ElasticityMatrix D = elasticity_matrix(material, analysis);
  lambda = D(0, 1);
  mu = D(D.rows() - 1, D.rows() - 1);
  const StressVector s = initial_stress(material, analysis);
  if (is_plane) {
    initial.topLeftCorner<2, 2>() << s[0], s[2],  //
        s[2], s[1];
  } else {
    initial << s[0], s[3], s[5],  //
        s[3], s[1], s[4],         //
        s[5], s[4], s[2];
  }
  if (analysis == Analysis::plane_strain) {
    across_by_sum = material.poissons_ratio;
    across_initial = -material.youngs_modulus * material.initial_strain[2];
  }
}

void HookesLaw::complete(StressBlock& block) const noexcept {
  if (is_plane) block.row(2) = across_by_sum * (block.row(0) + block.row(1));
}

void HookesLaw::complete(Stress& stress) const noexcept {
  if (is_plane) stress[2] = across_by_sum * (stress[0] + stress[1]) + across_initial;
}

StressBlock stress_by_displacement(const HookesLaw& law, double lambda, const Mat3& projector,
                                   const Vec3& g) noexcept {
  StressBlock block;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 known = projector.col(axis);
    block.col(axis) =
        stress_of(lambda * g[axis] * projector + law.mu * (known * g.transpose() + g * known.transpose()));
  }
  law.complete(block);
  return block;
}

void StressRows::apply(std::span<const Vec3> u, std::span<Stress> stress) const noexcept {
  for (std::size_t row = 0; row < constant.size(); ++row) {
    double sum[6];
    for (int i = 0; i < 6; ++i) sum[i] = constant[row][i];
    for (auto k = static_cast<std::size_t>(first[row]); k < static_cast<std::size_t>(first[row + 1]); ++k) {
      const double* b = block.data() + 18 * k;
      const double* v = u[node[k]].data();
#pragma omp simd
      for (int i = 0; i < 6; ++i) sum[i] += b[i] * v[0] + b[6 + i] * v[1] + b[12 + i] * v[2];
    }
    for (int i = 0; i < 6; ++i) stress[row][i] = sum[i];
  }
}

void StressRows::apply_turned(std::span<const Vec3> at, bool is_plane, std::span<const Vec3> u,
                              std::span<Mat3> turn, std::span<Stress> stress) const noexcept {
  for (std::size_t row = 0; row < constant.size(); ++row) {
    const auto begin = static_cast<std::size_t>(first[row]), end = static_cast<std::size_t>(first[row + 1]);
    Mat3 fit = Mat3::Zero();  // deformation; its polar factor is the common rotation
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3 X = at[node[k]] - at[row];
      fit.noalias() += (X + u[node[k]] - u[row]) * X.transpose();
    }
    turn[row] = is_plane ? nearest_rotation_in_plane(fit) : nearest_rotation(fit);
    Stress sum = constant[row];
    for (std::size_t k = begin; k < end; ++k) {
      const Vec3 X = at[node[k]] - at[row];
      const Vec3 strained = turn[row].transpose() * (X + u[node[k]] - u[row]) - X;
      sum.noalias() += Eigen::Map<const StressBlock>(block.data() + 18 * k) * strained;
    }
    stress[row] = sum;
  }
}

void StressMean::add(Index row, double weight, std::span<const Index> nodes,
                     std::span<const StressBlock> by_nodes, const Stress& constant) {
  Row& to = rows_[row];
  to.weight += weight;
  to.constant += weight * constant;
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    const auto [block, is_new] = to.blocks.emplace(nodes[j], StressBlock::Zero());
    block->second += weight * by_nodes[j];
  }
}

StressRows StressMean::rows() const {
  StressRows result;
  result.first.push_back(0);
  for (const Row& row : rows_) {
    for (const auto& [node, sum] : row.blocks) {
      result.node.push_back(node);
      const StressBlock mean = sum / row.weight;
      result.block.insert(result.block.end(), mean.data(), mean.data() + mean.size());
    }
    result.first.push_back(static_cast<Index>(result.node.size()));
    result.constant.push_back(row.constant / row.weight);  // 0 / 0 if nothing was added
  }
  return result;
}

}  // namespace palpate
