#include "runtime/viewer/wire.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "runtime/viewer/seen_values.h"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are sent as they are in memory");

enum class Kind : std::uint32_t { scene = 1, patch = 2, frame = 3, ticks = 4 };

constexpr std::size_t alignment = 4;
constexpr float largest_displacement = 32767.0F;
constexpr float largest_stress = 65534.0F;

class WireMessage {
 public:
  WireMessage(Kind kind, std::uint32_t scene) {
    add(static_cast<std::uint32_t>(kind));
    add(scene);
  }

  template <class Number>
  void add(Number number) {
    bytes_.append(reinterpret_cast<const char*>(&number), sizeof number);
  }
  void add_count(std::size_t count) { add(static_cast<std::uint32_t>(count)); }
  void add_vector(const Vec3& v) {
    for (const double x : v) add(static_cast<float>(x));
  }
  void add_pose(const ToolPose& pose) {
    add_vector(pose.position);
    for (const double part : pose.orientation.coeffs()) add(static_cast<float>(part));  // x, y, z, w
  }

  /// Before each array whose numbers may be smaller than the alignment, and after it.
  void align() { bytes_.resize((bytes_.size() + alignment - 1) / alignment * alignment, '\0'); }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

template <std::size_t corners>
void add_nodes(WireMessage& message, const std::vector<std::array<Index, corners>>& simplices) {
  for (const std::array<Index, corners>& nodes : simplices) {
    for (const Index node : nodes) message.add(static_cast<std::uint32_t>(node));
  }
}

/// So that the largest value is the largest number.
float unit_of(float largest_value, float largest_number) {
  return largest_value > 0.0F ? largest_value / largest_number : 0.0F;
}

float in_unit(float value, float unit, float largest_number) {
  if (!std::isfinite(value) || unit == 0.0F) return 0.0F;
  return std::clamp(std::round(value / unit), -largest_number, largest_number);
}

}  // namespace

std::string encode_scene(const Scene& scene) {
  WireMessage message(Kind::scene, scene.number);
  message.add_count(static_cast<std::size_t>(scene.dimension));
  message.add_count(scene.nodes.size());
  message.add_count(scene.triangles.size());
  message.add_count(scene.edges.size());
  for (const Vec3& node : scene.nodes) message.add_vector(node);
  add_nodes(message, scene.triangles);
  add_nodes(message, scene.edges);
  for (const std::uint8_t axes : scene.held) message.add(axes);
  return message.take();
}

std::string encode_patch(std::uint32_t scene, const ScenePatch& patch) {
  WireMessage message(Kind::patch, scene);
  message.add(patch.number);
  message.add_count(patch.hidden.size());
  message.add_count(patch.nodes.size());
  message.add_count(patch.triangles.size());
  message.add_count(patch.outline.size());
  for (const Index triangle : patch.hidden) message.add(static_cast<std::uint32_t>(triangle));
  for (const Vec3& node : patch.nodes) message.add_vector(node);
  add_nodes(message, patch.triangles);
  add_nodes(message, patch.outline);
  return message.take();
}

bool fits(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch) {
  const std::vector<float>& of_scene =
      scene.is_plane ? picture.plane_displacement : picture.frame.displacement;
  if (of_scene.size() < 3 * scene.nodes.size()) return false;
  return patch == nullptr || patch->surface_nodes.empty() ||
         picture.frame.displacement.size() >= 3 * (static_cast<std::size_t>(patch->surface_nodes.back()) + 1);
}

std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch) {
  const SeenValues values(picture, scene, patch);
  const std::size_t nodes = values.scene_nodes();
  const std::size_t all_nodes = nodes + values.patch_nodes();
  float largest_u = 0.0F;
  float largest_von_mises = 0.0F;
  for (std::size_t k = 0; k < all_nodes; ++k) {
    for (const float u : std::span(values.displacement(k), 3)) {
      if (std::isfinite(u)) largest_u = std::max(largest_u, std::abs(u));
    }
    if (std::isfinite(values.von_mises(k)))
      largest_von_mises = std::max(largest_von_mises, values.von_mises(k));
  }
  const float unit_u = unit_of(largest_u, largest_displacement);
  const float unit_stress = unit_of(largest_von_mises, largest_stress);
  const std::vector<SeenValues::Pressure> pressures = values.pressures();

  WireMessage message(Kind::frame, scene.number);
  message.reserve(256 + 40 * picture.contacts.size() + 8 * pressures.size() + 8 * all_nodes);
  message.add(static_cast<double>(picture.frame.tick));
  message.add(picture.frame.time);
  message.add_pose(picture.tool);
  message.add_pose(picture.device);
  message.add_vector(picture.on_body.force);
  message.add_vector(picture.on_body.torque);
  message.add(unit_u);
  message.add(unit_stress);
  message.add(static_cast<std::uint32_t>(picture.status));
  message.add_count(picture.contacts.size());
  message.add(patch == nullptr ? std::uint32_t{0} : patch->number);
  message.add_count(values.patch_nodes());
  message.add_count(pressures.size());
  message.add(static_cast<float>(picture.force_error));
  message.add_count(static_cast<std::size_t>(picture.left_out));
  for (const SeenContact& contact : picture.contacts) {
    message.add_vector(contact.position);
    message.add_vector(contact.normal);
    message.add_vector(contact.force);
    message.add(contact.held ? 1.0F : 0.0F);
  }
  for (const SeenValues::Pressure& pressure : pressures)
    message.add(static_cast<std::uint32_t>(pressure.node));
  for (const SeenValues::Pressure& pressure : pressures) message.add(pressure.value);

  const auto add_values = [&](std::size_t first, std::size_t end) {
    for (std::size_t k = first; k < end; ++k) {
      for (const float u : std::span(values.displacement(k), 3))
        message.add(static_cast<std::int16_t>(in_unit(u, unit_u, largest_displacement)));
    }
    message.align();
    for (std::size_t k = first; k < end; ++k) {
      const float stress = values.von_mises(k);
      message.add(std::isfinite(stress) ? static_cast<std::uint16_t>(
                                              std::max(0.0F, in_unit(stress, unit_stress, largest_stress)))
                                        : unknown_stress);
    }
  };
  add_values(0, nodes);
  message.align();
  add_values(nodes, all_nodes);
  return message.take();
}

std::string encode_ticks(std::uint32_t scene, std::span<const TickNote> ticks, std::int64_t stride) {
  WireMessage message(Kind::ticks, scene);
  message.add(static_cast<double>(ticks.front().number));
  message.add_count(ticks.size());
  message.add(static_cast<std::uint32_t>(stride));
  for (const TickNote& tick : ticks) message.add_vector(tick.force);
  for (const TickNote& tick : ticks) message.add(static_cast<float>(tick.shown));
  for (const TickNote& tick : ticks) message.add(static_cast<float>(tick.depth));
  for (const TickNote& tick : ticks)
    message.add(static_cast<float>(1e-3 * static_cast<double>(tick.lateness_ns)));
  for (const TickNote& tick : ticks)
    message.add(static_cast<float>(1e-3 * static_cast<double>(tick.compute_ns)));
  for (const TickNote& tick : ticks) message.add(static_cast<std::uint32_t>(tick.status));
  for (const TickNote& tick : ticks) message.add(static_cast<float>(tick.force_error));
  for (const TickNote& tick : ticks) message.add(static_cast<std::uint32_t>(tick.left_out));
  for (const TickNote& tick : ticks)
    message.add(static_cast<std::uint8_t>(std::clamp(tick.contacts, std::int32_t{0}, std::int32_t{255})));
  return message.take();
}

}  // namespace palpate
