// C of a near field's nodes, from the Green's functions and from the patch.
#include <algorithm>
#include <array>

#include "runtime/core/body/near_field.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

/// Sets entry (i, j) of a block in d rows to value(i, j).
template <class Value>
void set_entries(Index d, double* block, std::ptrdiff_t row, const Value& value) noexcept {
  for (Index i = 0; i < d; ++i) {
    for (Index j = 0; j < d; ++j) block[i * row + j] = value(i, j);
  }
}

/// Sets a block to the weighted sum of those of the stored nodes that its node follows.
template <Index D>
void sum_of_parts(std::span<const FollowedNodes::Part> parts, const double* by_followed, std::ptrdiff_t width,
                  double* block, std::ptrdiff_t row) noexcept {
  std::array<double, std::size_t{D} * D> sum{};
  for (const FollowedNodes::Part& part : parts) {
    const double* by = by_followed + std::ptrdiff_t{D} * part.number;
    for (std::size_t i = 0; i < D; ++i) {
      for (std::size_t j = 0; j < D; ++j)
        sum[D * i + j] +=
            part.weight * by[static_cast<std::ptrdiff_t>(i) * width + static_cast<std::ptrdiff_t>(j)];
    }
  }
  set_entries(D, block, row, [&](Index i, Index j) { return sum[static_cast<std::size_t>(D * i + j)]; });
}

}  // namespace

/// Computes X = Xi_Q for forces on the node, and Y = M X.
void NearField::respond(const ElasticBody& body, Index place) noexcept {
  const std::span<const Index> Q = patch()->stored_nodes();
  const std::ptrdiff_t width = patch_dofs();
  for (int axis = 0; axis < dimension_; ++axis) std::fill_n(X(dimension_ * place + axis), width, 0.0);
  for (const FollowedNodes::Part& part : followed_.parts(place)) {
    body.greens().gather(followed_.nodes()[at(part.number)], Q,
                         {work_.gathered.data(), static_cast<std::size_t>(dimension_ * width)});
    for (int axis = 0; axis < dimension_; ++axis)
      palpate::add(work_.gathered.data() + axis * width, part.weight, X(dimension_ * place + axis), width);
  }
  for (int axis = 0; axis < dimension_; ++axis) {
    const double* x = X(dimension_ * place + axis);
    double* y = Y(dimension_ * place + axis);
    for (std::ptrdiff_t dof = 0; dof < width; ++dof)
      y[dof] = dot(patch()->correction(static_cast<Index>(dof)), x, width);
  }
}

/// Gathers the rows of H, which are those of Y of a node in the patch.
void NearField::respond_within(Index place) noexcept {
  for (int axis = 0; axis < dimension_; ++axis) {
    double* y = Y(dimension_ * place + axis);
    std::fill_n(y, patch_dofs(), 0.0);
    patch()->for_each_part(patch_place(place), [&](Index node, double weight) {
      palpate::add(patch()->response(dimension_ * node + axis), weight, y, patch_dofs());
    });
  }
}

/// Computes C between a node and the first `count` nodes, which are those before it and itself; for a group
/// there may be more.
void NearField::connect(const ElasticBody& body, Index place, Index count) noexcept {
  if (patch_place(place) >= 0) {
    connect_within_patch(place);
  } else if (is_group(place)) {
    connect_by_members(place, count);
  } else {
    connect_beside_patch(body, place);
  }
  const std::ptrdiff_t d = dimension_;
  const std::ptrdiff_t width = d * count;
  for (std::ptrdiff_t axis = 0; axis < d; ++axis)
    std::copy_n(work_.blocks.data() + axis * width, width, C_.data() + (d * place + axis) * stride_);
  // The node's columns are written into each row at once, as each row is in memory of its own.
  for (std::ptrdiff_t dof = 0; dof < width; ++dof) {
    double* entries = C_.data() + dof * stride_ + d * place;
    for (std::ptrdiff_t axis = 0; axis < d; ++axis)
      entries[axis] = work_.blocks[at(static_cast<Index>(axis * width + dof))];
  }
}

/// Computes C from the members' rows: A^T C A with their maps A.
void NearField::connect_by_members(Index place, Index count) noexcept {
  const std::ptrdiff_t d = dimension_;
  const std::ptrdiff_t width = d * count, after = d * (place + 1);
  std::fill_n(work_.blocks.data(), d * width, 0.0);
  const auto for_each_entry = [&](auto&& visit) {
    for_each_member(place, [&](Index member, double, const Eigen::Matrix3d& map) {
      for (std::ptrdiff_t a = 0; a < d; ++a) {
        for (std::ptrdiff_t i = 0; i < d; ++i) visit(d * place_of(member) + a, i, map(a, i));
      }
    });
  };
  for_each_entry([&](std::ptrdiff_t dof, std::ptrdiff_t i, double factor) {
    const double* row = C_.data() + dof * stride_;
    double* block = work_.blocks.data() + i * width;
    palpate::add(row, factor, block, d * place);
    palpate::add(row + after, factor, block + after, width - after);
  });
  for_each_entry([&](std::ptrdiff_t dof, std::ptrdiff_t j, double factor) {
    for (std::ptrdiff_t i = 0; i < d; ++i)
      work_.blocks[at(static_cast<Index>(i * width + d * place + j))] +=
          factor * work_.blocks[at(static_cast<Index>(i * width + dof))];
  });
}

