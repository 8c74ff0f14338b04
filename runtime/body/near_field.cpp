#include "runtime/body/near_field.h"

#include <algorithm>
#include <utility>

#include "meshes/node_vectors.h"
#include "runtime/solve/tick_tuning.h"
#include "runtime/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::ptrdiff_t beyond_row = 2;  // numbers readable past a row: four are read at the last node

}  // namespace

NearField::NearField(const Body& body, Index capacity, Index patch_nodes)
    : dimension_(body.dimension()),
      capacity_(capacity),
      surface_nodes_(static_cast<Index>(body.surface_rest_positions().size())),
      parts_(std::max(body.most_surface_parts(), body.aggregates().most_members())),
      most_members_(body.aggregates().most_members()),
      stride_((static_cast<std::ptrdiff_t>(dimension_) * capacity + beyond_row + 7) / 8 * 8),
      patch_stride_((static_cast<std::ptrdiff_t>(dimension_) * patch_nodes + 7) / 8 * 8),
      patch_room_(patch_nodes),
      place_(at(body.aggregate_node(body.aggregates().count())), -1),
      place_in_patch_(place_.size(), -1),
      nodes_(at(capacity), -1),
      wanted_(at(capacity), 0),
      C_(stride_ * dimension_ * capacity),
      force_(at(dimension_ * capacity)),
      last_force_(force_.size()),
      displacement_(force_.size()),
      begun_(force_.size()),
      last_motion_(force_.size()),
      offset_(force_.size()),
      blocks_(static_cast<std::size_t>(dimension_) * force_.size()),
      base_(at(std::min(parts_ * capacity, body.greens().nodes()))),
      base_uses_(base_.size()),
      base_of_stored_(at(body.greens().nodes()), -1),
      bases_of_(at(parts_ * capacity)),
      part_weight_(bases_of_.size()),
      part_count_(at(capacity)),
      member_count_(at(capacity)),
      member_(at(most_members_ * capacity)),
      member_weight_(member_.size()),
      member_map_(member_.size()),
      by_base_(static_cast<std::size_t>(dimension_ * dimension_) * base_.size()),
      gathered_(static_cast<std::size_t>(dimension_ * dimension_) * std::max(base_.size(), at(patch_nodes))),
      base_force_(static_cast<std::size_t>(dimension_) * base_.size()),
      X_(force_.size() * static_cast<std::size_t>(patch_stride_)),
      Y_(X_.size()),
      patch_force_(patch_stride_),
      load_(dimension_, capacity, static_cast<Index>(base_.size()), patch_nodes) {}

bool NearField::is_loaded(Index place) const noexcept {
  const double* f = force_.data() + std::ptrdiff_t{dimension_} * place;
  return std::any_of(f, f + dimension_, [](double value) { return value != 0.0; });
}

Index NearField::longest_unwanted() const noexcept {
  Index found = -1;
  for (Index place = 0; place < count_; ++place) {
    const std::int64_t wanted = wanted_[place];
    if (wanted == tick_ || is_loaded(place)) continue;
    if (found < 0 || wanted < wanted_[found]) found = place;
  }
  return found;
}

void NearField::begin_tick() noexcept {
  ++tick_;
  for (std::size_t dof = 0; dof < at(dimension_ * count_); ++dof) {
    last_motion_[dof] = displacement_[dof] - begun_[dof];
    begun_[dof] = displacement_[dof];
  }
  const std::int64_t patience =
      tuning.body.patience * tuning.body.usual_nodes / std::max(count_, tuning.body.usual_nodes);
  for (int k = 0; k < 2; ++k) {
    const Index place = longest_unwanted();
    if (place < 0 || wanted_[place] + patience >= tick_) return;
    forget(place);
  }
}

bool NearField::want(const Body& body, Index surface_node) noexcept {
  if (place_of(surface_node) < 0) {
    if (body.aggregate_of(surface_node) >= 0) return false;  // weights unknown
    if (count_ == capacity_) {
      const Index place = longest_unwanted();
      if (place < 0) return false;
      forget(place);
    }
    add(body, surface_node);
  }
  wanted_[place_of(surface_node)] = tick_;
  return true;
}

