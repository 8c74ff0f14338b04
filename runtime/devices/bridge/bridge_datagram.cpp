#include "runtime/devices/bridge/bridge_datagram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/little_endian.h"

namespace palpate {
namespace {

constexpr std::uint32_t state_magic = 0x53504C50;    // "PLPS"
constexpr std::uint32_t command_magic = 0x43504C50;  // "PLPC"
constexpr std::uint32_t button_bits = 0xFFFF;
constexpr std::uint32_t in_use_bit = 1U << 16U;
constexpr std::uint32_t fault_bit = 1U << 17U;

constexpr double farthest = 10.0;                          // m
constexpr double fastest = 100.0;                          // m/s
constexpr double widest_gripper = 2.0 * std::numbers::pi;  // rad
constexpr double unit_tolerance = 0.01;                    // of a quaternion's length

/// xx, yy, zz, xy, yz, zx
constexpr std::array<std::pair<Eigen::Index, Eigen::Index>, 6> stiffness_order = {
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}}};

double read_double(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return std::bit_cast<double>(read_number<std::uint64_t>(bytes, at));
}

double read_float(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return std::bit_cast<float>(read_number<std::uint32_t>(bytes, at));
}

Vec3 read_doubles(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return {read_double(bytes, at), read_double(bytes, at + 8), read_double(bytes, at + 16)};
}

Vec3 read_floats(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return {read_float(bytes, at), read_float(bytes, at + 4), read_float(bytes, at + 8)};
}

void write_double(std::span<std::uint8_t> bytes, std::size_t at, double value) noexcept {
  write_number(bytes, at, std::bit_cast<std::uint64_t>(value));
}

void write_float(std::span<std::uint8_t> bytes, std::size_t at, double value) noexcept {
  constexpr double most = std::numeric_limits<float>::max();  // beyond it a conversion is not defined
  write_number(bytes, at, std::bit_cast<std::uint32_t>(static_cast<float>(std::clamp(value, -most, most))));
}

void write_doubles(std::span<std::uint8_t> bytes, std::size_t at, const Vec3& values) noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    write_double(bytes, at + 8 * k, values[static_cast<Eigen::Index>(k)]);
  }
}

void write_floats(std::span<std::uint8_t> bytes, std::size_t at, const Vec3& values) noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    write_float(bytes, at + 4 * k, values[static_cast<Eigen::Index>(k)]);
  }
}

Refusal check_head(std::span<const std::uint8_t> datagram, std::uint32_t magic, std::size_t size) noexcept {
  if (datagram.size() < 8) return Refusal::size;
  if (read_number<std::uint32_t>(datagram, 0) != magic) return Refusal::magic;
  // Before the size: another version may be of another.
  if (read_number<std::uint16_t>(datagram, 4) != bridge_version) return Refusal::version;
  if (datagram.size() != size || read_number<std::uint16_t>(datagram, 6) != size) return Refusal::size;
  return Refusal::none;
}

void write_head(std::span<std::uint8_t> datagram, std::uint32_t magic) noexcept {
  write_number(datagram, 0, magic);
  write_number(datagram, 4, bridge_version);
  write_number(datagram, 6, static_cast<std::uint16_t>(datagram.size()));
}

using Limits = std::array<double, 5>;

DeviceLimits as_limits(Limits said) noexcept {
  for (double& limit : said) {
    if (limit == 0.0) limit = std::numeric_limits<double>::infinity();
  }
  return {said[0], said[1], said[2], said[3], said[4]};
}

Limits as_said(const DeviceLimits& limits) noexcept {
  Limits said = {limits.max_force, limits.max_torque, limits.max_stiffness, limits.max_damping,
                 limits.workspace_radius};
  for (double& limit : said) {
    if (std::isinf(limit)) limit = 0.0;
  }
  return said;
}

}  // namespace

Refusal decode_bridge_state(std::span<const std::uint8_t> datagram, BridgeState& state) noexcept {
  if (const Refusal head = check_head(datagram, state_magic, bridge_state_bytes); head != Refusal::none) {
    return head;
  }
  const Vec3 position = read_doubles(datagram, 32);
  const Vec3 velocity = read_doubles(datagram, 56);
  const Eigen::Quaterniond orientation{read_float(datagram, 80), read_float(datagram, 84),
                                       read_float(datagram, 88), read_float(datagram, 92)};
  const double gripper = read_float(datagram, 96);
  Limits limits{};
  for (std::size_t k = 0; k < limits.size(); ++k) {
    limits[k] = read_float(datagram, 100 + 4 * k);
  }
  const auto is_finite = [](double value) { return std::isfinite(value); };
  const auto is_negative = [](double value) { return value < 0.0; };
  if (!position.allFinite() || !velocity.allFinite() || !orientation.coeffs().allFinite() ||
      !std::isfinite(gripper) || !std::all_of(limits.begin(), limits.end(), is_finite)) {
    return Refusal::not_finite;
  }
  if (!(position.norm() <= farthest) || !(velocity.norm() <= fastest) || std::abs(gripper) > widest_gripper ||
      std::any_of(limits.begin(), limits.end(), is_negative)) {
    return Refusal::implausible;
  }
  if (std::abs(orientation.norm() - 1.0) > unit_tolerance) return Refusal::orientation;

  const auto flags = read_number<std::uint32_t>(datagram, 20);
  state.nonce = read_number<std::uint64_t>(datagram, 8);
  state.time = read_number<std::uint64_t>(datagram, 24);
  state.device = {};
  state.device.sequence = read_number<std::uint32_t>(datagram, 16);
  state.device.buttons = flags & button_bits;
  state.device.pose.grab = (flags & 1U) != 0;
  state.device.pose.position = position;
  state.device.pose.orientation = orientation.normalized();
  state.device.velocity = velocity;
  state.gripper = gripper;
  state.limits = as_limits(limits);
  state.in_use = (flags & in_use_bit) != 0;
  state.fault = (flags & fault_bit) != 0;
  return Refusal::none;
}

