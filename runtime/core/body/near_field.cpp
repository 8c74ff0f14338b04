#include "runtime/core/body/near_field.h"

#include <algorithm>
#include <utility>

#include "base/vectors.h"
#include "runtime/core/solve/tick_tuning.h"
#include "runtime/core/solve/vector_loops.h"

namespace palpate {
namespace {

constexpr std::ptrdiff_t beyond_row = 2;  // numbers readable past a row: four are read at the last node

}  // namespace

NearField::NearField(const ElasticBody& body, Index capacity, Index patch_nodes)
    : dimension_(body.dimension()),
      capacity_(capacity),
      surface_nodes_(static_cast<Index>(body.surface_rest_positions().size())),
      most_members_(body.aggregates().most_members()),
      stride_((static_cast<std::ptrdiff_t>(dimension_) * capacity + beyond_row + 7) / 8 * 8),
      place_(at(body.aggregate_node(body.aggregates().count())), -1),
      nodes_(at(capacity), -1),
      wanted_(at(capacity), 0),
      C_(stride_ * dimension_ * capacity),
      force_(at(dimension_ * capacity)),
      last_force_(force_.size()),
      displacement_(force_.size()),
      begun_(force_.size()),
      last_motion_(force_.size()),
      offset_(force_.size()),
      followed_(dimension_, capacity, std::max(body.most_surface_parts(), most_members_),
                body.greens().nodes(), body.most_surface_parts() > 1),
      members_{std::vector<Index>(at(capacity)), std::vector<Index>(at(most_members_ * capacity)),
               std::vector<double>(at(most_members_ * capacity)),
               std::vector<Eigen::Matrix3d>(at(most_members_ * capacity))},
      local_points_(body.local() != nullptr ? capacity : 0),
      load_(body, std::max<Index>(most_members_, 1) * capacity, followed_.room(), patch_nodes) {
  beside_.room = patch_nodes;
  beside_.stride = (static_cast<std::ptrdiff_t>(dimension_) * patch_nodes + 7) / 8 * 8;
  beside_.place_in_patch.assign(place_.size(), -1);
  beside_.X.resize(force_.size() * static_cast<std::size_t>(beside_.stride));
  beside_.Y.resize(beside_.X.size());
  beside_.force.resize(static_cast<std::size_t>(beside_.stride));
  const auto blocks = [d = dimension_](Index nodes) { return at(d * d * nodes); };
  work_.blocks.resize(blocks(capacity));
  work_.by_followed.resize(blocks(followed_.room()));
  if (body.local() != nullptr) work_.local.resize(blocks(capacity));
  work_.gathered.resize(blocks(patch_nodes));
  work_.fine_row.resize(patch_nodes > 0 ? at(dimension_ * Patch::most_nodes) : 0);
}

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
  added_blocks_ = 0;
  for (std::size_t dof = 0; dof < at(dimension_ * count_); ++dof) {
    last_motion_[dof] = displacement_[dof] - begun_[dof];
    begun_[dof] = displacement_[dof];
  }
  const bool is_fine = load_.local != nullptr;
  const std::int64_t patience =
      is_fine ? tuning.body.fine_patience
              : tuning.body.patience * tuning.body.usual_nodes / std::max(count_, tuning.body.usual_nodes);
  for (int k = 0; k < (is_fine ? tuning.body.most_forgotten : 2); ++k) {
    const Index place = longest_unwanted();
    if (place < 0 || wanted_[place] + patience >= tick_) return;
    forget(place);
  }
}

bool NearField::want(const ElasticBody& body, Index surface_node) noexcept {
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

bool NearField::want_group(const ElasticBody& body, Index group, std::span<const double> weights,
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
  Index& count = members_.count[at(count_)];
  count = 0;
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (weights[k] == 0.0) continue;
    const std::size_t to = at(most_members_ * count_ + count++);
    members_.node[to] = members[k];
    members_.weight[to] = weights[k];
    members_.map[to] = maps[k];
  }
  add(body, node);
  wanted_[at(place_of(node))] = tick_;
  return true;
}

