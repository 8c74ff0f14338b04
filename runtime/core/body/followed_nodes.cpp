#include "runtime/core/body/followed_nodes.h"

#include <algorithm>

#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr Index most_kept = 512;  // nodes whose compliance is kept: 19 MB

}  // namespace

FollowedNodes::FollowedNodes(int dimension, Index places, Index most_parts, Index stored_nodes, bool shared)
    : dimension_(dimension),
      most_parts_(most_parts),
      stored_(static_cast<std::size_t>(std::min(most_parts * places, stored_nodes))),
      uses_(stored_.size()),
      number_(static_cast<std::size_t>(stored_nodes), -1),
      parts_(static_cast<std::size_t>(most_parts * places)),
      part_count_(static_cast<std::size_t>(places)),
      force_(static_cast<std::size_t>(dimension) * stored_.size()),
      kept_(shared ? std::min(most_kept, room()) : 0),
      compliance_(static_cast<std::size_t>(dimension * kept_) * static_cast<std::size_t>(dimension * kept_)),
      gathered_(static_cast<std::size_t>(dimension) * force_.size()) {}

void FollowedNodes::add(Index place, Index stored, double weight) noexcept {
  Index& number = number_[static_cast<std::size_t>(stored)];
  if (number < 0) {
    number = count_++;
    stored_[static_cast<std::size_t>(number)] = stored;
    uses_[static_cast<std::size_t>(number)] = 0;
  }
  ++uses_[static_cast<std::size_t>(number)];
  Index& count = part_count_[static_cast<std::size_t>(place)];
  parts_[first(place) + static_cast<std::size_t>(count++)] = {number, weight};
}

void FollowedNodes::leave(Index place, Index places) noexcept {
  for (const Part& part : parts(place)) {
    const auto number = static_cast<std::size_t>(part.number);
    if (--uses_[number] > 0) continue;
    number_[static_cast<std::size_t>(stored_[number])] = -1;
    const auto last = static_cast<std::size_t>(--count_);
    move_compliance(count_, part.number);
    if (number == last) continue;
    stored_[number] = stored_[last];
    uses_[number] = uses_[last];
    number_[static_cast<std::size_t>(stored_[number])] = static_cast<Index>(number);
    for (Index other = 0; other < places; ++other) {
      for (std::size_t k = first(other); k < first(other) + parts(other).size(); ++k) {
        if (parts_[k].number == static_cast<Index>(last)) parts_[k].number = static_cast<Index>(number);
      }
    }
  }
  part_count_[static_cast<std::size_t>(place)] = 0;
}

/// Node `from`, the last one, takes the place of `to`.
void FollowedNodes::move_compliance(Index from, Index to) noexcept {
  if (to >= known_) return;
  if (from >= known_) {
    known_ = to;
    return;
  }
  known_ = from;
  const std::ptrdiff_t d = dimension_, stride = d * kept_, width = d * (from + 1);
  for (std::ptrdiff_t axis = 0; axis < d; ++axis)
    std::copy_n(compliance_.data() + (d * from + axis) * stride, width,
                compliance_.data() + (d * to + axis) * stride);
  for (std::ptrdiff_t dof = 0; dof < width; ++dof)
    std::copy_n(compliance_.data() + dof * stride + d * from, d, compliance_.data() + dof * stride + d * to);
}

/// Gathers the compliance of nodes that have come.
void FollowedNodes::gather(const Greens& greens) noexcept {
  const std::ptrdiff_t d = dimension_, stride = d * kept_;
  for (; known_ < count_; ++known_) {
    const std::ptrdiff_t width = d * (known_ + 1);
    greens.gather(stored_[static_cast<std::size_t>(known_)],
                  nodes().first(static_cast<std::size_t>(known_ + 1)),
                  std::span(gathered_).first(static_cast<std::size_t>(d * width)));
    for (std::ptrdiff_t axis = 0; axis < d; ++axis) {
      const double* row = gathered_.data() + axis * width;
      std::copy_n(row, width, compliance_.data() + (d * known_ + axis) * stride);
      for (std::ptrdiff_t dof = 0; dof < width; ++dof)
        compliance_[static_cast<std::size_t>(dof * stride + d * known_ + axis)] = row[dof];
    }
  }
}

void FollowedNodes::add_compliance(const Greens& greens, Index place, std::span<double> rows) noexcept {
  const std::ptrdiff_t d = dimension_, stride = d * kept_, width = d * count_;
  const bool keeps = count_ <= kept_;
  if (keeps) gather(greens);
  for (const Part& part : parts(place)) {
    const double* of_node = keeps ? compliance_.data() + d * part.number * stride : gathered_.data();
    if (!keeps) {
      greens.gather(stored_[static_cast<std::size_t>(part.number)], nodes(),
                    std::span(gathered_).first(static_cast<std::size_t>(d * width)));
    }
    for (std::ptrdiff_t axis = 0; axis < d; ++axis)
      palpate::add(of_node + axis * (keeps ? stride : width), part.weight, rows.data() + axis * width, width);
  }
}

void FollowedNodes::move(Index from, Index to) noexcept {
  part_count_[static_cast<std::size_t>(to)] = part_count_[static_cast<std::size_t>(from)];
  std::copy_n(parts_.begin() + static_cast<std::ptrdiff_t>(first(from)), most_parts_,
              parts_.begin() + static_cast<std::ptrdiff_t>(first(to)));
  if (from != to) part_count_[static_cast<std::size_t>(from)] = 0;
}

void FollowedNodes::unload() noexcept {
  std::fill_n(force_.data(), forces().size(), 0.0);
}

void FollowedNodes::load(const Part& part, const Vec3& force) noexcept {
  double* on_node = force_.data() + std::ptrdiff_t{dimension_} * part.number;
  for (int axis = 0; axis < dimension_; ++axis) on_node[axis] += part.weight * force[axis];
}

}  // namespace palpate