bool NearField::want_group(const Body& body, Index group, std::span<const double> weights,
                           std::span<const Eigen::Matrix3d> maps) noexcept {
  if (patch() != nullptr) return false;
  const Index node = body.aggregate_node(group);
  const Index old = place_of(node);
  if (old >= 0 && (is_loaded(old) || wanted_[at(old)] == tick_)) return false;
  if (old >= 0) forget(old);
  if (count_ == capacity_) {
    const Index place = longest_unwanted();
    if (place < 0) return false;
    forget(place);
  }
  const std::span<const Index> members = body.aggregates().members(group);
  Index& count = member_count_[at(count_)];
  count = 0;
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (weights[k] == 0.0) continue;
    const std::size_t to = at(most_members_ * count_ + count++);
    member_[to] = members[k];
    member_weight_[to] = weights[k];
    member_map_[to] = maps[k];
  }
  add(body, node);
  wanted_[at(place_of(node))] = tick_;
  return true;
}

void NearField::add(const Body& body, Index surface_node) noexcept {
  const Index place = count_++;
  place_[at(surface_node)] = place;
  nodes_[at(place)] = surface_node;
  enter(body, place);
  connect(body, place);
  for (Index dof = dimension_ * place; dof < dimension_ * (place + 1); ++dof) {
    force_[at(dof)] = 0.0;
    displacement_[at(dof)] =
        offset_[at(dof)] + dot(row(dof).data(), force_.data(), std::ptrdiff_t{dimension_} * place);
    begun_[at(dof)] = displacement_[at(dof)];
    last_motion_[at(dof)] = 0.0;
  }
}

/// Initialises a node: its displacement without forces and, outside the patch, the stored nodes that it
/// follows and the response of the patch to it.
void NearField::enter(const Body& body, Index place) noexcept {
  part_count_[at(place)] = 0;
  std::fill_n(offset_.begin() + std::ptrdiff_t{dimension_} * place, dimension_, 0.0);
  if (is_group(place)) {
    for_each_member(place,
                    [&](Index member, double, const Eigen::Matrix3d&) { follow(body, place, member); });
    return;
  }
  if (patch_place(place) < 0) {
    follow(body, place, node(place));
    if (patch() != nullptr) respond(body, place);
  }
  if (patch() != nullptr && patch()->has_offset()) find_offset(place);
}

void NearField::find_offset(Index place) noexcept {
  const Index in_patch = patch_place(place);
  for (Index axis = 0; axis < dimension_; ++axis) {
    offset_[at(dimension_ * place + axis)] =
        in_patch >= 0 ? patch()->offset()[dimension_ * in_patch + axis]
                      : dot(X(dimension_ * place + axis), patch()->offset_forces().data(), patch_dofs());
  }
}

/// Adds the stored nodes followed by a surface node that is at this place, alone or as a member.
void NearField::follow(const Body& body, Index place, Index surface_node) noexcept {
  const SurfaceParts parts = body.surface_parts(surface_node);
  for (std::size_t k = 0; k < parts.stored.size(); ++k) {
    Index& base = base_of_stored_[at(parts.stored[k])];
    if (base < 0) {
      base = base_count_++;
      base_[at(base)] = parts.stored[k];
      base_uses_[at(base)] = 0;
    }
    ++base_uses_[at(base)];
    const std::size_t part = at(parts_ * place + part_count_[at(place)]++);
    bases_of_[part] = base;
    part_weight_[part] = parts.weights[k];
  }
}

