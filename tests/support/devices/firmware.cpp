#include "tests/support/devices/firmware.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/safety/monotonic_clock.h"
#include "tests/support/devices/board_codec.h"

namespace palpate {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;

void put16(Bytes& report, std::size_t at, std::int16_t number) {
  write_number(std::span<std::uint8_t>(report), at, number);
}

}  // namespace

// --- what all have ---

Firmware::Firmware(std::uint16_t its_vendor, std::uint16_t its_product, std::string its_name,
                   Bytes its_descriptor)
    : vendor(its_vendor),
      product(its_product),
      name(std::move(its_name)),
      descriptor(std::move(its_descriptor)),
      reports(parse_report_descriptor(descriptor, name)),
      made_(monotonic_now()) {}

std::optional<Bytes> Firmware::input() {
  const std::lock_guard lock(mutex_);
  return do_input();
}

void Firmware::output(std::span<const std::uint8_t> report) {
  const std::lock_guard lock(mutex_);
  outputs_.emplace_back(report.begin(), report.end());
  do_output(report);
}

std::size_t Firmware::output_bytes(std::uint8_t id) const {
  const std::size_t bytes = reports.report_bytes(HidReportType::output, id);
  return bytes == 0 ? 0 : 1 + bytes;
}

bool Firmware::set_feature(std::span<const std::uint8_t> report) {
  const std::lock_guard lock(mutex_);
  return do_set_feature(report);
}

std::optional<Bytes> Firmware::get_feature(std::uint8_t id) {
  const std::lock_guard lock(mutex_);
  return do_get_feature(id);
}

bool Firmware::is_ready() const {
  const std::lock_guard lock(mutex_);
  return do_is_ready();
}

std::vector<ShownForce> Firmware::forces() const {
  const std::lock_guard lock(mutex_);
  return forces_;
}

std::vector<Bytes> Firmware::outputs() const {
  const std::lock_guard lock(mutex_);
  return outputs_;
}

std::size_t Firmware::output_count() const {
  const std::lock_guard lock(mutex_);
  return outputs_.size();
}

double Firmware::time() const {
  const std::lock_guard lock(mutex_);
  return now();
}

void Firmware::show(const Vec3& force) {
  show(force, now());
}

void Firmware::show(const Vec3& force, double time) {
  forces_.push_back({time, force});
}

double Firmware::now() const {
  return 1e-9 * static_cast<double>(monotonic_now() - made_);
}

// --- WoodenHaptics ---

Bytes woodenhaptics_descriptor() {
  return bytes(
      "06 AB FF 0A 00 02 A1 01 "                        // page FFAB, usage 0200, application
      "75 10 95 07 16 00 80 26 FF 7F 09 01 81 02 "      // seven numbers in
      "75 10 95 07 16 00 80 26 FF 7F 09 02 91 02 C0");  // seven numbers out
}

WoodenHapticsFirmware::WoodenHapticsFirmware(const ArmConstants& arm, Hand hand)
    : Firmware(0x1234, 0x0006, "WoodenHaptics", woodenhaptics_descriptor()),
      arm_(arm),
      hand_(std::move(hand)) {}

void WoodenHapticsFirmware::press_button(bool down) {
  button_ = down;
}

void WoodenHapticsFirmware::press_calibrate() {
  calibrate_ = true;
}

std::array<std::int16_t, 6> WoodenHapticsFirmware::counters() const {
  const Vec3 angles = inverse_arm(arm_, hand_(now())).value();
  std::array<std::int16_t, 6> result{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double ratio =
        (arm_.motor_aligned[k] ? -1.0 : 1.0) * arm_.capstan_diameters[i] / arm_.body_diameters[i];
    result[k] = static_cast<std::int16_t>(std::lround(angles[i] / ratio / turn * arm_.counts_per_turn[k]));
  }
  return result;
}

Vec3 WoodenHapticsFirmware::force_of(const Vec3& currents) const {
  // Motors do the work of the force: torque times turning = force times motion, for a count of each.
  const auto middle = counters();
  Mat3 motion;  // [m] for two counts of each motor, in rows
  Vec3 work;    // [J]
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    auto more = middle;
    auto less = middle;
    ++more[k];
    --less[k];
    motion.row(i) =
        arm_position(arm_, joint_angles(arm_, more)) - arm_position(arm_, joint_angles(arm_, less));
    work[i] = arm_.torque_constants[i] * currents[i] * 2.0 * turn / arm_.counts_per_turn[k];
  }
  return motion.lu().solve(work);
}

