#include "runtime/devices/reports/pid_sequence.h"

namespace palpate {
namespace {

constexpr int most_tries = 60;  // attempts at Block Load, as in Linux

}  // namespace

PidRequest PidSequence::next() const noexcept {
  using Kind = PidRequest::Kind;
  switch (step_) {
    case Step::reset:
    case Step::last_reset:
      return {Kind::output, encode_device_control(layout_.device_reset)};
    case Step::enable:
      return {Kind::output, encode_device_control(layout_.enable_actuators)};
    case Step::create:
      return {Kind::set_feature, encode_create_constant(layout_)};
    case Step::load:
      return {Kind::get_feature, block_load_request(layout_)};
    case Step::set_effect:
      return {Kind::output, encode_set_effect(layout_, blocks_[axis_], constants_.directions[axis_])};
    case Step::set_constant:
      return {Kind::output, encode_constant_force(layout_, blocks_[axis_], 0.0)};
    case Step::start:
      return {Kind::output, encode_operation(layout_, blocks_[axis_], layout_.start)};
    case Step::stop:
      return {Kind::output, encode_operation(layout_, blocks_[axis_], layout_.stop)};
    case Step::running:
    case Step::over:
      break;
  }
  return {};
}

void PidSequence::done() noexcept {
  switch (step_) {
    case Step::reset:
      step_ = Step::enable;
      break;
    case Step::enable:
      step_ = Step::create;
      break;
    case Step::create:
      step_ = Step::load;
      tries_ = 0;
      break;
    case Step::set_effect:
      step_ = Step::set_constant;
      break;
    case Step::set_constant:
      step_ = Step::start;
      break;
    case Step::start:
      step_ = ++axis_ == pid_axes ? Step::running : Step::create;
      break;
    case Step::stop:
      if (++axis_ == pid_axes || blocks_[axis_] == 0) step_ = Step::last_reset;
      break;
    case Step::last_reset:
      step_ = Step::over;
      break;
    case Step::load:
    case Step::running:
    case Step::over:
      break;
  }
}

void PidSequence::received(std::span<const std::uint8_t> report) noexcept {
  if (step_ != Step::load) return;
  const auto answer = decode_block_load(layout_, report);
  if (answer && answer->load == PidLoad::full) {
    fail(
        "the device has no room for another effect; another program may use it, such as the kernel's "
        "hid-pidff");
  } else if (answer && answer->load == PidLoad::success) {
    blocks_[axis_] = answer->block;
    step_ = Step::set_effect;
  } else if (++tries_ == most_tries) {
    fail("the device does not say that it loaded the effect");
  }
}

void PidSequence::refused() noexcept {
  if (step_ == Step::load) {
    if (++tries_ == most_tries) fail("the device does not answer to Block Load");
  } else if (step_ == Step::stop || step_ == Step::last_reset) {
    done();  // on the way out a failed step is skipped
  } else {
    fail("the device refuses a report that its descriptor describes");
  }
}

std::array<PidReport, pid_axes> PidSequence::force(const PidForce& wish) const noexcept {
  return {encode_constant_force(layout_, blocks_[0], wish.parts[0]),
          encode_constant_force(layout_, blocks_[1], wish.parts[1])};
}

void PidSequence::stop() noexcept {
  if (step_ == Step::stop || step_ == Step::last_reset || step_ == Step::over) return;
  axis_ = 0;
  step_ = blocks_[0] != 0 ? Step::stop : Step::last_reset;
}

void PidSequence::fail(const char* why) noexcept {
  failure_ = why;
  stop();
}

}  // namespace palpate