/// Releases the stored nodes that no other place follows; the last one replaces each released one.
void NearField::leave(Index place) noexcept {
  for (Index k = 0; k < part_count_[at(place)]; ++k) {
    const Index base = bases_of_[at(parts_ * place + k)];
    if (--base_uses_[at(base)] > 0) continue;
    base_of_stored_[at(base_[at(base)])] = -1;
    const Index last = --base_count_;
    if (base == last) continue;
    base_[at(base)] = base_[at(last)];
    base_uses_[at(base)] = base_uses_[at(last)];
    base_of_stored_[at(base_[at(base)])] = base;
    for (Index other = 0; other < count_; ++other) {
      const auto first = bases_of_.begin() + std::ptrdiff_t{parts_} * other;
      std::replace(first, first + part_count_[at(other)], last, base);
    }
  }
  part_count_[at(place)] = 0;
}

/// Computes X = Xi_Q for forces on the node, and Y = M X.
void NearField::respond(const Body& body, Index place) noexcept {
  const std::span<const Index> Q = patch()->stored_nodes();
  const std::ptrdiff_t width = patch_dofs();
  for (int axis = 0; axis < dimension_; ++axis) std::fill_n(X(dimension_ * place + axis), width, 0.0);
  for (Index k = 0; k < part_count_[at(place)]; ++k) {
    body.greens().gather(base_[at(bases_of_[at(parts_ * place + k)])], Q,
                         {gathered_.data(), static_cast<std::size_t>(dimension_ * width)});
    const double weight = part_weight_[at(parts_ * place + k)];
    for (int axis = 0; axis < dimension_; ++axis)
      palpate::add(gathered_.data() + axis * width, weight, X(dimension_ * place + axis), width);
  }
  for (int axis = 0; axis < dimension_; ++axis) {
    const double* x = X(dimension_ * place + axis);
    double* y = Y(dimension_ * place + axis);
    for (std::ptrdiff_t dof = 0; dof < width; ++dof)
      y[dof] = dot(patch()->correction(static_cast<Index>(dof)), x, width);
  }
}

/// Computes C between a node and the first `count` nodes, which are those before it and itself; for a group
/// there may be more.
void NearField::connect(const Body& body, Index place, Index count) noexcept {
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
    std::copy_n(blocks_.data() + axis * width, width, C_.data() + (d * place + axis) * stride_);
  // The node's columns are written into each row at once, as each row is in memory of its own.
  for (std::ptrdiff_t dof = 0; dof < width; ++dof) {
    double* entries = C_.data() + dof * stride_ + d * place;
    for (std::ptrdiff_t axis = 0; axis < d; ++axis)
      entries[axis] = blocks_[at(static_cast<Index>(axis * width + dof))];
  }
}

/// Computes C from the members' rows: A^T C A with their maps A.
void NearField::connect_by_members(Index place, Index count) noexcept {
  const std::ptrdiff_t d = dimension_;
  const std::ptrdiff_t width = d * count, after = d * (place + 1);
  std::fill_n(blocks_.data(), d * width, 0.0);
  const auto for_each_entry = [&](auto&& visit) {
    for_each_member(place, [&](Index member, double, const Eigen::Matrix3d& map) {
      for (std::ptrdiff_t a = 0; a < d; ++a) {
        for (std::ptrdiff_t i = 0; i < d; ++i) visit(d * place_of(member) + a, i, map(a, i));
      }
    });
  };
  for_each_entry([&](std::ptrdiff_t dof, std::ptrdiff_t i, double factor) {
    const double* row = C_.data() + dof * stride_;
    double* block = blocks_.data() + i * width;
    palpate::add(row, factor, block, d * place);
    palpate::add(row + after, factor, block + after, width - after);
  });
  for_each_entry([&](std::ptrdiff_t dof, std::ptrdiff_t j, double factor) {
    for (std::ptrdiff_t i = 0; i < d; ++i)
      blocks_[at(static_cast<Index>(i * width + d * place + j))] +=
          factor * blocks_[at(static_cast<Index>(i * width + dof))];
  });
}