void NearField::add(const ElasticBody& body, Index surface_node) noexcept {
  const Index place = count_++;
  added_blocks_ += count_;
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
void NearField::enter(const ElasticBody& body, Index place) noexcept {
  std::fill_n(offset_.begin() + std::ptrdiff_t{dimension_} * place, dimension_, 0.0);
  if (load_.local != nullptr)
    local_points_.set(place, is_group(place) ? LocalCompliance::Point{} : load_.local->point(node(place)));
  if (is_group(place)) {
    for_each_member(place,
                    [&](Index member, double, const Eigen::Matrix3d&) { follow(body, place, member); });
    return;
  }
  if (patch_place(place) < 0) {
    follow(body, place, node(place));
    if (patch() != nullptr) respond(body, place);
  } else {
    respond_within(place);
  }
  if (patch() != nullptr && patch()->has_offset()) find_offset(place);
}

void NearField::find_offset(Index place) noexcept {
  const Index in_patch = patch_place(place);
  for (Index axis = 0; axis < dimension_; ++axis) {
    offset_[at(dimension_ * place + axis)] =
        in_patch >= 0 ? 0.0
                      : dot(X(dimension_ * place + axis), patch()->offset_forces().data(), patch_dofs());
    if (in_patch < 0) continue;
    patch()->for_each_part(in_patch, [&](Index node, double weight) {
      offset_[at(dimension_ * place + axis)] += weight * patch()->offset()[dimension_ * node + axis];
    });
  }
}

/// Adds the stored nodes followed by a surface node that is at this place, alone or as a member.
void NearField::follow(const ElasticBody& body, Index place, Index surface_node) noexcept {
  const SurfaceParts parts = body.surface_parts(surface_node);
  for (std::size_t k = 0; k < parts.stored.size(); ++k)
    followed_.add(place, parts.stored[k], parts.weights[k]);
}

/// Removes a node; the last node takes its place.
void NearField::forget(Index place) noexcept {
  followed_.leave(place, count_);
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
    for (std::ptrdiff_t axis = 0; axis < d; ++axis) row[d * place + axis] = row[d * last + axis];
  }
  move(last, place);
  if (patch() == nullptr) return;
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
  followed_.move(from, to);
  if (load_.local != nullptr) local_points_.move(from, to);
  if (is_group(from)) {
    const auto move_members = [&](auto& of_members) {
      std::copy_n(of_members.begin() + std::ptrdiff_t{most_members_} * from, members_.count[at(from)],
                  of_members.begin() + std::ptrdiff_t{most_members_} * to);
    };
    members_.count[at(to)] = members_.count[at(from)];
    move_members(members_.node);
    move_members(members_.weight);
    move_members(members_.map);
  }
  for (std::vector<double>* of_dofs :
       {&force_, &last_force_, &displacement_, &begun_, &last_motion_, &offset_}) {
    std::copy_n(of_dofs->begin() + std::ptrdiff_t{dimension_} * from, dimension_,
                of_dofs->begin() + std::ptrdiff_t{dimension_} * to);
  }
  place_[at(nodes_[at(to)])] = to;
}

bool NearField::change_patch(const ElasticBody& body, std::shared_ptr<const Patch> patch) noexcept {
  if (patch != nullptr && (std::ssize(patch->stored_nodes()) > beside_.room || !load_.fits(*patch)))
    return false;
  for (Index place = 0; patch != nullptr && place < count_; ++place) {
    if (is_group(place) && wanted_[at(place)] == tick_) return false;
  }
  ++revision_;
  for (Index place = 0; place < count_; ++place) followed_.leave(place, count_);
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
    for (const Index surface_node : load_.patch->surface_nodes())
      beside_.place_in_patch[at(surface_node)] = -1;
  }
  load_.patch = std::move(patch);
  if (load_.patch != nullptr) {
    Index k = 0;
    for (const Index surface_node : load_.patch->surface_nodes())
      beside_.place_in_patch[at(surface_node)] = k++;
  }
  for (Index place = 0; place < count_; ++place) {
    enter(body, place);
    connect(body, place);
  }
  return true;
}

void NearField::change_compliance(const ElasticBody& body,
                                  std::shared_ptr<const Greens> compliance) noexcept {
  ++revision_;
  load_.compliance = std::move(compliance);
  followed_.forget_compliance();
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
  double largest = 0.0;
  for (Index place = 0; place < count_; ++place) largest = std::max(largest, force(place).norm());
  for (Index place = 0; place < count_; ++place) {
    if (wanted_[at(place)] != tick_ && force(place).norm() < tuning.passes.left_behind * largest)
      std::fill_n(force_.begin() + std::ptrdiff_t{dimension_} * place, dimension_, 0.0);
  }
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

/// Adds the load of a force at a place to the stored nodes that it follows.
void NearField::load_followed(Index place, const Vec3& f) noexcept {
  const std::span<const FollowedNodes::Part> parts = followed_.parts(place);
  if (is_group(place)) {
    const FollowedNodes::Part* part = parts.data();
    for_each_member(place,
                    [&](Index, double, const Eigen::Matrix3d& map) { followed_.load(*part++, map * f); });
    return;
  }
  for (const FollowedNodes::Part& part : parts) followed_.load(part, f);
}

/// Computes the load on stored nodes and on Q by forces [d m].
void NearField::spread(std::span<const double> forces) noexcept {
  followed_.unload();
  std::fill(beside_.force.begin(), beside_.force.end(), 0.0);
  for (Index place = 0; place < count_; ++place) {
    const Vec3 f = vector_at(forces, dimension_, place);
    if (f.isZero(0.0)) continue;
    load_followed(place, f);
    if (patch() == nullptr) continue;
    for (int axis = 0; axis < dimension_; ++axis)
      palpate::add(Y(dimension_ * place + axis), f[axis], beside_.force.data(), patch_dofs());
  }
}

/// Calls visit(stored node, force) for the result of `spread`.
template <class Visit>
void NearField::for_each_stored_force(Visit&& visit) const noexcept {
  const auto go = [&](std::span<const Index> stored, std::span<const double> force) {
    for (std::size_t k = 0; k < stored.size(); ++k) {
      const double* f = force.data() + static_cast<std::size_t>(dimension_) * k;
      if (std::any_of(f, f + dimension_, [](double value) { return value != 0.0; })) visit(stored[k], f);
    }
  };
  go(followed_.nodes(), followed_.forces());
  if (patch() == nullptr) return;
  const std::span<const Index> Q = patch()->stored_nodes();
  go(Q, beside_.force);
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
    if (load_.local_now() == nullptr) continue;
    const Vec3 force = vector_at(force_, dimension_, place);
    if (is_group(place)) {
      for_each_member(place, [&](Index member, double, const Eigen::Matrix3d& map) {
        load_.add_point(member, map * force);
      });
    } else {
      load_.add_point(node(place), force);
    }
  }
  load_.lump_points();
  spread(force_);
  if (patch() != nullptr && patch()->has_offset())
    palpate::add(patch()->offset_forces().data(), 1.0, beside_.force.data(), patch_dofs());
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
