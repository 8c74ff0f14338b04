#include "runtime/background/picture_maker.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <numeric>
#include <optional>
#include <string>

#include "base/error.h"
#include "base/vectors.h"
#include "runtime/depth/coarse_parts.h"

namespace palpate {

namespace {

/// Sorts numbers, and leaves each once.
void sort_out(std::vector<Index>& numbers) {
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
}

}  // namespace

bool pictures_follow_from_contacts(const Body& body) noexcept {
  const bool is_static = body.coarse() != nullptr || (body.contact_model() == ContactModel::quasi_static &&
                                                      body.model().dynamics.method == DynamicsMethod::none);
  return body.live() == nullptr && is_static && (body.refinement() == 1 || body.local() != nullptr);
}

ContactLoads contact_loads(std::span<const NodalForce> forces, std::span<const NodalPress> presses) {
  std::map<Index, std::array<double, 4>> at;
  for (const NodalForce& loaded : forces)
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[loaded.node][axis] += loaded.force[static_cast<Eigen::Index>(axis)];
  for (const NodalPress& pressed : presses) at[pressed.node][3] += pressed.force;
  ContactLoads loads;
  for (const auto& [node, sum] : at) {
    loads.node.push_back(node);
    for (std::size_t axis = 0; axis < 3; ++axis) loads.force.push_back(static_cast<float>(sum[axis]));
    loads.press.push_back(static_cast<float>(sum[3]));
  }
  return loads;
}

PictureMaker::PictureMaker(const Body& body)
    : body_(body),
      rest_(body.surface_in_mesh()),
      stored_(static_cast<std::size_t>(body.greens().order())),
      u_(rest_.size()),
      stress_(body),
      force_(rest_.size(), Vec3::Zero()),
      nodal_stress_(rest_.size()) {
  for (std::size_t node = 0; node < rest_.size(); ++node)
    rest_[node] = body.surface_rest_positions()[node] - rest_[node];
}

void PictureMaker::show(const SurfaceLoad& load, const MotionSnapshot* motion,
                        std::span<const NodalForce> forces, std::span<const NodalPress> presses,
                        SurfaceFrame& frame) {
  const std::shared_ptr<const Patch> part = fine_part(load);
  std::vector<Index> drawn;
  if (load.local_now() != nullptr) {
    drawn.resize(body_.surface_stored_nodes().size());
    std::iota(drawn.begin(), drawn.end(), 0);
    if (part != nullptr)
      drawn.insert(drawn.end(), part->surface_nodes().begin(), part->surface_nodes().end());
    sort_out(drawn);
  }
  surface_displacement(body_, load, stored_, u_, motion,
                       drawn.empty() ? std::nullopt : std::optional(std::span<const Index>(drawn)));
  frame.displacement.resize(3 * u_.size());
  const auto enter = [&](std::size_t node) {
    u_[node] += rest_[node];
    for (std::size_t axis = 0; axis < 3; ++axis)
      frame.displacement[3 * node + axis] = static_cast<float>(u_[node][static_cast<Eigen::Index>(axis)]);
  };
  for (const Index node : drawn) enter(static_cast<std::size_t>(node));
  for (std::size_t node = 0; node < u_.size() && drawn.empty(); ++node) enter(node);
  show_stress(forces, part != nullptr ? part.get() : load.patch.get(), frame);
  show_pressure(presses, frame);
}

void keep_recorded(const Body& body, SurfaceFrame& frame) {
  if (body.local() == nullptr) return;
  const std::size_t own = body.surface_stored_nodes().size();
  frame.displacement.resize(3 * own);
  frame.von_mises.resize(own);
  frame.pressure.resize(own);
}

std::shared_ptr<const Patch> PictureMaker::fine_part(const SurfaceLoad& load) {
  if (load.local_now() == nullptr || load.point_count == 0 || body_.refinement() == 1) return nullptr;
  if (part_ != nullptr && box_of_part_.contains(load.points_box)) return part_;
  const Vec3 beside = Vec3::Constant(0.25 * load.local->reach());
  box_of_part_ = {load.points_box.min() - beside, load.points_box.max() + beside};
  const Eigen::AlignedBox3d box(box_of_part_.min() - beside, box_of_part_.max() + beside);
  const FineSurface& fine = body_.fine_surface();
  const auto corners = [&](std::size_t simplex) { return body_.simplices().subspan(3 * simplex, 3); };
  Patch::Parts parts;
  for (std::size_t simplex = 0; simplex < fine.element.size(); ++simplex) {
    if (box.contains(load.local->point(corners(simplex)[0]).x))
      parts.elements.push_back(fine.element[simplex]);
  }
  sort_out(parts.elements);
  for (std::size_t simplex = 0; simplex < fine.element.size(); ++simplex) {
    if (!std::binary_search(parts.elements.begin(), parts.elements.end(), fine.element[simplex])) continue;
    for (const Index node : corners(simplex)) parts.surface_nodes.push_back(node);
  }
  sort_out(parts.surface_nodes);
  part_ = std::make_shared<const Patch>(std::move(parts));
  return part_;
}

void PictureMaker::show_stress(std::span<const NodalForce> forces, const Patch* patch, SurfaceFrame& frame) {
  for (const NodalForce& loaded : forces) force_[loaded.node] += loaded.force;
  stress_.evaluate(u_, force_, patch, nodal_stress_);
  for (const NodalForce& loaded : forces) force_[loaded.node].setZero();
  frame.von_mises.reserve(nodal_stress_.size());
  for (const Stress& stress : nodal_stress_) frame.von_mises.push_back(static_cast<float>(von_mises(stress)));
}

void PictureMaker::show_pressure(std::span<const NodalPress> presses, SurfaceFrame& frame) const {
  frame.pressure.resize(u_.size());
  for (const NodalPress& pressed : presses) {
    const auto node = static_cast<std::size_t>(pressed.node);
    frame.pressure[node] += static_cast<float>(pressed.force / stress_.areas()[node]);
  }
}

void PictureMaker::follow_field(const std::vector<float>& field, SurfaceLoad& load,
                                MotionSnapshot& motion) const {
  const auto dofs = static_cast<std::size_t>(body_.coarse()->dofs());
  if (field.size() != dofs) {
    throw Error("field has " + std::to_string(field.size()) + " numbers, and the body's coarse field " +
                    std::to_string(dofs),
                "/contacts", "give the model that was recorded");
  }
  const std::vector<double> q(field.begin(), field.end());
  TwoLevelState state = at_rest(body_.coarse());
  state.H_inverse.setZero();  // q has what the forces move it by
  for (Index node = 0; node < body_.greens().nodes(); ++node) {
    const CoarseAt at = coarse_at(*body_.coarse(), node, q);
    state.turns[static_cast<std::size_t>(node)].R = at.R;
    set_vector(motion.u, body_.dimension(), node, at.moved);
  }
  motion.moves = true;
  load.compliance = load.local != nullptr ? two_levels({load.local, &load.local->smooth()}, std::move(state))
                                          : two_levels(body_.shared_greens(), std::move(state));
}

SurfaceFrame PictureMaker::picture(const ContactLoads& loads) {
  const auto count = static_cast<Index>(loads.node.size());
  SurfaceLoad load(body_, count, body_.most_surface_parts() * count, 0);
  std::vector<NodalForce> forces;
  std::vector<NodalPress> presses;
  for (std::size_t k = 0; k < loads.node.size(); ++k) {
    const Index node = loads.node[k];
    if (node < 0 || static_cast<std::size_t>(node) >= u_.size())
      throw Error("is no node of the surface: " + std::to_string(node), "/contacts",
                  "give the model that was recorded");
    const float* f = loads.force.data() + 3 * k;
    forces.push_back({node, Vec3(f[0], f[1], f[2])});
    presses.push_back({node, loads.press[k]});
    load.add_point(node, forces.back().force);
    const SurfaceParts parts = body_.surface_parts(node);
    for (std::size_t part = 0; part < parts.stored.size(); ++part) {
      const Vec3 shared = parts.weights[part] * forces.back().force;
      load.add(parts.stored[part], shared.data());
    }
  }
  SurfaceFrame frame{.tick = loads.tick, .time = loads.time};
  MotionSnapshot motion(body_);
  if (body_.coarse() != nullptr) follow_field(loads.field, load, motion);
  show(load, &motion, forces, presses, frame);
  keep_recorded(body_, frame);
  return frame;
}

}  // namespace palpate
