#include "runtime/body/prescribed_nodes.h"

#include <algorithm>
#include <cmath>

#include "base/vectors.h"

namespace palpate {
namespace {

bool all_finite(std::span<const double> values) noexcept {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

std::size_t dofs(int dimension, Index nodes) noexcept {
  return static_cast<std::size_t>(dimension) * static_cast<std::size_t>(nodes);
}

/// Removes the entries of one node: those of later nodes move up.
template <class T>
void erase_entries(std::vector<T>& values, Index k, Index nodes, std::ptrdiff_t entries) noexcept {
  T* gap = values.data() + entries * k;
  std::copy(gap + entries, values.data() + entries * nodes, gap);
}

}  // namespace

PrescribedNodes::PrescribedNodes(const Body& body, Index max_nodes, const Overlay* overlay)
    : capacitance_(body.dimension(), max_nodes),
      overlay_(overlay),
      nodes_(static_cast<std::size_t>(max_nodes), -1),
      displacement_(dofs(body.dimension(), max_nodes)),
      force_(dofs(body.dimension(), max_nodes)),
      work_(static_cast<std::size_t>(body.dimension()) * dofs(body.dimension(), max_nodes)) {}

std::span<const Index> PrescribedNodes::nodes() const noexcept {
  return {nodes_.data(), static_cast<std::size_t>(count())};
}
std::span<const double> PrescribedNodes::displacement() const noexcept {
  return {displacement_.data(), dofs(dimension(), count())};
}
std::span<const double> PrescribedNodes::forces() const noexcept {
  return {force_.data(), dofs(dimension(), count())};
}

PrescribedStatus PrescribedNodes::hold(const Body& body, Index node) noexcept {
  if (node < 0 || node >= body.greens().nodes()) return PrescribedStatus::no_such_node;
  if (position_of(node) >= 0) return PrescribedStatus::ok;
  const Index k = count();
  if (k == capacitance_.max_nodes()) return PrescribedStatus::full;

  nodes_[k] = node;
  const auto d = static_cast<std::size_t>(dimension());
  const std::size_t width = d * static_cast<std::size_t>(k + 1);
  const std::span<double> blocks(work_.data(), d * width);
  const std::span<const Index> columns(nodes_.data(), static_cast<std::size_t>(k) + 1);
  body.greens().gather(node, columns, blocks);
  if (overlay_ != nullptr) overlay_->add_to_blocks(body, node, columns, blocks);

  Vec3 where_it_is = Vec3::Zero();
  for (std::size_t axis = 0; axis < d; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    for (std::size_t j = 0; j < width - d; ++j) where_it_is[row] += blocks[axis * width + j] * force_[j];
  }
  if (capacitance_.add(blocks) != CapacitanceStatus::ok) return PrescribedStatus::not_positive_definite;
  set_vector(displacement_, dimension(), k, where_it_is);
  set_vector(force_, dimension(), k, Vec3::Zero());
  return PrescribedStatus::ok;
}

PrescribedStatus PrescribedNodes::release(Index node) noexcept {
  const Index k = position_of(node);
  if (k < 0) return PrescribedStatus::no_such_node;
  erase_entries(nodes_, k, count(), 1);
  erase_entries(displacement_, k, count(), dimension());
  erase_entries(force_, k, count(), dimension());
  capacitance_.remove(k);
  return PrescribedStatus::ok;
}

PrescribedStatus PrescribedNodes::prescribe(Index node, const Vec3& displacement) noexcept {
  const Index k = position_of(node);
  if (k < 0) return PrescribedStatus::no_such_node;
  set_vector(displacement_, dimension(), k, displacement);
  return PrescribedStatus::ok;
}

PrescribedStatus PrescribedNodes::solve() noexcept {
  const std::span<double> f(work_.data(), dofs(dimension(), count()));
  std::copy_n(displacement_.begin(), f.size(), f.begin());
  capacitance_.solve(f);
  if (!all_finite(f)) return PrescribedStatus::result_not_finite;
  std::copy(f.begin(), f.end(), force_.begin());
  return PrescribedStatus::ok;
}

Index PrescribedNodes::position_of(Index node) const noexcept {
  const std::span<const Index> held = nodes();
  const auto found = std::find(held.begin(), held.end(), node);
  return found == held.end() ? -1 : static_cast<Index>(found - held.begin());
}

void PrescribedNodes::displace(const Body& body, std::span<double> u) const noexcept {
  if (overlay_ == nullptr) return body.greens().displacement(nodes(), forces(), u);
  const Eigen::VectorXd beside = overlay_->forces_beside(body, nodes(), forces());
  std::vector<Index> all(nodes().begin(), nodes().end());
  std::vector<double> f(forces().begin(), forces().end());
  all.insert(all.end(), overlay_->stored_nodes().begin(), overlay_->stored_nodes().end());
  f.insert(f.end(), beside.begin(), beside.end());
  body.greens().displacement(all, f, u);
}

}  // namespace palpate