/// Displacement of a new node along one axis by forces on a group; `by` has that by forces on stored nodes.
void NearField::connect_to_group(Index group, const double* by, double* block) const noexcept {
  Index part = parts_ * group;  // each member follows one stored node
  std::fill_n(block, dimension_, 0.0);
  for_each_member(group, [&](Index, double, const Eigen::Matrix3d& map) {
    const double* u = by + std::ptrdiff_t{dimension_} * bases_of_[at(part)];
    for (int j = 0; j < dimension_; ++j) {
      for (int a = 0; a < dimension_; ++a) block[j] += part_weight_[at(part)] * map(a, j) * u[a];
    }
    ++part;
  });
}

void NearField::connect_within_patch(Index place) noexcept {
  const Index d = dimension_;
  double* block = blocks_.data();
  for (Index i = 0; i < d; ++i) {
    const double* C = patch()->compliance(d * patch_place(place) + i);
    const double* H = patch()->response(d * patch_place(place) + i);
    for (Index other = 0; other <= place; ++other) {
      for (Index j = 0; j < d; ++j) {
        *block++ =
            patch_place(other) >= 0 ? C[d * patch_place(other) + j] : dot(H, X(d * other + j), patch_dofs());
      }
    }
  }
}

void NearField::connect_beside_patch(const Body& body, Index place) noexcept {
  const Index d = dimension_;
  const std::ptrdiff_t width = std::ptrdiff_t{d} * base_count_;
  std::fill_n(by_base_.data(), d * width, 0.0);
  for (Index k = 0; k < part_count_[at(place)]; ++k) {
    load_.greens(body).gather(base_[at(bases_of_[at(parts_ * place + k)])], {base_.data(), at(base_count_)},
                              {gathered_.data(), static_cast<std::size_t>(d * width)});
    palpate::add(gathered_.data(), part_weight_[at(parts_ * place + k)], by_base_.data(), d * width);
  }
  double* block = blocks_.data();
  for (Index i = 0; i < d; ++i) {
    const double* by = by_base_.data() + i * width;
    for (Index other = 0; other <= place; ++other) {
      if (is_group(other)) {
        connect_to_group(other, by, block);
        block += d;
        continue;
      }
      for (Index j = 0; j < d; ++j) {
        double sum = 0.0;
        if (patch_place(other) >= 0) {
          sum = dot(patch()->response(d * patch_place(other) + j), X(d * place + i), patch_dofs());
        } else {
          for (Index k = 0; k < part_count_[at(other)]; ++k) {
            const auto part = at(parts_ * other + k);
            sum += part_weight_[part] * by[d * bases_of_[part] + j];
          }
          if (patch() != nullptr) sum += dot(X(d * other + j), Y(d * place + i), patch_dofs());
        }
        *block++ = sum;
      }
    }
  }
}

/// Removes a node; the last node takes its place.
void NearField::forget(Index place) noexcept {
  leave(place);
  const Index last = --count_;
  place_[at(node(place))] = -1;
  if (place == last) return;
  const std::ptrdiff_t d = dimension_;
  const std::ptrdiff_t width = d * (last + 1);
  for (std::ptrdiff_t axis = 0; axis < d; ++axis) {
    std::copy_n(C_.data() + (d * last + axis) * stride_, width, C_.data() + (d * place + axis) * stride_);
  }
  for (std::ptrdiff_t dof = 0; dof < width; ++dof) {
    double* row = C_.data() + dof * stride_;
    std::copy_n(row + d * last, d, row + d * place);
  }
  move(last, place);
  if (patch() == nullptr || patch_place(place) >= 0) return;
  for (std::ptrdiff_t axis = 0; axis < d; ++axis) {
    std::copy_n(X(static_cast<Index>(d * last + axis)), patch_dofs(),
                X(static_cast<Index>(d * place + axis)));
    std::copy_n(Y(static_cast<Index>(d * last + axis)), patch_dofs(),
                Y(static_cast<Index>(d * place + axis)));
  }
}