/// Displacement of an added node along one axis by a group that is here: `by` has that by stored nodes.
void NearField::connect_to_group(Index group, const double* by, double* block) const noexcept {
  const FollowedNodes::Part* part = followed_.parts(group).data();  // each member follows one stored node
  std::fill_n(block, dimension_, 0.0);
  for_each_member(group, [&](Index, double, const Eigen::Matrix3d& map) {
    const double* u = by + std::ptrdiff_t{dimension_} * part->number;
    for (int j = 0; j < dimension_; ++j) {
      for (int a = 0; a < dimension_; ++a) block[j] += part->weight * map(a, j) * u[a];
    }
    ++part;
  });
}

void NearField::connect_within_patch(Index place) noexcept {
  const Index d = dimension_;
  double* block = work_.blocks.data();
  for (Index i = 0; i < d; ++i) {
    const double* C = compliance_row(place, i);
    for (Index other = 0; other <= place; ++other, block += d) {
      if (patch_place(other) < 0) {
        for (Index j = 0; j < d; ++j) block[j] = dot(Y(d * place + i), X(d * other + j), patch_dofs());
        continue;
      }
      std::fill_n(block, d, 0.0);
      patch()->for_each_part(patch_place(other), [&](Index column, double weight) {
        for (Index j = 0; j < d; ++j) block[j] += weight * C[d * column + j];
      });
    }
  }
}

/// Row of the compliance between a node of the patch and those of the fine mesh.
const double* NearField::compliance_row(Index place, Index axis) noexcept {
  if (!patch()->is_sampled()) return patch()->compliance(dimension_ * patch_place(place) + axis);
  std::fill_n(work_.fine_row.begin(), patch()->fine_dofs(), 0.0);
  patch()->for_each_part(patch_place(place), [&](Index node, double weight) {
    palpate::add(patch()->compliance(dimension_ * node + axis), weight, work_.fine_row.data(),
                 patch()->fine_dofs());
  });
  return work_.fine_row.data();
}

void NearField::connect_beside_patch(const ElasticBody& body, Index place) noexcept {
  const Index d = dimension_;
  const std::ptrdiff_t width = d * std::ssize(followed_.nodes());
  const std::span<double> by_followed =
      std::span(work_.by_followed).first(static_cast<std::size_t>(d * width));
  std::fill(by_followed.begin(), by_followed.end(), 0.0);
  followed_.add_compliance(load_.greens(body), place, by_followed);
  for (Index other = 0; other <= place; ++other) {
    double* block = work_.blocks.data() + std::ptrdiff_t{d} * other;
    const std::ptrdiff_t row = std::ptrdiff_t{d} * (place + 1);
    if (is_group(other)) {
      for (Index i = 0; i < d; ++i)
        connect_to_group(other, work_.by_followed.data() + i * width, block + i * row);
    } else if (patch_place(other) >= 0) {
      set_entries(d, block, row,
                  [&](Index i, Index j) { return dot(Y(d * other + j), X(d * place + i), patch_dofs()); });
    } else if (d == 3) {
      sum_of_parts<3>(followed_.parts(other), work_.by_followed.data(), width, block, row);
    } else {
      sum_of_parts<2>(followed_.parts(other), work_.by_followed.data(), width, block, row);
    }
    if (patch() == nullptr || is_group(other) || patch_place(other) >= 0) continue;
    set_entries(d, block, row, [&](Index i, Index j) {
      return block[i * row + j] + dot(X(d * other + j), Y(d * place + i), patch_dofs());
    });
  }
  if (load_.local_now() != nullptr) add_local(*load_.local_now(), place);
}

/// Adds the local compliance between a node and those before it, turned with them.
void NearField::add_local(const LocalCompliance& local, Index place) noexcept {
  const std::ptrdiff_t width = std::ptrdiff_t{3} * (place + 1);
  const LocalCompliance::Point& point = local.point(node(place));
  const bool turns = load_.compliance != nullptr;
  if (turns) std::fill_n(work_.local.begin(), 3 * width, 0.0);
  local.add_row(point, local_points_, place + 1, turns ? work_.local.data() : work_.blocks.data());
  const Mat3 R = load_.rotation(point);
  for (Index other = 0; other <= place; ++other) {
    Mat3 B = Mat3::Zero();
    if (is_group(other) && other < place) {
      for_each_member(other, [&](Index member, double, const Eigen::Matrix3d& map) {
        const LocalCompliance::Point& loaded = local.point(member);
        B += R * local.between(point, loaded) * load_.rotation(loaded).transpose() * map;
      });
    } else if (turns) {
      using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
      const Eigen::Map<const Rows> row(work_.local.data(), 3, width);
      B = R * row.middleCols<3>(Eigen::Index{3} * other) *
          load_.rotation(local.point(node(other))).transpose();
    } else {
      continue;
    }
    for (std::ptrdiff_t i = 0; i < 3; ++i) {
      for (std::ptrdiff_t j = 0; j < 3; ++j)
        work_.blocks[at(static_cast<Index>(i * width + std::ptrdiff_t{3} * other + j))] += B(i, j);
    }
  }
}

}  // namespace palpate