std::optional<Bytes> WoodenHapticsFirmware::do_input() {
  if (current_flows_ && now() - told_ > watchdog) {
    current_flows_ = false;
    show(Vec3::Zero());
  }
  if (answers_ == 0) return std::nullopt;
  --answers_;
  Bytes report(14, 0);
  const auto right = counters();
  for (std::size_t k = 0; k < 6; ++k) {
    put16(report, 2 * k, static_cast<std::int16_t>(right[k] + error_[k] + (k == 3 && button_ ? 10000 : 0)));
  }
  put16(report, 12, calibrate_ ? 1 : 0);
  return report;
}

void WoodenHapticsFirmware::do_output(std::span<const std::uint8_t> report) {
  if (report.size() != 15 || report[0] != 0) return;
  std::array<std::int16_t, 7> numbers{};
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    numbers[k] = read_number<std::int16_t>(report, 1 + 2 * k);
  }
  ++answers_;
  told_ = now();
  if (numbers[3] == 1) {
    const auto right = counters();
    const std::array<std::int16_t, 6> wanted = {numbers[4], numbers[5], numbers[6],
                                                numbers[0], numbers[1], numbers[2]};
    for (std::size_t k = 0; k < 6; ++k) {
      error_[k] = static_cast<std::int16_t>(wanted[k] - right[k]);
    }
    calibrate_ = false;
    current_flows_ = false;
    show(Vec3::Zero());
  } else {
    current_flows_ = numbers[0] != 0 || numbers[1] != 0 || numbers[2] != 0;
    show(force_of(1e-3 * Vec3(numbers[0], numbers[1], numbers[2])));
  }
}

// --- board ---

BoardFirmware::BoardFirmware(const BoardFeature& feature, Hand hand, std::uint32_t first_sequence)
    : Firmware(0xCAFE, 0x4001, "Board", board_report_descriptor(3)),
      feature_(feature),
      hand_(std::move(hand)),
      first_(first_sequence),
      sequence_(first_sequence) {}

std::vector<std::uint32_t> BoardFirmware::answered() const {
  const std::lock_guard lock(mutex_);
  return answered_;
}

std::uint32_t BoardFirmware::sequence() const {
  const std::lock_guard lock(mutex_);
  return sequence_;
}

std::optional<Bytes> BoardFirmware::do_input() {
  if (now() < 1e-3 * static_cast<double>(sequence_ - first_)) return std::nullopt;
  BoardInput input{.sequence = sequence_, .axes = 3};
  const Vec3 place = hand_(1e-3 * static_cast<double>(sequence_ - first_));
  for (std::size_t k = 0; k < 3; ++k) {
    input.values[k] = static_cast<std::int32_t>(std::lround(1e6 * place[static_cast<Eigen::Index>(k)]));
  }
  ++sequence_;
  return encode_board_input(input);
}

void BoardFirmware::do_output(std::span<const std::uint8_t> report) {
  const auto force = decode_board_force(report);
  if (!force) return;
  answered_.push_back(force->sequence);
  const double watchdog = 1e-3 * feature_.watchdog;
  if (shows_ && now() > told_ + watchdog) show(Vec3::Zero(), told_ + watchdog);
  told_ = now();
  shows_ = true;
  show(1e-6 * feature_.force_unit * Vec3(force->counts[0], force->counts[1], force->counts[2]));
}

std::optional<Bytes> BoardFirmware::do_get_feature(std::uint8_t id) {
  if (id != 3) return std::nullopt;
  return encode_board_feature(feature_);
}

// --- joystick ---

JoystickFirmware::JoystickFirmware(const PidConstants& constants, Hand hand)
    : Firmware(0x045E, 0x001B, "SideWinder Force Feedback 2", bytes(side_winder_descriptor)),
      constants_(constants),
      hand_(std::move(hand)),
      layout_(find_pid_layout(reports, name)) {}

std::size_t JoystickFirmware::playing() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::ranges::count_if(effects_, [](const auto& effect) { return effect.second.plays; }));
}

