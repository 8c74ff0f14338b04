#include "runtime/near_field.h"

#include <algorithm>

#include "runtime/node_vectors.h"

namespace palpate {
namespace {

constexpr std::int64_t patience = 200;  // ticks that an unwanted node stays: a tool often comes back

}  // namespace

NearField::NearField(const Body& body, Index capacity)
    : dimension_(body.dimension()),
      capacity_(capacity),
      stride_((static_cast<std::ptrdiff_t>(dimension_) * capacity + 7) / 8 * 8),
      place_(body.surface_stored_nodes().size(), -1),
      nodes_(static_cast<std::size_t>(capacity), -1),
      stored_(static_cast<std::size_t>(capacity), -1),
      wanted_(static_cast<std::size_t>(capacity), 0),
      C_(static_cast<std::size_t>(stride_ * dimension_ * capacity)),
      force_(static_cast<std::size_t>(dimension_ * capacity)),
      last_force_(force_.size()),
      displacement_(force_.size()),
      blocks_(static_cast<std::size_t>(dimension_) * force_.size()),
      loaded_(static_cast<std::size_t>(capacity), -1),
      loaded_force_(force_.size()) {}

bool NearField::is_loaded(Index place) const noexcept {
  const double* f = force_.data() + std::ptrdiff_t{dimension_} * place;
  return std::any_of(f, f + dimension_, [](double value) { return value != 0.0; });
}

Index NearField::longest_unwanted() const noexcept {
  Index found = -1;
  for (Index place = 0; place < count_; ++place) {
    const std::int64_t wanted = wanted_[static_cast<std::size_t>(place)];
    if (wanted == tick_ || is_loaded(place)) continue;
    if (found < 0 || wanted < wanted_[static_cast<std::size_t>(found)]) found = place;
  }
  return found;
}

void NearField::begin_tick() noexcept {
  ++tick_;
  for (int k = 0; k < 2; ++k) {
    const Index place = longest_unwanted();
    if (place < 0 || wanted_[static_cast<std::size_t>(place)] + patience >= tick_) return;
    forget(place);
  }
}

bool NearField::want(const Body& body, Index surface_node) noexcept {
  if (place_of(surface_node) < 0) {
    if (count_ == capacity_) {
      const Index place = longest_unwanted();
      if (place < 0) return false;
      forget(place);
    }
    add(body, surface_node);
  }
  wanted_[static_cast<std::size_t>(place_of(surface_node))] = tick_;
  return true;
}

void NearField::add(const Body& body, Index surface_node) noexcept {
  const Index place = count_++;
  const auto d = static_cast<std::ptrdiff_t>(dimension_);
  place_[static_cast<std::size_t>(surface_node)] = place;
  nodes_[static_cast<std::size_t>(place)] = surface_node;
  stored_[static_cast<std::size_t>(place)] =
      body.surface_stored_nodes()[static_cast<std::size_t>(surface_node)];

  const std::ptrdiff_t width = d * count_;
  body.greens().gather(stored_[static_cast<std::size_t>(place)],
                       {stored_.data(), static_cast<std::size_t>(count_)},
                       {blocks_.data(), static_cast<std::size_t>(d * width)});
  for (std::ptrdiff_t axis = 0; axis < d; ++axis) {
    const double* block = blocks_.data() + axis * width;
    std::copy_n(block, width, C_.data() + (d * place + axis) * stride_);
    double* column = C_.data() + d * place + axis;
    for (std::ptrdiff_t dof = 0; dof < width; ++dof) column[dof * stride_] = block[dof];

    double u = 0.0;
    for (std::ptrdiff_t dof = 0; dof < d * place; ++dof)
      u += block[dof] * force_[static_cast<std::size_t>(dof)];
    force_[static_cast<std::size_t>(d * place + axis)] = 0.0;
    displacement_[static_cast<std::size_t>(d * place + axis)] = u;
  }
}

/// The last node takes its place.
void NearField::forget(Index place) noexcept {
  const Index last = --count_;
  place_[static_cast<std::size_t>(nodes_[static_cast<std::size_t>(place)])] = -1;
  if (place == last) return;
  const auto d = static_cast<std::ptrdiff_t>(dimension_);
  const std::ptrdiff_t width = d * (last + 1);
  for (std::ptrdiff_t axis = 0; axis < d; ++axis) {
    std::copy_n(C_.data() + (d * last + axis) * stride_, width, C_.data() + (d * place + axis) * stride_);
  }
  for (std::ptrdiff_t dof = 0; dof < width; ++dof) {
    double* row = C_.data() + dof * stride_;
    std::copy_n(row + d * last, d, row + d * place);
  }
  const auto to = static_cast<std::size_t>(place);
  const auto from = static_cast<std::size_t>(last);
  nodes_[to] = nodes_[from];
  stored_[to] = stored_[from];
  wanted_[to] = wanted_[from];
  std::copy_n(force_.data() + d * last, d, force_.data() + d * place);
  std::copy_n(displacement_.data() + d * last, d, displacement_.data() + d * place);
  place_[static_cast<std::size_t>(nodes_[to])] = place;
}

void NearField::unload() noexcept {
  std::copy_n(force_.begin(), dimension_ * count_, last_force_.begin());
  std::fill_n(force_.begin(), dimension_ * count_, 0.0);
}

void NearField::retreat(double share) noexcept {
  const Index dofs = dimension_ * count_;
  for (std::size_t dof = 0; dof < static_cast<std::size_t>(dofs); ++dof)
    force_[dof] = last_force_[dof] + share * (force_[dof] - last_force_[dof]);
}

void NearField::load(Index place, const Vec3& force) noexcept {
  for (int axis = 0; axis < dimension_; ++axis) {
    const Index dof = dimension_ * place + axis;
    force_[static_cast<std::size_t>(dof)] += force[axis];
  }
}

void NearField::displace() noexcept {
  const std::ptrdiff_t width = std::ptrdiff_t{dimension_} * count_;
  double* __restrict u = displacement_.data();
  std::fill_n(u, width, 0.0);
  loaded_count_ = 0;
  for (Index place = 0; place < count_; ++place) {
    if (!is_loaded(place)) continue;
    const double* f = force_.data() + std::ptrdiff_t{dimension_} * place;
    loaded_[static_cast<std::size_t>(loaded_count_)] = stored_[static_cast<std::size_t>(place)];
    std::copy_n(f, dimension_, loaded_force_.data() + std::ptrdiff_t{dimension_} * loaded_count_);
    ++loaded_count_;
    for (int axis = 0; axis < dimension_; ++axis) {
      const double* __restrict c = C_.data() + (std::ptrdiff_t{dimension_} * place + axis) * stride_;
      const double force = f[axis];
#pragma omp simd
      for (std::ptrdiff_t dof = 0; dof < width; ++dof) u[dof] += force * c[dof];
    }
  }
}

Vec3 NearField::displacement(Index place) const noexcept {
  return vector_at(displacement_, dimension_, place);
}

}  // namespace palpate
