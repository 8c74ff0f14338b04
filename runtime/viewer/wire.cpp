#include "runtime/viewer/wire.h"

#include <algorithm>
#include <bit>

#include "runtime/scene/seen_values.h"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are sent as they are in memory");

enum class Kind : std::uint32_t { scene = 1, patch = 2, frame = 3, ticks = 4 };

constexpr std::size_t message_head = 256;  // bytes, about

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
  void add_bytes(std::string_view bytes) { bytes_.append(bytes); }
  void pad() { bytes_.resize((bytes_.size() + 3) / 4 * 4); }
  void add_count(std::size_t count) { add(static_cast<std::uint32_t>(count)); }
  void add_vector(const Vec3& v) {
    for (const double x : v) add(static_cast<float>(x));
  }
  void add_pose(const ToolPose& pose) {
    add_vector(pose.position);
    for (const double part : pose.orientation.coeffs()) add(static_cast<float>(part));  // x, y, z, w
  }

  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

template <std::size_t corners>
void add_nodes(WireMessage& message, const std::vector<std::array<Index, corners>>& simplices,
               std::span<const std::uint32_t> places = {}) {
  for (const std::array<Index, corners>& nodes : simplices) {
    for (const Index node : nodes)
      message.add(places.empty() ? static_cast<std::uint32_t>(node) : places[static_cast<std::size_t>(node)]);
  }
}

void add_bytes_of(WireMessage& message, const std::vector<std::uint8_t>& numbers) {
  message.pad();
  for (const std::uint8_t number : numbers) message.add(number);
}

/// Appends the part of a scene with several materials.
void add_materials(WireMessage& message, const Scene& scene) {
  const InnerSurface& inner = scene.inner;
  message.pad();
  message.add_count(inner.nodes.size());
  message.add_count(inner.triangles.size());
  for (const Vec3& node : inner.nodes) message.add_vector(node);
  add_nodes(message, inner.triangles);
  add_bytes_of(message, scene.materials);
  add_bytes_of(message, inner.inside);
  add_bytes_of(message, inner.outside);
}

/// Returns the index of each node in the order of the scene.
std::vector<std::uint32_t> places_in_order(const Scene& scene) {
  std::vector<std::uint32_t> places(scene.order.size());
  for (std::size_t k = 0; k < places.size(); ++k)
    places[static_cast<std::size_t>(scene.order[k])] = static_cast<std::uint32_t>(k);
  return places;
}

}  // namespace

std::string encode_scene(const Scene& scene) {
  WireMessage message(Kind::scene, scene.number);
  message.add_count(static_cast<std::size_t>(scene.dimension));
  message.add_count(scene.nodes.size());
  message.add_count(scene.triangles.size());
  message.add_count(scene.edges.size());
  const std::vector<std::uint32_t> places = places_in_order(scene);
  message.reserve(message_head + 13 * scene.nodes.size() + 12 * scene.triangles.size() +
                  8 * scene.edges.size());
  for (const Index node : scene.order) message.add_vector(scene.nodes[static_cast<std::size_t>(node)]);
  add_nodes(message, scene.triangles, places);
  add_nodes(message, scene.edges, places);
  for (const Index node : scene.order) message.add(scene.held[static_cast<std::size_t>(node)]);
  if (!scene.materials.empty()) add_materials(message, scene);
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
  if (!patch.materials.empty()) add_bytes_of(message, patch.materials);
  return message.take();
}

std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch,
                         const WireValues& values, const WireValues* base) {
  const SeenValues seen(picture, scene, patch);
  const std::vector<SeenValues::Pressure> pressures = seen.pressures();
  const std::string bits = encode_values(values, base);

  WireMessage message(Kind::frame, scene.number);
  message.reserve(message_head + 40 * picture.contacts.size() + 8 * pressures.size() + bits.size());
  message.add(static_cast<double>(picture.frame.tick));
  message.add(picture.frame.time);
  message.add(values.number);
  message.add(base == nullptr ? std::uint32_t{0} : base->number);
  message.add(values.exponent_u);
  message.add(values.exponent_stress);
  message.add_pose(picture.tool);
  message.add_pose(picture.device);
  message.add_vector(picture.on_body.force);
  message.add_vector(picture.on_body.torque);
  message.add(static_cast<std::uint32_t>(picture.status));
  message.add_count(picture.contacts.size());
  message.add(values.patch);
  message.add_count(seen.patch_nodes());
  message.add_count(pressures.size());
  message.add(static_cast<float>(picture.force_error));
  message.add_count(static_cast<std::size_t>(picture.left_out));
  message.add(static_cast<float>(picture.greens_error));
  for (const SeenContact& contact : picture.contacts) {
    message.add_vector(contact.position);
    message.add_vector(contact.normal);
    message.add_vector(contact.force);
    message.add(contact.held ? 1.0F : 0.0F);
  }
  std::vector<std::uint32_t> places;
  if (!pressures.empty()) places = places_in_order(scene);
  for (const SeenValues::Pressure& pressure : pressures) {
    const auto node = static_cast<std::size_t>(pressure.node);
    message.add(node < places.size() ? places[node] : static_cast<std::uint32_t>(node));
  }
  for (const SeenValues::Pressure& pressure : pressures) message.add(pressure.value);
  message.add_bytes(bits);
  return message.take();
}

std::string encode_frame(const SurfacePicture& picture, const Scene& scene, const ScenePatch* patch) {
  return encode_frame(picture, scene, patch, wire_values(picture, scene, patch, 1), nullptr);
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