/// Moves all data of a node except C, X and Y.
void NearField::move(Index from, Index to) noexcept {
  nodes_[at(to)] = nodes_[at(from)];
  wanted_[at(to)] = wanted_[at(from)];
  part_count_[at(to)] = part_count_[at(from)];
  std::copy_n(bases_of_.begin() + std::ptrdiff_t{parts_} * from, parts_,
              bases_of_.begin() + std::ptrdiff_t{parts_} * to);
  std::copy_n(part_weight_.begin() + std::ptrdiff_t{parts_} * from, parts_,
              part_weight_.begin() + std::ptrdiff_t{parts_} * to);
  if (is_group(from)) {
    const auto move_members = [&](auto& of_members) {
      std::copy_n(of_members.begin() + std::ptrdiff_t{most_members_} * from, member_count_[at(from)],
                  of_members.begin() + std::ptrdiff_t{most_members_} * to);
    };
    member_count_[at(to)] = member_count_[at(from)];
    move_members(member_);
    move_members(member_weight_);
    move_members(member_map_);
  }
  for (std::vector<double>* of_dofs :
       {&force_, &last_force_, &displacement_, &begun_, &last_motion_, &offset_}) {
    std::copy_n(of_dofs->begin() + std::ptrdiff_t{dimension_} * from, dimension_,
                of_dofs->begin() + std::ptrdiff_t{dimension_} * to);
  }
  place_[at(nodes_[at(to)])] = to;
}

bool NearField::change_patch(const Body& body, std::shared_ptr<const Patch> patch) noexcept {
  if (patch != nullptr && std::ssize(patch->stored_nodes()) > patch_room_) return false;
  for (Index place = 0; patch != nullptr && place < count_; ++place) {
    if (is_group(place) && wanted_[at(place)] == tick_) return false;
  }
  ++revision_;
  for (Index place = 0; place < count_; ++place) leave(place);
  const Index before = count_;
  count_ = 0;
  for (Index place = 0; place < before; ++place) {
    if (wanted_[at(place)] != tick_) {
      place_[at(node(place))] = -1;
    } else {
      move(place, count_++);
    }
  }
  if (load_.patch != nullptr) {
    for (const Index surface_node : load_.patch->surface_nodes()) place_in_patch_[at(surface_node)] = -1;
  }
  load_.patch = std::move(patch);
  if (load_.patch != nullptr) {
    Index k = 0;
    for (const Index surface_node : load_.patch->surface_nodes()) place_in_patch_[at(surface_node)] = k++;
  }
  for (Index place = 0; place < count_; ++place) {
    enter(body, place);
    connect(body, place);
  }
  return true;
}

void NearField::change_compliance(const Body& body, std::shared_ptr<const Greens> compliance) noexcept {
  ++revision_;
  load_.compliance = std::move(compliance);
  bool has_groups = false;
  for (Index place = 0; place < count_; ++place) has_groups = has_groups || is_group(place);
  for (Index place = count_; place-- > 0 && !has_groups;) {
    if (wanted_[at(place)] != tick_ && !is_loaded(place)) forget(place);
  }
  for (Index place = 0; place < count_; ++place) {
    if (!is_group(place)) connect(body, place);
  }
  for (Index place = 0; place < count_; ++place) {  // from their members' rows, which may come later
    if (is_group(place)) connect(body, place, count_);
  }
  for (std::size_t dof = 0; dof < at(dimension_ * count_); ++dof) begun_[dof] -= displacement_[dof];
  displace();
  for (std::size_t dof = 0; dof < at(dimension_ * count_); ++dof) begun_[dof] += displacement_[dof];
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
    force_[dof] += force[axis];
  }
}

/// Adds the load on the patch by the force at a place, for evaluating the displacement there.
void NearField::load_patch(Index place) noexcept {
  const double* f = force_.data() + std::ptrdiff_t{dimension_} * place;
  if (patch_place(place) >= 0) return load_.add_to_patch(patch_place(place), f);
  for (int axis = 0; axis < dimension_; ++axis)
    palpate::add(X(dimension_ * place + axis), f[axis], load_.beside.data(), patch_dofs());
}

