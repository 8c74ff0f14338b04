#include "overlay/patch_layers.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace palpate {
namespace {

using Eigen::MatrixXd;

std::size_t number(Index i) noexcept {
  return static_cast<std::size_t>(i);
}

}  // namespace

PatchLayers::PatchLayers(const PatchMesh& patch, int dimension, const std::vector<Index>& surface)
    : layer_of_(patch.local.nodes.size(), unreached), first_dof_(patch.free_dof.size(), -1) {
  const auto d = static_cast<std::size_t>(dimension);
  const auto is_free = [&](Index node) {
    const auto first = patch.free_dof.begin() + static_cast<std::ptrdiff_t>(d * number(node));
    return std::any_of(first, first + dimension, [](Index dof) { return dof >= 0; });
  };
  for (std::size_t node = 0; node < layer_of_.size(); ++node) {
    if (!is_free(static_cast<Index>(node))) layer_of_[node] = none;
  }
  std::vector<Index> reached;
  for (const Index node : surface) {
    if (layer_of_[number(node)] == unreached) reached.push_back(node);
  }
  if (reached.empty()) sizes_.push_back(0);
  while (!reached.empty()) {
    add_layer(reached, patch, d);
    reached = next_to(patch);
  }
  for (std::size_t node = 0; node < layer_of_.size(); ++node) {  // nodes not connected to the surface
    if (layer_of_[node] == unreached) reached.push_back(static_cast<Index>(node));
  }
  if (!reached.empty()) add_layer(reached, patch, d);
}

void PatchLayers::add_layer(const std::vector<Index>& nodes, const PatchMesh& patch, std::size_t d) {
  Index size = 0;
  for (const Index node : nodes) {
    layer_of_[number(node)] = count();
    for (std::size_t dof = d * number(node); dof < d * (number(node) + 1); ++dof) {
      if (patch.free_dof[dof] >= 0) first_dof_[dof] = size++;
    }
  }
  sizes_.push_back(size);
}

/// Nodes that share an element with the last layer and have no layer yet.
std::vector<Index> PatchLayers::next_to(const PatchMesh& patch) const {
  std::vector<Index> found;
  for (Index e = 0; e < patch.local.elements(); ++e) {
    const auto nodes = patch.local.element_nodes(e);
    const auto is_last = [&](Index node) { return layer_of_[number(node)] == count() - 1; };
    if (std::none_of(nodes.begin(), nodes.end(), is_last)) continue;
    std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(found),
                 [&](Index node) { return layer_of_[number(node)] == unreached; });
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

void LayeredStiffness::clear(const PatchLayers& layers, Eigen::Index width) {
  const auto before = [&](int k) { return k > 0 ? layers.size(k - 1) : 0; };
  Eigen::Index size = 0;
  for (int k = 0; k < layers.count(); ++k) size += layers.size(k) * (layers.size(k) + before(k) + width);
  entries_.assign(static_cast<std::size_t>(size), 0.0);
  diagonal.clear();
  above.clear();
  columns.clear();
  double* next = entries_.data();
  const auto add = [&](auto& blocks, Eigen::Index rows, Eigen::Index count) {
    blocks.emplace_back(next, rows, count);
    next += rows * count;
  };
  for (int k = 0; k < layers.count(); ++k) {
    add(diagonal, layers.size(k), layers.size(k));
    add(above, layers.size(k), before(k));
    add(columns, layers.size(k), width);
  }
}

bool eliminate(LayeredStiffness& K, MatrixXd& G) {
  for (std::size_t k = K.diagonal.size(); k-- > 0;) {
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(K.diagonal[k]);
    if (factor.info() != Eigen::Success) return false;
    const auto L = factor.matrixL();
    L.solveInPlace(K.columns[k]);
    G.selfadjointView<Eigen::Lower>().rankUpdate(K.columns[k].transpose());
    if (k == 0) break;
    L.solveInPlace(K.above[k]);
    K.diagonal[k - 1].selfadjointView<Eigen::Lower>().rankUpdate(K.above[k].transpose(), -1.0);
    K.columns[k - 1].noalias() -= K.above[k].transpose() * K.columns[k];
  }
  return true;
}

SurfaceLayer surface_layer(const LayeredStiffness& K) {
  // K.diagonal[0] is K_L's Schur complement on the surface's layer; its inverse is that block of K_L^-1.
  const Eigen::Index size = K.diagonal[0].rows();
  const auto L = K.diagonal[0].triangularView<Eigen::Lower>();
  MatrixXd inverse = MatrixXd::Identity(size, size);
  L.solveInPlace(inverse);
  SurfaceLayer result{.compliance = MatrixXd::Zero(size, size),
                      .columns = inverse.transpose() * K.columns[0]};
  result.compliance.selfadjointView<Eigen::Lower>().rankUpdate(inverse.transpose());
  result.compliance.triangularView<Eigen::StrictlyUpper>() = result.compliance.transpose();
  return result;
}

void put_surface(const PatchLayers& layers, const SurfaceLayer& surface,
                 const Eigen::SparseMatrix<double, Eigen::RowMajor>& shape, Eigen::Index d,
                 CondensedPatch& result) {
  result.T = MatrixXd::Zero(d * std::ssize(result.surface), shape.cols());
  result.compliance = MatrixXd::Zero(result.T.rows(), result.T.rows());
  std::vector<Eigen::Index> place(static_cast<std::size_t>(result.T.rows()));
  for (std::size_t dof = 0; dof < place.size(); ++dof) {
    const auto width = static_cast<std::size_t>(d);
    const std::size_t local = width * number(result.surface[dof / width]) + dof % width;
    place[dof] = layers.place_of(local);
    result.T.row(static_cast<Eigen::Index>(dof)) = shape.row(static_cast<Eigen::Index>(local));
  }
  for (std::size_t i = 0; i < place.size(); ++i) {
    if (place[i] < 0) continue;
    const auto row = static_cast<Eigen::Index>(i);
    result.T.row(row) -= surface.columns.row(place[i]).head(shape.cols());
    for (std::size_t j = 0; j < place.size(); ++j) {
      if (place[j] >= 0)
        result.compliance(static_cast<Eigen::Index>(j), row) = surface.compliance(place[j], place[i]);
    }
  }
}

}  // namespace palpate