std::array<std::uint8_t, bridge_state_bytes> encode_bridge_state(const BridgeState& state) noexcept {
  std::array<std::uint8_t, bridge_state_bytes> datagram{};
  const DeviceState& device = state.device;
  const Eigen::Quaterniond& orientation = device.pose.orientation;
  write_head(datagram, state_magic);
  write_number(datagram, 8, state.nonce);
  write_number(datagram, 16, device.sequence);
  write_number(
      datagram, 20,
      (device.buttons & button_bits) | (state.in_use ? in_use_bit : 0U) | (state.fault ? fault_bit : 0U));
  write_number(datagram, 24, state.time);
  write_doubles(datagram, 32, device.pose.position);
  write_doubles(datagram, 56, device.velocity);
  write_float(datagram, 80, orientation.w());
  write_floats(datagram, 84, orientation.vec());
  write_float(datagram, 96, state.gripper);
  const Limits limits = as_said(state.limits);
  for (std::size_t k = 0; k < limits.size(); ++k) {
    write_float(datagram, 100 + 4 * k, limits[k]);
  }
  return datagram;
}

Refusal decode_bridge_command(std::span<const std::uint8_t> datagram, BridgeCommand& command) noexcept {
  if (const Refusal head = check_head(datagram, command_magic, bridge_command_bytes); head != Refusal::none) {
    return head;
  }
  const auto mode = read_number<std::uint32_t>(datagram, 32);
  const double damping = read_float(datagram, 36);
  const Vec3 force = read_doubles(datagram, 40);
  const Vec3 point = read_doubles(datagram, 64);
  const Vec3 torque = read_floats(datagram, 88);
  Mat3 stiffness;
  for (std::size_t k = 0; k < stiffness_order.size(); ++k) {
    const auto [row, column] = stiffness_order[k];
    stiffness(row, column) = stiffness(column, row) = read_float(datagram, 100 + 4 * k);
  }
  const double radius = read_float(datagram, 124);
  const double max_force = read_float(datagram, 132);
  if (!force.allFinite() || !point.allFinite() || !torque.allFinite() || !stiffness.allFinite() ||
      !std::isfinite(damping) || !std::isfinite(radius) || !std::isfinite(max_force)) {
    return Refusal::not_finite;
  }
  if (mode > static_cast<std::uint32_t>(BridgeMode::local_model) || damping < 0.0 || radius < 0.0 ||
      max_force < 0.0) {
    return Refusal::implausible;
  }

  command.nonce = read_number<std::uint64_t>(datagram, 8);
  command.sequence = read_number<std::uint32_t>(datagram, 16);
  command.answers = read_number<std::uint32_t>(datagram, 20);
  command.time = read_number<std::uint64_t>(datagram, 24);
  command.mode = static_cast<BridgeMode>(mode);
  command.command = {{force, torque}, {force, stiffness, point, radius}};
  command.damping = damping;
  command.time_to_live = read_number<std::uint16_t>(datagram, 128);
  command.fade = read_number<std::uint16_t>(datagram, 130);
  command.max_force = max_force;
  return Refusal::none;
}

std::array<std::uint8_t, bridge_command_bytes> encode_bridge_command(const BridgeCommand& command) noexcept {
  std::array<std::uint8_t, bridge_command_bytes> datagram{};
  const Wrench& wrench = command.command.wrench;
  const LocalModel& local = command.command.local;
  write_head(datagram, command_magic);
  write_number(datagram, 8, command.nonce);
  write_number(datagram, 16, command.sequence);
  write_number(datagram, 20, command.answers);
  write_number(datagram, 24, command.time);
  write_number(datagram, 32, static_cast<std::uint32_t>(command.mode));
  write_float(datagram, 36, command.damping);
  write_doubles(datagram, 40, wrench.force);
  write_doubles(datagram, 64, local.point);
  write_floats(datagram, 88, wrench.torque);
  for (std::size_t k = 0; k < stiffness_order.size(); ++k) {
    const auto [row, column] = stiffness_order[k];
    write_float(datagram, 100 + 4 * k, 0.5 * (local.stiffness(row, column) + local.stiffness(column, row)));
  }
  write_float(datagram, 124, local.radius);
  write_number(datagram, 128, command.time_to_live);
  write_number(datagram, 130, command.fade);
  write_float(datagram, 132, command.max_force);
  return datagram;
}

}  // namespace palpate
