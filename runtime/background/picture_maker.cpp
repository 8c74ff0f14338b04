#include "runtime/background/picture_maker.h"

#include <array>
#include <cstddef>
#include <map>
#include <string>

#include "base/error.h"

namespace palpate {

bool pictures_follow_from_contacts(const Body& body) noexcept {
  return body.live() == nullptr && body.contact_model() == ContactModel::quasi_static &&
         body.model().dynamics.method == DynamicsMethod::none && body.refinement() == 1;
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
  surface_displacement(body_, load, stored_, u_, motion);
  frame.displacement.reserve(3 * u_.size());
  for (std::size_t node = 0; node < u_.size(); ++node) {
    u_[node] += rest_[node];
    for (const double x : u_[node]) frame.displacement.push_back(static_cast<float>(x));
  }
  show_stress(forces, load.patch.get(), frame);
  show_pressure(presses, frame);
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

SurfaceFrame PictureMaker::picture(const ContactLoads& loads) {
  const auto count = static_cast<Index>(loads.node.size());
  SurfaceLoad load(body_.dimension(), 0, count, 0);
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
    const SurfaceParts parts = body_.surface_parts(node);
    if (!parts.stored.empty()) load.add(parts.stored.front(), forces.back().force.data());
  }
  SurfaceFrame frame{.tick = loads.tick, .time = loads.time};
  show(load, nullptr, forces, presses, frame);
  return frame;
}

}  // namespace palpate