std::optional<Bytes> JoystickFirmware::do_input() {
  if (now() < 1e-3 * static_cast<double>(sent_)) return std::nullopt;
  const Vec3 place = hand_(1e-3 * static_cast<double>(sent_++));
  Bytes report(1 + std::size_t{layout_.axes[0].report_bytes}, 0);
  report[0] = layout_.axes[0].report_id;
  for (std::size_t k = 0; k < pid_axes; ++k) {
    const HidElement& axis = layout_.axes[k];
    const double part =
        (k == 0 ? 1.0 : -1.0) * place[static_cast<Eigen::Index>(k)] / constants_.half_travel[k];
    const auto range = static_cast<double>(axis.logical_max - axis.logical_min);
    write_element(axis, axis.logical_min + std::llround(0.5 * (1.0 + part) * range),
                  std::span(report).subspan(1));
  }
  if (on_change && report == said_) return std::nullopt;
  said_ = report;
  return report;
}

void JoystickFirmware::do_output(std::span<const std::uint8_t> report) {
  const std::span<const std::uint8_t> body = report.subspan(1);
  const auto is = [&](const HidOption& option) {
    return option.element.report_id == report[0] && read_element(option.element, body) == option.value;
  };
  const auto effect = [&](const HidElement& block) -> Effect* {
    if (block.report_id != report[0]) return nullptr;
    const auto found = effects_.find(read_element(block, body));
    return found == effects_.end() ? nullptr : &found->second;
  };
  if (is(layout_.device_reset)) {
    effects_.clear();
    enabled_ = false;
  } else if (is(layout_.enable_actuators)) {
    enabled_ = true;
  } else if (Effect* set = effect(layout_.effect_block)) {
    const HidElement& angle = layout_.effect_direction;
    set->direction = 360.0 * static_cast<double>(read_element(angle, body) - angle.logical_min) /
                     static_cast<double>(angle.logical_max - angle.logical_min);
  } else if (Effect* constant = effect(layout_.constant_block)) {
    constant->part = static_cast<double>(read_element(layout_.magnitude, body)) /
                     static_cast<double>(layout_.magnitude.logical_max);
  } else if (Effect* operated = effect(layout_.operation_block)) {
    if (is(layout_.start)) operated->plays = true;
    if (is(layout_.stop)) operated->plays = false;
  }
  // By PID a direction of 0 pulls to the user, 90 degrees to the left.
  Vec3 force = Vec3::Zero();
  for (const auto& [block, playing] : effects_) {
    if (!playing.plays || !enabled_) continue;
    const double angle = playing.direction * turn / 360.0;
    force -= playing.part * Vec3(constants_.full_force[0] * std::sin(angle),
                                 constants_.full_force[1] * std::cos(angle), 0.0);
  }
  show(force);
}

bool JoystickFirmware::do_set_feature(std::span<const std::uint8_t> report) {
  if (report[0] != layout_.create_constant.element.report_id) return false;
  if (!full) effects_[static_cast<std::int64_t>(effects_.size()) + 1] = {};
  pending_ = slow;
  return true;
}

std::optional<Bytes> JoystickFirmware::do_get_feature(std::uint8_t id) {
  if (!has_loaded || id != layout_.load_block.report_id) return std::nullopt;
  Bytes report(1 + std::size_t{layout_.load_block.report_bytes}, 0);
  report[0] = id;
  const std::span<std::uint8_t> body = std::span(report).subspan(1);
  if (full) {
    write_element(layout_.load_full.element, layout_.load_full.value, body);
  } else if (pending_ > 0) {
    --pending_;
  } else {
    write_element(layout_.load_block, static_cast<std::int64_t>(effects_.size()), body);
    write_element(layout_.load_success.element, layout_.load_success.value, body);
  }
  return report;
}

// --- SpaceMouse ---

SpaceMouseFirmware::SpaceMouseFirmware(std::function<std::array<std::int16_t, 6>(double)> cap)
    : Firmware(0x256F, 0xC62E, "SpaceMouse Wireless", bytes(space_mouse_wireless_descriptor)),
      cap_(std::move(cap)) {}

std::optional<Bytes> SpaceMouseFirmware::do_input() {
  if (now() < 8e-3 * static_cast<double>(sent_)) return std::nullopt;
  const auto counts = cap_(8e-3 * static_cast<double>(sent_++));
  const bool holds = std::ranges::any_of(counts, [](std::int16_t count) { return count != 0; });
  if (!holds && !held_) return std::nullopt;
  held_ = holds;
  Bytes report(13, 0);
  report[0] = 1;
  for (std::size_t k = 0; k < 6; ++k) {
    put16(report, 1 + 2 * k, counts[k]);
  }
  return report;
}

}  // namespace palpate
