#include "runtime/devices/reports/pid_effects.h"

#include <chrono>
#include <thread>

namespace palpate {
namespace {

constexpr int max_tries = 60;  // attempts at Block Load, as in Linux
constexpr const char* refused = "the device refuses a report that its descriptor describes";

}  // namespace

const char* PidEffects::start(const PidWire& wire) {
  blocks_ = {};
  if (!wire.output(encode_device_control(layout_.device_reset)) ||
      !wire.output(encode_device_control(layout_.enable_actuators)))
    return refused;
  for (std::size_t axis = 0; axis < pid_axes; ++axis) {
    std::uint32_t& block = blocks_[axis];
    if (!wire.set_feature(encode_create_constant(layout_))) return refused;
    if (const char* const failure = load(wire, block)) return failure;
    if (!wire.output(encode_set_effect(layout_, block, constants_.directions[axis])) ||
        !wire.output(encode_constant_force(layout_, block, 0.0)) ||
        !wire.output(encode_operation(layout_, block, layout_.start)))
      return refused;
  }
  return nullptr;
}

const char* PidEffects::load(const PidWire& wire, std::uint32_t& block) const {
  bool has_answered = false;
  for (int k = 0; k < max_tries; ++k) {
    // Some devices need a moment to load an effect.
    if (k > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    PidReport report = block_load_request(layout_);
    has_answered = wire.get_feature(report);
    const auto answer = has_answered ? decode_block_load(layout_, report.span()) : std::nullopt;
    if (answer && answer->load == PidLoad::full)
      return "the device has no room for another effect; another program may use it, such as the kernel's "
             "hid-pidff";
    if (answer && answer->load == PidLoad::success) {
      block = answer->block;
      return nullptr;
    }
  }
  return has_answered ? "the device does not say that it loaded the effect"
                      : "the device does not answer to Block Load";
}

std::array<PidReport, pid_axes> PidEffects::force(const std::array<double, pid_axes>& parts) const noexcept {
  return {encode_constant_force(layout_, blocks_[0], parts[0]),
          encode_constant_force(layout_, blocks_[1], parts[1])};
}

std::vector<PidReport> PidEffects::stop() const {
  std::vector<PidReport> reports;
  for (const std::uint32_t block : blocks_)
    if (block != 0) reports.push_back(encode_constant_force(layout_, block, 0.0));
  for (const std::uint32_t block : blocks_)
    if (block != 0) reports.push_back(encode_operation(layout_, block, layout_.stop));
  reports.push_back(encode_device_control(layout_.device_reset));
  return reports;
}

}  // namespace palpate