/// Adds a force to one of the stored nodes that a place follows.
void NearField::load_base(std::size_t part, const Vec3& f) noexcept {
  double* on_base = base_force_.data() + std::ptrdiff_t{dimension_} * bases_of_[part];
  for (int axis = 0; axis < dimension_; ++axis) on_base[axis] += part_weight_[part] * f[axis];
}

/// Adds the load on stored nodes by a force at a place.
void NearField::load_bases(Index place, const Vec3& f) noexcept {
  std::size_t part = at(parts_ * place);
  if (is_group(place)) {
    for_each_member(place, [&](Index, double, const Eigen::Matrix3d& map) { load_base(part++, map * f); });
    return;
  }
  for (Index k = 0; k < part_count_[at(place)]; ++k) load_base(part++, f);
}

/// Computes the load on stored nodes and on Q by forces [d m].
void NearField::spread(std::span<const double> forces) noexcept {
  std::fill_n(base_force_.data(), dimension_ * base_count_, 0.0);
  std::fill(patch_force_.begin(), patch_force_.end(), 0.0);
  for (Index place = 0; place < count_; ++place) {
    const Vec3 f = vector_at(forces, dimension_, place);
    if (f.isZero(0.0)) continue;
    load_bases(place, f);
    if (patch() == nullptr) continue;
    const Index in_patch = patch_place(place);
    for (int axis = 0; axis < dimension_; ++axis) {
      const double* on_patch =
          in_patch >= 0 ? patch()->response(dimension_ * in_patch + axis) : Y(dimension_ * place + axis);
      palpate::add(on_patch, f[axis], patch_force_.data(), patch_dofs());
    }
  }
}

/// Calls visit(stored node, force) for the result of `spread`.
template <class Visit>
void NearField::for_each_stored_force(Visit&& visit) const noexcept {
  const auto go = [&](const Index* stored, const double* force, Index count) {
    for (Index k = 0; k < count; ++k) {
      const double* f = force + std::ptrdiff_t{dimension_} * k;
      if (std::any_of(f, f + dimension_, [](double value) { return value != 0.0; })) visit(stored[k], f);
    }
  };
  go(base_.data(), base_force_.data(), base_count_);
  if (patch() == nullptr) return;
  const std::span<const Index> Q = patch()->stored_nodes();
  go(Q.data(), patch_force_.data(), static_cast<Index>(Q.size()));
}

void NearField::displace() noexcept {
  const std::ptrdiff_t width = std::ptrdiff_t{dimension_} * count_;
  std::copy_n(offset_.data(), width, displacement_.data());
  load_.clear();
  for (Index place = 0; place < count_; ++place) {
    if (!is_loaded(place)) continue;
    const double* f = force_.data() + std::ptrdiff_t{dimension_} * place;
    if (dimension_ == 3) {
      add_three(row(3 * place).data(), stride_, f, displacement_.data(), width);
    } else {
      for (int axis = 0; axis < dimension_; ++axis)
        palpate::add(row(dimension_ * place + axis).data(), f[axis], displacement_.data(), width);
    }
    if (patch() != nullptr) load_patch(place);
  }
  spread(force_);
  if (patch() != nullptr && patch()->has_offset())
    palpate::add(patch()->offset_forces().data(), 1.0, patch_force_.data(), patch_dofs());
  for_each_stored_force([this](Index stored, const double* f) { load_.add(stored, f); });
}

void NearField::put_on_stored_nodes(std::span<const double> forces, NodalLoad& stored) noexcept {
  spread(forces);
  for_each_stored_force([&](Index node, const double* f) {
    stored.add({&node, 1}, {f, static_cast<std::size_t>(dimension_)}, 1.0);
  });
}

Vec3 NearField::force(Index place) const noexcept {
  return vector_at(force_, dimension_, place);
}

Vec3 NearField::displacement(Index place) const noexcept {
  return vector_at(displacement_, dimension_, place);
}

Vec3 NearField::offset(Index place) const noexcept {
  return vector_at(offset_, dimension_, place);
}

Vec3 NearField::last_motion(Index place) const noexcept {
  return vector_at(last_motion_, dimension_, place);
}

}  // namespace palpate
