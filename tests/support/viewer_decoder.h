// The messages of web/PROTOCOL.md as a reader of that text would decode them.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace palpate::test {

/// Takes numbers off a message's front.
class Bytes {
 public:
  explicit Bytes(std::string bytes) : bytes_(std::move(bytes)) {}

  template <class Number>
  Number take() {
    if (at_ + sizeof(Number) > bytes_.size()) throw std::out_of_range("the message is too short");
    Number number{};
    std::memcpy(&number, bytes_.data() + at_, sizeof number);
    at_ += sizeof number;
    return number;
  }
  template <class Number>
  std::vector<Number> array(std::size_t count) {
    at_ = (at_ + 3) / 4 * 4;
    std::vector<Number> numbers;
    for (std::size_t k = 0; k < count; ++k) numbers.push_back(take<Number>());
    return numbers;
  }
  std::uint32_t u32() { return take<std::uint32_t>(); }
  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  std::size_t at_ = 0;
};

struct DecodedScene {
  std::uint32_t scene, dimension;
  std::vector<float> position;
  std::vector<std::uint32_t> triangle, edge;
  std::vector<std::uint8_t> held;
};

inline DecodedScene decode_scene(const std::string& message) {
  Bytes bytes(message);
  if (bytes.u32() != 1) throw std::invalid_argument("no scene");
  DecodedScene scene{};
  scene.scene = bytes.u32();
  scene.dimension = bytes.u32();
  const std::size_t S = bytes.u32();
  const std::size_t T = bytes.u32();
  const std::size_t E = bytes.u32();
  scene.position = bytes.array<float>(3 * S);
  scene.triangle = bytes.array<std::uint32_t>(3 * T);
  scene.edge = bytes.array<std::uint32_t>(2 * E);
  scene.held = bytes.array<std::uint8_t>(S);
  if (!bytes.at_end()) throw std::invalid_argument("the scene is too long");
  return scene;
}

struct DecodedPatch {
  std::uint32_t scene, patch;
  std::vector<std::uint32_t> hidden;
  std::vector<float> position;
  std::vector<std::uint32_t> triangle, outline;
};

inline DecodedPatch decode_patch(const std::string& message) {
  Bytes bytes(message);
  if (bytes.u32() != 2) throw std::invalid_argument("no patch");
  DecodedPatch patch{};
  patch.scene = bytes.u32();
  patch.patch = bytes.u32();
  const std::size_t H = bytes.u32();
  const std::size_t m = bytes.u32();
  const std::size_t t = bytes.u32();
  const std::size_t o = bytes.u32();
  patch.hidden = bytes.array<std::uint32_t>(H);
  patch.position = bytes.array<float>(3 * m);
  patch.triangle = bytes.array<std::uint32_t>(3 * t);
  patch.outline = bytes.array<std::uint32_t>(2 * o);
  if (!bytes.at_end()) throw std::invalid_argument("the patch is too long");
  return patch;
}

struct DecodedFrame {
  std::uint32_t scene;
  double tick, time;
  std::vector<float> tool, device, force, torque;
  float unit_u, unit_stress;
  std::uint32_t status, contacts, patch, patch_nodes;
  float force_error;
  std::uint32_t left_out;
  std::vector<float> contact;
  std::vector<std::uint32_t> pressure_node;
  std::vector<float> pressure;
  std::vector<float> u;       // of the scene's nodes, then of the patch's [m]
  std::vector<float> stress;  // likewise [Pa]; -1 where it is not known
};

inline DecodedFrame decode_frame(const std::string& message, std::size_t scene_nodes) {
  Bytes bytes(message);
  if (bytes.u32() != 3) throw std::invalid_argument("no frame");
  DecodedFrame frame{};
  frame.scene = bytes.u32();
  frame.tick = bytes.take<double>();
  frame.time = bytes.take<double>();
  frame.tool = bytes.array<float>(7);
  frame.device = bytes.array<float>(7);
  frame.force = bytes.array<float>(3);
  frame.torque = bytes.array<float>(3);
  frame.unit_u = bytes.take<float>();
  frame.unit_stress = bytes.take<float>();
  frame.status = bytes.u32();
  frame.contacts = bytes.u32();
  frame.patch = bytes.u32();
  frame.patch_nodes = bytes.u32();
  const std::size_t q = bytes.u32();
  frame.force_error = bytes.take<float>();
  frame.left_out = bytes.u32();
  frame.contact = bytes.array<float>(std::size_t{10} * frame.contacts);
  frame.pressure_node = bytes.array<std::uint32_t>(q);
  frame.pressure = bytes.array<float>(q);
  for (const std::size_t nodes : {scene_nodes, std::size_t{frame.patch_nodes}}) {
    for (const std::int16_t u : bytes.array<std::int16_t>(3 * nodes))
      frame.u.push_back(static_cast<float>(u) * frame.unit_u);
    for (const std::uint16_t stress : bytes.array<std::uint16_t>(nodes))
      frame.stress.push_back(stress == 65535 ? -1.0F : static_cast<float>(stress) * frame.unit_stress);
  }
  if (!bytes.at_end()) throw std::invalid_argument("the frame is too long");
  return frame;
}

struct DecodedTicks {
  std::uint32_t scene;
  double first;
  std::uint32_t stride;
  std::vector<float> force, shown, depth, late_us, compute_us, force_error;
  std::vector<std::uint32_t> status, left_out;
  std::vector<std::uint8_t> contacts;
};

inline DecodedTicks decode_ticks(const std::string& message) {
  Bytes bytes(message);
  if (bytes.u32() != 4) throw std::invalid_argument("no ticks");
  DecodedTicks ticks{};
  ticks.scene = bytes.u32();
  ticks.first = bytes.take<double>();
  const std::uint32_t n = bytes.u32();
  ticks.stride = bytes.u32();
  ticks.force = bytes.array<float>(std::size_t{3} * n);
  ticks.shown = bytes.array<float>(n);
  ticks.depth = bytes.array<float>(n);
  ticks.late_us = bytes.array<float>(n);
  ticks.compute_us = bytes.array<float>(n);
  ticks.status = bytes.array<std::uint32_t>(n);
  ticks.force_error = bytes.array<float>(n);
  ticks.left_out = bytes.array<std::uint32_t>(n);
  ticks.contacts = bytes.array<std::uint8_t>(n);
  if (!bytes.at_end()) throw std::invalid_argument("the ticks are too long");
  return ticks;
}

}  // namespace palpate::test
